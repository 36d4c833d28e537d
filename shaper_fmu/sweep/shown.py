"""What a study and a store show of themselves: at the prompt, in a notebook, and by `shaper-fmu info`."""

from __future__ import annotations

from collections import Counter
from collections.abc import Mapping
from typing import TYPE_CHECKING

import numpy as np

from shaper_fmu.errors import StudyError, nearest
from shaper_fmu.notebook.texts import counted, listed
from shaper_fmu.page.blocks import Table
from shaper_fmu.page.figures import Figure, Line
from shaper_fmu.sweep.plan import SAMPLED
from shaper_fmu.sweep.variation import Vary

if TYPE_CHECKING:
    from shaper_fmu.sweep.stored import Stored
    from shaper_fmu.sweep.study import Study


def study_text(study: Study) -> str:
    """A study in one line; a wrong one, which nothing has checked, too."""
    parts = (study.vary, "start value"), (study.compare, "case"), (study.metrics, "metric")
    sizes = [counted(len(part), what) for part, what in parts if isinstance(part, Mapping)]
    return f"{', '.join(sizes)}, of {study.system}"


def study_facts(study: Study) -> dict[str, str]:
    """The facts of a study, as texts."""
    plan = study.plan
    sampled = f"{counted(plan.samples or 0, 'sample')}, seed {plan.seed}" if plan.kind in SAMPLED else ""
    return {
        "system": str(study.system_path),
        "time": f"to {study.stop_time:g} s in steps of {study.step:g} s, {study.algorithm}",
        "ends early": f"{study.stop_when} true for {study.stop_hold:g} s" if study.stop_when else "",
        "plan": ", ".join(filter(None, (plan.kind, sampled))),
        "cases": ", ".join(study.compare),
        "related to": study.reference or "",
        "metrics": ", ".join(f"{name} ({type(one).kind()} of {one.output})" for name, one in study.metrics.items()),
        "refined": f"where {study.refine.metric} crosses {study.refine.level:g}, to {study.refine.width:g}" if study.refine else "",
    }


def varied_table(study: Study) -> Table:
    """The start values that vary."""
    rows = [[name, _values(one, study.plan.kind in SAMPLED), _nominal(one)] for name, one in study.vary.items()]
    return Table("Varied start values", ["start value", "values", "nominal"], rows, left_aligned=True)


def _values(one: Vary, sampled: bool) -> str:
    if one.values is not None:
        return listed([f"{value:g}" if isinstance(value, float) else str(value) for value in one.values])
    if one.factors is not None:
        return f"{listed([f'{factor:g}' for factor in one.factors])} times the nominal value"
    if one.mean is not None or one.deviation is not None:
        return f"{one.distribution}, mean {_nominal(one) if one.mean is None else f'{one.mean:g}'}, deviation {one.deviation:g}"
    kind = one.distribution or "uniform" if sampled else f"{one.points} points, {one.spacing}"
    return f"{one.low:g} to {one.high:g}, {kind}" if one.low is not None and one.high is not None else kind


def _nominal(one: Vary) -> str:
    return f"{one.nominal:g}" if one.nominal is not None else "the system's"


def counts_text(counts: Mapping[str, int]) -> str:
    """What is done of how much: "36 of 39 done, 1 failed, 2 planned"."""
    total = sum(counts.values())
    rest = [f"{counts[status]} {status}" for status in ("failed", "planned") if counts.get(status)]
    return ", ".join([f"{counts.get('done', 0)} of {total} done", *rest])


def cases_table(store: Stored) -> Table:
    """What is done of each case, and the range of each metric there."""
    study = store.study()
    found: dict[str, dict[str, list[float]]] = {case: {} for case in study.compare}
    counts: dict[str, Counter[str]] = {case: Counter() for case in study.compare}
    for status in ("done", "failed"):
        for run in store.iterate(status):
            counts[run.compared][run.status] += 1
            for name, value in run.metrics.items():
                low, high = found[run.compared].get(name, [value, value])
                found[run.compared][name] = [min(low, value), max(high, value)]
    rows = []
    for case, metrics in found.items():
        ranges = [f"{low:.4g} to {high:.4g}" for low, high in (metrics.get(m, [np.nan, np.nan]) for m in study.metrics)]
        rows.append([case, str(counts[case]["done"]), str(counts[case]["failed"]), *(r.replace("nan to nan", "-") for r in ranges)])
    return Table("Cases", ["case", "done", "failed", *study.metrics], rows)


def metric_figures(store: Stored, metric: str | None = None) -> list[Figure]:
    """Metrics over the first varied value, a line for each case; points alone where several start values vary.

    StudyError for an unknown metric, if nothing is done, and if the value is a text or a truth.
    """
    study = store.study()
    if metric is not None and metric not in study.metrics:
        raise StudyError(f"{store.path}: there is no metric {metric!r}.{nearest(metric, study.metrics)}")
    over, joined = next(iter(study.vary)), len(study.vary) == 1
    runs = list(store.iterate("done"))
    if not runs:
        raise StudyError(f"{store.path}: no run is done; nothing can be plotted")
    if any(isinstance(run.varied[over], str | bool) for run in runs):
        raise StudyError(f"{store.path}: {over} has no numbers for values; use store.runs()")
    figures = []
    for name in [metric] if metric is not None else study.metrics:
        lines = []
        for style, case in enumerate(study.compare):
            points = sorted((float(run.varied[over]), run.metrics[name]) for run in runs if run.compared == case)
            if points:
                x, y = np.array(points).T
                lines.append(Line(case, x, y, markers=True, joined=joined, style=style))
        figures.append(Figure(name, f"{study.name}: {name}", over, f"{name} of {study.metrics[name].output}", lines))
    return figures
