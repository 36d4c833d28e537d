"""A control that is constant between switches: the motion, the residual vibration, and their changes with the switches."""

from __future__ import annotations

import math
from dataclasses import dataclass
from functools import cached_property

import numpy as np

from shaper_fmu.design.lp.exchange import peaks
from shaper_fmu.design.lp.layout import Band


@dataclass(frozen=True)
class Control:
    """Values of the derivative of this order of the position between the times, from rest at 0; 0 after the last.

    `times` has one element more than `values`, begins with 0 and does not decrease.
    """

    times: np.ndarray
    values: np.ndarray
    order: int

    @property
    def duration(self) -> float:
        """The last time."""
        return float(self.times[-1])

    @cached_property
    def jumps(self) -> np.ndarray:
        """By how much the control changes at each of the times."""
        return np.diff(self.values, prepend=0.0, append=0.0)

    def state(self, k: int, t: np.ndarray) -> np.ndarray:
        """The k-th derivative of the position at the times t, k below the order."""
        return self._powers(self.order - k, t) @ self.jumps

    def state_slopes(self, k: int, t: np.ndarray) -> np.ndarray:
        """How it changes with the switches, the instants t held: a row for each of them, a column for each time."""
        return -self._powers(self.order - k - 1, t) * self.jumps

    def _powers(self, power: int, t: np.ndarray) -> np.ndarray:
        since = np.subtract.outer(t, self.times)
        return np.where(since > 0.0, since**power, 0.0) / math.factorial(power)

    def before(self) -> np.ndarray:
        """The control just before each of the times."""
        return np.concatenate(([0.0], self.values))

    def turns(self) -> np.ndarray:
        """Instants between switches at which the acceleration passes through zero, so that the speed has an extremum."""
        if self.order == 2:
            return np.zeros(0)
        a = self.state(2, self.times)
        begin, end = a[:-1], a[1:]
        crossing = np.flatnonzero((begin * end < 0.0) & (self.values != 0.0))
        return self.times[crossing] - begin[crossing] / self.values[crossing]

    def residual(self, w: float, damping_ratio: float) -> complex:
        """The mode's deflection at the end over that of a step of one unit at its own time: |.| is V of Singer and Seering."""
        p = w * complex(-damping_ratio, math.sqrt(1.0 - damping_ratio * damping_ratio))
        return complex(np.exp(p * (self.duration - self.times)) @ self.jumps / p**self.order)

    def residual_slopes(self, w: float, damping_ratio: float) -> np.ndarray:
        """How the residual changes with each of the times; the last one is the end as well."""
        p = w * complex(-damping_ratio, math.sqrt(1.0 - damping_ratio * damping_ratio))
        parts = self.jumps * np.exp(p * (self.duration - self.times)) / p ** (self.order - 1)
        slopes = -parts
        slopes[-1] += parts.sum()
        return slopes

    def along(self, w: np.ndarray, damping_ratio: float) -> np.ndarray:
        """The residual and its first two derivatives by the frequency, shape (3, n)."""
        rate = complex(-damping_ratio, math.sqrt(1.0 - damping_ratio * damping_ratio))
        since = rate * (self.duration - self.times)
        weights = self.jumps / rate**self.order * np.array([np.ones(len(since)), since, since * since])
        s, slope, curvature = weights @ np.exp(np.multiply.outer(since, w))
        n = self.order
        return np.array([s, slope - n * s / w, curvature - 2.0 * n * slope / w + n * (n + 1) * s / w**2]) / w**n

    def peaks(self, band: Band) -> tuple[np.ndarray, np.ndarray]:
        """Local maxima of the residual over a band: frequencies, and V there."""
        return peaks(lambda w: self.along(w, band.damping_ratio), band.low, band.high, self.duration)
