"""Failures and provenance of a sweep."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

from shaper_fmu.page.blocks import Block, Table, Text
from shaper_fmu.report.sweep.data import LISTED_FAILURES, SweepData

_MOST_KINDS = 50


def failure_blocks(data: SweepData) -> list[Block]:
    """The kinds of failures with the first run of each, and the first failed runs."""
    failures = data.failures
    if not failures.total:
        return []
    kinds = [
        [str(count), str(failures.first[kind].id), failures.first[kind].reason or kind]
        for kind, count in failures.kinds.most_common(_MOST_KINDS)
    ]
    rows = [
        [str(run.id), run.compared, ", ".join(f"{name} = {_number(v)}" for name, v in run.varied.items()), run.reason or ""]
        for run in failures.runs
    ]
    listed = f"Failed runs, the first {LISTED_FAILURES} of {failures.total}" if len(rows) < failures.total else "Failed runs"
    return [
        Table("Failures by reason", ["runs", "first run", "its reason"], kinds, left_aligned=True),
        Table(listed, ["run", "case", "start values", "reason"], rows, left_aligned=True),
    ]


def _number(value: Any) -> str:
    return str(value) if isinstance(value, bool | str) else f"{value:.6g}"


def plan_table(data: SweepData) -> Table:
    """The varied values, cases and metrics."""
    study, rows = data.study, []
    plan = study.plan.kind.replace("_", " ")
    rows.append(["plan", f"{plan}, {study.plan.samples} points, seed {study.plan.seed}" if data.sampled else plan])
    for axis, vary in zip(data.axes, study.vary.values(), strict=True):
        if data.sampled:
            given = {"from": vary.low, "to": vary.high, "mean": vary.mean, "deviation": vary.deviation}
            numbers = ", ".join(f"{what} {axis.shown(value)}" for what, value in given.items() if value is not None)
            text = f"{vary.distribution or 'uniform'}, {numbers}".replace("_", "-")
        elif axis.texts:
            text = ", ".join(axis.texts[:_MOST_KINDS])
        else:
            text = f"{axis.shown(axis.grid[0])} to {axis.shown(axis.grid[-1])}, {len(axis.grid)} values"
        rows.append([f"varied: {axis.name}", f"{text}; nominal {axis.shown(axis.nominal)}"])
    for case, values in study.compare.items():
        given = ", ".join(f"{name} = {_number(value)}" for name, value in values.items()) or "the system as it is"
        rows.append([f"case: {case}" + (" (reference)" if case == study.reference else ""), given])
    for name, measure in study.metrics.items():
        given = {key: getattr(measure, key) for key in measure.fields()}
        values = ", ".join(f"{key} = {_number(value)}" for key, value in given.items())
        rows.append([f"metric: {name}", f"{measure.kind()}: {values}"])
    if study.refine is not None:
        refine = study.refine
        rows.append(["refined", f"{refine.metric} at {refine.level:g}, to intervals of {refine.width:g}"])
    rows.append(["runs", f"{study.stop_time:g} s in steps of {study.step:g} s, {study.algorithm}, inputs: {study.interpolation}"])
    if study.stop_when:
        rows.append(["ended early", f"once {study.stop_when} had been true for {study.stop_hold:g} s"])
    return Table("Study", ["what", "how"], rows, left_aligned=True)


def provenance_table(provenance: Mapping[str, Any]) -> Table:
    """Version and digests."""
    rows = [["shaper-fmu", str(provenance.get("shaper-fmu", "unknown"))]]
    if "system" in provenance:
        rows.append(["system (SHA-256)", str(provenance["system"])])
    rows += [[f"FMU {name} (SHA-256)", str(digest)] for name, digest in provenance.get("fmus", {}).items()]
    return Table("Provenance", ["what", "version or digest"], rows, left_aligned=True)


def remark_blocks(data: SweepData) -> list[Block]:
    """The store's remarks on the sweep."""
    return [Text(f"Note: {remark}.") for remark in data.remarks.values()]
