"""How fast the cycloid + ramped versine + ramp profile gets, and the durations that a speed limit permits.

The peak speed of the unit move is (1 + M)/T with M^2 = (1 - x)^2 + 4 zeta^2 x and x = (Tn/T)^2. Its logarithmic slope
along Tn/T has the sign of N(x) = M + (1 - x)(1 - 3x) + 8 zeta^2 x, which is convex in x, positive at 0 and not negative
from 1 on. So there is at most one stretch of durations, somewhat above the natural period, on which a longer move needs
more speed; it exists for light damping, and then a limit may permit a duration and forbid some longer ones.
"""

from __future__ import annotations

import math


def cycloid_versine_ramp_peak_velocity(duration: float, natural_frequency: float, damping_ratio: float) -> float:
    """Peak speed of the unit move [1/s], exact: the profile's oscillation runs through one full turn."""
    ratio = 2.0 * math.pi / (duration * natural_frequency)
    sine = 1.0 - ratio * ratio
    cosine = 2.0 * damping_ratio * ratio
    return (1.0 + math.sqrt(sine * sine + cosine * cosine)) / duration


def cycloid_versine_ramp_shortest(
    max_velocity: float, natural_frequency: float, damping_ratio: float
) -> tuple[float, float, float]:
    """Shortest duration [s] within a speed limit [1/s] of the unit move, and the ends of a gap of forbidden longer ones [s].

    The gap is open and empty (0, 0) where the peak speed only falls with the duration. Exact to the last bit.
    """
    period = 2.0 * math.pi / natural_frequency
    middle = _lowest_slope(damping_ratio)
    if _slope(middle, damping_ratio) >= 0.0:
        return _from(period, max_velocity, natural_frequency, damping_ratio), 0.0, 0.0
    trough = period / math.sqrt(_slope_zero(middle, 1.0, damping_ratio))
    crest = period / math.sqrt(_slope_zero(middle, 0.0, damping_ratio))
    if cycloid_versine_ramp_peak_velocity(trough, natural_frequency, damping_ratio) > max_velocity:
        return _from(crest, max_velocity, natural_frequency, damping_ratio), 0.0, 0.0
    below = 0.5 * trough
    while cycloid_versine_ramp_peak_velocity(below, natural_frequency, damping_ratio) <= max_velocity:
        below *= 0.5
    shortest = _crossing(trough, below, max_velocity, natural_frequency, damping_ratio)
    if cycloid_versine_ramp_peak_velocity(crest, natural_frequency, damping_ratio) <= max_velocity:
        return shortest, 0.0, 0.0
    gap_start = _crossing(trough, crest, max_velocity, natural_frequency, damping_ratio)
    return shortest, gap_start, _from(crest, max_velocity, natural_frequency, damping_ratio)


def _slope(x: float, damping_ratio: float) -> float:
    """N(x), with the sign of the change of the peak speed along (Tn/T)^2 = x."""
    damping = 4.0 * damping_ratio * damping_ratio
    return math.sqrt((1.0 - x) * (1.0 - x) + damping * x) + (1.0 - x) * (1.0 - 3.0 * x) + 2.0 * damping * x


def _lowest_slope(damping_ratio: float) -> float:
    """The place of N's minimum in [0, 1], where its rising derivative changes sign."""
    damping = 4.0 * damping_ratio * damping_ratio
    low = 0.0
    high = 1.0
    for _ in range(60):
        x = 0.5 * (low + high)
        root = math.sqrt((1.0 - x) * (1.0 - x) + damping * x)
        if (x - 1.0 + 0.5 * damping) + (6.0 * x - 4.0 + 2.0 * damping) * root < 0.0:
            low = x
        else:
            high = x
    return 0.5 * (low + high)


def _slope_zero(negative: float, positive: float, damping_ratio: float) -> float:
    """The zero of N between a place where it is negative and one where it is not."""
    for _ in range(60):
        x = 0.5 * (negative + positive)
        if _slope(x, damping_ratio) < 0.0:
            negative = x
        else:
            positive = x
    return positive


def _from(start: float, max_velocity: float, natural_frequency: float, damping_ratio: float) -> float:
    """The duration [s] from which on the limit is kept; the peak speed must fall from `start` [s] on."""
    duration = start
    if cycloid_versine_ramp_peak_velocity(duration, natural_frequency, damping_ratio) <= max_velocity:
        while cycloid_versine_ramp_peak_velocity(0.5 * duration, natural_frequency, damping_ratio) <= max_velocity:
            duration *= 0.5
        return _crossing(duration, 0.5 * duration, max_velocity, natural_frequency, damping_ratio)
    while cycloid_versine_ramp_peak_velocity(duration, natural_frequency, damping_ratio) > max_velocity:
        duration *= 2.0
    return _crossing(duration, 0.5 * duration, max_velocity, natural_frequency, damping_ratio)


def _crossing(permitted: float, forbidden: float, max_velocity: float, natural_frequency: float, damping_ratio: float) -> float:
    """The last permitted duration [s] before a forbidden one, bisected to the last bit."""
    for _ in range(1100):
        middle = 0.5 * (permitted + forbidden)
        if middle in (permitted, forbidden):
            break
        if cycloid_versine_ramp_peak_velocity(middle, natural_frequency, damping_ratio) <= max_velocity:
            permitted = middle
        else:
            forbidden = middle
    return permitted
