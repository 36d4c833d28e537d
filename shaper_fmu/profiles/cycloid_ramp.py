"""Cycloid + ramp: no residual vibration of an undamped mode, for any duration.

The parts L1 = r^2 and L2 = 1 - r^2 with r = Tn/T (Alici, Kapucu and Baysec 1999, as Ozokutan et al. 2025, eqs. (10)-(13), give it):
cycloid + ramped versine + ramp for a mode without damping. A damped mode keeps some vibration.
"""

from __future__ import annotations

from shaper_fmu.profiles.cycloid_versine_ramp import (
    cycloid_versine_ramp,
    cycloid_versine_ramp_durations,
    cycloid_versine_ramp_peaks,
)
from shaper_fmu.profiles.method import ProfileMethod


def cycloid_ramp(s: float, duration: float, natural_frequency: float) -> tuple[float, float, float]:
    """Position [-], velocity [1/s] and acceleration [1/s2] at s in [0, duration]; natural_frequency in rad/s."""
    return cycloid_versine_ramp(s, duration, natural_frequency, 0.0)


def cycloid_ramp_peaks(duration: float, natural_frequency: float) -> tuple[float, float]:
    """Peak speed [1/s]; the acceleration's is infinite, since the velocity jumps."""
    return cycloid_versine_ramp_peaks(duration, natural_frequency, 0.0)


def cycloid_ramp_shortest(max_velocity: float, max_acceleration: float, natural_frequency: float) -> tuple[float, float, float]:
    """Shortest duration [s] and a gap of forbidden ones; no limit of the acceleration [1/s2] can be kept."""
    return cycloid_versine_ramp_durations(max_velocity, max_acceleration, natural_frequency, 0.0)


CYCLOID_RAMP = ProfileMethod(
    name="cycloid_ramp",
    number=10,
    move=cycloid_ramp,
    peaks=cycloid_ramp_peaks,
    shortest=cycloid_ramp_shortest,
    jumps_at_ends=True,
    tuned=False,
    summary="`cycloid_versine_ramp` without the part against damping: no residual vibration of an undamped mode, at any duration",
    paper="Alici, Kapucu and Baysec 1999",
)
