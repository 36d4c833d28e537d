"""Cycloid: y = s/T - sin(2 pi s/T)/(2 pi); velocity and acceleration are zero at both ends."""

from __future__ import annotations

import math


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
