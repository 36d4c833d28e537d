"""External signals that drive an input: a function of time, a constant, or a table."""

from __future__ import annotations

import numbers
from collections.abc import Callable
from dataclasses import dataclass
from typing import Any, Literal, cast

import numpy as np
from fmpy.model_description import ModelVariable

from shaper_fmu.component import time_rounding
from shaper_fmu.errors import ModelError, SimulationError
from shaper_fmu.master.variables import typed_value

Signal = Callable[[float], float]
Interpolation = Literal["hold", "linear"]


@dataclass(frozen=True)
class Table:
    """Values over time, shapes (n,): held from their time on, or joined by straight lines; a repeated time is a jump.

    Before the first and after the last row it keeps that row's value.
    """

    times: np.ndarray
    values: np.ndarray
    linear: bool = False

    def __call__(self, t: float) -> float:
        # a row that is meant to fall on a communication point counts as reached in spite of rounding
        after = int(np.searchsorted(self.times, t + time_rounding(t, 0.0), side="right"))
        if after == 0 or after == len(self.times) or not self.linear:
            return float(self.values[max(0, after - 1)])
        part = min(1.0, max(0.0, (t - self.times[after - 1]) / (self.times[after] - self.times[after - 1])))
        return float(self.values[after - 1] + part * (self.values[after] - self.values[after - 1]))

    def jumps(self) -> np.ndarray:
        """The times at which the value jumps."""
        changes = self.values[1:] != self.values[:-1]
        return self.times[1:][changes & (self.times[1:] == self.times[:-1]) if self.linear else changes]


def make_signal(source: Any, interpolation: Interpolation, target: str) -> Signal:
    """A function of time from a function, a number, or a table: shape (n, 2), or a pair of sequences (times, values).

    A held table takes each value from its time on; a linear one goes straight between the rows and may repeat a time
    to jump. Before the first and after the last row the table keeps that row's value. Raises ModelError.
    """
    if isinstance(source, numbers.Real | np.bool_) or (isinstance(source, np.ndarray) and source.ndim == 0):
        return Table(np.zeros(1), np.array([float(source)]))  # pyright: ignore[reportArgumentType]
    if callable(source):
        return cast(Signal, source)
    if interpolation not in ("hold", "linear"):
        raise ModelError([f"{target}: interpolation {interpolation!r} is neither 'hold' nor 'linear'"])
    times, values = _columns(source, target)
    return Table(times, values, interpolation == "linear")


@dataclass(frozen=True)
class TypedSignal:
    """A signal with each value in the type of the variable that it drives, which is called `target` in messages."""

    variable: ModelVariable
    signal: Signal
    target: str

    def __call__(self, t: float) -> float:
        try:
            value = self.signal(t)
        except Exception as error:
            text = f"{self.target} at t = {t:.15g} s: its function failed: {type(error).__name__}: {error}"
            raise SimulationError(text) from error
        if self.variable.type in ("Real", "Float64", "Float32") and isinstance(value, float):
            return value
        try:
            return typed_value(self.variable, value, f"{self.target} at t = {t:.15g} s")
        except ModelError as error:
            raise SimulationError(error.problems[0]) from None


def typed_signal(variable: ModelVariable, signal: Signal, target: str) -> Signal:
    """The signal with each value in the variable's type; a value that has none, or a failing function, is a SimulationError.

    Raises ModelError for a value of a table that has none.
    """

    if isinstance(signal, Table) and variable.type in ("Real", "Float64", "Float32"):
        return signal  # the compiled loop reads it
    if isinstance(signal, Table):
        for value in np.unique(signal.values).tolist():
            typed_value(variable, value, target)

    return TypedSignal(variable, signal, target)


def _columns(source: Any, target: str) -> tuple[np.ndarray, np.ndarray]:
    try:
        table = np.asarray(source, dtype=float)
    except (TypeError, ValueError):
        raise ModelError([f"{target}: the table is not made of numbers"]) from None
    pair = isinstance(source, tuple) and len(source) == 2
    columns = table if pair else table.T
    if table.ndim != 2 or columns.shape[0] != 2 or columns.shape[1] < 1:
        raise ModelError([f"{target}: a table has the shape (n, 2) or is a pair (times, values), not {table.shape}"])
    if not np.isfinite(columns).all():
        raise ModelError([f"{target}: the table contains a value that is not finite"])
    if (np.diff(columns[0]) < 0).any():
        raise ModelError([f"{target}: the table's times decrease at row {int(np.argmax(np.diff(columns[0]) < 0)) + 2}"])
    return columns[0], columns[1]
