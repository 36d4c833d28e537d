"""Runs everything for Jung (2011), for the claims and the figures."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from shaper_fmu.design.modal_responses import ModalResponse, step_response
from shaper_fmu.design.mode_selection import ModeSet, Selection, mode_sets, select_modes
from shaper_fmu.progress import Update
from shaper_fmu.reproduce.partial_modes.runs import (
    GAINS,
    PRINTED,
    Bench,
    Case,
    Mode,
    cases,
    chain_modes,
    residual_by_printed_formula,
)

MASS, STIFFNESS, DAMPING = (15.0, 8.0, 10.0), (400.0, 120.0), (20.0, 6.0)
"""The chain FMU's defaults [kg, N/m, N s/m]."""
TOLERANCES = (0.02, 0.05, 0.10, 0.15, 0.30)
_RUNS = 3 * 4 + 8


@dataclass(frozen=True)
class Study:
    """Everything that was found.

    Attributes:
        modes: of the free chain, the slow one and the fast one.
        by_printed_formula: residual by eq. (8) as printed, of the modes of eq. (11) [%].
        cases: with shapers for the chain's modes; `printed`: for the rounded modes of eq. (11); `s_shaped`: the S-shaped move.
        response: of the closed loop, by its modes, for comparison and for the choice.
        sets: all sets of the closed loop's modes with ZVD; `chosen`: for each tolerance and kind; `cure`: the runs of all sets.
    """

    modes: tuple[Mode, Mode]
    by_printed_formula: tuple[float, float]
    cases: dict[str, Case]
    printed: dict[str, Case]
    s_shaped: dict[str, Case]
    response: ModalResponse
    sets: list[ModeSet]
    chosen: dict[tuple[str, float], Selection]
    cure: dict[tuple[int, ...], Case]


def study(update: Update) -> Study:
    """Run it; `update(done, total)` is called now and then."""
    count = 0

    def done() -> None:
        nonlocal count
        count += 1
        update(count, _RUNS)

    update(0, _RUNS)
    slow, fast = chain_modes()
    residuals = residual_by_printed_formula(PRINTED[0]), residual_by_printed_formula(PRINTED[1])
    response = closed_loop()
    sets = mode_sets(response, "zvd")
    with Bench() as bench:
        step, printed = cases(bench, slow, fast, done), cases(bench, *PRINTED, done)
        cure = {}
        for one in sets:
            cure[one.modes] = bench.run(tuple(mode_of(response, k) for k in one.modes))
            done()
    with Bench(s_shaped=True) as bench:
        s_shaped = cases(bench, slow, fast, done)
    chosen = {(kind, t): select_modes(response, kind, t) for kind in ("zvd", "zv") for t in TOLERANCES}
    return Study((slow, fast), residuals, step, printed, s_shaped, response, sets, chosen, cure)


def mode_of(response: ModalResponse, k: int) -> Mode:
    """(natural frequency [rad/s], damping ratio) of a pole."""
    return float(response.natural_frequency[k]), float(response.damping_ratio[k])


def closed_loop() -> ModalResponse:
    """The loop's response by its matrices: M x'' + C x' + K x = (Kp (r - x1) - Kd x1', 0, 0), eqs. (9) and (10)."""
    springs = np.array([[-1.0, 1.0, 0.0], [0.0, -1.0, 1.0]])
    inverse = np.diag(1.0 / np.array(MASS))
    k, c = (springs.T @ np.diag(values) @ springs for values in (STIFFNESS, DAMPING))
    k[0, 0] += GAINS["proportional_gain"]
    c[0, 0] += GAINS["derivative_gain"]
    a = np.block([[np.zeros((3, 3)), np.eye(3)], [-inverse @ k, -inverse @ c]])
    b = np.array([0.0, 0.0, 0.0, GAINS["proportional_gain"] / MASS[0], 0.0, 0.0])
    return step_response(a, b, np.eye(6)[:3], ["x1", "x2", "x3"])
