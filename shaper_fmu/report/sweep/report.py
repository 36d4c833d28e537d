"""The report of a sweep: robustness, maps, duration against robustness, yield, responses, failures, provenance."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path

from shaper_fmu.page.blocks import Block, Heading, Progress, Table, Text, write_report
from shaper_fmu.page.figures import Figure, Map
from shaper_fmu.report.run import system_drawing
from shaper_fmu.report.sweep.curves import curve_blocks, robustness_table
from shaper_fmu.report.sweep.data import SweepData, read_sweep
from shaper_fmu.report.sweep.maps import map_blocks
from shaper_fmu.report.sweep.origin import failure_blocks, plan_table, provenance_table, remark_blocks
from shaper_fmu.report.sweep.pareto import duration_variable, pareto_blocks
from shaper_fmu.report.sweep.responses import Reruns, response_blocks
from shaper_fmu.report.sweep.yields import yield_blocks, yield_table
from shaper_fmu.sweep.engine import load_stored_system
from shaper_fmu.sweep.store import Store


def write_sweep_report(store: Path | str, output: Path | str, progress: Progress | None = None) -> list[Path]:
    """Write the page of a store, and a PNG and an SVG of each figure beside it; returns all paths, the page first.

    Raises StudyError if the store is none, or if the system has changed since its runs.
    """
    data = read_store(store)
    return write_report(output, data.study.name, sweep_blocks(data), ("png", "svg"), progress)


def read_store(store: Path | str) -> SweepData:
    """The store as arrays. Raises StudyError as `write_sweep_report` does."""
    with Store(store) as opened:
        return read_sweep(opened, load_stored_system(opened))


def summary_tables(data: SweepData) -> list[Table]:
    """The tables for a terminal: robustness of each metric over each varied value, or the yields of a sampled plan."""
    if data.sampled:
        return [yield_table(data, metric) for metric in data.quantities]
    return [robustness_table(data, metric, i) for i in range(len(data.axes)) for metric in data.quantities]


def sweep_blocks(data: SweepData) -> list[Block]:
    """Blocks of the page for a whole store; sections that a study has nothing for are left out."""
    extra = duration_variable(data.system)
    with Reruns(data, [extra] if extra else []) as reruns:
        nominal = reruns.nominal()
        sections: dict[str, list[Block]] = {"Summary": [*summary_blocks(data), *system_drawing(data.system)]}
        sections["Yield"] = yield_blocks(data)
        sections["Robustness"] = curve_blocks(data)
        sections["Maps"] = map_blocks(data)
        sections["Duration against robustness"] = pareto_blocks(data, nominal)
        sections["Time responses"] = response_blocks(data, reruns, nominal)
    sections["Failed runs"] = failure_blocks(data)
    sections["Study and provenance"] = [plan_table(data), provenance_table(data.provenance)]
    return _with_own_keys([block for title, found in sections.items() if found for block in (Heading(title), *found)])


def summary_blocks(data: SweepData) -> list[Block]:
    """The number of runs, and the remarks."""
    done, failed, total = data.counts.get("done", 0), data.counts.get("failed", 0), sum(data.counts.values())
    open_ = f" {total - done - failed} are still to be done: start the sweep again." if done + failed < total else ""
    cases = f"{len(data.cases)} case{'s' if len(data.cases) > 1 else ''}"
    text = f"{done} of {total} runs done, {failed} failed. {cases} over {', '.join(axis.name for axis in data.axes)}.{open_}"
    return [Text(text), *remark_blocks(data)]


def _with_own_keys(blocks: list[Block]) -> list[Block]:
    """The blocks, with a number at the key of a figure whose key another one has already."""
    used: set[str] = set()
    found: list[Block] = []
    for block in blocks:
        if isinstance(block, Figure | Map):
            key, number = block.key, 2
            while key.lower() in used:  # some file systems do not tell large from small letters
                key, number = f"{block.key}_{number}", number + 1
            used.add(key.lower())
            block = replace(block, key=key)
        found.append(block)
    return found
