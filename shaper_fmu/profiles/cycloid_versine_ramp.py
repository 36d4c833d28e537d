"""Cycloid + ramped versine + ramp: no residual vibration of one damped mode, for any duration.

Taskin, Kilic and Kapucu 2019; Kilic and Kapucu 2011, eqs. (3)-(6). With R = 2 pi/T and r = R/wn, the parts
L1 R s/(2 pi) + L2/(2 pi) (R s - sin R s) + L3/(2 pi) (R s + 1 - cos R s), L2 = 1 - r^2, L3 = 2 zeta r,
L1 = 1 - L2 - L3, add up to the form used here. The velocity jumps at both ends. For durations below a natural
period the profile is not monotone.
"""

from __future__ import annotations

import math

from shaper_fmu.profiles.cycloid_versine_ramp_limits import cycloid_versine_ramp_peak_velocity, cycloid_versine_ramp_shortest
from shaper_fmu.profiles.limits import NO_LIMIT
from shaper_fmu.profiles.method import ProfileMethod


def cycloid_versine_ramp(s: float, duration: float, natural_frequency: float, damping_ratio: float) -> tuple[float, float, float]:
    """Position [-], velocity [1/s] and acceleration [1/s2] at s in [0, duration] of a move over the unit distance.

    natural_frequency in rad/s. The velocity's jumps at both ends are not part of the acceleration.
    """
    rate = 2.0 * math.pi / duration
    ratio = rate / natural_frequency
    cycloid_part = 1.0 - ratio * ratio
    versine_part = 2.0 * damping_ratio * ratio
    angle = rate * s
    sine = math.sin(angle)
    cosine = math.cos(angle)
    scale = 1.0 / (2.0 * math.pi)
    return (
        scale * (angle - cycloid_part * sine + versine_part * (1.0 - cosine)),
        scale * rate * (1.0 - cycloid_part * cosine + versine_part * sine),
        scale * rate * rate * (cycloid_part * sine + versine_part * cosine),
    )


def cycloid_versine_ramp_peaks(duration: float, natural_frequency: float, damping_ratio: float) -> tuple[float, float]:
    """Peak speed of the unit move [1/s]; the acceleration's is infinite, since the velocity jumps."""
    return cycloid_versine_ramp_peak_velocity(duration, natural_frequency, damping_ratio), math.inf


def cycloid_versine_ramp_durations(
    max_velocity: float, max_acceleration: float, natural_frequency: float, damping_ratio: float
) -> tuple[float, float, float]:
    """Shortest duration [s] and a gap of forbidden ones; no limit of the acceleration [1/s2] can be kept."""
    if max_acceleration < NO_LIMIT:
        return NO_LIMIT, 0.0, 0.0
    return cycloid_versine_ramp_shortest(max_velocity, natural_frequency, damping_ratio)


CYCLOID_VERSINE_RAMP = ProfileMethod(
    name="cycloid_versine_ramp",
    number=5,
    move=cycloid_versine_ramp,
    peaks=cycloid_versine_ramp_peaks,
    shortest=cycloid_versine_ramp_durations,
    jumps_at_ends=True,
    summary="no residual vibration of a mode with `natural_frequency` and `damping_ratio`, at any duration; its velocity jumps "
    "at the ends",
    paper="Taskin, Kilic and Kapucu 2019",
)
