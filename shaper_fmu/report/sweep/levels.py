"""The tolerated level of a metric, and the values that are compared with it."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from shaper_fmu.page.figures import label
from shaper_fmu.report.sweep.data import SweepData

TOLERATED = 0.05
"""The level, as a share of the reference's metric, where the study's refinement names no other one."""


@dataclass(frozen=True)
class Judged:
    """The values of a metric that are compared with a level.

    Attributes:
        values: shares of the reference's metric if there is a reference, else the metric's own values; shape (n,).
        level: what is tolerated, in the same.
        description: the level, for example "5 % of unshaped".
        label: the axis in a figure.
        unit, factor: what people see: value * factor, in this unit.
        cases: those that are judged: all but the reference.
    """

    values: np.ndarray
    level: float
    description: str
    label: str
    unit: str
    factor: float
    cases: list[str]

    def shown(self, value: float) -> str:
        """A value with its unit."""
        if np.isnan(value):
            return "-"
        return "never" if np.isinf(value) else f"{value * self.factor:.4g} {self.unit}".rstrip()


def judged(data: SweepData, metric: str) -> Judged:
    """By the study's refinement; else 5 % of the reference; without one, 5 % of overshoot, or of the largest value."""
    study, quantity, values = data.study, data.quantities[metric], data.metrics[metric]
    refined = study.refine.level if study.refine is not None and study.refine.metric == metric else None
    if study.reference is not None:
        level = TOLERATED if refined is None else refined
        axis = label(quantity.description, f"% of {study.reference}")
        cases = [case for case in data.cases if case != study.reference]
        return Judged(data.relative(metric), level, f"{100.0 * level:.4g} % of {study.reference}", axis, "%", 100.0, cases)
    if refined is not None:
        level, description = refined, quantity.shown(refined)
    elif study.metrics[metric].unit == "%":
        level, description = TOLERATED, f"{100.0 * TOLERATED:g} %"
    else:
        finite = values[np.isfinite(values)]
        level = TOLERATED * float(np.max(np.abs(finite), initial=0.0))
        description = f"{100.0 * TOLERATED:g} % of the largest value, {quantity.shown(level)}"
    return Judged(values, level, description, quantity.label(), quantity.unit, quantity.factor, data.cases)
