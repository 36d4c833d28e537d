"""The same modulation against a carrier of another phase, which Taskin, Kilic and Kapucu (2019) do not print.

A PulseTrain's carrier is at its peak at the start. Here the profile and the ZV staircase go through the PulseWidthModulator, whose
carrier has any phase. The profile is held over steps of 20 microseconds, which shifts an edge by less.
"""

from __future__ import annotations

import math
from typing import Any

import numpy as np

from shaper_fmu.export.build import fmu_path
from shaper_fmu.master.results import Results
from shaper_fmu.master.system import System
from shaper_fmu.reproduce.pwm.runs import (
    DAMPING_RATIO,
    HALF_PERIOD,
    LONG_CASE,
    NATURAL_FREQUENCY,
    SHORT,
    SHORT_CASE,
    STIFFNESS,
    ZV_CASE,
)
from shaper_fmu.reproduce.runs import OscillatorBench

PHASE = 0.92
"""Of the carrier at the start, in periods after its peak; the paper's thresholds hold with it, and ZV needs a ratio of 13."""
SAMPLING = 2e-5
"""Communication step [s]."""
STOP = 0.14
"""End of the runs [s], after the longer command's end."""
_DAMPED = 0.5 / HALF_PERIOD  # Hz


def modulated(system: System) -> str:
    """A profile, or a step through a ZV shaper, against a carrier; returns the pulses' name."""
    mode = {"natural_frequency": NATURAL_FREQUENCY, "damping_ratio": DAMPING_RATIO}
    system.add("profile", fmu_path("MotionProfile"), profile="cycloid_versine_ramp", duration=HALF_PERIOD, **mode)
    system.add("shaper", fmu_path("InputShaper"), shaper="none", **{name: [value] for name, value in mode.items()})
    system.add("modulator", fmu_path("PulseWidthModulator"))
    system.connect("profile.position", "shaper.command")
    system.connect("shaper.shaped", "modulator.reference")
    return "modulator.pulse"


_CASES: dict[str, dict[str, Any]] = {
    LONG_CASE: {"profile.duration": HALF_PERIOD},
    SHORT_CASE: {"profile.duration": SHORT},
    ZV_CASE: {"profile.profile": "step", "shaper.shaper": "zv"},
}


def at_phase(phase: float) -> dict[str, np.ndarray]:
    """Residual vibration of the paper's commands at whole ratios 1 to 25 against a carrier of this phase [% of a step's], (25,)."""
    found = {}
    with OscillatorBench(modulated, STOP, SAMPLING, STIFFNESS) as bench:
        for case, values in _CASES.items():
            rows = []
            for ratio in range(1, 26):
                carrier = {"modulator.carrier_frequency": ratio * _DAMPED, "modulator.carrier_phase": 2.0 * math.pi * phase}
                rows.append(bench.residuals({**values, **carrier}, NATURAL_FREQUENCY, DAMPING_RATIO, 0.0).relative)
            found[case] = 100.0 * np.array(rows)
    return found


def any_s_curve(ratio: float, stop: float) -> Results:
    """Fig. 1 of the paper: an S-curve, here a cycloid, against the carrier; position of the curve and pulses."""
    system = System("pulse width modulation")
    command = modulated(system)
    system.set("profile.profile", "cycloid")
    system.set("modulator.carrier_frequency", ratio * _DAMPED)
    return system.simulate(stop, SAMPLING, record=["profile.position", command], everywhere=True)
