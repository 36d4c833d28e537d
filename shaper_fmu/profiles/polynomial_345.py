"""3-4-5 polynomial: y = 10 u^3 - 15 u^4 + 6 u^5 with u = s/T; velocity and acceleration are zero at both ends."""

from __future__ import annotations

import math

from shaper_fmu.profiles.method import ProfileMethod


def polynomial_345(s: float, duration: float) -> tuple[float, float, float]:
    """Position [-], velocity [1/s] and acceleration [1/s2] at s in [0, duration] of a move over the unit distance."""
    u = s / duration
    rest = 1.0 - u
    return (
        u * u * u * (10.0 - u * (15.0 - 6.0 * u)),
        30.0 * u * u * rest * rest / duration,
        60.0 * u * rest * (1.0 - 2.0 * u) / (duration * duration),
    )


def polynomial_345_peaks(duration: float) -> tuple[float, float]:
    """Peak speed 15/(8 T) [1/s] and peak acceleration 10/(sqrt(3) T^2) [1/s2] of the unit move."""
    return 1.875 / duration, 10.0 / (math.sqrt(3.0) * duration * duration)


def polynomial_345_shortest(max_velocity: float, max_acceleration: float) -> tuple[float, float, float]:
    """Shortest duration [s] for limits of the unit move in 1/s and 1/s2."""
    return max(1.875 / max_velocity, math.sqrt(10.0 / (math.sqrt(3.0) * max_acceleration))), 0.0, 0.0


POLYNOMIAL_345 = ProfileMethod(
    name="polynomial_345",
    number=4,
    move=polynomial_345,
    peaks=polynomial_345_peaks,
    shortest=polynomial_345_shortest,
    summary="y = L (10 u^3 - 15 u^4 + 6 u^5), u = s/T",
)
