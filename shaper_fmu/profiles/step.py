"""Step: the whole distance at once; the impulses of its velocity and acceleration are not part of them."""

from __future__ import annotations

import math

from shaper_fmu.profiles.limits import NO_LIMIT
from shaper_fmu.profiles.method import ProfileMethod


def step(s: float) -> tuple[float, float, float]:
    """Position [-], velocity [1/s] and acceleration [1/s2] at s [s] after a step of unit height."""
    return (1.0 if s >= 0.0 else 0.0), 0.0, 0.0


def step_peaks() -> tuple[float, float]:
    """Infinite: the position jumps."""
    return math.inf, math.inf


def step_shortest() -> tuple[float, float, float]:
    """No duration keeps any limit."""
    return NO_LIMIT, 0.0, 0.0


def no_time() -> float:
    """A step takes no time, whatever duration is given [s]."""
    return 0.0


STEP = ProfileMethod(
    name="step",
    number=1,
    move=step,
    peaks=step_peaks,
    shortest=step_shortest,
    span=no_time,
    constant=("position", "velocity", "acceleration"),
    jumps_at_ends=True,
    summary="at once, at start_time",
)
