"""Responses of a plant to a command, with and without the shaper, for the report."""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from dataclasses import dataclass

import numpy as np

from shaper_fmu.master.events import treat_events
from shaper_fmu.tune.choice.boxes import ModeBox
from shaper_fmu.tune.choice.choice import Candidate
from shaper_fmu.tune.plant import Plant
from shaper_fmu.tune.verification.command import Command
from shaper_fmu.tune.verification.commanded import COARSER, STEPS_PER_PERIOD
from shaper_fmu.tune.verification.move import MoveCommand

_PERIODS = 5.0
_MOST_POINTS = 20_000
_SAME_TIME = 1e-6
_BEFORE = 0.02
"""Of the time shown: what is shown before the step."""


@dataclass(frozen=True)
class Responses:
    """Outputs after a command that begins at time 0.

    Attributes:
        case: "nominal" or "worst".
        values: of the parameters that vary.
        time: [s], shape (n,).
        outputs: (unshaped, shaped) of each output by name, in its unit, each of shape (n,).
        units: of the outputs, by name.
    """

    case: str
    values: Mapping[str, float]
    time: np.ndarray
    outputs: Mapping[str, tuple[np.ndarray, np.ndarray]]
    units: Mapping[str, str]


def simulated_responses(
    plant: Plant,
    outputs: Sequence[str],
    candidate: Candidate,
    boxes: Sequence[ModeBox],
    command: Command | MoveCommand,
    case: str,
    values: Mapping[str, float],
    step: float,
) -> Responses:
    """Simulate a command with and without the candidate's shaper; its beginning is time 0 of the result.

    `step` is the communication step [s], that of the verification; it is divided for points that are a 24th of the fastest period
    apart at most, and of finer ones some are left out. Raises SimulationError if the plant cannot be run.
    """
    slowest = 2.0 * math.pi / min(box.natural_frequency.low for box in boxes)
    fastest = 2.0 * math.pi / max(box.natural_frequency.high for box in boxes)
    shown = command.shown(plant, candidate)
    if isinstance(command, MoveCommand):  # the step is for an abrupt move, which is not shown
        step = max(step, min(COARSER * step, plant.longest_step))
    end = max(one.end for one in shown) - command.start + _PERIODS * slowest
    step /= max(1, math.ceil(step / (fastest / STEPS_PER_PERIOD) - 1e-9))
    kept = max(1, math.floor(max(fastest / STEPS_PER_PERIOD, end / _MOST_POINTS) / step))
    names = {name: plant.full(name) for name in outputs}
    runs = []
    for system in (one.system for one in shown):
        options = {"everywhere": treat_events(system, None).exact, **command.stepping(plant)}
        made = plant.made(system, list(names.values()), command.start + end, step, values, **options)
        runs.append((made, _on_grid(made.time, step)))
    (before, grid), (after, same) = runs
    late = np.flatnonzero(before.time[grid] >= command.start - _BEFORE * end)[::kept]
    found = {name: (before[full][grid[late]], after[full][same[late]]) for name, full in names.items()}
    return Responses(case, values, before.time[grid[late]] - command.start, found, {name: plant.unit(name) for name in names})


def _on_grid(time: np.ndarray, step: float) -> np.ndarray:
    """Rows at the communication points, the last one at each; there are others at events, of which each is a step, too."""
    numbers = np.round(time / step)
    on = np.flatnonzero((np.abs(time - numbers * step) <= _SAME_TIME * step) | (time == time[-1]))
    return on[np.flatnonzero(np.diff(time[on], append=np.inf) > 0.0)]
