"""Two-part command: two cycloid + ramped versine + ramp moves in series, each over half the distance in half the time.

Kilic and Kapucu 2011: a wrong natural frequency leaves less residual vibration than with the single move.
"""

from __future__ import annotations

from shaper_fmu.profiles.cycloid_versine_ramp import cycloid_versine_ramp


def two_part(s: float, duration: float, natural_frequency: float, damping_ratio: float) -> tuple[float, float, float]:
    """Position [-], velocity [1/s] and acceleration [1/s2] at s in [0, duration] of a move over the unit distance.

    The velocity jumps at the start and at the end. In the middle nothing jumps: the first part ends with the velocity and
    the acceleration with which the second, its equal, begins.
    """
    half = 0.5 * duration
    done = 0.0
    if s >= half:
        s -= half
        done = 0.5
    position, velocity, acceleration = cycloid_versine_ramp(s, half, natural_frequency, damping_ratio)
    return done + 0.5 * position, 0.5 * velocity, 0.5 * acceleration
