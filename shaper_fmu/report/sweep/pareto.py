"""The trade-off between the command's duration and the worst metric over the varied range."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from shaper_fmu.analysis.response import command_end
from shaper_fmu.master.results import Results
from shaper_fmu.master.system import System
from shaper_fmu.page.blocks import Block, Table, Text
from shaper_fmu.page.figures import Figure, Line
from shaper_fmu.report.sweep.data import SweepData
from shaper_fmu.report.sweep.responses import worst_index


@dataclass(frozen=True)
class Candidate:
    """A case: duration [s], largest metric of its completed runs, and whether no other case is better in one and as good in the
    other."""

    case: str
    duration: float
    worst: float
    best: bool


def duration_variable(system: System) -> str | None:
    """The only calculated parameter `duration` in the system, "instance.duration"; None if there is none, or several."""
    found = [
        name
        for name, fmu in system.fmus.items()
        if "duration" in fmu.variables and fmu.variables["duration"].causality == "calculatedParameter"
    ]
    return f"{found[0]}.duration" if len(found) == 1 else None


def durations(data: SweepData, nominal: dict[str, Results | str]) -> tuple[dict[str, float], str]:
    """Each case's duration [s] at the nominal values (NaN for a failed run), and its description; "" if it is unknown."""
    variable, commands = duration_variable(data.system), data.study.commands()
    if variable is None and not commands:
        return {}, ""

    def duration(results: Results | str) -> float:
        if isinstance(results, str):
            return float("nan")
        if variable is not None:
            return float(results[variable][0])
        return max(command_end(results.time, results[command]) for command in commands) - data.start_time

    text = variable if variable is not None else f"end of {' and '.join(commands)}"
    return {case: duration(results) for case, results in nominal.items()}, text


def candidates(data: SweepData, metric: str, duration: dict[str, float]) -> list[Candidate]:
    """The cases that have both numbers, by rising duration."""
    found = []
    for case in data.cases:
        i = worst_index(data, metric, case)
        if i is not None and np.isfinite(duration[case]):
            found.append((duration[case], float(data.metrics[metric][i]), case))
    found.sort(key=lambda one: one[:2])
    return [
        Candidate(case, d, m, not any(e <= d and n <= m and (e, n) != (d, m) for e, n, _ in found) and np.isfinite(m))
        for d, m, case in found
    ]


def pareto_table(data: SweepData, metric: str, found: list[Candidate], text: str) -> Table:
    """Duration, worst metric, and whether a case is dominated."""
    relative, rows = data.relative(metric), []
    for one in found:
        own = data.of(one.case)
        shares = relative[own & np.isfinite(relative)]
        share = f"{100.0 * shares.max():.3g} %" if len(shares) else "-"
        failed = int(((data.case == data.cases.index(one.case)) & ~data.done).sum())
        mark = "not dominated" if one.best else ""
        rows.append([one.case, f"{one.duration:.5g}", data.quantities[metric].shown(one.worst), share, str(failed), mark])
    head = ["case", f"duration [s] ({text})", "largest over the range", "largest share of the reference", "failed runs", ""]
    if data.study.reference is None:
        head, rows = [*head[:3], *head[4:]], [[*row[:3], *row[4:]] for row in rows]
    return Table(f"Duration and robustness: {data.quantities[metric].description}", head, rows)


def pareto_figure(data: SweepData, metric: str, found: list[Candidate], text: str) -> Figure:
    """A point for each case, and the front of those that are not dominated."""
    quantity = data.quantities[metric]
    shown = [one for one in found if np.isfinite(one.worst)]
    lines = [
        Line(
            one.case, np.array([one.duration]), np.array([one.worst * quantity.factor]),
            markers=True, style=data.cases.index(one.case), joined=False,
        )
        for one in shown
    ]  # fmt: skip
    front = [one for one in shown if one.best]
    if len(front) > 1:
        x, y = np.array([one.duration for one in front]), np.array([one.worst * quantity.factor for one in front])
        stairs = Line("not dominated", np.repeat(x, 2)[1:], np.repeat(y, 2)[:-1], style=6)
        lines.append(stairs)
    title, y_label = f"Duration against robustness: {quantity.description}", f"largest {quantity.label()}"
    return Figure(f"pareto_{metric}", title, f"duration [s] ({text})", y_label, lines)


def pareto_blocks(data: SweepData, nominal: dict[str, Results | str]) -> list[Block]:
    """Figure and table of every metric, or a sentence if no duration is known."""
    if len(data.cases) < 2 or not data.done.any():
        return []
    duration, text = durations(data, nominal)
    if not text:
        return [Text("No metric refers to a command, and no instance declares a duration: durations are not compared.")]
    blocks: list[Block] = []
    lost = [case for case in data.cases if not np.isfinite(duration[case])]
    if lost:
        blocks.append(Text(f"Without a duration, as the run with the nominal values failed: {', '.join(lost)}."))
    for metric in data.quantities:
        found = candidates(data, metric, duration)
        if any(np.isfinite(one.worst) for one in found):
            blocks.append(pareto_figure(data, metric, found, text))
        if found:
            blocks.append(pareto_table(data, metric, found, text))
    return blocks
