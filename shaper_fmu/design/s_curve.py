"""The shortest S-curve for several modes: its segment time, within limits of speed and acceleration.

With segments of tau, whose acceleration swings up to kappa A, the move over D at cruise speed V takes D/V + ta with
ta = tau + max(tau, kappa V/a); without a cruise D = V ta. Longer segments swing less and take longer: between is the
shortest move, found by a scan that is repeated about its best place.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass
from types import SimpleNamespace
from typing import Any

import numpy as np

from shaper_fmu.component import NO_EVENT
from shaper_fmu.design.profiles import Profile, profile
from shaper_fmu.errors import ArgumentError
from shaper_fmu.profiles.s_curve_modes import harmonics, speeding_up

MOST_MODES = 3
_TAUS, _SCANS = 81, 4
_NAMES = [f"{place}_{name}" for place in ("second", "third") for name in ("natural_frequency", "damping_ratio")]
_X = np.linspace(0.0, 1.0, 121).tolist()


def shortest_s_curve(
    distance: float,
    *,
    max_velocity: float,
    max_acceleration: float,
    modes: Sequence[float | tuple[float, float]],
) -> Profile:
    """The shortest S-curve (profile s_curve_modes) that leaves no vibration of one to three modes.

    Args:
        distance: distance to move [m], negative for the other way.
        max_velocity, max_acceleration: limits [m/s, m/s2]; both are needed.
        modes: natural frequencies [rad/s], or pairs of frequency and damping ratio.

    Shortest of all segment times and cruise speeds of this profile, as far as a scan of five levels shows; `fastest_move` finds
    shorter moves, whose acceleration jumps.
    """
    pairs = _checked(distance, max_velocity, max_acceleration, modes)
    record = SimpleNamespace(**dict.fromkeys(_NAMES, 0.0), segment_time=0.0)
    record.__dict__.update(modes_as_parameters(pairs))
    task = _Task(record, pairs[0], max_velocity / abs(distance), max_acceleration / abs(distance))
    longest = 4.0 * math.pi / min(w for w, _ in pairs)
    low, tau, high = 0.01 * longest, 0.0, longest
    for _ in range(_SCANS):
        taus = np.geomspace(low, high, _TAUS)
        best = int(np.argmin([task.duration(tau) for tau in taus.tolist()]))
        low, tau, high = (float(taus[i]) for i in (max(0, best - 1), best, min(_TAUS - 1, best + 1)))
    limits = {"max_velocity": max_velocity, "max_acceleration": max_acceleration, **modes_as_parameters(pairs)}
    found = [profile("s_curve_modes", distance, None, *pairs[0], **limits, segment_time=time) for time in (0.0, tau)]
    return min(found, key=lambda law: law.duration)


@dataclass(frozen=True)
class _Task:
    """The first mode, a record with the others, and the limits of the unit move [1/s, 1/s2]."""

    record: Any
    mode: tuple[float, float]
    speed: float
    hardness: float

    def duration(self, tau: float) -> float:
        """Of the shortest move with segments of tau [s]; infinite where the speed swings beyond its limit."""
        c = harmonics(self.record, tau, *self.mode)
        swing = np.array([speeding_up(c, x, 2.0)[0] for x in _X])
        kappa = max(1.0, float(swing.max()), 1.0 - float(swing.min()))
        slope = kappa / self.hardness
        cruise = min(self.speed, self._without_cruise(tau, slope))
        ramp = tau + max(tau, slope * cruise)
        if kappa > 1.0 + 1e-9:
            length = ramp / tau
            speeds = np.array([speeding_up(c, begin + x, length)[1] for begin in (0.0, length - 1.0) for x in _X]) / (length - 1.0)
            if cruise * max(float(speeds.max()), 1.0 - float(speeds.min())) > self.speed * (1.0 + 1e-9):
                return math.inf
        return 1.0 / cruise + ramp

    @staticmethod
    def _without_cruise(tau: float, slope: float) -> float:
        """V with V (tau + max(tau, slope V)) = 1."""
        return min(0.5 / tau, (math.sqrt(tau * tau + 4.0 * slope) - tau) / (2.0 * slope))


def _checked(
    distance: float, max_velocity: float, max_acceleration: float, modes: Sequence[float | tuple[float, float]]
) -> list[tuple[float, float]]:
    pairs = [(float(w), float(z)) for w, z in (mode if isinstance(mode, tuple) else (mode, 0.0) for mode in modes)]
    if not 0 < len(pairs) <= MOST_MODES:
        raise ArgumentError(f"{len(pairs)} modes; an S-curve takes 1 to {MOST_MODES}")
    if not all(0.0 < w < math.inf and 0.0 <= z < 1.0 for w, z in pairs):
        raise ArgumentError("a mode needs a finite natural frequency above 0 and a damping ratio from 0 to less than 1")
    if distance == 0.0 or not math.isfinite(distance):
        raise ArgumentError(f"distance = {distance}: must be a finite number other than 0")
    if not (0.0 < max_velocity < NO_EVENT and 0.0 < max_acceleration < NO_EVENT):
        raise ArgumentError("the shortest S-curve needs max_velocity and max_acceleration, both above 0")
    return pairs


def modes_as_parameters(pairs: Sequence[tuple[float, float]]) -> dict[str, float]:
    """The profile's parameters for all modes but the first."""
    if len(pairs) > MOST_MODES:
        raise ArgumentError(f"{len(pairs)} modes; an S-curve takes 1 to {MOST_MODES}")
    return dict(zip(_NAMES, (value for pair in pairs[1:] for value in pair), strict=False))
