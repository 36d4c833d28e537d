"""Excitations of the input, as tables of held values."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Literal, get_args

import numpy as np

from shaper_fmu.errors import ModelError, nearest

ExcitationKind = Literal["pulse", "doublet", "step", "chirp"]


@dataclass(frozen=True)
class Excitation:
    """An excitation on top of the input's value at rest.

    pulse: `amplitude` for `width`. doublet: a pulse, then its negative, which leaves a rigid body where it comes to rest. step:
    `amplitude` for good, free from its beginning. chirp: a sine that sweeps linearly from 0 to 0.25 / `grid` [Hz] over `width`.

    Attributes:
        kind: of the excitation.
        amplitude: in the input's unit.
        width: [s].
        start: time at which it begins [s].
        rest: the input's value without it.
        grid: distance of a chirp's values [s].
    """

    kind: ExcitationKind
    amplitude: float
    width: float
    start: float
    rest: float
    grid: float

    def __post_init__(self) -> None:
        if self.kind not in get_args(ExcitationKind):
            raise ModelError([f"there is no excitation {self.kind!r}.{nearest(self.kind, get_args(ExcitationKind))}"])

    @property
    def end(self) -> float:
        """When the response becomes free [s]."""
        lengths = {"pulse": self.width, "doublet": 2.0 * self.width, "step": 0.0, "chirp": self.width}
        return self.start + lengths[self.kind]

    def levels(self) -> np.ndarray:
        """Times and values on top of rest, held from each time on; shape (k, 2)."""
        a, t, w = self.amplitude, self.start, self.width
        if self.kind == "pulse":
            return np.array([[t, a], [t + w, 0.0]])
        if self.kind == "doublet":
            return np.array([[t, a], [t + w, -a], [t + 2.0 * w, 0.0]])
        if self.kind == "step":
            return np.array([[t, a]])
        count = max(2, round(w / self.grid))
        s = (np.arange(count) + 0.5) / count
        values = a * np.sin(0.25 * np.pi * count * s * s)
        return np.column_stack([t + np.append(np.arange(count), count) * w / count, np.append(values, 0.0)])

    def table(self) -> np.ndarray:
        """The input from time 0 on, shape (k, 2)."""
        levels = self.levels()
        levels[:, 1] += self.rest
        return levels if levels[0, 0] <= 0.0 else np.concatenate([[[0.0, self.rest]], levels])

    def transform(self, pole: complex, time: float) -> complex:
        """sum of the input's jumps times exp(pole (time - their times)): residues at `time` over those of a unit step."""
        levels = self.levels()
        jumps = np.diff(levels[:, 1], prepend=0.0)
        return complex(np.sum(jumps * np.exp(pole * (time - levels[:, 0]))))
