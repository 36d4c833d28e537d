"""Figures of merit that are computed while a system is stepped, so that no trajectory has to be kept.

They see every macro step, and both sides of every event.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Mapping
from dataclasses import dataclass
from typing import Any, ClassVar

import numpy as np

from shaper_fmu.errors import ModelError
from shaper_fmu.master.layout import ENVELOPE, EXTREMES, METRIC, OUTSIDE, SQUARE


@dataclass(frozen=True)
class Metric:
    """Base of all metrics: of the variable `output`, "instance.variable"."""

    output: str

    kind: ClassVar[int] = EXTREMES

    def variables(self) -> list[str]:
        """The variables that it needs: the output, then a second and a third, "" for none."""
        return [self.output, "", ""]

    def parameter(self) -> float:
        """The number that goes with it."""
        return 0.0

    def values(self, gathered: np.ndarray) -> np.ndarray:
        """The metric of each run, shape (n,), from what the loop has gathered, shape (n,), of type `METRIC`."""
        raise NotImplementedError

    def unfinished(self, gathered: np.ndarray) -> np.ndarray:
        """Whether the value of each run means nothing: a command that is measured from its end must have come to it."""
        return (gathered["begin"] >= gathered["time"]) & bool(self.variables()[1])

    def problem(self, row: Any) -> str:
        """Words for a run that is unfinished."""
        return f"{self.variables()[1]} has not come to its end by t = {row['time']:g} s; run for longer"


@dataclass(frozen=True)
class Final(Metric):
    """Value at the end."""

    def values(self, gathered: np.ndarray) -> np.ndarray:
        return gathered["last"].copy()


@dataclass(frozen=True)
class Peak(Metric):
    """Largest magnitude."""

    def values(self, gathered: np.ndarray) -> np.ndarray:
        return np.maximum(np.abs(gathered["largest"]), np.abs(gathered["smallest"]))


@dataclass(frozen=True)
class Overshoot(Metric):
    """How far the output goes beyond its final value, as a share of its way from start to end; 0 if it does not move."""

    def values(self, gathered: np.ndarray) -> np.ndarray:
        first, last = gathered["first"], gathered["last"]
        beyond = np.where(last > first, gathered["largest"] - last, last - gathered["smallest"])
        way = np.abs(last - first)
        return np.maximum(0.0, beyond / np.where(way == 0.0, np.inf, way))


@dataclass(frozen=True)
class Residual(Metric):
    """Residual vibration: half the peak-to-peak value from the last change of the variable `command` on.

    The run should go on for a period of the slowest mode after it; steps of h miss up to (w h)^2 / 8 of a sine's peak.
    """

    command: str

    def variables(self) -> list[str]:
        return [self.output, self.command, ""]

    def values(self, gathered: np.ndarray) -> np.ndarray:
        return 0.5 * (gathered["largest"] - gathered["smallest"])


@dataclass(frozen=True)
class Envelope(Metric):
    """Residual vibration by its envelope: the largest hypot(x - rest, v / w) from the last change of `command` on.

    `rate` is the variable that is the output's derivative v, `natural_frequency` w [rad/s] that of the mode, `rest` the value
    about which the output swings. It does not depend on where in the period the steps fall; damping is not undone.
    """

    command: str
    rate: str
    natural_frequency: float
    rest: float = 0.0

    kind: ClassVar[int] = ENVELOPE

    def variables(self) -> list[str]:
        return [self.output, self.command, self.rate]

    def parameter(self) -> float:
        return self.natural_frequency

    def values(self, gathered: np.ndarray) -> np.ndarray:
        return gathered["largest"].copy()


@dataclass(frozen=True)
class SettlingTime(Metric):
    """Time after which the output stays within `tolerance` of `target` [s since the start of the run]; inf if it does not."""

    target: float
    tolerance: float

    kind: ClassVar[int] = OUTSIDE

    def parameter(self) -> float:
        return self.tolerance

    def values(self, gathered: np.ndarray) -> np.ndarray:
        outside = np.abs(gathered["last"] - self.target) > self.tolerance
        return np.where(outside, math.inf, gathered["sum"] - gathered["begin"])


@dataclass(frozen=True)
class Effort(Metric):
    """Root mean square of a variable that is held over the steps, such as a force."""

    kind: ClassVar[int] = SQUARE

    def values(self, gathered: np.ndarray) -> np.ndarray:
        span = gathered["time"] - gathered["begin"]
        passed = span > 0.0
        return np.where(passed, np.sqrt(gathered["sum"] / np.where(passed, span, 1.0)), np.abs(gathered["last"]))


def metric_rows(metrics: Mapping[str, Metric], place: Callable[[str], int]) -> np.ndarray:
    """What the loop gathers for each metric, shape (n,), of type `METRIC`; `place` tells where a variable is on the bus."""
    rows = np.zeros(len(metrics), METRIC)
    for row, metric in zip(rows, metrics.values(), strict=True):
        found = [place(name) if name else -1 for name in metric.variables()]
        row["kind"], row["parameter"] = metric.kind, metric.parameter()
        row["place"], row["command"], row["rate"] = found
        row["rest"] = getattr(metric, "rest", getattr(metric, "target", 0.0))
    return rows


def check_metrics(metrics: Mapping[str, Metric]) -> None:
    """Raise ModelError for what is no metric, or for a number that makes no sense."""
    for name, metric in metrics.items():
        if not isinstance(metric, Metric):
            raise ModelError(
                [f"metric {name!r} is {metric!r}; use Final, Peak, Overshoot, Residual, Envelope, SettlingTime or Effort"]
            )
        number = metric.parameter()
        positive = metric.kind in (ENVELOPE, OUTSIDE)
        if not math.isfinite(number) or (positive and not number > 0.0):
            raise ModelError([f"metric {name!r}: {number} must be a positive number"])


def metric_variables(metrics: Mapping[str, Metric]) -> list[str]:
    """All variables that the metrics need, each once."""
    return list(dict.fromkeys(name for metric in metrics.values() for name in metric.variables() if name))


def metric_values(metrics: Mapping[str, Metric], gathered: np.ndarray) -> dict[str, float]:
    """The values at the end of a run."""
    return {name: float(metric.values(gathered[i : i + 1])[0]) for i, (name, metric) in enumerate(metrics.items())}
