"""Runs of a plant without a command, behind an unshaped one and behind a shaped one."""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from typing import Any, Protocol

import numpy as np

from shaper_fmu.master.events import treat_events
from shaper_fmu.master.results import Results
from shaper_fmu.tune.choice.boxes import ModeBox
from shaper_fmu.tune.choice.choice import Candidate
from shaper_fmu.tune.plant import Plant
from shaper_fmu.tune.verification.command import Case
from shaper_fmu.tune.verification.move import MoveCommand
from shaper_fmu.tune.verification.peaks import peak_to_peak

STEPS_OF_MOVE = 160
"""The same where the input moves: an abrupt move of a 20th of the period is one of eight steps."""
COARSER = 4
"""Times that step where the input does not move abruptly: the plant without a command, and the move that is verified."""
STEPS_PER_PERIOD = 24
"""Of the fastest mode, at first: a parabola through three samples misses a sine's peak by 1.1e-4 at most."""
_PERIODS = 1.5
_ON_GRID = 1e-3
_SAME_TIME = 1e-6
"""Share of a step by which times may differ that are the same."""


class AnyCommand(Protocol):
    """What a verification commands: a `Command`, a `MoveCommand`, or several inputs' commands."""

    @property
    def name(self) -> str:
        """Its name in messages."""
        ...

    @property
    def start(self) -> float:
        """When it begins [s]."""
        ...

    def cases(self, plant: Plant, candidate: Candidate) -> dict[str, Case]:
        """See `Command.cases`."""
        ...

    def stepping(self, plant: Plant) -> dict[str, Any]:
        """Options of the runs."""
        ...


class CommandedRuns:
    """The three cases of a verification, to be run again and again.

    Args:
        plant: to be wired with a shaper.
        outputs, candidate, boxes: see `verify`.
        command: that leaves the plant at rest, but for vibration.

    Attributes:
        outputs: names with instances.
        fastest: the shortest period of the modes [s].
        step: communication step of all runs [s].
        window: after a command, in which the residual is measured [s].
        cases: "rest", "before" and "after": without a command, with the unshaped one, and with the shaped one.
    """

    def __init__(
        self,
        plant: Plant,
        outputs: Sequence[str],
        candidate: Candidate,
        boxes: Sequence[ModeBox],
        command: AnyCommand,
    ):
        self.plant: Plant = plant
        self.outputs: list[str] = [plant.full(name) for name in outputs]
        self.fastest: float = 2.0 * math.pi / max(box.natural_frequency.high for box in boxes)
        per_period = STEPS_OF_MOVE if isinstance(command, MoveCommand) else STEPS_PER_PERIOD
        self.step: float = min(self.fastest / per_period, plant.longest_step)
        self.window: float = _PERIODS * 2.0 * math.pi / min(box.natural_frequency.low for box in boxes)
        self.command: AnyCommand = command
        self.candidate: Candidate = candidate
        self.cases: dict[str, Case] = command.cases(plant, candidate)

    @property
    def steps(self) -> float:
        """Of the three cases at one set of parameters."""
        return sum((case.end + self.window) / self._step_of(name) for name, case in self.cases.items())

    def record(self, case: str, values: Mapping[str, float], window: float) -> tuple[int, np.ndarray]:
        """The first row after the last change of the command, and the outputs at every communication step, shape (n, m)."""
        wanted = self.cases[case]
        found = self._run(wanted, values, wanted.end + window, self.step)
        grid = np.flatnonzero(np.diff(found.time, append=math.inf) > _SAME_TIME * self.step)  # of two values at a jump the last
        rows = self._on_grid(found.time[grid])
        kept = grid[rows]
        begin = int(np.searchsorted(found.time[kept], wanted.end + (1.0 + _SAME_TIME) * self.step, "right"))
        return begin, np.column_stack([found[name][kept] for name in self.outputs])

    def _on_grid(self, time: np.ndarray) -> np.ndarray:
        """Rows at multiples of the step; others are those of events."""
        apart = time / self.step
        return np.flatnonzero(np.abs(apart - np.round(apart)) < _ON_GRID)

    def residuals(self, case: str, values: Mapping[str, float], window: float) -> list[float]:
        """Half the peak-to-peak value of each output over a window [s] from the last change of the command on.

        An output that follows the input at once has two values at that change, and solvers that step on beyond the communication
        points tell a wrong one there when the input has been set: of such outputs the window begins with the next value.
        """
        wanted = self.cases[case]
        system, last = wanted.system, wanted.end
        exact = treat_events(system, None).exact
        step = self._step_of(case)
        found = self._run(wanted, values, last + window, step)
        begin = last if exact else last + step  # without events the change comes a step later
        after = int(np.searchsorted(found.time, begin + _SAME_TIME * step, "right"))
        at = min(after - 1, int(np.searchsorted(found.time, last - _SAME_TIME * step))) if exact else after - 1
        firsts = [after if self.plant.follows(name) else at for name in self.outputs]
        half = 0.5 * wanted.scale
        return [half * peak_to_peak(found.time[n:], found[name][n:]) for name, n in zip(self.outputs, firsts, strict=True)]

    def _step_of(self, case: str) -> float:
        """Communication step of a case [s]: of an abrupt move, which the step is for, or a longer one."""
        if not isinstance(self.command, MoveCommand) or case == "before":
            return self.step
        return max(self.step, min(COARSER * self.step, self.plant.longest_step))

    def _run(self, wanted: Case, values: Mapping[str, float], stop: float, step: float) -> Results:
        system = wanted.system
        options = {"everywhere": treat_events(system, None).exact, **self.command.stepping(self.plant)}
        return self.plant.made(system, self.outputs, stop, step, values, again=True, **options)
