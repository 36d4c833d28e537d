"""Trapezoidal acceleration, cruise, trapezoidal deceleration: no vibration of an undamped mode.

The other acceleration profile of Mimmi and Pennacchi as Kilic and Kapucu 2011 describe them. The shares are not said there; here
the acceleration rises, stays and falls over a third of a pulse each, A = 3 V/(2 ta) with V = 1/(T - ta), and the two pulses
begin whole natural periods apart (shaper_fmu/profiles/apart.py).
"""

from __future__ import annotations

import math

from shaper_fmu.profiles.apart import natural_period, pulse_time, shortest_apart
from shaper_fmu.profiles.method import ProfileMethod
from shaper_fmu.profiles.trapezoid import trapezoid_cruise_time


def trapezoidal_acceleration(s: float, duration: float, ramp: float) -> tuple[float, float, float]:
    """Position [-], velocity [1/s] and acceleration [1/s2] at s in [0, duration] of a move over the unit distance.

    ramp: duration of each pulse [s].
    """
    speed = 1.0 / (duration - ramp)
    if s < ramp:
        return pulse(s, ramp, speed)
    left = duration - s
    if left < ramp:
        position, velocity, acceleration = pulse(left, ramp, speed)
        return 1.0 - position, velocity, -acceleration
    return speed * (s - 0.5 * ramp), speed, 0.0


def pulse(s: float, ramp: float, speed: float) -> tuple[float, float, float]:
    """Position [-], velocity [1/s] and acceleration [1/s2] while it gets up to speed [1/s]."""
    rise = ramp / 3.0
    top = 0.5 * speed / rise
    if s < rise:
        jerk = top / rise
        return jerk * s * s * s / 6.0, 0.5 * jerk * s * s, jerk * s
    if s < 2.0 * rise:
        u = s - 0.5 * rise
        return top * (0.5 * u * u + rise * rise / 24.0), top * u, top
    jerk = top / rise
    left = ramp - s
    return speed * (s - 0.5 * ramp) + jerk * left * left * left / 6.0, speed - 0.5 * jerk * left * left, jerk * left


def trapezoidal_acceleration_peaks(duration: float, ramp: float) -> tuple[float, float]:
    """Peak speed [1/s] and peak acceleration [1/s2] of the unit move."""
    speed = 1.0 / (duration - ramp)
    return speed, (1.5 * speed / ramp if ramp > 0.0 else math.inf)


def trapezoidal_acceleration_shortest(
    max_velocity: float, max_acceleration: float, natural_frequency: float
) -> tuple[float, float, float]:
    """Shortest duration [s] for limits of the unit move in 1/s and 1/s2, and a gap of forbidden ones."""
    return shortest_apart(max_velocity, max_acceleration, natural_frequency, 1.5)


def trapezoidal_acceleration_kink(i: int, duration: float, ramp: float) -> float:
    """When the acceleration has a kink [s], three times within and after each pulse."""
    return (i + 1.0) * ramp / 3.0 if i < 3 else duration - (6.0 - i) * ramp / 3.0


TRAPEZOIDAL_ACCELERATION = ProfileMethod(
    name="trapezoidal_acceleration",
    number=14,
    move=trapezoidal_acceleration,
    peaks=trapezoidal_acceleration_peaks,
    shortest=trapezoidal_acceleration_shortest,
    ramp=pulse_time,
    least=natural_period,
    kink=trapezoidal_acceleration_kink,
    kinks=6,
    cruise_time=trapezoid_cruise_time,
    tuned=False,
    summary="`constant_acceleration` with an acceleration that rises, stays and falls over a third of the pulse each",
    paper="Mimmi and Pennacchi, as Kilic and Kapucu 2011 describe it",
)
