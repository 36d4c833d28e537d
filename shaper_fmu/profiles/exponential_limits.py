"""The output of the exponential profile and its derivatives, how fast the command gets, and the durations that a limit permits."""

from __future__ import annotations

import math

from shaper_fmu.profiles.limits import NO_LIMIT

END = 40.0
"""X at the end of the move: exp(-40) is less than a rounding error."""
_POINTS = 64
_STEP = 1.02
"""Ratio of the durations between which the limit's crossings are looked for."""
_GOLDEN = 0.6180339887498949


def output(x: float) -> tuple[float, float, float, float, float]:
    """y = 1 - exp(-40 x^3) and its four derivatives along x.

    With p = 3 c x^2 = X', the derivatives of e = exp(-X) are -p e, (p^2 - p') e, (-p^3 + 3 p p' - p'') e, and so on.
    """
    e = math.exp(-END * x * x * x)
    p = 3.0 * END * x * x
    p1 = 6.0 * END * x
    p2 = 6.0 * END
    return (
        1.0 - e,
        p * e,
        (p1 - p * p) * e,
        (p * p * p - 3.0 * p * p1 + p2) * e,
        (6.0 * p * p * p1 - p * p * p * p - 3.0 * p1 * p1 - 4.0 * p * p2) * e,
    )


def exponential_peak_velocity(duration: float, natural_frequency: float, damping_ratio: float) -> float:
    """Peak speed of the unit move [1/s]: the largest of a scan's tops, each refined."""
    rate = 1.0 / (natural_frequency * duration)
    best = _speed(0.0, rate, damping_ratio)
    before = 0.0
    here = best
    for i in range(1, _POINTS + 1):
        after = _speed(i / _POINTS, rate, damping_ratio)
        if here >= before and here >= after:
            best = max(best, _top(max(i - 2, 0) / _POINTS, i / _POINTS, rate, damping_ratio))
        before = here
        here = after
    return best / duration


def _top(low: float, high: float, rate: float, damping_ratio: float) -> float:
    """The largest speed times the duration between two places, by golden sections."""
    best = 0.0
    for _ in range(40):
        span = _GOLDEN * (high - low)
        left = _speed(high - span, rate, damping_ratio)
        right = _speed(low + span, rate, damping_ratio)
        best = max(best, left, right)
        if left > right:
            high = low + span
        else:
            low = high - span
    return best


def _speed(x: float, rate: float, damping_ratio: float) -> float:
    """Speed times the duration at x = s/T, rate = 1/(w T)."""
    _, y1, y2, y3, _ = output(x)
    return abs(y1 + 2.0 * damping_ratio * rate * y2 + rate * rate * y3)


def exponential_shortest(
    max_velocity: float, max_acceleration: float, natural_frequency: float, damping_ratio: float
) -> tuple[float, float, float]:
    """Shortest duration [s] within a limit of the speed [1/s], and the ends of a gap of forbidden longer ones.

    Near the natural period a longer move may need more speed. The crossings are looked for from long durations down, to where the
    jump of the start, 240/(w^2 T^3), exceeds the limit. No limit of the acceleration [1/s2] can be kept.
    """
    if max_acceleration < NO_LIMIT:
        return NO_LIMIT, 0.0, 0.0
    permitted = 1.0 / max_velocity
    while exponential_peak_velocity(permitted, natural_frequency, damping_ratio) > max_velocity:
        permitted *= 2.0
    permitted = max(permitted, 20.0 / natural_frequency, 8.0 / max_velocity)
    lowest = math.pow(6.0 * END / (natural_frequency * natural_frequency * max_velocity), 1.0 / 3.0)
    within = True
    upper = 0.0
    start = 0.0
    end = 0.0
    duration = permitted
    while duration > lowest and start == 0.0:
        shorter = max(duration / _STEP, 0.999 * lowest)
        fits = exponential_peak_velocity(shorter, natural_frequency, damping_ratio) <= max_velocity
        if within and not fits:
            if end == 0.0:
                end = _crossing(duration, shorter, max_velocity, natural_frequency, damping_ratio)
            else:
                start = _crossing(duration, shorter, max_velocity, natural_frequency, damping_ratio)
        elif fits and not within:
            upper = _crossing(shorter, duration, max_velocity, natural_frequency, damping_ratio)
        within = fits
        duration = shorter
    if start > 0.0:
        return start, upper, end
    return end, 0.0, 0.0


def _crossing(permitted: float, forbidden: float, max_velocity: float, natural_frequency: float, damping_ratio: float) -> float:
    """The last permitted duration [s] before a forbidden one, bisected to the last bit."""
    for _ in range(1100):
        middle = 0.5 * (permitted + forbidden)
        if middle in (permitted, forbidden):
            break
        if exponential_peak_velocity(middle, natural_frequency, damping_ratio) <= max_velocity:
            permitted = middle
        else:
            forbidden = middle
    return permitted
