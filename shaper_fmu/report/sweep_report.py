"""The report of a sweep: the table at the ends and in the middle, robustness curves, time responses."""

from __future__ import annotations

from collections.abc import Mapping

import numpy as np

from shaper_fmu.analysis.response import command_end
from shaper_fmu.master.simulation import Simulation
from shaper_fmu.master.system import System
from shaper_fmu.report.figures import Figure, Line, label
from shaper_fmu.report.page import Block, Table, Text
from shaper_fmu.sweep.engine import simulate_run
from shaper_fmu.sweep.store import Run
from shaper_fmu.sweep.study import Residual, Study

TOLERATED = 5.0
"""The line drawn at this share of the reference [%]."""


def nominal_slice(study: Study, runs: list[Run], case: str, varied: str) -> list[Run]:
    """The completed runs of a case in which all but one start value are nominal, in the plan's order."""
    fixed = {name: vary.nominal for name, vary in study.vary.items() if name != varied}
    chosen = [run for run in runs if run.compared == case and run.status == "done"]
    return [run for run in chosen if all(run.varied[name] == value for name, value in fixed.items())]


def robustness_table(study: Study, runs: list[Run], system: System, metric: str, varied: str) -> Table:
    """A metric of all cases at the lowest, the nominal and the highest value, in units for people and in % of the reference."""
    unit, factor = system.display_unit(system.ports([study.metrics[metric].output])[0])
    grid, nominal = study.vary[varied].grid(), study.vary[varied].nominal
    columns = list(dict.fromkeys([grid[0], nominal, grid[-1]]))
    found = {
        (case, run.varied[varied]): run.metrics[metric]
        for case in study.compare
        for run in nominal_slice(study, runs, case, varied)
    }

    def cell(case: str, value: float) -> str:
        if (case, value) not in found:
            return "failed"
        text = f"{found[case, value] * factor:.3f} {unit}"
        reference = found.get((study.reference or "", value))
        return f"{text} ({found[case, value] / reference:.1%})" if reference and case != study.reference else text

    varied_unit, varied_factor = system.display_unit(system.ports([varied])[0])

    def place(value: float) -> str:
        if value == nominal:
            return "nominal"
        return f"{value / nominal - 1:+.0%}" if nominal else f"nominal {value * varied_factor:+g}"

    head = [f"{value * varied_factor:g} {varied_unit} ({place(value)})" for value in columns]
    rows = [[case, *(cell(case, value) for value in columns)] for case in study.compare]
    related = f" (share of {study.reference})" if study.reference else ""
    return Table(f"{metric.replace('_', ' ').capitalize()} over {varied}{related}", ["", *head], rows)


def robustness_figures(study: Study, runs: list[Run], system: System, metric: str, varied: str) -> list[Figure]:
    """The metric over the varied start value, absolute and (if the study names a reference) relative to it."""
    shown_unit, factor = system.display_unit(system.ports([study.metrics[metric].output])[0])
    varied_unit, varied_factor = system.display_unit(system.ports([varied])[0])
    curves = {case: nominal_slice(study, runs, case, varied) for case in study.compare}
    name, axis = metric.replace("_", " "), label(varied, varied_unit)
    marks = [(study.vary[varied].nominal * varied_factor, "nominal")]

    def line(case: str, values: list[float]) -> Line:
        return Line(
            case,
            np.array([run.varied[varied] for run in curves[case]]) * varied_factor,
            np.array(values),
            markers=True,
            style=list(study.compare).index(case),
        )

    key = f"robustness_{metric}"
    lines = [line(case, [run.metrics[metric] * factor for run in curve]) for case, curve in curves.items()]
    figures = [Figure(key, f"Robustness: {name}", axis, label(name, shown_unit), lines, marks=marks)]
    if study.reference:
        base = {run.varied[varied]: run.metrics[metric] for run in curves[study.reference]}
        relative = [
            line(
                case,
                [run.metrics[metric] / base[run.varied[varied]] * 100 if base.get(run.varied[varied]) else np.nan for run in curve],
            )
            for case, curve in curves.items()
            if case != study.reference
        ]
        level = [(TOLERATED, f"{TOLERATED:g} %")]
        title = f"Robustness: {name} relative to {study.reference}"
        figures.append(Figure(f"{key}_relative", title, axis, f"{name} [% of {study.reference}]", relative, level, marks))
    return figures


def response_figures(study: Study, runs: list[Run], system: System, varied: str) -> list[Figure]:
    """Time responses of the metrics' outputs, run again at the lowest, the nominal and the highest value."""
    grid, nominal = study.vary[varied].grid(), study.vary[varied].nominal
    outputs = list(dict.fromkeys(metric.output for metric in study.metrics.values()))
    commands = [metric.command for metric in study.metrics.values() if isinstance(metric, Residual)]
    varied_unit, varied_factor = system.display_unit(system.ports([varied])[0])
    figures = []
    with Simulation(system, record=study.recorded()) as simulation:
        for place, value in {"lowest": grid[0], "nominal": nominal, "highest": grid[-1]}.items():
            chosen = {
                case: next((r for r in nominal_slice(study, runs, case, varied) if r.varied[varied] == value), None)
                for case in study.compare
            }
            results = {case: simulate_run(simulation, study, run) for case, run in chosen.items() if run is not None}
            if not results:
                continue
            ends = max((command_end(r.time, r[c]) for r in results.values() for c in commands), default=None)
            marks = [(ends, "last command ends")] if ends is not None else []
            for output in outputs:
                unit = next(iter(results.values())).display(output)[1]
                lines = [
                    Line(case, r.time, r.display(output)[0], style=list(study.compare).index(case)) for case, r in results.items()
                ]
                title = f"{output} at the {place} {varied} = {value * varied_factor:g} {varied_unit}"
                figures.append(
                    Figure(
                        f"response_{output.replace('.', '_')}_{place}", title, "time [s]", label(output, unit), lines, marks=marks
                    )
                )
    return figures


def sweep_blocks(study: Study, runs: list[Run], system: System, provenance: Mapping) -> list[Block]:
    """Blocks of the page for a whole store."""
    done = sum(run.status == "done" for run in runs)
    failed = [run for run in runs if run.status == "failed"]
    blocks: list[Block] = [
        Text(f"{done} of {len(runs)} runs done, {len(failed)} failed. {study.step:g} s communication steps, {study.algorithm}.")
    ]
    for varied in study.vary:
        for metric in study.metrics:
            blocks.append(robustness_table(study, runs, system, metric, varied))
            blocks += robustness_figures(study, runs, system, metric, varied)
        blocks += response_figures(study, runs, system, varied)
    if failed:
        rows = [
            [str(run.id), run.compared, ", ".join(f"{n} = {v:g}" for n, v in run.varied.items()), run.reason or ""]
            for run in failed
        ]
        blocks.append(Table("Failed runs", ["run", "case", "start values", "reason"], rows))
    rows = [["shaper-fmu", str(provenance.get("shaper-fmu", "unknown"))]]
    rows += [[f"FMU {name}", digest] for name, digest in provenance.get("fmus", {}).items()]
    return [*blocks, Table("Provenance", ["what", "version or SHA-256"], rows)]
