"""Runs everything for Kilic and Kapucu (2011), and returns numbers."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from shaper_fmu.master.results import Results
from shaper_fmu.progress import Update
from shaper_fmu.reproduce.runs import OscillatorBench
from shaper_fmu.reproduce.two_part.arm import ArmBench, ArmResiduals
from shaper_fmu.reproduce.two_part.compared import Compared, compare
from shaper_fmu.reproduce.two_part.runs import (
    COMMANDS,
    DAMPING_RATIO,
    DURATION,
    SHAPERS,
    PendulumBench,
    band,
    oscillator,
    rope_length,
    shape,
    shaped_vibration,
    step_swing,
    vibration,
    vibration_after,
    vibration_by_estimate,
)

LEVEL = 0.05
"""Residual vibration that is taken for none, as a share of a step's; the paper names no level."""
RATIOS = np.linspace(0.6, 1.5, 181)
"""Natural frequency over the designed one, shape (n,)."""
ARM_RATIOS = np.linspace(0.7, 1.4, 36)
ERRORS = (0.8, 0.9, 1.1, 1.2)
DURATIONS = (0.1, 0.3, 0.5, 0.9703, 1.5, 3.0)
"""Durations of the single profile [s], from a twelfth of a period to 2.6 periods."""
DAMPINGS = DAMPING_RATIO * np.linspace(0.0, 4.0, 41)
"""Damping ratios of the plant; shape (m,)."""
MAP_RATIOS = np.linspace(0.75, 1.35, 49)
MAP_DAMPINGS = DAMPING_RATIO * np.linspace(0.0, 4.0, 25)
STOP = 3.0
"""End of the time responses [s]."""


@dataclass(frozen=True)
class Swing:
    """The swing of the pendulum whose hinge makes the motion exactly.

    Attributes:
        run: over time. peak: largest during the run, residual: largest after the move [rad].
        band: frequencies over the designed one between which V stays below 5 %. vibration: V at the designed frequency.
    """

    run: Results
    peak: float
    residual: float
    band: tuple[float, float]
    vibration: float


@dataclass(frozen=True)
class Estimates:
    """A command designed for a wrong estimate w* of a pendulum's frequency, as the paper's eq. (7) has it.

    Attributes:
        curve, errors: V over `RATIOS` of w*/w, and at `ERRORS`. band: w*/w between which V stays below 5 %.
        amplitude: of a linear pendulum's swing after the move, over `RATIOS` [rad]. arm: on the hydraulic arm, over `ARM_RATIOS`.
        arm_band: as `band`, on the arm.
        in_periods: V at `ERRORS` where the move takes 0.85 periods of w* in place of its fixed time; `in_periods_band` below 5 %.
    """

    curve: np.ndarray
    errors: list[float]
    band: tuple[float, float]
    amplitude: np.ndarray
    arm: np.ndarray
    arm_band: tuple[float, float]
    in_periods: list[float]
    in_periods_band: tuple[float, float]


@dataclass(frozen=True)
class Study:
    """Numbers of all runs, by command ("single", "two-part") or shaper ("ZV", "ZVD").

    Attributes:
        shapes: the commands over time, with their peaks. durations: V of the single profile by duration [s].
        half: V of the first part of the two-part command, relative to its own distance.
        nominal, errors, bands, curves: V on the oscillator at the designed frequency, at `ERRORS`, below 5 %, over `RATIOS`:
            the pendulum changes, the command stays.
        shaper_durations: of `SHAPERS` [s].
        swings: of the nonlinear pendulum. arm, arm_bands, arm_curves, arm_runs: the same of the hydraulic arm.
        estimates: of the commands of `COMMANDS`: the command changes, the pendulum stays.
        undamped: V at the designed frequency of commands that are designed without damping.
        compared: other methods, by name and duration [s].
        believed: V over `DAMPINGS` for which the command is designed; the pendulum has the paper's.
        damping: V over `DAMPINGS` of the pendulum. maps: V over `MAP_DAMPINGS` and `MAP_RATIOS`, shape (m, n).
    """

    shapes: dict[str, Results]
    durations: dict[float, float]
    half: float
    nominal: dict[str, float]
    errors: dict[str, list[float]]
    bands: dict[str, tuple[float, float]]
    curves: dict[str, np.ndarray]
    shaper_durations: dict[str, float]
    swings: dict[str, Swing]
    arm: dict[str, ArmResiduals]
    arm_bands: dict[str, tuple[float, float]]
    arm_curves: dict[str, np.ndarray]
    arm_runs: dict[str, Results]
    estimates: dict[str, Estimates]
    undamped: dict[str, float]
    compared: dict[str, dict[float, Compared]]
    believed: dict[str, np.ndarray]
    damping: dict[str, np.ndarray]
    maps: dict[str, np.ndarray]


