"""Cycloid: y = s/T - sin(2 pi s/T)/(2 pi); velocity and acceleration are zero at both ends."""

from __future__ import annotations

import math

from shaper_fmu.profiles.method import ProfileMethod


def cycloid(s: float, duration: float) -> tuple[float, float, float]:
    """Position [-], velocity [1/s] and acceleration [1/s2] at s in [0, duration] of a move over the unit distance."""
    rate = 2.0 * math.pi / duration
    angle = rate * s
    scale = 1.0 / (2.0 * math.pi)
    return (
        scale * (angle - math.sin(angle)),
        scale * rate * (1.0 - math.cos(angle)),
        scale * rate * rate * math.sin(angle),
    )


def cycloid_peaks(duration: float) -> tuple[float, float]:
    """Peak speed 2/T [1/s] and peak acceleration 2 pi/T^2 [1/s2] of the unit move."""
    return 2.0 / duration, 2.0 * math.pi / (duration * duration)


def cycloid_shortest(max_velocity: float, max_acceleration: float) -> tuple[float, float, float]:
    """Shortest duration [s] for limits of the unit move in 1/s and 1/s2."""
    return max(2.0 / max_velocity, math.sqrt(2.0 * math.pi / max_acceleration)), 0.0, 0.0


CYCLOID = ProfileMethod(
    name="cycloid",
    number=3,
    move=cycloid,
    peaks=cycloid_peaks,
    shortest=cycloid_shortest,
    summary="y = L (s/T - sin(2 pi s/T)/(2 pi))",
)
