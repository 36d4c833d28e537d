"""Reads a sweep's store into arrays for the parts of its report."""

from __future__ import annotations

import math
import re
from array import array
from collections import Counter
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field
from functools import cached_property
from typing import Any

import numpy as np

from shaper_fmu.errors import ModelError
from shaper_fmu.master.system import System
from shaper_fmu.page.figures import label
from shaper_fmu.ssp.archive import SspSystem
from shaper_fmu.sweep.plan import SAMPLED, Value
from shaper_fmu.sweep.runs import Run
from shaper_fmu.sweep.store import Store
from shaper_fmu.sweep.study import Study
from shaper_fmu.sweep.variation import Vary

LISTED_FAILURES = 50
_MOST_REASONS = 1000
_NUMBER = re.compile(r"(?<![A-Za-z_\[])[-+]?\d+\.?\d*(?:[eE][-+]?\d+)?")


@dataclass(frozen=True)
class Axis:
    """A varied start value: shown = value * factor, in `unit`. Values that are no numbers are numbered, with `texts`."""

    name: str
    unit: str
    factor: float
    nominal: float
    grid: tuple[float, ...] = ()
    texts: tuple[str, ...] = ()
    logarithmic: bool = False

    def label(self) -> str:
        """For the axis of a figure."""
        return label(self.name, self.unit)

    def shown(self, value: float) -> str:
        """A value with its unit; a frequency in rad/s in Hz, too."""
        if self.texts:
            return self.texts[int(value)]
        number = value * self.factor
        hertz = f", {number / (2.0 * math.pi):.4g} Hz" if self.unit == "rad/s" and "frequency" in self.name else ""
        return f"{number:.6g} {self.unit}".rstrip() + hertz

    def deviation(self, value: float) -> str:
        """How far a value is from the nominal one."""
        if value == self.nominal:
            return "nominal"
        if self.texts:
            return ""
        if self.nominal:
            return f"{100.0 * (value / self.nominal - 1.0):+.4g} %"
        return f"nominal {value * self.factor:+.6g} {self.unit}".rstrip()


@dataclass(frozen=True)
class Quantity:
    """A metric as people want to see it: shown = value * factor, in `unit`."""

    name: str
    unit: str
    factor: float

    @property
    def description(self) -> str:
        """Its name as a text."""
        return self.name.replace("_", " ")

    def label(self) -> str:
        """For the axis of a figure."""
        return label(self.description, self.unit)

    def shown(self, value: float) -> str:
        """A value with its unit."""
        if np.isnan(value):
            return "-"
        return "never" if np.isinf(value) else f"{value * self.factor:.4g} {self.unit}".rstrip()


@dataclass
class Failures:
    """The failed runs: how many of each kind (numbers in the reason left out) with the first of them, and the first runs."""

    kinds: Counter[str] = field(default_factory=Counter)
    first: dict[str, Run] = field(default_factory=dict)
    runs: list[Run] = field(default_factory=list)
    total: int = 0

    def add(self, run: Run) -> None:
        """Enter a run."""
        self.total += 1
        kind = _NUMBER.sub("...", run.reason or "no reason given")
        if kind not in self.kinds and len(self.kinds) >= _MOST_REASONS:
            kind = "other reasons"
        self.kinds[kind] += 1
        self.first.setdefault(kind, run)
        if len(self.runs) < LISTED_FAILURES:
            self.runs.append(run)


@dataclass(frozen=True)
class SweepData:
    """A store: n runs that are done or failed, over d varied start values.

    Attributes:
        ids, case, done: number, number of the case, and whether it is done, of each run; shape (n,).
        points: the varied values, shape (n, d).
        metrics: by name, shape (n,) each; NaN for failed runs.
    """

    study: Study
    system: System
    start_time: float
    counts: Mapping[str, int]
    provenance: Mapping[str, Any]
    remarks: Mapping[str, str]
    axes: list[Axis]
    quantities: dict[str, Quantity]
    ids: np.ndarray
    case: np.ndarray
    done: np.ndarray
    points: np.ndarray
    metrics: dict[str, np.ndarray]
    failures: Failures
    _relative: dict[str, np.ndarray] = field(default_factory=dict, repr=False)

    @property
    def cases(self) -> list[str]:
        """The compared cases."""
        return list(self.study.compare)

    @property
    def sampled(self) -> bool:
        """Whether the plan is a random one."""
        return self.study.plan.kind in SAMPLED

    @cached_property
    def place(self) -> np.ndarray:
        """The number of each run's point, equal for equal varied values; shape (n,)."""
        return np.unique(self.points, axis=0, return_inverse=True)[1].reshape(-1)

    def of(self, case: str) -> np.ndarray:
        """Which runs belong to this case and are done, shape (n,)."""
        return (self.case == self.cases.index(case)) & self.done

    def relative(self, metric: str) -> np.ndarray:
        """The metric as a share of the reference's at the same point, shape (n,); NaN without a reference, or if it is 0."""
        if metric not in self._relative:
            self._relative[metric] = self._shares(metric)
        return self._relative[metric]

    def _shares(self, metric: str) -> np.ndarray:
        found = np.full(len(self.ids), np.nan)
        if self.study.reference is None or not len(found):
            return found
        base = np.full(int(self.place.max()) + 1, np.nan)
        mask = self.of(self.study.reference)
        base[self.place[mask]] = self.metrics[metric][mask]
        base = base[self.place]
        fits = np.isfinite(base) & (base != 0.0)
        found[fits] = self.metrics[metric][fits] / base[fits]
        return found

    def run(self, index: int) -> Run:
        """A run as the store has it."""
        values = {axis.name: self.stored(i, self.points[index, i]) for i, axis in enumerate(self.axes)}
        found = {name: float(values[index]) for name, values in self.metrics.items()}
        return Run(int(self.ids[index]), self.cases[self.case[index]], values, "done", found, None)

    def nominal_run(self, case: str) -> Run:
        """The run of a case with all nominal values, which the plan need not have."""
        values = {axis.name: self.stored(i, axis.nominal) for i, axis in enumerate(self.axes)}
        return Run(-1, case, values, "done", {}, None)

    def stored(self, number: int, value: float) -> Value:
        """A value of the start value of this number as the study has it."""
        values = self.study.vary[self.axes[number].name].values
        return values[int(value)] if self.axes[number].texts and values is not None else float(value)


