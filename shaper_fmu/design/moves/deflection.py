"""The transient deflection of a mode on the way: q'' + 2 zeta w q' + w^2 q = -a from rest, with the base's acceleration a.

q is the mode's deflection from its base [m]; at a constant acceleration it rests at -a / w^2. At each instant it is linear in the
control, so that |q| <= limit there is linear, too; Singhose, Banerjee and Seering 1997 limit on/off commands so.
"""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np

from shaper_fmu.design.moves.control import Control

_SAMPLES = 24
"""Of q' in a period, between which its zeros are sought."""
_NEWTON = 8
_SAME = 1e-9
"""Share to which an acceleration is the one that holds the deflection."""
_BESIDE = 1e-3
"""Extremes this share of the duration beside a segment that holds the deflection are its own."""
_HELD = 1e-3
"""A segment holds the deflection at its limit where the latter and the rate's 0 are missed by this share of it, or less."""


@dataclass(frozen=True)
class Deflection:
    """|q| <= limit at all times, for a mode of this frequency [rad/s] and damping ratio."""

    frequency: float
    damping_ratio: float
    limit: float

    @property
    def pole(self) -> complex:
        """p = w (-zeta + j sqrt(1 - zeta^2))."""
        return self.frequency * complex(-self.damping_ratio, math.sqrt(1.0 - self.damping_ratio**2))

    @property
    def holding(self) -> float:
        """The acceleration [m/s2] that holds the deflection at its limit."""
        return self.frequency**2 * self.limit

    def unit(self, order: int, since: np.ndarray) -> np.ndarray:
        """What a unit impulse of the acceleration's integral of this order (0: the acceleration) adds to -q, s after it; 0 before.

        g_0 = Im exp(p s) / wd, g_1 its integral, g_2 that of g_1; g_-1 its derivative.
        """
        p, s = self.pole, np.maximum(since, 0.0)
        if order <= 0:
            grown = p ** (-order) * np.exp(p * s)
        elif order == 1:
            grown = np.expm1(p * s) / p
        else:
            grown = (np.expm1(p * s) - p * s) / p**2
        return np.where(since > 0.0, grown.imag / p.imag, 0.0)

    def state(self, control: Control, derivative: int, t: np.ndarray) -> np.ndarray:
        """q [m], or its first or second derivative, at the times t."""
        return -self.unit(control.order - 1 - derivative, np.subtract.outer(t, control.times)) @ control.jumps

    def slopes(self, control: Control, derivative: int, t: np.ndarray) -> np.ndarray:
        """How that changes with the switches, the instants t held: a row for each of them, a column for each time."""
        return self.unit(control.order - 2 - derivative, np.subtract.outer(t, control.times)) * control.jumps

    def extremes(self, control: Control) -> np.ndarray:
        """Instants at which q can be largest: the switches, and where q' passes through 0, also after the end."""
        end = control.duration + 2.0 * math.pi / self.pole.imag
        edges = np.append(control.times, end)
        counts = 2 + np.ceil(_SAMPLES * np.diff(edges) * self.frequency / (2.0 * math.pi)).astype(int)
        found = [control.times]
        for begin, stop, count in zip(edges[:-1], edges[1:], counts, strict=True):
            t = np.linspace(begin, stop, count)
            rate = self.state(control, 1, t)
            left = np.flatnonzero(rate[:-1] * rate[1:] < 0.0)
            if len(left):
                found.append(self._zeros(control, t[left], t[left + 1]))
        return np.concatenate(found)

    def _zeros(self, control: Control, low: np.ndarray, high: np.ndarray) -> np.ndarray:
        """Where q' = 0 between these instants: Newton's method, and the middle where that would leave them."""
        sign = np.sign(self.state(control, 1, high))
        t = 0.5 * (low + high)
        for _ in range(_NEWTON):
            rate, bend = self.state(control, 1, t), self.state(control, 2, t)
            above = rate * sign > 0.0
            low, high = np.where(above, low, t), np.where(above, t, high)
            with np.errstate(divide="ignore", invalid="ignore"):
                near = t - rate / bend
            t = np.where((near >= low) & (near <= high), near, 0.5 * (low + high))
        return t

    def peak(self, control: Control) -> float:
        """The largest |q| at any time [m]."""
        return float(np.abs(self.state(control, 0, self.extremes(control))).max())

    def held(self, control: Control) -> list[int]:
        """Numbers of the segments along which q rests at its limit."""
        begins = control.times[:-1]
        q, rate = self.state(control, 0, begins), self.state(control, 1, begins)
        still = np.abs(control.values + np.sign(q) * self.holding) <= _SAME * self.holding
        near = np.abs(np.abs(q) - self.limit) <= _HELD * self.limit
        return np.flatnonzero(still & near & (np.abs(rate) <= _HELD * self.frequency * self.limit)).tolist()

    def conditions(self, control: Control, t: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
        """|q| / limit - 1 at these extremes or switches, and how it changes with the times: a switch takes q along with it."""
        q, slopes = self.state(control, 0, t), self.slopes(control, 0, t)
        slopes += (t[:, None] == control.times) * self.state(control, 1, t)[:, None]
        sign = np.sign(q)
        return sign * q / self.limit - 1.0, sign[:, None] * slopes / self.limit

    def equations(self, control: Control, reached: float, margin: float) -> tuple[np.ndarray, np.ndarray]:
        """The same, to be 0, where the limit is reached but for a share; where a segment holds it, q' at its begin, too."""
        t, held = self.extremes(control), self.held(control)
        for k in held:
            t = t[(t < control.times[k] - _BESIDE * control.duration) | (t > control.times[k + 1] + _BESIDE * control.duration)]
        misses, slopes = self.conditions(control, np.append(t, control.times[held]))
        misses += margin
        chosen = misses >= -reached
        chosen[len(t) :] = True
        rate, rate_slopes = self._rates(control, np.array(held, dtype=int))
        return np.append(misses[chosen], rate), np.vstack((slopes[chosen], rate_slopes))

    def _rates(self, control: Control, switches: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
        """q' at switches, scaled, and how it changes with the times; before a switch q'' is from the left."""
        t, scale = control.times[switches], self.frequency * self.limit
        slopes = self.slopes(control, 1, t)
        slopes[np.arange(len(t)), switches] = self.state(control, 2, t)
        return self.state(control, 1, t) / scale, slopes / scale
