"""Runs of the paper's commands on the whole hydraulic arm: profile, servo valve, cylinder, slide and rod."""

from __future__ import annotations

import math
from dataclasses import dataclass

from shaper_fmu.export.build import fmu_path
from shaper_fmu.master.results import Results
from shaper_fmu.master.simulation import Simulation
from shaper_fmu.master.system import System
from shaper_fmu.metrics.final import Final
from shaper_fmu.metrics.peak import Peak
from shaper_fmu.reproduce.two_part.runs import (
    COMMANDS,
    DAMPING_RATIO,
    DISTANCE,
    DURATION,
    GRAVITY,
    NATURAL_FREQUENCY,
    START,
    step_swing,
    swing_envelope,
)

ROD_LENGTH = 0.485
"""Length of the steel rod [m]; printed "0.485 mm"."""
ROD_MASS = 0.43
"""Of a steel rod of that length with the paper's diameter of 12 mm [kg]."""
STEP = 2e-4
"""Communication step [s]; steps of 1 ms change the residual swing by less than 1e-6 rad."""
SETTLED = 0.25
"""So long after the command's end the position loop has settled, and the residual swing is measured [s]."""

_STATE = ("arm.swing_angle", "arm.swing_rate")
_PEAKS = ("arm.swing_angle", "arm.slide_velocity", "arm.slide_position", "profile.velocity")
SHOWN = ("profile.position", "arm.slide_position", "arm.swing_angle", "arm.pressure[1]", "arm.pressure[2]")


@dataclass(frozen=True)
class ArmResiduals:
    """The residual swing of the rod after a command.

    Attributes:
        vibration: V, the swing's envelope taken back to the end of the command by its damping, over that of a step.
        envelope: of the swing `SETTLED` after the command's end [rad]. amplitude: the same, taken back to the end [rad].
        peaks: the largest magnitudes of swing [rad], slide speed [m/s], slide position [m] and reference speed [m/s].
    """

    vibration: float
    envelope: float
    amplitude: float
    peaks: dict[str, float]


class ArmBench:
    """Live FMUs of profile and arm; use it in a with statement."""

    def __init__(self) -> None:
        system = System("two_part_pendulum")
        design = {"natural_frequency": NATURAL_FREQUENCY, "damping_ratio": DAMPING_RATIO}
        system.add("profile", fmu_path("MotionProfile"), duration=DURATION, distance=DISTANCE, start_time=START, **design)
        system.add("arm", fmu_path("HydraulicPendulum"), rod_mass=ROD_MASS)
        system.connect("profile.position", "arm.reference_position")
        metrics = {**{name: Final(name) for name in _STATE}, **{f"peak {name}": Peak(name) for name in _PEAKS}}
        self._simulation = Simulation(system, record=[], metrics=metrics)
        self._shown = Simulation(system, record=SHOWN)

    def __enter__(self) -> ArmBench:
        return self

    def __exit__(self, *error: object) -> None:
        self._simulation.close()
        self._shown.close()

    def residuals(self, command: str, ratio: float | None = None, estimate: float = 1.0) -> ArmResiduals:
        """After a command of `COMMANDS`, with the paper's rod or one that has `ratio` times the designed frequency.

        `estimate` is the frequency for which the command is designed, over the paper's.
        """
        length = ROD_LENGTH if ratio is None else rod_length(ratio)
        values = {
            "profile.profile": COMMANDS[command], "profile.natural_frequency": estimate * NATURAL_FREQUENCY, **rod(length),
        }  # fmt: skip
        found = self._simulation.run(START + DURATION + SETTLED, STEP, start_values=values).metrics
        w = math.sqrt(1.5 * GRAVITY / length)
        envelope = swing_envelope(found[_STATE[0]], found[_STATE[1]], w)
        peaks = {name: found[f"peak {name}"] for name in _PEAKS}
        at_end = envelope * math.exp(DAMPING_RATIO * w * SETTLED)
        return ArmResiduals(at_end / step_swing(length / 1.5), envelope, at_end, peaks)

    def shown(self, command: str, stop_time: float) -> Results:
        """Time responses with the paper's rod."""
        values = {"profile.profile": COMMANDS[command], "profile.natural_frequency": NATURAL_FREQUENCY, **rod(ROD_LENGTH)}
        return self._shown.run(stop_time, 1e-3, start_values=values)


def rod_length(ratio: float) -> float:
    """Length of a rod whose natural frequency is `ratio` times the designed one, 3 g / (2 w^2) [m]."""
    w = ratio * NATURAL_FREQUENCY
    return 1.5 * GRAVITY / (w * w)


def rod(length: float) -> dict[str, float]:
    """Start values for a rod of this length [m] with the paper's mass and damping ratio."""
    w = math.sqrt(1.5 * GRAVITY / length)
    return {"arm.rod_length": length, "arm.hinge_damping": 2.0 * DAMPING_RATIO * w * ROD_MASS * length * length / 3.0}