def read_sweep(store: Store, loaded: SspSystem) -> SweepData:
    """The store as arrays: about 100 bytes a run."""
    study, system = store.study(), loaded.system
    axes = [_axis(name, vary, study, system) for name, vary in study.vary.items()]
    numbers = [_numbers(vary, axis) for vary, axis in zip(study.vary.values(), axes, strict=True)]
    case_numbers = {case: i for i, case in enumerate(study.compare)}
    ids, case, done = array("q"), array("l"), array("b")
    points, metrics, failures = array("d"), array("d"), Failures()
    nothing = [float("nan")] * len(study.metrics)
    for run in store.iterate():
        if run.status not in ("done", "failed"):
            continue
        ids.append(run.id)
        case.append(case_numbers[run.compared])
        done.append(run.status == "done")
        for known, value in zip(numbers, run.varied.values(), strict=True):
            points.append(known[value] if known else value)
        metrics.extend(run.metrics.values() if run.status == "done" else nothing)
        if run.status == "failed":
            failures.add(run)
    columns = np.array(metrics).reshape(len(ids), len(study.metrics)).T.copy()
    return SweepData(
        study, system, loaded.structure.start_time or 0.0, store.counts(), store.provenance(), store.remarks(), axes,
        {name: _quantity(name, study, system) for name in study.metrics},
        np.array(ids), np.array(case), np.array(done, bool), np.array(points).reshape(len(ids), len(axes)),
        dict(zip(study.metrics, columns, strict=True)), failures,
    )  # fmt: skip


def _axis(name: str, vary: Vary, study: Study, system: System) -> Axis:
    instance, variable = system.split(name)
    unit, factor = system.display_unit((instance, variable))
    if study.plan.kind in SAMPLED:
        nominal = vary.nominal if vary.nominal is not None else float(vary.quantiles(np.array([0.5]))[0])
        return Axis(name, unit, factor, nominal)
    grid = vary.grid()
    if any(isinstance(value, bool | str) for value in grid):
        return Axis(name, "", 1.0, _own(grid, instance, variable, system), tuple(range(len(grid))), tuple(map(_text, grid)))
    values = tuple(float(value) for value in grid)
    nominal = vary.nominal if vary.nominal is not None else values[len(values) // 2]
    return Axis(name, unit, factor, nominal, values, logarithmic=vary.spacing == "log" and vary.values is None)


def _own(grid: Sequence[Value], instance: str, variable: str, system: System) -> float:
    """The number of the system's own value in a list of texts and booleans; 0 if it is not there."""
    fmu = system.fmus[instance]
    own = system.start_values[instance].get(variable, fmu.variables[variable].start)
    try:
        typed = [fmu.start_values({variable: value})[variable] for value in (own, *grid)]
    except (ModelError, KeyError):
        return 0.0
    return float(typed[1:].index(typed[0])) if typed[0] in typed[1:] else 0.0


def _text(value: Value) -> str:
    return str(value).lower() if isinstance(value, bool) else str(value)


def _numbers(vary: Vary, axis: Axis) -> dict[Value, int]:
    return {value: i for i, value in enumerate(vary.values or [])} if axis.texts else {}


def _quantity(name: str, study: Study, system: System) -> Quantity:
    measure = study.metrics[name]
    if measure.unit:
        return Quantity(name, measure.unit, measure.factor)
    return Quantity(name, *system.display_unit(system.ports([measure.output])[0]))
