"""Ramp: constant speed; what superposed profiles are compared with (Kapucu, Yildirim, Yavuz and Baysec 2008)."""

from __future__ import annotations

import math

from shaper_fmu.profiles.limits import NO_LIMIT
from shaper_fmu.profiles.method import ProfileMethod


def ramp(s: float, duration: float) -> tuple[float, float, float]:
    """Position [-], velocity [1/s] and acceleration [1/s2] at s in [0, duration], but for the velocity's jumps."""
    return s / duration, 1.0 / duration, 0.0


def ramp_peaks(duration: float) -> tuple[float, float]:
    """The speed [1/s]; the acceleration's peak is infinite, since the velocity jumps."""
    return 1.0 / duration, math.inf


def ramp_shortest(max_velocity: float, max_acceleration: float) -> tuple[float, float, float]:
    """Shortest duration [s] for a limit of the speed [1/s]; no limit of the acceleration [1/s2] can be kept."""
    if max_acceleration < NO_LIMIT:
        return NO_LIMIT, 0.0, 0.0
    return 1.0 / max_velocity, 0.0, 0.0


RAMP = ProfileMethod(
    name="ramp",
    number=9,
    move=ramp,
    peaks=ramp_peaks,
    shortest=ramp_shortest,
    constant=("velocity", "acceleration"),
    jumps_at_ends=True,
    tuned=False,
    summary="constant speed; no residual vibration of an undamped mode if the duration is a multiple of its period",
)
