"""Half a cycloid, constant speed, half a cycloid: no vibration of an undamped mode.

Alici, Kapucu and Baysec 1999 as Kilic and Kapucu 2011 describe it: cycloid, constant speed, cycloid. Read here as a cycloid cut in
its middle, so that the acceleration is half a wave of a sine, A sin(pi s/ta), with A = pi V/(2 ta) and V = 1/(T - ta). The
halves begin whole natural periods apart (shaper_fmu/profiles/apart.py), which the description leaves open.
"""

from __future__ import annotations

import math

from shaper_fmu.profiles.apart import natural_period, pulse_time, shortest_apart
from shaper_fmu.profiles.method import ProfileMethod


def cycloid_cruise(s: float, duration: float, ramp: float) -> tuple[float, float, float]:
    """Position [-], velocity [1/s] and acceleration [1/s2] at s in [0, duration] of a move over the unit distance.

    ramp: duration of each half of the cycloid [s].
    """
    speed = 1.0 / (duration - ramp)
    if s < ramp:
        return half_cycloid(s, ramp, speed)
    left = duration - s
    if left < ramp:
        position, velocity, acceleration = half_cycloid(left, ramp, speed)
        return 1.0 - position, velocity, -acceleration
    return speed * (s - 0.5 * ramp), speed, 0.0


def half_cycloid(s: float, ramp: float, speed: float) -> tuple[float, float, float]:
    """Position [-], velocity [1/s] and acceleration [1/s2] while it gets up to speed [1/s]."""
    rate = math.pi / ramp
    angle = rate * s
    return (
        0.5 * speed / rate * (angle - math.sin(angle)),
        0.5 * speed * (1.0 - math.cos(angle)),
        0.5 * speed * rate * math.sin(angle),
    )


def cycloid_cruise_peaks(duration: float, ramp: float) -> tuple[float, float]:
    """Peak speed [1/s] and peak acceleration [1/s2] of the unit move."""
    speed = 1.0 / (duration - ramp)
    return speed, (0.5 * math.pi * speed / ramp if ramp > 0.0 else math.inf)


def cycloid_cruise_shortest(max_velocity: float, max_acceleration: float, natural_frequency: float) -> tuple[float, float, float]:
    """Shortest duration [s] for limits of the unit move in 1/s and 1/s2, and a gap of forbidden ones."""
    return shortest_apart(max_velocity, max_acceleration, natural_frequency, 0.5 * math.pi)


def cycloid_cruise_kink(i: int, duration: float, ramp: float) -> float:
    """When the acceleration has a kink [s]: where the cruise begins and ends."""
    return ramp if i == 0 else duration - ramp


def cycloid_cruise_time(duration: float, ramp: float) -> float:
    """The distance over the speed between the halves [s]."""
    return duration - ramp


CYCLOID_CRUISE = ProfileMethod(
    name="cycloid_cruise",
    number=12,
    move=cycloid_cruise,
    peaks=cycloid_cruise_peaks,
    shortest=cycloid_cruise_shortest,
    ramp=pulse_time,
    least=natural_period,
    kink=cycloid_cruise_kink,
    kinks=2,
    cruise_time=cycloid_cruise_time,
    tuned=False,
    summary="half a cycloid, constant speed, half a cycloid, which begin whole periods of `natural_frequency` apart: no residual "
    "vibration of an undamped mode, at any duration above its period",
    paper="Alici, Kapucu and Baysec 1999",
)
