"""Exponential: the command that makes a mode's output 1 - exp(-(a s)^3), by its inverse dynamics.

Sahinkaya 2001 prescribes the output of the system, and calculates the input that makes it. The function is not printed in
the papers that this project reproduces; taken here is the lowest power for which the input begins without a jump. With
y = 1 - exp(-X) and X = 40 (s/T)^3, so that y(T) = 1 to rounding, the command is

    u = y + (2 zeta/w) y' + y''/w^2,

and the mode follows y exactly: no residual vibration at any duration, damped or not. The velocity jumps at the start.
"""

from __future__ import annotations

import math

from shaper_fmu.profiles.exponential_limits import exponential_peak_velocity, exponential_shortest, output
from shaper_fmu.profiles.method import ProfileMethod


def exponential(s: float, duration: float, natural_frequency: float, damping_ratio: float) -> tuple[float, float, float]:
    """Position [-], velocity [1/s] and acceleration [1/s2] at s in [0, duration]; natural_frequency in rad/s."""
    rate = 1.0 / (natural_frequency * duration)
    damping = 2.0 * damping_ratio * rate
    square = rate * rate
    y, y1, y2, y3, y4 = output(s / duration)
    return (
        y + damping * y1 + square * y2,
        (y1 + damping * y2 + square * y3) / duration,
        (y2 + damping * y3 + square * y4) / (duration * duration),
    )


def exponential_peaks(duration: float, natural_frequency: float, damping_ratio: float) -> tuple[float, float]:
    """Peak speed [1/s]; the acceleration's is infinite, since the velocity jumps at the start."""
    return exponential_peak_velocity(duration, natural_frequency, damping_ratio), math.inf


EXPONENTIAL = ProfileMethod(
    name="exponential",
    number=15,
    move=exponential,
    peaks=exponential_peaks,
    shortest=exponential_shortest,
    jumps_at_start=True,
    tuned=False,
    summary="makes the mode follow y = L (1 - exp(-40 (s/T)^3)), by its inverse dynamics: no residual vibration of that mode, at "
    "any duration; its velocity jumps at the start",
    paper="Sahinkaya 2001",
)
