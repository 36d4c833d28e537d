"""Two-part command: two cycloid + ramped versine + ramp moves in series, each over half the distance in half the time.

Kilic and Kapucu 2011: a wrong natural frequency leaves less residual vibration than with the single move.
"""

from __future__ import annotations

import math

from shaper_fmu.profiles.cycloid_versine_ramp import cycloid_versine_ramp
from shaper_fmu.profiles.cycloid_versine_ramp_limits import cycloid_versine_ramp_peak_velocity, cycloid_versine_ramp_shortest
from shaper_fmu.profiles.limits import NO_LIMIT
from shaper_fmu.profiles.method import ProfileMethod


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


def two_part_peaks(duration: float, natural_frequency: float, damping_ratio: float) -> tuple[float, float]:
    """Peak speed of the unit move [1/s]; the acceleration's is infinite, since the velocity jumps."""
    return 0.5 * cycloid_versine_ramp_peak_velocity(0.5 * duration, natural_frequency, damping_ratio), math.inf


def two_part_shortest(
    max_velocity: float, max_acceleration: float, natural_frequency: float, damping_ratio: float
) -> tuple[float, float, float]:
    """Shortest duration [s] and a gap of forbidden ones; no limit of the acceleration [1/s2] can be kept."""
    if max_acceleration < NO_LIMIT:
        return NO_LIMIT, 0.0, 0.0
    half, gap_start, gap_end = cycloid_versine_ramp_shortest(2.0 * max_velocity, natural_frequency, damping_ratio)
    return 2.0 * half, 2.0 * gap_start, 2.0 * gap_end


TWO_PART = ProfileMethod(
    name="two_part",
    number=6,
    move=two_part,
    peaks=two_part_peaks,
    shortest=two_part_shortest,
    jumps_at_ends=True,
    summary="two such moves in series, which tolerate a wrong frequency better",
    paper="Kilic and Kapucu 2011",
)
