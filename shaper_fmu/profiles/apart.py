"""Two equal and opposite pulses of acceleration, whole natural periods apart: they leave no vibration of an undamped mode.

Whatever their shape, each leaves a vibration of the same amplitude, and n periods later the second cancels the first. So of a
duration T the pulse takes ta = T - n Tn, with n Tn between T/2 (no cruise) and T. The smallest n needs the least
acceleration: V = 1/(n Tn) and A = c V/ta for the unit distance, where c is the pulse's peak over its mean.
"""

from __future__ import annotations

import math

from shaper_fmu.profiles.limits import NO_LIMIT

_ROUNDING = 1e-12
SHORTEST_PULSE = 0.01
"""Periods that a pulse takes at least, where limits ask for the shortest duration."""


def pulse_time(duration: float, max_velocity: float, natural_frequency: float) -> float:
    """Duration of each pulse [s]; the limit in 1/s."""
    period = 2.0 * math.pi / natural_frequency
    return max(0.0, duration - period * periods_apart(max(0.5 * duration, 1.0 / max_velocity) / period))


def periods_apart(least: float) -> float:
    """The smallest whole number of periods that is `least` or more, to rounding."""
    whole = float(int(least))
    if least - whole > _ROUNDING * least:
        whole += 1.0
    return whole


def natural_period(natural_frequency: float) -> float:
    """The duration that a move must exceed [s]."""
    return 2.0 * math.pi / natural_frequency


def shortest_apart(
    max_velocity: float, max_acceleration: float, natural_frequency: float, peak: float
) -> tuple[float, float, float]:
    """Shortest duration [s] for limits in 1/s and 1/s2, and the ends of a gap of forbidden ones; `peak` is c.

    In periods, n permits durations from n + max(q/n, the shortest pulse) to 2 n, where q = c/(a Tn^2). That is none if
    q > n^2, and leaves a gap before those of n + 1 if n = 1 or q > n^2 - 1; there is no second gap.
    """
    period = 2.0 * math.pi / natural_frequency
    hardness = peak / (max_acceleration * period * period) if max_acceleration < NO_LIMIT else 0.0
    apart = max(periods_apart(1.0 / (max_velocity * period)), periods_apart(math.sqrt(hardness)))
    shortest = period * (apart + max(hardness / apart, SHORTEST_PULSE)) * (1.0 + _ROUNDING)
    more = apart + 1.0
    following = period * (more + max(hardness / more, SHORTEST_PULSE)) * (1.0 + _ROUNDING)
    last = 2.0 * apart * period * (1.0 + _ROUNDING)
    if shortest > last:
        return following, 0.0, 0.0
    if following > last:
        return shortest, last, following
    return shortest, 0.0, 0.0
