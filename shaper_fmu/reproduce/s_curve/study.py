"""Runs everything for the paper on the smooth S-curve, and returns numbers."""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np

from shaper_fmu.master.results import Results
from shaper_fmu.progress import Update
from shaper_fmu.reproduce.s_curve.runs import DISTANCE, FINE, SHAPER_PERIODS, STEPS, BeamBench, Residuals, damped, first_frequency

DURATIONS = (0.8, 1.25, 1.75, 2.25, 4.25)
"""The paper's durations, in periods of the first mode (section 4)."""

STIFFER = 1.05**2
"""Factor on Young's modulus that raises all frequencies by 5 %."""

GRID = np.arange(0.4, 5.0001, 0.05)
"""Durations of the scans, in periods."""

SCANNED = {
    "S-curve": "s_curve",
    "3-4-5 polynomial": "polynomial_345",
    "cycloid": "cycloid",
    "trapezoidal velocity": "trapezoid",
    "triangular velocity": "trapezoid",
}
DAMPING = (0.0, 0.01, 0.02)
COMMANDS = {
    "S-curve": ("s_curve", "none", False),
    "S-curve, told the damping": ("s_curve", "none", True),
    "3-4-5 polynomial": ("polynomial_345", "none", False),
    "3-4-5 polynomial, ZV": ("polynomial_345", "zv", False),
    "3-4-5 polynomial, ZVD": ("polynomial_345", "zvd", False),
}
"""Profile, shaper on mode 1, and whether the profile gets the damping: all else is designed for an undamped mode."""

SHORTEST_MOVE = 0.25
"""Moves under a shaper take at least so many periods."""

OTHER_BEAMS = {
    "E = 6 GPa": {"youngs_modulus": 6e9},
    "no tip mass": {"tip_mass": 0.0},
    "tip mass 0.1 kg": {"tip_mass": 0.1},
    "length 0.4 m": {"length": 0.4},
}
RATIOS = np.arange(0.8, 1.2001, 0.02)
CRUISE = (0.3, 0.45, 1.0)
"""Distance [m], duration [s] and speed limit [m/s] of a move with a cruise, for eqs. (15) to (22)."""

EXAMPLE = (0.8, 1.4, 1.0)
"""The same of one whose segments of 0.3 s are longer than a period, as in figure 2."""


@dataclass(frozen=True)
class Study:
    """Numbers of all runs; durations are in periods of the first mode.

    Attributes:
        frequencies: the beam's [rad/s]; shape (5,). period: of the first mode [s].
        nominal, polynomial: per duration, what the S-curve (with fine steps) and the 3-4-5 polynomial leave.
        stiffer, polynomial_stiffer: what they leave where all frequencies are 5 % higher.
        cruise: per duration, speed in the middle of the S-curve [m/s].
        scans: per profile, over GRID.
        at_period: relative residual of profiles that last one period, and of a trapezoid whose ramps do.
        others: relative residual of the S-curve on other beams, each with its own frequency.
        segment_error: largest deviation from eqs. (15) and (16), as a share of speed and distance.
        jumps: largest change of the S-curve's acceleration at 0.8 periods in a step of 1/288 and of 1/2880 period [m/s2].
        shortest: per distance [m], the shortest S-curve that keeps to 1 m/s.
        modes: per command, damping ratio and duration, in five modes.
        mode_scans: per command, durations and what is left in the undamped modes.
        detuned: per duration, relative residual in mode 1 over RATIOS.
        shown: per profile and duration, time responses. example: of the move EXAMPLE.
    """

    frequencies: np.ndarray
    period: float
    nominal: dict[float, Residuals]
    polynomial: dict[float, Residuals]
    stiffer: dict[float, Residuals]
    polynomial_stiffer: dict[float, Residuals]
    cruise: dict[float, float]
    scans: dict[str, list[Residuals]]
    at_period: dict[str, float]
    others: dict[str, float]
    segment_error: float
    jumps: tuple[float, float]
    shortest: dict[float, float]
    modes: dict[tuple[str, float, float], Residuals]
    mode_scans: dict[str, tuple[np.ndarray, list[Residuals]]]
    detuned: dict[float, np.ndarray]
    shown: dict[tuple[str, float], Results]
    example: Results


