"""Residual vibration of any command on one mode, and its sensitivity to wrong frequencies and damping.

A command is an `ImpulseSequence`, a `PulseSequence` or a `Profile`: whatever has residual_vibration(w, zeta). Two
measures are in use, and each function names the one it gives:

- V (Singer and Seering 1990): the residual envelope at the command's end, over the envelope that a step (for impulses: a
  unit impulse) has at its own time. The percentage residual vibration PRV is 100 V for an undamped mode.
- rel: the residual envelope over that of the unshaped step at the same instant, rel = V exp(zeta w T) with the command's
  duration T. Both are equal for an undamped mode.
"""

from __future__ import annotations

import math
from collections.abc import Iterable
from typing import Protocol, cast

import numpy as np


class Command(Protocol):
    """A command that ends."""

    @property
    def duration(self) -> float:
        """Time from its start to its end [s]."""
        ...

    def residual_vibration(self, natural_frequency: float, damping_ratio: float = 0.0, /) -> float:
        """V on a mode of this frequency [rad/s] and damping ratio."""
        ...


_RIPPLE_SHARE = 0.5  # V changes over frequency ratios of 2 pi / (w T): no faster than a scan in steps of 0.5 / (w T) sees
_TOUCHING = 1.0 + 1e-9


def relative_residual(command: Command, natural_frequency: float, damping_ratio: float = 0.0) -> float:
    """rel = V exp(zeta w T): the residual over that of the unshaped step at the same instant."""
    v = command.residual_vibration(natural_frequency, damping_ratio)
    return grown(v, damping_ratio * natural_frequency * command.duration)


def grown(v: float, exponent: float) -> float:
    """v exp(exponent), infinite if it overflows."""
    if exponent > 700.0:
        return math.inf if v > 0.0 else 0.0
    return v * math.exp(exponent)


def sensitivity_curve(command: Command, natural_frequency: float, damping_ratio: float, ratios: Iterable[float]) -> np.ndarray:
    """V at each ratio of the actual to the design frequency, damping ratio unchanged; shape (n,)."""
    return np.array([command.residual_vibration(r * natural_frequency, damping_ratio) for r in ratios])


def damping_curve(command: Command, natural_frequency: float, damping_ratios: Iterable[float]) -> np.ndarray:
    """V at the design frequency for each actual damping ratio; shape (n,)."""
    return np.array([command.residual_vibration(natural_frequency, zeta) for zeta in damping_ratios])


def tolerated_band(
    command: Command,
    natural_frequency: float,
    damping_ratio: float = 0.0,
    tolerance: float = 0.05,
    *,
    limits: tuple[float, float] = (1e-3, 10.0),
    scan: float = 0.005,
) -> tuple[float, float] | None:
    """The band of frequency ratios around 1 in which V <= tolerance, to rounding; None if V exceeds it at 1.

    The nearest crossings are bracketed by steps of `scan` and found by Brent's method; the band ends at `limits`. A
    maximum that touches the tolerance within 1e-9 of it is no crossing.
    """

    def excess(ratio: float) -> float:
        return command.residual_vibration(ratio * natural_frequency, damping_ratio) - tolerance

    scan = min(scan, _RIPPLE_SHARE / max(1e-9, natural_frequency * command.duration))
    slack = (_TOUCHING - 1.0) * tolerance
    if excess(1.0) > slack:
        return None

    from scipy.optimize import brentq  # takes long to load: only where it is needed

    def edge(step: float, limit: float) -> float:
        inside, outside = 1.0, 1.0 + step
        while limits[0] < outside < limits[1] and excess(outside) <= slack:
            inside, outside = outside, outside + step
        if not limits[0] < outside < limits[1]:
            return limit
        if excess(inside) >= 0.0:  # it touches the tolerance right here
            return inside
        return cast(float, brentq(excess, inside, outside, xtol=1e-15))

    return edge(-scan, limits[0]), edge(scan, limits[1])


def insensitivity(command: Command, natural_frequency: float, damping_ratio: float = 0.0, tolerance: float = 0.05) -> float:
    """Width of the tolerated band; 0 if there is none."""
    band = tolerated_band(command, natural_frequency, damping_ratio, tolerance)
    return band[1] - band[0] if band else 0.0
