"""Runs for Kilic and Kapucu (2011): the commands on FMUs of an oscillator, a pendulum and the hydraulic arm.

The oscillator holds the command over steps of h = T / 2000, so that it comes h / 2 late: 1e-4 of V, by the damping; the rest
of the error is O(h^2) and leaves less than 1e-6 at the designed frequency.
"""

from __future__ import annotations

import math
from collections.abc import Callable
from typing import Any

import numpy as np
from scipy.optimize import brentq

from shaper_fmu.export.build import fmu_path
from shaper_fmu.master.results import Results
from shaper_fmu.master.simulation import Simulation
from shaper_fmu.master.system import System
from shaper_fmu.metrics.final import Final
from shaper_fmu.metrics.peak import Peak
from shaper_fmu.reproduce.runs import OscillatorBench

NATURAL_FREQUENCY = 5.5045
"""Measured natural frequency of the pendulum [rad/s] (section 5)."""
DAMPING_RATIO = 0.08
DURATION = 0.9703
"""Duration of the move [s]."""
DISTANCE = 0.09
"""Distance of the move [m]."""
GRAVITY = 9.81
COMMANDS = {"single": "cycloid_versine_ramp", "two-part": "two_part"}
"""The paper's commands, as profiles of the MotionProfile."""
SHAPERS = {"ZV": "zv", "ZVD": "zvd"}
"""Input shapers beside them, on a step."""
STEPS = 2000
"""Communication steps in a move on the linear plants."""
START = 100.5 * DURATION / STEPS
"""Pendulum and arm begin to move here [s]: the profile's jumps of speed then lie in the middle of steps."""
END = (STEPS + 101) * DURATION / STEPS
"""The first communication point after the move [s]."""


def oscillator(stop_time: float = DURATION) -> OscillatorBench:
    """A profile through an input shaper on an oscillator; by default the shaper passes the profile on."""

    def build(system: System) -> str:
        plain = {"natural_frequency": NATURAL_FREQUENCY, "damping_ratio": DAMPING_RATIO}
        system.add("profile", fmu_path("MotionProfile"), duration=DURATION, **plain)
        system.add("shaper", fmu_path("InputShaper"), shaper="none", **{name: [value] for name, value in plain.items()})
        system.connect("profile.position", "shaper.command")
        return "shaper.shaped"

    return OscillatorBench(build, stop_time, DURATION / STEPS, keep=["shaper.duration"])


def command_values(command: str) -> dict[str, Any]:
    """Start values for a command of `COMMANDS`."""
    return {"profile.profile": COMMANDS[command]}


def vibration(
    bench: OscillatorBench,
    command: str,
    ratio: float = 1.0,
    damping_ratio: float = DAMPING_RATIO,
    design_damping: float = DAMPING_RATIO,
) -> float:
    """V of a command on a plant with `ratio` times the designed frequency and this damping ratio."""
    values = {**command_values(command), "profile.damping_ratio": design_damping}
    return bench.residuals(values, ratio * NATURAL_FREQUENCY, damping_ratio, DURATION).vibration


def vibration_by_estimate(bench: OscillatorBench, command: str, estimate: float, in_periods: bool = False) -> float:
    """V of a command designed for `estimate` times the plant's natural frequency, as in eq. (7) of the paper.

    Its duration is the paper's; with `in_periods` it is as many periods of the estimate as the paper's is of the plant.
    """
    duration = DURATION / estimate if in_periods else DURATION
    values = {
        **command_values(command), "profile.natural_frequency": estimate * NATURAL_FREQUENCY, "profile.duration": duration,
    }  # fmt: skip
    return bench.residuals(values, NATURAL_FREQUENCY, DAMPING_RATIO, duration, step=duration / STEPS).vibration


def shaped_vibration(bench: OscillatorBench, shaper: str, ratio: float) -> tuple[float, float]:
    """V of a step through a shaper of `SHAPERS` at its own end, exact since its jumps are events; and its duration [s]."""
    start = {"profile.profile": "step", "shaper.shaper": SHAPERS[shaper]}
    found = bench.residuals(start, ratio * NATURAL_FREQUENCY, DAMPING_RATIO, "shaper.duration", step=0.05)
    return found.vibration, found.kept["shaper.duration"]


