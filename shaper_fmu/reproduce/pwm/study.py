"""Runs everything for Taskin, Kilic and Kapucu (2019)."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import dataclass
from typing import Any

import numpy as np

from shaper_fmu.master.results import Results
from shaper_fmu.progress import Update
from shaper_fmu.reproduce.pwm.phases import PHASE, any_s_curve, at_phase
from shaper_fmu.reproduce.pwm.runs import (
    CASES,
    DAMPING_RATIO,
    DESIGNS,
    HALF_PERIOD,
    LONG_CASE,
    SHORT,
    SHORT_CASE,
    ZV_CASE,
    Scan,
    damped_frequency,
    on_the_grid,
    profile_vibration,
    ratios,
    scan,
    time_response,
    train_bench,
    vibration,
    zv_bench,
    zv_staircase,
)
from shaper_fmu.reproduce.runs import OscillatorBench, band_below, last_crossing

LEVEL = 5.0
"""Residual vibration that the paper tolerates [%]."""
FREQUENCIES = np.linspace(0.7, 1.3, 241)
"""Natural frequency over the designed one, shape (n,)."""
DAMPINGS = DAMPING_RATIO * np.linspace(0.0, 2.0, 41)
"""Damping ratios, the designed one in the middle, shape (m,)."""
GRID_STEPS = [0.01, 0.001, 0.0001]
"""Communication steps [s] of the runs that do not end steps at the pulses."""
ROBUST: dict[str, dict[str, Any]] = {
    f"{LONG_CASE}, ratio 12": {**CASES[LONG_CASE], "train.frequency_ratio": 12.0},
    f"{LONG_CASE}, ratio 25": {**CASES[LONG_CASE], "train.frequency_ratio": 25.0},
    f"{SHORT_CASE}, ratio 13": {**CASES[SHORT_CASE], "train.frequency_ratio": 13.0},
    f"{ZV_CASE}, ratio 12": {**CASES[ZV_CASE], "train.frequency_ratio": 12.0},
    **DESIGNS,
}
"""Commands whose robustness is compared with that of the ZV staircase."""
STAIRCASE = "ZV staircase"


@dataclass(frozen=True)
class Robustness:
    """V [%] of a command over `FREQUENCIES` and `DAMPINGS`, the band round 1 of the former in which it is below 5 %."""

    frequency: np.ndarray
    damping: np.ndarray
    band: tuple[float, float]


@dataclass(frozen=True)
class Study:
    """All that was found.

    `dense` and `whole`: the paper's commands over the frequency ratio in steps of 0.02 and 1. `crossing`: where they fall
    below 5 % for good, on the dense grid. `first`: the whole ratio from which all are below 5 %, nan if none is.
    `shifted`: residual vibration at whole ratios with a carrier of the phase `PHASE` [%], `first_shifted`: as `first`.
    `s_curve`: any S-curve, modulated with ratio 9. `responses`: time responses by (case, ratio). `grid`: see `on_the_grid`.
    """

    damped_frequency: float
    staircase: tuple[float, float]
    duration: float
    profile: dict[float, float]
    dense: dict[str, Scan]
    whole: dict[str, Scan]
    crossing: dict[str, float]
    first: dict[str, float]
    first_v: dict[str, float]
    shifted: dict[str, np.ndarray]
    first_shifted: dict[str, float]
    s_curve: Results
    robust: dict[str, Robustness]
    designs: dict[str, tuple[float, list[float]]]
    responses: dict[tuple[str, float], Results]
    grid: dict[str, dict[tuple[str, float], Scan]]


def first_below(x: np.ndarray, y: np.ndarray, level: float = LEVEL) -> float:
    """The first x from which on y stays below the level; nan if the last one does not. Shapes (n,)."""
    above = np.flatnonzero(y >= level)
    if len(above) == 0:
        return float(x[0])
    return float(x[above[-1] + 1]) if above[-1] + 1 < len(x) else float("nan")


def study(update: Update) -> Study:
    """Run it all; `update(done, total)` counts the parts."""
    total = len(CASES) + len(ROBUST) + 1 + 4 + 3
    count = 0

    def done() -> None:
        nonlocal count
        count += 1
        update(count, total)

    update(0, total)
    with train_bench() as bench:
        dense = {case: scan(bench, values, ratios(0.02), done) for case, values in CASES.items()}
        robust = {name: _robustness(bench, values, done) for name, values in ROBUST.items()}
        designs = {}
        for name, values in DESIGNS.items():
            points = [vibration(bench, values, x) for x in (0.8, 0.9, 1.0, 1.1, 1.2)]
            travel = bench.residuals(values, 1.0, 0.0, 0.0).kept["train.travel_time"]
            designs[name] = travel, points
    with zv_bench() as bench:
        robust[STAIRCASE] = _robustness(bench, {}, done)
        duration = bench.residuals({}, 1.0, 0.0, 0.0).kept["shaper.duration"]
    shifted = at_phase(PHASE)
    done()
    whole = {case: found.whole() for case, found in dense.items()}
    responses = {}
    for key, stop in {(LONG_CASE, 9.0): 0.16, (ZV_CASE, 9.0): 0.16, (LONG_CASE, 12.0): 0.45, (SHORT_CASE, 12.0): 0.45}.items():
        responses[key] = time_response(CASES[key[0]], key[1], stop)
        done()
    grid = on_the_grid(GRID_STEPS, lambda _done, _total: None)
    done()
    found = Study(
        damped_frequency=damped_frequency(),
        staircase=zv_staircase(),
        duration=duration,
        profile={tau: profile_vibration(tau) for tau in (HALF_PERIOD, SHORT)},
        dense=dense,
        whole=whole,
        crossing={case: last_crossing(s.ratio, s.relative, LEVEL) for case, s in dense.items()},
        first={case: first_below(s.ratio, s.relative) for case, s in whole.items()},
        first_v={case: first_below(s.ratio, s.vibration) for case, s in whole.items()},
        shifted=shifted,
        first_shifted={case: first_below(whole[case].ratio, values) for case, values in shifted.items()},
        s_curve=any_s_curve(9.0, 0.16),
        robust=robust,
        designs=designs,
        responses=responses,
        grid=grid,
    )
    done()
    return found


def _robustness(bench: OscillatorBench, values: Mapping[str, Any], done: Callable[[], None]) -> Robustness:
    frequency = np.array([vibration(bench, values, x) for x in FREQUENCIES])
    damping = np.array([vibration(bench, values, 1.0, z) for z in DAMPINGS])
    done()
    return Robustness(frequency, damping, band_below(FREQUENCIES, frequency, LEVEL, 1.0))
