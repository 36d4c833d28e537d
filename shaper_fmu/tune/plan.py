"""The plan of a tuning's experiments: what each part takes, told before the work, and compared with the budget."""

from __future__ import annotations

import math
import time
from collections.abc import Mapping, Sequence
from dataclasses import dataclass

import numpy as np

from shaper_fmu.errors import SimulationError
from shaper_fmu.tune.choice.boxes import ModeBox
from shaper_fmu.tune.meter import Budget, BudgetError, Effort, Part, seconds_words
from shaper_fmu.tune.plant import Plant

_PROBED = 12
"""Steps that measure what one costs."""
_LOOKED = 101
_LOOK = 256 + 256 + 134 + _LOOKED
"""Steps of a survey that finds the modes at once: the excitation, about half of it, another step, and the plant at rest."""
_EXCITE = 3 * 102
"""Steps of an experiment on one mode: the excitation, about half of it, and half the step."""
_STEPS_PER_PERIOD, _WINDOW, _SHOWN = 24, 1.5, 5.0
_USUAL_DELAY = 0.5
"""Of a shaper, in periods of the slowest mode."""
_USUAL_MOVE = 1.0
"""Duration of a move, in the same."""
_ABRUPT_PER_PERIOD, _MOVED_PER_PERIOD, _ABRUPT, _FINER = 160, 40, 0.05, 2
"""Steps of the abrupt move that a move is compared with, and of the other runs; its duration; how often the steps are divided."""
_PLACES = (1, 9, 25)
"""Points of the grid in a verification, by the number of parameters that vary; 3 for each of more."""
_SEARCHED = 6
"""Points of the search for the worst place that a parameter usually adds."""


@dataclass(frozen=True)
class Cost:
    """What a plant takes: of a step, and of a run besides its steps [s]; 0 where it could not be measured."""

    step: float = 0.0
    run: float = 0.0

    def seconds(self, effort: Effort) -> float:
        """Time of so many steps and runs [s]."""
        return self.step * effort.steps + self.run * effort.runs


@dataclass(frozen=True)
class Plan:
    """The steps and runs of each part, the least and the usual ones, for a plant with one mode.

    Attributes:
        least: below which there is no verdict of `tuned`.
        usual: with the search for the worst place, and the responses for the report.
        cost: measured.
        points: of the range, at which modes are identified.
        moves: whether it is for a move.
    """

    least: Mapping[Part, Effort]
    usual: Mapping[Part, Effort]
    cost: Cost
    points: int
    moves: bool = False

    @property
    def steps(self) -> int:
        """The usual ones of all parts."""
        return _sum(self.usual).steps

    def words(self) -> str:
        """The plan in a sentence."""
        parts = ", ".join(f"{name} {self._told(one)}" for name, one in self.usual.items())
        each = f", {seconds_words(self.cost.step)} each" if self.cost.step else ""
        points = f"{self.points} points of the range" if self.points > 1 else "one point"
        kind = "one mode, a move of one period" if self.moves else "one mode"
        return (
            f"plan for {kind} and {points}: {self._told(_sum(self.usual))}{each}: {parts}; more for several modes, by the "
            "ratio of their frequencies, and where the step matters or the time scale is not the one expected"
        )

    def check(self, budget: Budget) -> None:
        """Raise BudgetError if not even the least fits."""
        whole = _sum(self.least)
        if budget.steps is not None and whole.steps > budget.steps:
            raise BudgetError(
                f"a budget of {budget.steps:,} steps is too small: {self._least_words()}, for a plant with one mode; "
                f"give at least so many (--steps), or vary fewer parameters; usual are {_sum(self.usual).steps:,}"
            )
        if budget.seconds is not None and self.cost.seconds(whole) > budget.seconds:
            raise BudgetError(
                f"a budget of {seconds_words(budget.seconds)} is too small: {self._least_words()} and "
                f"{seconds_words(self.cost.seconds(whole))}, for a plant with one mode; give at least so much (--budget), "
                "or vary fewer parameters"
            )

    def _least_words(self) -> str:
        parts = ", ".join(f"{name} {one.steps:,}" for name, one in self.least.items())
        return f"a verdict takes {_sum(self.least).steps:,} steps at least ({parts})"

    def _told(self, effort: Effort) -> str:
        taken = self.cost.seconds(effort)
        return f"{effort.steps:,} steps" + (f" ({seconds_words(taken)})" if taken else "")