def vibration_after(bench: OscillatorBench, duration: float) -> float:
    """V of the single profile over another duration [s], with as many steps."""
    values = {**command_values("single"), "profile.duration": duration}
    return bench.residuals(values, NATURAL_FREQUENCY, DAMPING_RATIO, duration, step=duration / STEPS).vibration


def band(curve: Callable[[float], float], level: float, low: float = 0.7, high: float = 1.6) -> tuple[float, float]:
    """The ratios below and above 1 at which curve(ratio) crosses the level, by root finding over runs; it must be below it at 1."""
    ends = []
    for end in (low, high):
        outside = next((r for r in np.linspace(1.0, end, 61)[1:] if curve(r) > level), None)
        if outside is None:
            return math.nan, math.nan
        inside = outside - (end - 1.0) / 60.0
        ends.append(brentq(lambda r: curve(r) - level, *sorted((inside, outside)), xtol=1e-7))
    return ends[0], ends[1]


def shape(command: str) -> Results:
    """The command itself over `DISTANCE`, from its FMU; the metrics are its largest position [m] and speed [m/s]."""
    system = System("command")
    values = {"profile": COMMANDS[command], "natural_frequency": NATURAL_FREQUENCY, "damping_ratio": DAMPING_RATIO}
    system.add("profile", fmu_path("MotionProfile"), duration=DURATION, distance=DISTANCE, start_time=START, **values)
    peaks = {name: Peak(f"profile.{name}") for name in ("position", "velocity")}
    return system.simulate(1.2 * DURATION, DURATION / STEPS, metrics=peaks)


def base_acceleration(moved: Results) -> tuple[np.ndarray, np.ndarray]:
    """Mean accelerations of a trolley that has the profile's speed at all communication points: times [s], values [m/s2].

    Jumps of the speed, in the middle of steps, are spread over their steps, so that the error is O(step^2).
    """
    return moved.time[:-1], np.diff(moved["profile.velocity"]) / np.diff(moved.time)


class PendulumBench:
    """Nonlinear swing of a pendulum whose hinge makes a command's motion exactly; use it in a with statement.

    An OverheadCrane with a rope of g / wn^2: a rod swings like a load on a rope of two thirds of its length.
    """

    def __init__(self, moved: Results):
        system = System("pendulum")
        system.add("crane", fmu_path("OverheadCrane"), hoist_speed=0.0, damping_ratio=DAMPING_RATIO)
        system.drive("crane.trolley_acceleration", base_acceleration(moved))
        self._shown = Simulation(system, record=["crane.swing_angle"])
        names = ("crane.swing_angle", "crane.swing_rate")
        self._simulation = Simulation(system, record=[], metrics={name: Final(name) for name in names})

    def __enter__(self) -> PendulumBench:
        return self

    def __exit__(self, *error: object) -> None:
        self._shown.close()
        self._simulation.close()

    def shown(self, stop_time: float) -> Results:
        """The swing over time, at the designed frequency."""
        return self._shown.run(stop_time, DURATION / STEPS, start_values={"crane.initial_rope_length": rope_length(1.0)})

    def vibration(self, ratio: float) -> float:
        """V of the swing, right after the command, with `ratio` times the designed frequency."""
        length = rope_length(ratio)
        start = {"crane.initial_rope_length": length}
        found = self._simulation.run(END, DURATION / STEPS, start_values=start).metrics
        w = ratio * NATURAL_FREQUENCY
        return swing_envelope(found["crane.swing_angle"], found["crane.swing_rate"], w) / step_swing(length)


def rope_length(ratio: float) -> float:
    """Length of the rope with `ratio` times the designed frequency [m]."""
    w = ratio * NATURAL_FREQUENCY
    return GRAVITY / (w * w)


def swing_envelope(angle: float, rate: float, natural_frequency: float) -> float:
    """Envelope of a free, small swing at its angle [rad] and rate [rad/s], for the paper's damping ratio [rad]."""
    decay = DAMPING_RATIO * natural_frequency
    damped = natural_frequency * math.sqrt(1.0 - DAMPING_RATIO * DAMPING_RATIO)
    return math.hypot(angle, (rate + decay * angle) / damped)


def step_swing(length: float) -> float:
    """Envelope of the small swing on a rope of this length [m] that a step of the hinge over `DISTANCE` would start [rad]."""
    return DISTANCE / length / math.sqrt(1.0 - DAMPING_RATIO * DAMPING_RATIO)
