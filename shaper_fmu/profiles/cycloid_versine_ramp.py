"""Cycloid + ramped versine + ramp: no residual vibration of one damped mode, for any duration.

Taskin, Kilic and Kapucu 2019; Kilic and Kapucu 2011, eqs. (3)-(6). With R = 2 pi/T and r = R/wn, the parts
L1 R s/(2 pi) + L2/(2 pi) (R s - sin R s) + L3/(2 pi) (R s + 1 - cos R s), L2 = 1 - r^2, L3 = 2 zeta r,
L1 = 1 - L2 - L3, add up to the form used here. The velocity jumps at both ends. For durations below a natural
period the profile is not monotone.
"""

from __future__ import annotations

import math


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