def measured_cost(plant: Plant) -> Cost:
    """What a step and a run take, from a few steps without excitation; counted as settling. Fails as the plant does, later."""
    rest, step = np.array([[0.0, plant.rest_value({})]]), plant.duration_hint / _LOOKED
    with plant.meter.part("settle"):
        before, begin = plant.meter.whole, time.perf_counter()
        try:
            plant.run(rest, _PROBED * step, step, {})
        except SimulationError:
            return Cost()
        taken, stepping = time.perf_counter() - begin, plant.meter.whole.stepping - before.stepping
    return Cost(stepping / _PROBED, max(0.0, taken - stepping))


def plan_for(points: int, parameters: int, cost: Cost, moves: bool = False) -> Plan:
    """The plan for so many operating points and parameters that vary; with `moves` for a move."""
    settle, excite = Effort(_PROBED + _LOOKED * points, 1 + points), Effort(_EXCITE * points, 3 * points)
    known: dict[Part, Effort] = {"settle": settle, "look": Effort(_LOOK, 4), "excite": excite}
    return Plan(
        {**known, "verify": verification_effort(1.0, parameters, 0.0, usual=False, moves=moves)},
        {**known, "verify": verification_effort(1.0, parameters, _USUAL_MOVE if moves else _USUAL_DELAY, usual=True, moves=moves)},
        cost,
        points,
        moves,
    )


def verification_effort(
    ratio: float, parameters: int, delay: float, *, usual: bool, start: float = 0.0, moves: bool = False
) -> Effort:
    """Steps of a verification, for modes whose frequencies have this ratio; times in periods of the slowest one.

    `usual` is with the search for the worst place and the responses that a report shows. With `moves` it is that of a move which
    lasts as long as `delay`.
    """
    per_period = _STEPS_PER_PERIOD * ratio
    point, finest, shown_per_period = per_period * (3.0 * (start + _WINDOW) + delay), 2.0, per_period
    later = per_period * _WINDOW
    if moves:
        finer = ratio * (_FINER if usual else 1)
        abrupt = _ABRUPT_PER_PERIOD * (start + _ABRUPT / ratio + _WINDOW)
        point = finer * (abrupt + _MOVED_PER_PERIOD * (2.0 * (start + _WINDOW) + delay))
        finest, shown_per_period = 2.5 if usual else 2.0, finer * _MOVED_PER_PERIOD
        later = ratio * _ABRUPT_PER_PERIOD * _WINDOW
    places = _PLACES[parameters] if parameters < len(_PLACES) else 3**parameters
    places += _SEARCHED * parameters if usual else 0
    steps = point * (places + finest) + later
    shown = 4 if parameters else 2
    if usual:
        steps += shown * shown_per_period * (start + delay + _SHOWN)
    return Effort(math.ceil(steps), 3 * places + 4 + (shown if usual else 0))


def of_modes(
    boxes: Sequence[ModeBox], parameters: int, delay: float, start: float, *, usual: bool = False, moves: bool = False
) -> Effort:
    """The least or the usual verification for these modes, a shaper's delay or a move's duration, and the command's start [s]."""
    slowest = 2.0 * math.pi / min(box.natural_frequency.low for box in boxes)
    ratio = max(box.natural_frequency.high for box in boxes) * slowest / (2.0 * math.pi)
    return verification_effort(ratio, parameters, delay / slowest, usual=usual, start=start / slowest, moves=moves)


def _sum(parts: Mapping[Part, Effort]) -> Effort:
    return sum(parts.values(), Effort())