def run_study(update: Update) -> Study:
    """Everything, in some seconds; `update(done, total)` is called after each part."""
    parts = 7
    update(0, parts)
    shapes = {name: shape(name) for name in COMMANDS}
    with oscillator(DURATIONS[-1]) as bench:
        durations = {d: vibration_after(bench, d) for d in DURATIONS}
        half = vibration_after(bench, 0.5 * DURATION)
    update(1, parts)
    with oscillator() as bench:
        bands = {name: band(lambda r, n=name: vibration(bench, n, r), LEVEL) for name in COMMANDS}
        curves = {name: np.array([vibration(bench, name, r) for r in RATIOS]) for name in COMMANDS}
        nominal = {name: vibration(bench, name) for name in COMMANDS}
        errors = {name: [vibration(bench, name, r) for r in ERRORS] for name in COMMANDS}
        undamped = {name: vibration(bench, name, design_damping=0.0) for name in COMMANDS}
        believed = {name: np.array([vibration(bench, name, design_damping=z) for z in DAMPINGS]) for name in COMMANDS}
        damping = {name: np.array([vibration(bench, name, 1.0, z) for z in DAMPINGS]) for name in COMMANDS}
        update(2, parts)
        maps = {name: _map(bench, name) for name in COMMANDS}
    compared = compare(LEVEL)
    update(3, parts)
    shaper_durations = {}
    with oscillator(1.5) as shaped:
        for name in SHAPERS:
            bands[name] = band(lambda r, n=name: shaped_vibration(shaped, n, r)[0], LEVEL)
            curves[name] = np.array([shaped_vibration(shaped, name, r)[0] for r in RATIOS])
            nominal[name], shaper_durations[name] = shaped_vibration(shaped, name, 1.0)
    update(4, parts)
    swings = {name: _swing(moved) for name, moved in shapes.items()}
    update(5, parts)
    with ArmBench() as real:
        arm = {name: real.residuals(name) for name in COMMANDS}
        arm_curves = {name: np.array([real.residuals(name, r).vibration for r in ARM_RATIOS]) for name in COMMANDS}
        arm_bands = {name: band(lambda r, n=name: real.residuals(n, r).vibration, LEVEL) for name in COMMANDS}
        arm_runs = {name: real.shown(name, STOP) for name in COMMANDS}
        update(6, parts)
        with oscillator() as fixed, oscillator(DURATION / ARM_RATIOS[0]) as scaled:
            estimates = {name: _estimates(name, fixed, scaled, real) for name in COMMANDS}
    update(parts, parts)
    return Study(
        shapes, durations, half, nominal, errors, bands, curves, shaper_durations, swings,
        arm, arm_bands, arm_curves, arm_runs, estimates, undamped, compared, believed, damping, maps,
    )  # fmt: skip


def _map(bench: OscillatorBench, command: str) -> np.ndarray:
    return np.array([[vibration(bench, command, r, z) for r in MAP_RATIOS] for z in MAP_DAMPINGS])


def _estimates(command: str, fixed: OscillatorBench, scaled: OscillatorBench, arm: ArmBench) -> Estimates:
    def in_periods(estimate: float) -> float:
        return vibration_by_estimate(scaled, command, estimate, in_periods=True)

    curve = np.array([vibration_by_estimate(fixed, command, r) for r in RATIOS])
    return Estimates(
        curve=curve,
        errors=[vibration_by_estimate(fixed, command, r) for r in ERRORS],
        band=band(lambda r: vibration_by_estimate(fixed, command, r), LEVEL),
        amplitude=curve * step_swing(rope_length(1.0)),
        arm=np.array([arm.residuals(command, estimate=r).amplitude for r in ARM_RATIOS]),
        arm_band=band(lambda r: arm.residuals(command, estimate=r).vibration, LEVEL),
        in_periods=[in_periods(r) for r in ERRORS],
        in_periods_band=band(in_periods, LEVEL),
    )


def _swing(moved: Results) -> Swing:
    with PendulumBench(moved) as bench:
        run = bench.shown(STOP)
        angle = np.abs(run["crane.swing_angle"])
        after = run.time > moved.time[np.flatnonzero(moved["profile.moving"])[-1]]
        found = band(bench.vibration, LEVEL)
        return Swing(run, float(np.max(angle)), float(np.max(angle[after])), found, bench.vibration(1.0))
