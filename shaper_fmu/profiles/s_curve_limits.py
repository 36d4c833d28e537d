"""How fast the S-curve gets within its segments, the shortest duration that limits permit, and the profile's record."""

from __future__ import annotations

import math

from shaper_fmu.profiles.limits import NO_LIMIT
from shaper_fmu.profiles.method import ProfileMethod
from shaper_fmu.profiles.s_curve import s_curve, s_curve_boundary, s_curve_segment_time, segment

_ROUNDING = 1e-14


def s_curve_peaks(duration: float, ramp: float, natural_frequency: float, damping_ratio: float) -> tuple[float, float]:
    """Peak speed [1/s] and peak acceleration [1/s2] of the unit move; `ramp`: a segment's duration; s and rad/s."""
    if ramp <= 0.0:
        return math.inf, math.inf
    speed = 1.0 / (duration - 2.0 * ramp)
    velocity, acceleration = segment_peaks(2.0 * math.pi / (natural_frequency * ramp), damping_ratio)
    return velocity * speed, acceleration * (speed / ramp)


def segment_peaks(ratio: float, damping_ratio: float) -> tuple[float, float]:
    """Peak speed over the cruise speed and peak acceleration over A, both at least 1, for ratio = Tn/tau.

    ds/dx = 1 + M cos(2 pi x - phi) up to the factor A. For M > 1 it has two zeros, which bound the pieces on which the
    acceleration is monotone; on each, a zero of an acceleration is an extreme of the speed.
    """
    sine_part = ratio * ratio - 1.0
    cosine_part = 2.0 * damping_ratio * ratio
    amplitude = math.sqrt(sine_part * sine_part + cosine_part * cosine_part)
    if amplitude <= 1.0:
        return 1.0, 1.0
    phase = math.atan2(cosine_part, sine_part)
    spread = math.atan2(math.sqrt((1.0 - 1.0 / amplitude) * (1.0 + 1.0 / amplitude)), -1.0 / amplitude)
    first = _turns(phase + spread)
    second = _turns(phase - spread)
    top = min(first, second)
    bottom = max(first, second)
    highest = segment(top, ratio, damping_ratio)[0]
    lowest = segment(bottom, ratio, damping_ratio)[0]
    acceleration = max(1.0, max(highest, 1.0 - lowest))
    velocity = 1.0
    if lowest < 0.0:
        velocity = max(velocity, _speed_at_zero(top, bottom, ratio, damping_ratio))
        velocity = max(velocity, _speed_at_zero(1.0, bottom, ratio, damping_ratio))
    if highest > 1.0:
        velocity = max(velocity, _speed_at_one(top, 0.0, ratio, damping_ratio))
        velocity = max(velocity, _speed_at_one(top, bottom, ratio, damping_ratio))
    return velocity, acceleration


def _turns(angle: float) -> float:
    """The angle [rad] in turns, brought into [0, 1)."""
    turns = angle / (2.0 * math.pi)
    if turns < 0.0:
        return turns + 1.0
    if turns >= 1.0:
        return turns - 1.0
    return turns


def _level(high: float, low: float, level: float, ratio: float, damping_ratio: float) -> float:
    """Where the first segment's acceleration is `level`, between a place where it is higher and one where it is lower."""
    for _ in range(60):
        middle = 0.5 * (high + low)
        if segment(middle, ratio, damping_ratio)[0] > level:
            high = middle
        else:
            low = middle
    return 0.5 * (high + low)


def _speed_at_zero(high: float, low: float, ratio: float, damping_ratio: float) -> float:
    """Largest speed of the first and fourth segments where their acceleration passes zero."""
    velocity = segment(_level(high, low, 0.0, ratio, damping_ratio), ratio, damping_ratio)[1]
    return max(abs(velocity), abs(1.0 - velocity))


def _speed_at_one(high: float, low: float, ratio: float, damping_ratio: float) -> float:
    """Largest speed of the second and fifth segments where their acceleration passes zero."""
    x = _level(high, low, 1.0, ratio, damping_ratio)
    gained = x + damping_ratio * ratio / math.pi - segment(x, ratio, damping_ratio)[1]
    return max(abs(0.5 + gained), abs(0.5 - gained))


def s_curve_shortest(
    max_velocity: float, max_acceleration: float, natural_frequency: float, damping_ratio: float
) -> tuple[float, float, float]:
    """Shortest duration [s] for limits of the unit move in 1/s and 1/s2, with the paper's choice of the segment time.

    For strongly damped modes (seen at a damping ratio of 0.5) another segment time can permit a shorter move.
    Both peaks fall with the duration: bracketed by doubling, bisected to the last bit. Where the segments do not swing
    beyond V and A (long segments), it is 1/v + 2 v/a with cruise, max(2/v, sqrt(8/a)) without.
    """
    duration = 1.0 / max_velocity + 2.0 * max_velocity / max_acceleration
    if duration * max_velocity > 2.0:
        duration = max(2.0 / max_velocity, math.sqrt(8.0 / max_acceleration))
    if _permitted(duration, max_velocity, max_acceleration, natural_frequency, damping_ratio):
        return duration, 0.0, 0.0
    forbidden = duration
    while not _permitted(duration, max_velocity, max_acceleration, natural_frequency, damping_ratio):
        forbidden = duration
        duration *= 2.0
        if duration >= NO_LIMIT:
            return NO_LIMIT, 0.0, 0.0
    for _ in range(1100):
        middle = 0.5 * (forbidden + duration)
        if middle in (forbidden, duration):
            break
        if _permitted(middle, max_velocity, max_acceleration, natural_frequency, damping_ratio):
            duration = middle
        else:
            forbidden = middle
    return duration, 0.0, 0.0


def _permitted(
    duration: float, max_velocity: float, max_acceleration: float, natural_frequency: float, damping_ratio: float
) -> bool:
    tau = s_curve_segment_time(duration, max_velocity)
    velocity, acceleration = s_curve_peaks(duration, tau, natural_frequency, damping_ratio)
    return velocity <= max_velocity * (1.0 + _ROUNDING) and acceleration <= max_acceleration * (1.0 + _ROUNDING)


def s_curve_cruise_time(duration: float, ramp: float) -> float:
    """The distance over the cruise speed [s]."""
    return duration - 2.0 * ramp


S_CURVE = ProfileMethod(
    name="s_curve",
    number=7,
    move=s_curve,
    peaks=s_curve_peaks,
    shortest=s_curve_shortest,
    ramp=s_curve_segment_time,
    kink=s_curve_boundary,
    cruise_time=s_curve_cruise_time,
    summary="five smooth acceleration segments, no residual vibration of that mode either, damped or not; it cruises at "
    "max_velocity, or has no cruise where it would not reach it",
    paper="Ozokutan, Karadag, Kapucu and Kutuk 2025",
)
