"""Checks free responses (samples at equal intervals) and scales them for the fit."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np

from shaper_fmu.errors import ShaperFmuError

FEWEST_SAMPLES = 24
_ROUNDING = 4.0 * np.finfo(float).eps


class IdentificationError(ShaperFmuError):
    """The data do not support an answer; the message gives the reason and a remedy."""


@dataclass(frozen=True)
class FreeResponse:
    """Outputs after the end of the excitation, sampled at equal intervals.

    Attributes:
        values: shape (n, m), a column for each output, in its unit; the first row is the time 0 of all residues.
        step: distance of the samples [s].
        names: of the outputs, m of them.
        floor: standard deviation of what is known to be wrong with the values whatever the fit (rounding, a solver's
            tolerance, quantisation), of each output in its unit, shape (m,).
    """

    values: np.ndarray
    step: float
    names: tuple[str, ...]
    floor: np.ndarray

    @property
    def duration(self) -> float:
        """Time from the first to the last sample [s]."""
        return (len(self.values) - 1) * self.step


def free_response(values: Any, step: float, names: Sequence[str] | None = None, floor: Any = 0.0) -> FreeResponse:
    """A `FreeResponse` from numbers of shape (n,) or (n, m); rounding is added to the floor. Raises IdentificationError."""
    table = np.asarray(values, float)
    table = table[:, None] if table.ndim == 1 else table
    if table.ndim != 2 or not table.size:
        raise IdentificationError(f"values of shape {np.shape(values)} are no response; give (n,) or (n, outputs)")
    found = tuple(names) if names is not None else tuple(f"x{j + 1}" for j in range(table.shape[1]))
    if len(found) != table.shape[1]:
        raise IdentificationError(f"{len(found)} names for {table.shape[1]} outputs")
    if not (np.isfinite(step) and step > 0.0):
        raise IdentificationError(f"step = {step:g} s must be a positive number")
    if not np.isfinite(table).all():
        row, column = np.argwhere(~np.isfinite(table))[0]
        raise IdentificationError(f"{found[column]} is not a finite number at sample {row} (t = {row * step:g} s)")
    if len(table) < FEWEST_SAMPLES:
        raise IdentificationError(f"{len(table)} samples are too few; at least {FEWEST_SAMPLES} are needed")
    known = np.broadcast_to(np.asarray(floor, float), (table.shape[1],))
    return FreeResponse(table, float(step), found, np.hypot(known, _ROUNDING * np.abs(table).max(axis=0)))


@dataclass(frozen=True)
class Data:
    """Columns to be fitted together: those outputs of all experiments that move.

    Attributes:
        y: shape (c, n), each column divided by its `scale`, so that its deviation from a straight line has the RMS 1.
        scale: shape (c,), in the outputs' units.
        floor: shape (c,), divided by the scale.
        step: [s].
        column: (experiment, output) of each column.
        shape: numbers of experiments and of outputs.
    """

    y: np.ndarray
    scale: np.ndarray
    floor: np.ndarray
    step: float
    column: tuple[tuple[int, int], ...]
    shape: tuple[int, int]

    @property
    def samples(self) -> int:
        """Number of samples n."""
        return self.y.shape[1]

    @property
    def duration(self) -> float:
        """Time from the first to the last sample [s]."""
        return (self.samples - 1) * self.step

    @property
    def time(self) -> np.ndarray:
        """Sample times [s], shape (n,)."""
        return self.step * np.arange(self.samples)


def scaled(responses: Sequence[FreeResponse], resolution: float) -> Data:
    """The columns of all experiments, cut to the shortest; the floor is at least `resolution` of the RMS.

    Raises IdentificationError if the experiments do not fit together, or nothing moves.
    """
    first = responses[0]
    if any(r.names != first.names or abs(r.step - first.step) > 1e-9 * first.step for r in responses):
        raise IdentificationError("experiments must have the same outputs and the same step")
    n = min(len(r.values) for r in responses)
    columns, scale, floor, place = [], [], [], []
    for e, response in enumerate(responses):
        for j in range(len(first.names)):
            column = response.values[:n, j]
            rms = float(np.std(_without_line(column)))
            if rms > 4.0 * response.floor[j]:
                columns.append(column / rms)
                scale.append(rms)
                floor.append(max(resolution, response.floor[j] / rms))
                place.append((e, j))
    if not columns:
        raise IdentificationError(
            f"nothing moves: {', '.join(first.names)} show nothing beyond rounding and a straight line; "
            "excite more, or look at other outputs"
        )
    shape = len(responses), len(first.names)
    return Data(np.array(columns), np.array(scale), np.array(floor), first.step, tuple(place), shape)


def _without_line(column: np.ndarray) -> np.ndarray:
    u = np.linspace(-1.0, 1.0, len(column))
    centred = column - column.mean()
    return centred - u * (u @ centred) / (u @ u)
