"""Runs everything for Jung (2011), for the claims and the figures."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from shaper_fmu.design.modal_responses import ModalResponse, step_response
from shaper_fmu.design.mode_selection import ModeSet, Selection, mode_sets, select_modes
from shaper_fmu.progress import Update
from shaper_fmu.reproduce.partial_modes.machine import SET_A, SETS, Machine
from shaper_fmu.reproduce.partial_modes.runs import (
    PRINTED,
    Bench,
    Case,
    Mode,
    cases,
    chain_modes,
    residual_by_printed_formula,
)

TOLERANCES = (0.02, 0.05, 0.10, 0.15, 0.30)
_RUNS = 3 * 4 * len(SETS) + 8


@dataclass(frozen=True)
class Found:
    """The responses of one set of masses, springs and gains: no shaper, "fast", "slow" and "both" modes of the chain shaped.

    Attributes:
        modes: of the free chain, the slow one and the fast one.
        cases: with shapers for the chain's modes; `printed`: for the rounded modes of eq. (11); `s_shaped`: the S-shaped move.
    """

    machine: Machine
    modes: tuple[Mode, Mode]
    cases: dict[str, Case]
    printed: dict[str, Case]
    s_shaped: dict[str, Case]


@dataclass(frozen=True)
class Study:
    """Everything that was found.

    Attributes:
        by_printed_formula: residual by eq. (8) as printed, of the modes of eq. (11) [%].
        found: for each set of `SETS`, in their order.
        response: of set A's closed loop, by its modes, for comparison and for the choice.
        sets: all sets of the closed loop's modes with ZVD; `chosen`: for each tolerance and kind; `cure`: the runs of all sets.
    """

    by_printed_formula: tuple[float, float]
    found: tuple[Found, ...]
    response: ModalResponse
    sets: list[ModeSet]
    chosen: dict[tuple[str, float], Selection]
    cure: dict[tuple[int, ...], Case]

    @property
    def default(self) -> Found:
        """Of set A, the defaults of the chain's FMU."""
        return self.found[0]


def study(update: Update) -> Study:
    """Run it; `update(done, total)` is called now and then."""
    count = 0

    def done() -> None:
        nonlocal count
        count += 1
        update(count, _RUNS)

    update(0, _RUNS)
    residuals = residual_by_printed_formula(PRINTED[0]), residual_by_printed_formula(PRINTED[1])
    response = closed_loop()
    sets = mode_sets(response, "zvd")
    cure, found = {}, []
    with Bench() as bench, Bench(s_shaped=True) as smooth:
        for one in sets:
            cure[one.modes] = bench.run(SET_A, tuple(mode_of(response, k) for k in one.modes))
            done()
        for machine in SETS:
            modes = chain_modes(machine)
            step, printed = cases(bench, machine, *modes, done), cases(bench, machine, *PRINTED, done)
            found.append(Found(machine, modes, step, printed, cases(smooth, machine, *modes, done)))
    chosen = {(kind, t): select_modes(response, kind, t) for kind in ("zvd", "zv") for t in TOLERANCES}
    return Study(residuals, tuple(found), response, sets, chosen, cure)


def mode_of(response: ModalResponse, k: int) -> Mode:
    """(natural frequency [rad/s], damping ratio) of a pole."""
    return float(response.natural_frequency[k]), float(response.damping_ratio[k])


def closed_loop() -> ModalResponse:
    """The response of set A's loop by its matrices."""
    a, b = SET_A.closed_loop()
    return step_response(a, b, np.eye(6)[:3], ["x1", "x2", "x3"])
