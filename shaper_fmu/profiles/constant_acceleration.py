"""Constant acceleration, cruise, constant deceleration, with intervals that leave no vibration of an undamped mode.

One of the two acceleration profiles of Mimmi and Pennacchi as Kilic and Kapucu 2011 describe them: constant, over intervals that
differ. Which intervals is not said there; here acceleration and deceleration begin whole natural periods apart
(shaper_fmu/profiles/apart.py). Of a duration of two periods the pulses take one each, and the frequency is tolerated better.
"""

from __future__ import annotations

from shaper_fmu.profiles.apart import natural_period, pulse_time, shortest_apart
from shaper_fmu.profiles.method import ProfileMethod
from shaper_fmu.profiles.trapezoid import ramp_end, trapezoid, trapezoid_cruise_time, trapezoid_peaks


def constant_acceleration_shortest(
    max_velocity: float, max_acceleration: float, natural_frequency: float
) -> tuple[float, float, float]:
    """Shortest duration [s] for limits of the unit move in 1/s and 1/s2, and a gap of forbidden ones."""
    return shortest_apart(max_velocity, max_acceleration, natural_frequency, 1.0)


CONSTANT_ACCELERATION = ProfileMethod(
    name="constant_acceleration",
    number=13,
    move=trapezoid,
    peaks=trapezoid_peaks,
    shortest=constant_acceleration_shortest,
    ramp=pulse_time,
    least=natural_period,
    event=ramp_end,
    cruise_time=trapezoid_cruise_time,
    constant=("acceleration",),
    jumps_at_ends=True,
    tuned=False,
    summary="a trapezoidal velocity whose acceleration and deceleration begin whole periods of `natural_frequency` apart: no "
    "residual vibration of an undamped mode, at any duration above its period",
    paper="Mimmi and Pennacchi, as Kilic and Kapucu 2011 describe it",
)
