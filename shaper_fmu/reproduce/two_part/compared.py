"""The methods that Kilic and Kapucu (2011) and Taskin, Kilic and Kapucu (2019) name beside theirs, on the paper's pendulum.

Robustness as in eq. (7): the command is designed for an estimate w*, the pendulum and the time of the move stay.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from shaper_fmu.reproduce.runs import OscillatorBench
from shaper_fmu.reproduce.two_part.runs import DAMPING_RATIO, DURATION, NATURAL_FREQUENCY, STEPS, band, oscillator

METHODS = {
    "two-part": "two_part",
    "single": "cycloid_versine_ramp",
    "ramp + cycloid (Kapucu et al. 2008)": "cycloid_ramp",
    "ramp + versine (Kapucu et al. 2008)": "versine_ramp",
    "ramp (Kapucu et al. 2008)": "ramp",
    "exponential output (Sahinkaya 2001)": "exponential",
    "constant acceleration (Mimmi and Pennacchi)": "constant_acceleration",
    "trapezoidal acceleration (Mimmi and Pennacchi)": "trapezoidal_acceleration",
    "cycloid, constant, cycloid (Alici et al. 1999)": "cycloid_cruise",
    "3-4-5 polynomial": "polynomial_345",
    "cycloid": "cycloid",
}
"""Profiles of the MotionProfile, by the method."""
LONGER_THAN_A_PERIOD = ("constant_acceleration", "trapezoidal_acceleration", "cycloid_cruise")
LONGER = 1.5 * 2.0 * np.pi / NATURAL_FREQUENCY
"""A time of 1.5 periods, in which all of them can move [s]."""


@dataclass(frozen=True)
class Compared:
    """V of a method with the right estimate, and the band of w*/w with V below the level; None where it is above it."""

    nominal: float
    band: tuple[float, float] | None

    @property
    def width(self) -> float:
        """Width of the band, 0 without one."""
        return self.band[1] - self.band[0] if self.band else 0.0


def compare(level: float) -> dict[str, dict[float, Compared]]:
    """All methods in the paper's time and in `LONGER`, where they can move in it."""
    with oscillator(LONGER) as bench:
        return {
            name: {
                duration: _compared(bench, kind, duration, level)
                for duration in (DURATION, LONGER)
                if duration == LONGER or kind not in LONGER_THAN_A_PERIOD
            }
            for name, kind in METHODS.items()
        }


def _compared(bench: OscillatorBench, kind: str, duration: float, level: float) -> Compared:
    def v(estimate: float) -> float:
        values = {"profile.profile": kind, "profile.natural_frequency": estimate * NATURAL_FREQUENCY, "profile.duration": duration}
        return bench.residuals(values, NATURAL_FREQUENCY, DAMPING_RATIO, duration, step=duration / STEPS).vibration

    nominal = v(1.0)
    return Compared(nominal, band(v, level) if nominal < level else None)
