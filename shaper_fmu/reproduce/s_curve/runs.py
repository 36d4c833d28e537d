"""Runs of a motion profile, shaped or not, on the flexible beam: three FMUs.

The beam is given the profile's acceleration, held over each communication step. That delays it by half a step, which
changes no residual, and errs by O(step^2): with 2880 steps a period by less than 0.004 % of a step's vibration, down to
moves of 0.4 periods. Steps of Tn / 2880 also let the impulses of ZV and ZVD shapers, which lie half periods apart, fall on
communication points.
"""

from __future__ import annotations

import math
from collections.abc import Mapping
from dataclasses import dataclass
from typing import Any

import numpy as np

from shaper_fmu.export.build import fmu_path
from shaper_fmu.master.results import Results
from shaper_fmu.master.simulation import Simulation
from shaper_fmu.master.system import System
from shaper_fmu.metrics.final import Final
from shaper_fmu.metrics.peak import Peak

MODES = 5
STEPS = 2880
"""Communication steps in a period of the first mode, by default."""

FINE = 80_000
"""So many that the S-curve's own residual is below 1e-6 % at each of the paper's durations."""

DISTANCE = 0.1
"""Distance of the moves [m]; the paper does not give its own. All but the speeds is proportional to it."""

SHAPER_PERIODS = {"none": 0.0, "zv": 0.5, "zvd": 1.0}
"""Duration of a shaper for an undamped mode, in its periods."""

_STATES = ("modal_deflection", "modal_velocity", "natural_frequency", "participation")
_PEAKS = {"velocity": "profile.velocity", "acceleration": "profile.acceleration", "deflection": "beam.tip_deflection"}
_MORE = {"speed": Final("profile.velocity"), "shortest": Final("profile.shortest_duration")}


@dataclass(frozen=True)
class Residuals:
    """The residual vibration and the effort of a move.

    Attributes:
        modes: residual amplitude of each mode at the tip, as a share of the distance; shape (modes,).
        relative: the same over what a step of the base leaves in the mode, an undamped one's PRV; shape (modes,).
        frequencies: of the modes that move [rad/s]; shape (modes,).
        velocity, acceleration: largest of the profile [m/s], [m/s2].
        deflection: largest of the tip during the move [m].
    """

    modes: np.ndarray
    relative: np.ndarray
    frequencies: np.ndarray
    velocity: float
    acceleration: float
    deflection: float


class BeamBench:
    """Profile, shaper and beam as live FMUs; use it in a with statement. `modes` of the beam move.

    The profile and the shaper are told the first mode of the beam with its start values, undamped, unless start values say
    otherwise.
    """

    def __init__(self, modes: int = 1):
        self.modes = modes
        self.natural_frequency: float = first_frequency()
        self.period: float = 2.0 * math.pi / self.natural_frequency
        system = System("s_curve_beam")
        system.add("profile", fmu_path("MotionProfile"), distance=DISTANCE, natural_frequency=self.natural_frequency)
        system.add("shaper", fmu_path("InputShaper"), shaper="none", natural_frequency=[self.natural_frequency])
        system.add("beam", fmu_path("FlexibleBeam"), modes=modes)
        system.connect("profile.acceleration", "shaper.command")
        system.connect("shaper.shaped", "beam.base_acceleration")
        names = [f"beam.{name}[{j + 1}]" for name in _STATES for j in range(modes)]
        metrics = {**{name: Final(name) for name in names}, **{key: Peak(name) for key, name in _PEAKS.items()}}
        self._simulation = Simulation(system, record=[], metrics={**metrics, **_MORE})
        self._shown = Simulation(system, record=[*_PEAKS.values(), "beam.base_position", "beam.tip_position", "profile.position"])

    def __enter__(self) -> BeamBench:
        return self

    def __exit__(self, *error: object) -> None:
        self._simulation.close()
        self._shown.close()

    def residuals(
        self, profile: str, periods: float, values: Mapping[str, Any] | None = None, *, shaper: str = "none", steps: int = STEPS
    ) -> Residuals:
        """After a move that takes so many periods of the first mode, the shaper's time included. `values` are start values."""
        start = self._start(profile, periods, values, shaper)
        distance = start.get("profile.distance", DISTANCE)
        found = self._simulation.run(periods * self.period, self.period / steps, start_values=start).metrics
        x, v, w, gamma = (np.array([found[f"beam.{name}[{j + 1}]"] for j in range(self.modes)]) for name in _STATES)
        zeta = np.array([start.get(f"beam.modal_damping[{j + 1}]", 0.0) for j in range(self.modes)])
        swing = np.hypot(x, (v + zeta * w * x) / (w * np.sqrt(1.0 - zeta * zeta))) / distance
        return Residuals(swing, swing / np.abs(gamma), w, found["velocity"], found["acceleration"], found["deflection"])

    def cruise_speed(self, periods: float, distance: float = DISTANCE) -> float:
        """Speed of the S-curve in the middle of the move, A tau [m/s]."""
        start = self._start("s_curve", periods, {"profile.distance": distance}, "none")
        return self._simulation.run(0.5 * periods * self.period, self.period / STEPS, start_values=start).metrics["speed"]

    def shortest(self, distance: float, limit: float) -> float:
        """Shortest S-curve within a limit of the speed [m/s], in periods, according to MotionProfile."""
        values = {"profile.distance": distance, "profile.max_velocity": limit}
        start = self._start("s_curve", 100.0, values, "none")
        return self._simulation.run(self.period, self.period, start_values=start).metrics["shortest"] / self.period

    def shown(
        self, profile: str, periods: float, stop: float, values: Mapping[str, Any] | None = None, *, steps: float = 288
    ) -> Results:
        """Time responses until `stop` [s] of an unshaped move."""
        return self._shown.run(stop, self.period / steps, start_values=self._start(profile, periods, values, "none"))

    def _start(self, profile: str, periods: float, values: Mapping[str, Any] | None, shaper: str) -> dict[str, Any]:
        duration = (periods - SHAPER_PERIODS[shaper]) * self.period
        return {"profile.profile": profile, "profile.duration": duration, "shaper.shaper": shaper, **(values or {})}


def first_frequency(**beam: float) -> float:
    """The first natural frequency that the beam's FMU computes [rad/s], with these start values."""
    system = System("beam")
    system.add("beam", fmu_path("FlexibleBeam"), base_acceleration=0.0, **beam)
    results = system.simulate(0.001, 0.001, record=["beam.natural_frequency[1]"])
    return float(results["beam.natural_frequency[1]"][0])


def damped(zeta: float) -> dict[str, float]:
    """Start values for the same damping ratio in all modes of the beam."""
    return {f"beam.modal_damping[{j + 1}]": zeta for j in range(MODES)}
