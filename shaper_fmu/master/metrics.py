"""Figures of merit that are computed while a system is stepped, so that no trajectory has to be kept.

They see every macro step, and both sides of every event.
"""

from __future__ import annotations

import math
from collections.abc import Iterable, Mapping
from dataclasses import dataclass
from typing import Any, ClassVar

import numpy as np

from shaper_fmu.errors import ModelError
from shaper_fmu.master.layout import ENVELOPE, EXTREMES, METRIC, OUTSIDE, SQUARE
from shaper_fmu.master.wiring import Port


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

    def value(self, row: Any) -> float:
        """The metric from what the loop has gathered: a row of `METRIC`."""
        raise NotImplementedError

    def problem(self, row: Any) -> str | None:
        """Why the value means nothing, in words, or None: a command that is measured from its end must have come to it."""
        command = self.variables()[1]
        if command and row["begin"] >= row["time"]:
            return f"{command} has not come to its end by t = {row['time']:g} s; run for longer"
        return None


@dataclass(frozen=True)
class Final(Metric):
    """Value at the end."""

    def value(self, row: Any) -> float:
        return float(row["last"])


@dataclass(frozen=True)
class Peak(Metric):
    """Largest magnitude."""

    def value(self, row: Any) -> float:
        return max(abs(float(row["largest"])), abs(float(row["smallest"])))


@dataclass(frozen=True)
class Overshoot(Metric):
    """How far the output goes beyond its final value, as a share of its way from start to end; 0 if it does not move."""

    def value(self, row: Any) -> float:
        first, last = float(row["first"]), float(row["last"])
        if first == last:
            return 0.0
        beyond = row["largest"] - last if last > first else last - row["smallest"]
        return max(0.0, float(beyond) / abs(last - first))


@dataclass(frozen=True)
class Residual(Metric):
    """Residual vibration: half the peak-to-peak value from the last change of the variable `command` on.

    The run should go on for a period of the slowest mode after it; steps of h miss up to (w h)^2 / 8 of a sine's peak.
    """

    command: str

    def variables(self) -> list[str]:
        return [self.output, self.command, ""]

    def value(self, row: Any) -> float:
        return 0.5 * (float(row["largest"]) - float(row["smallest"]))


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

    def value(self, row: Any) -> float:
        return float(row["largest"])


@dataclass(frozen=True)
class SettlingTime(Metric):
    """Time after which the output stays within `tolerance` of `target` [s since the start of the run]; inf if it does not."""

    target: float
    tolerance: float

    kind: ClassVar[int] = OUTSIDE

    def parameter(self) -> float:
        return self.tolerance

    def value(self, row: Any) -> float:
        return math.inf if abs(row["last"] - self.target) > self.tolerance else float(row["sum"] - row["begin"])


@dataclass(frozen=True)
class Effort(Metric):
    """Root mean square of a variable that is held over the steps, such as a force."""

    kind: ClassVar[int] = SQUARE

    def value(self, row: Any) -> float:
        span = float(row["time"] - row["begin"])
        return math.sqrt(float(row["sum"]) / span) if span > 0.0 else abs(float(row["last"]))


def metric_rows(metrics: Mapping[str, Metric], places: Mapping[Port, int]) -> np.ndarray:
    """What the loop gathers for each metric, shape (n,), of type `METRIC`."""
    rows = np.zeros(len(metrics), METRIC)
    for row, metric in zip(rows, metrics.values(), strict=True):
        found = [places[_port(name)] if name else -1 for name in metric.variables()]
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


def metric_values(metrics: Mapping[str, Metric], rows: Iterable[Any]) -> dict[str, float]:
    """The values at the end of a run."""
    return {name: metric.value(row) for (name, metric), row in zip(metrics.items(), rows, strict=True)}


def _port(name: str) -> Port:
    instance, _, variable = name.partition(".")
    return instance, variable
