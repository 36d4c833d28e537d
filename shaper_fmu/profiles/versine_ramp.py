"""Ramped versine + ramp: the part of cycloid + ramped versine + ramp that acts against damping, without the cycloid.

With L3 = 2 zeta r and L1 = 1 - L3, r = Tn/T. The cycloid's part is 1 - r^2: so nothing is left of the mode where T = Tn, and
of other durations what the missing cycloid would have cancelled (Kapucu, Yildirim, Yavuz and Baysec 2008 name the part).
"""

from __future__ import annotations

import math

from shaper_fmu.profiles.limits import NO_LIMIT
from shaper_fmu.profiles.method import ProfileMethod


def versine_ramp(s: float, duration: float, natural_frequency: float, damping_ratio: float) -> tuple[float, float, float]:
    """Position [-], velocity [1/s] and acceleration [1/s2] at s in [0, duration]; natural_frequency in rad/s."""
    rate = 2.0 * math.pi / duration
    part = 2.0 * damping_ratio * rate / natural_frequency
    angle = rate * s
    scale = 1.0 / (2.0 * math.pi)
    return (
        scale * (angle + part * (1.0 - math.cos(angle))),
        scale * rate * (1.0 + part * math.sin(angle)),
        scale * rate * rate * part * math.cos(angle),
    )


def versine_ramp_peaks(duration: float, natural_frequency: float, damping_ratio: float) -> tuple[float, float]:
    """Peak speed (1 + L3)/T [1/s]; the acceleration's peak is infinite, since the velocity jumps."""
    return (1.0 + 4.0 * math.pi * damping_ratio / (natural_frequency * duration)) / duration, math.inf


def versine_ramp_shortest(
    max_velocity: float, max_acceleration: float, natural_frequency: float, damping_ratio: float
) -> tuple[float, float, float]:
    """Shortest duration [s] for a limit of the speed [1/s], from v T^2 = T + L3 T; none keeps a limit of the acceleration."""
    if max_acceleration < NO_LIMIT:
        return NO_LIMIT, 0.0, 0.0
    part = 4.0 * math.pi * damping_ratio / natural_frequency
    return 0.5 * (1.0 + math.sqrt(1.0 + 4.0 * part * max_velocity)) / max_velocity * (1.0 + 4e-16), 0.0, 0.0


VERSINE_RAMP = ProfileMethod(
    name="versine_ramp",
    number=11,
    move=versine_ramp,
    peaks=versine_ramp_peaks,
    shortest=versine_ramp_shortest,
    jumps_at_ends=True,
    tuned=False,
    summary="`cycloid_versine_ramp` without the cycloid: no residual vibration of the mode if the duration is its undamped period",
    paper="Kapucu, Yildirim, Yavuz and Baysec 2008",
)