def run_study(update: Update) -> Study:
    """Run everything; `update(done, total)` counts the parts."""
    parts = 6
    with BeamBench() as bench, BeamBench(modes=5) as full:
        update(0, parts)
        stiff = {"beam.youngs_modulus": 3e9 * STIFFER}
        nominal = {r: bench.residuals("s_curve", r, steps=FINE) for r in DURATIONS}
        polynomial = {r: bench.residuals("polynomial_345", r) for r in DURATIONS}
        update(1, parts)
        scans = {name: [bench.residuals(kind, r, _limits(name, r * bench.period)) for r in GRID] for name, kind in SCANNED.items()}
        update(2, parts)
        detuned = {
            r: np.array([_relative(bench.residuals("s_curve", r, {"beam.youngs_modulus": 3e9 * x * x})) for x in RATIOS])
            for r in DURATIONS
        }
        update(3, parts)
        modes = {
            (name, zeta, r): _command(full, name, r, zeta)
            for name in COMMANDS
            for zeta in DAMPING
            for r in DURATIONS
            if possible(name, r)
        }
        update(4, parts)
        mode_scans = {}
        for name in ("S-curve", "3-4-5 polynomial", "3-4-5 polynomial, ZV", "3-4-5 polynomial, ZVD"):
            grid = np.array([r for r in np.arange(0.8, 2.4001, 0.02) if r - SHAPER_PERIODS[COMMANDS[name][1]] > 0.45])
            mode_scans[name] = grid, [_command(full, name, r, 0.0) for r in grid]
        update(5, parts)
        found = Study(
            frequencies=full.residuals("s_curve", 1.0).frequencies,
            period=bench.period,
            nominal=nominal,
            polynomial=polynomial,
            stiffer={r: bench.residuals("s_curve", r, stiff) for r in DURATIONS},
            polynomial_stiffer={r: bench.residuals("polynomial_345", r, stiff) for r in DURATIONS},
            cruise={r: bench.cruise_speed(r) for r in DURATIONS},
            scans=scans,
            at_period=_at_period(bench),
            others={name: _on_another(bench, values) for name, values in OTHER_BEAMS.items()},
            segment_error=_segment_error(bench),
            jumps=(_largest_jump(bench, 288), _largest_jump(bench, 2880)),
            shortest={d: bench.shortest(d, 1.0) for d in (0.1, 0.05, 0.02)},
            modes=modes,
            mode_scans=mode_scans,
            detuned=detuned,
            shown={(p, r): bench.shown(p, r, 6.0 * bench.period) for p in ("s_curve", "polynomial_345") for r in DURATIONS},
            example=_with_cruise(bench, *EXAMPLE),
        )
    update(parts, parts)
    return found


def possible(name: str, periods: float) -> bool:
    """Whether there is time enough for the command's shaper and a move."""
    return periods - SHAPER_PERIODS[COMMANDS[name][1]] >= SHORTEST_MOVE


def _relative(residuals: Residuals) -> float:
    return float(residuals.relative[0])


def _limits(name: str, duration: float) -> dict[str, float]:
    """A triangular velocity is a trapezoidal one with the least acceleration there can be, 4 D / T^2."""
    return {"profile.max_acceleration": 4.0 * DISTANCE / duration**2 * (1.0 + 1e-9)} if name == "triangular velocity" else {}


def _command(full: BeamBench, name: str, periods: float, zeta: float) -> Residuals:
    profile, shaper, knows_damping = COMMANDS[name]
    return full.residuals(
        profile, periods, {**damped(zeta), "profile.damping_ratio": zeta if knows_damping else 0.0}, shaper=shaper
    )


def _at_period(bench: BeamBench) -> dict[str, float]:
    found = {
        name: _relative(bench.residuals(SCANNED[name], 1.0)) for name in ("3-4-5 polynomial", "cycloid", "trapezoidal velocity")
    }
    return {**found, "ramps of a period": _relative(bench.residuals("trapezoid", 3.0))}


def _on_another(bench: BeamBench, beam: dict[str, float]) -> float:
    """The S-curve of 0.8 periods of another beam."""
    w = first_frequency(**beam)
    values = {**{f"beam.{name}": value for name, value in beam.items()}, "profile.natural_frequency": w}
    ratio = bench.natural_frequency / w
    return _relative(bench.residuals("s_curve", 0.8 * ratio, values, steps=round(STEPS * max(1.0, 1.0 / ratio))))


def _with_cruise(bench: BeamBench, distance: float, duration: float, speed: float) -> Results:
    """An S-curve that cruises at a speed limit, in steps of 1 ms."""
    values = {"profile.distance": distance, "profile.max_velocity": speed}
    return bench.shown("s_curve", duration / bench.period, duration, values, steps=bench.period / 0.001)


def _segment_error(bench: BeamBench) -> float:
    """Eqs. (15), (16) and (20) to (22) at the ends of the five segments of a move with a cruise."""
    distance, duration, speed = CRUISE
    run = _with_cruise(bench, *CRUISE)
    tau = (duration * speed - distance) / (2.0 * speed)
    cruise = duration - 2.0 * (duration * speed - distance) / speed
    a = 2.0 * speed * speed / (duration * speed - distance)
    a2 = a * (1.0 - (bench.period / tau) ** 2)
    ripple = a2 * tau**2 / (4.0 * math.pi**2)
    path = a * tau * (cruise + tau)
    expected = [
        (a * tau / 2.0, a * tau**2 / 6.0 - ripple),
        (a * tau, a * tau**2),
        (a * tau, path),
        (a * tau / 2.0, path + 5.0 * a * tau**2 / 6.0 + ripple),
        (0.0, a * tau * (cruise + 2.0 * tau)),
    ]
    ends = [round(1000.0 * t) for t in (tau, 2.0 * tau, 2.0 * tau + cruise, 3.0 * tau + cruise, duration)]
    errors = [
        max(abs(run["profile.velocity"][i] - v) / speed, abs(run["profile.position"][i] - d) / distance)
        for i, (v, d) in zip(ends, expected, strict=True)
    ]
    return float(max(errors))


def _largest_jump(bench: BeamBench, steps: int) -> float:
    run = bench.shown("s_curve", 0.8, 0.8 * bench.period, steps=steps)
    return float(np.max(np.abs(np.diff(run["profile.acceleration"]))))
