"""How fast the S-curve for several modes gets, the shortest duration that limits permit, and the profile's record."""

from __future__ import annotations

import math

from shaper_fmu.component import Parameter
from shaper_fmu.profiles.limits import NO_LIMIT
from shaper_fmu.profiles.method import ProfileMethod
from shaper_fmu.profiles.s_curve_modes import (
    Harmonics,
    harmonics,
    s_curve_modes,
    segment_time_of,
    speeding_up,
)
from shaper_fmu.profiles.workspace import ModesWorkspace

_ROUNDING = 1e-13
_POINTS = 48
_STEP = 1.03
"""Ratio of the durations at which the limits are looked at, from long ones down."""
_GOLDEN = 0.6180339887498949


def s_curve_modes_peaks(
    m: ModesWorkspace, duration: float, ramp: float, natural_frequency: float, damping_ratio: float
) -> tuple[float, float]:
    """Peak speed [1/s] and peak acceleration [1/s2] of the unit move; `ramp`: duration of the speeding-up [s]."""
    if ramp <= 0.0:
        return math.inf, math.inf
    tau = segment_time_of(m, ramp)
    c = harmonics(m, tau, natural_frequency, damping_ratio)
    length = ramp / tau
    speed = 1.0 / (duration - ramp)
    high = _extreme(c, 1.0, 0, 0.0, length)
    low = -_extreme(c, -1.0, 0, 0.0, length)
    acceleration = max(high, 1.0 - low)
    if acceleration <= 1.0:  # it never brakes while it speeds up
        return speed, speed / (ramp - tau)
    fast = length - 1.0
    slow = 0.0
    for i in range(2):
        begin = 0.0 if i == 0 else length - 1.0
        fast = max(fast, _extreme(c, 1.0, 1, begin, length))
        slow = min(slow, -_extreme(c, -1.0, 1, begin, length))
    velocity = max(fast, length - 1.0 - slow) / (length - 1.0)
    return velocity * speed, acceleration * (speed / (ramp - tau))


def _extreme(c: Harmonics, sign: float, which: int, begin: float, length: float) -> float:
    """The largest of sign times acceleration (0) or velocity (1) in the segment from `begin`: every top of a scan, refined."""
    best = sign * _value(c, which, begin, length)
    before = best
    here = best
    for i in range(1, _POINTS + 2):
        after = sign * _value(c, which, begin + min(i, _POINTS) / _POINTS, length)
        if here >= before and here >= after:
            best = max(best, _top(c, sign, which, begin + max(i - 2, 0) / _POINTS, begin + min(i, _POINTS) / _POINTS, length))
        before = here
        here = after
    return max(best, here)


def _top(c: Harmonics, sign: float, which: int, low: float, high: float, length: float) -> float:
    """The largest value between two places, by golden sections."""
    best = sign * _value(c, which, high, length)
    for _ in range(36):
        span = _GOLDEN * (high - low)
        left = sign * _value(c, which, high - span, length)
        right = sign * _value(c, which, low + span, length)
        best = max(best, left, right)
        if left > right:
            high = low + span
        else:
            low = high - span
    return best


def _value(c: Harmonics, which: int, x: float, length: float) -> float:
    acceleration, velocity, _ = speeding_up(c, x, length)
    return acceleration if which == 0 else velocity


def s_curve_modes_ramp(duration: float, max_velocity: float) -> float:
    """Duration of the speeding-up [s] that ends at the limit of the speed [1/s]; half of the move if it is not reached."""
    return max(0.0, min(0.5 * duration, duration - 1.0 / max_velocity))


def s_curve_modes_shortest(
    m: ModesWorkspace, max_velocity: float, max_acceleration: float, natural_frequency: float, damping_ratio: float
) -> tuple[float, float, float]:
    """The duration [s] from which on the limits of the unit move in 1/s and 1/s2 are kept.

    Looked for from long durations down, whose segments do not swing beyond V and A, and bisected to the last bit.
    """
    slowest = natural_frequency
    if m.second_natural_frequency > 0.0:
        slowest = min(slowest, m.second_natural_frequency)
    if m.third_natural_frequency > 0.0:
        slowest = min(slowest, m.third_natural_frequency)
    duration = 4.0 * max(1.0 / max_velocity, math.sqrt(1.0 / max_acceleration), 2.0 * math.pi / slowest)
    duration += m.segment_time
    while not _permitted(m, duration, max_velocity, max_acceleration, natural_frequency, damping_ratio):
        duration *= 2.0
        if duration >= NO_LIMIT:
            return NO_LIMIT, 0.0, 0.0
    shorter = duration / _STEP
    while _permitted(m, shorter, max_velocity, max_acceleration, natural_frequency, damping_ratio):
        duration = shorter
        shorter = duration / _STEP
    for _ in range(1100):
        middle = 0.5 * (shorter + duration)
        if middle in (shorter, duration):
            break
        if _permitted(m, middle, max_velocity, max_acceleration, natural_frequency, damping_ratio):
            duration = middle
        else:
            shorter = middle
    return duration, 0.0, 0.0


def _permitted(
    m: ModesWorkspace,
    duration: float,
    max_velocity: float,
    max_acceleration: float,
    natural_frequency: float,
    damping_ratio: float,
) -> bool:
    ramp = s_curve_modes_ramp(duration, max_velocity)
    velocity, acceleration = s_curve_modes_peaks(m, duration, ramp, natural_frequency, damping_ratio)
    return velocity <= max_velocity * (1.0 + _ROUNDING) and acceleration <= max_acceleration * (1.0 + _ROUNDING)


def s_curve_modes_boundary(m: ModesWorkspace, i: int, duration: float, ramp: float) -> float:
    """Time [s] of the i-th (0 .. 5) boundary between two parts, where the acceleration has a kink."""
    tau = segment_time_of(m, ramp)
    k = i if i < 3 else 5 - i
    time = tau if k == 0 else (ramp - tau if k == 1 else ramp)
    return time if i < 3 else duration - time


def s_curve_modes_cruise_time(duration: float, ramp: float) -> float:
    """The distance over the cruise speed [s]."""
    return duration - ramp


S_CURVE_MODES = ProfileMethod(
    name="s_curve_modes",
    number=16,
    move=s_curve_modes,
    peaks=s_curve_modes_peaks,
    shortest=s_curve_modes_shortest,
    ramp=s_curve_modes_ramp,
    kink=s_curve_modes_boundary,
    kinks=6,
    cruise_time=s_curve_modes_cruise_time,
    tuned=False,
    parameters={
        "second_natural_frequency": Parameter(
            0.0, "rad/s", "undamped natural frequency of a second mode of s_curve_modes, 0 for none", min=0.0
        ),
        "second_damping_ratio": Parameter(
            0.0, "", "damping ratio of that mode", min=0.0, max=1.0, exclusive="max", published=(0.0, 0.999)
        ),
        "third_natural_frequency": Parameter(
            0.0, "rad/s", "undamped natural frequency of a third mode of s_curve_modes, 0 for none", min=0.0
        ),
        "third_damping_ratio": Parameter(
            0.0, "", "damping ratio of that mode", min=0.0, max=1.0, exclusive="max", published=(0.0, 0.999)
        ),
        "segment_time": Parameter(
            0.0, "s", "duration of a segment of s_curve_modes with constant acceleration between two, 0 for none", min=0.0
        ),
    },
    summary="the S-curve for up to three modes, damped or not: no residual vibration of any of them, at any duration; with "
    "`segment_time` the acceleration stays constant between its segments",
    paper="after Ozokutan, Karadag, Kapucu and Kutuk 2025",
)
