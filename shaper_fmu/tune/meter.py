"""Counts what experiments on a plant cost: steps, runs and time of each part of the work."""

from __future__ import annotations

import math
import time
from collections.abc import Callable, Iterable, Iterator, Mapping
from contextlib import contextmanager
from dataclasses import dataclass, replace
from typing import Literal, get_args

import numpy as np

from shaper_fmu.errors import ShaperFmuError, SimulationError
from shaper_fmu.master.results import Results

Part = Literal["settle", "look", "excite", "linearize", "choose", "verify"]
"""settle: until the plant rests; look: the survey; excite: the experiments from which the modes come; linearize: the comparison
with the FMU's linearization; choose: the designs, without the plant; verify: the plant behind the shaper."""
PARTS: tuple[Part, ...] = get_args(Part)


class BudgetError(ShaperFmuError):
    """The budget does not allow what is asked for, or it is spent."""


@dataclass(frozen=True)
class Budget:
    """What experiments may take: steps of the plant, and wall time [s]; None for as much as it takes."""

    steps: int | None = None
    seconds: float | None = None

    def __bool__(self) -> bool:
        return self.steps is not None or self.seconds is not None


@dataclass(frozen=True)
class Effort:
    """What a part of the work has cost.

    Attributes:
        steps: communication steps of the plant; a step that ends at an event is one, too.
        runs: of the plant.
        seconds: wall time of the part [s], with all that was reckoned; of worker processes the sum.
        stepping: of them within the steps [s], where that was measured.
    """

    steps: int = 0
    runs: int = 0
    seconds: float = 0.0
    stepping: float = 0.0

    def __add__(self, other: Effort) -> Effort:
        return Effort(
            self.steps + other.steps, self.runs + other.runs, self.seconds + other.seconds, self.stepping + other.stepping
        )


@dataclass(frozen=True)
class Entry:
    """What a meter was asked for, or told: see `Meter.replay`.

    Attributes:
        part: that took the steps; None where it was asked whether so many fit the budget.
        steps: of a run.
        stepping: time within the steps [s].
        what: takes the steps that are asked for, in words.
    """

    part: Part | None
    steps: float
    stepping: float
    what: str


class Meter:
    """Counts the steps of a plant, and the time, by the part of the work at which they are taken.

    A run that does not fit the budget is not begun.

    Attributes:
        efforts: by part, in the order of `PARTS`.
        budget: see `Budget`; its time begins with the meter.
        stopped: the Ctrl-C after which no further run is begun.
        expected: steps of each part, as far as the plan knows.
        hear: called after each run with the part at work, the steps that it has taken, and those that are expected of it.
    """

    def __init__(self, budget: Budget | None = None) -> None:
        self.budget: Budget = budget or Budget()
        self.stopped: KeyboardInterrupt | None = None
        self.expected: dict[Part, int] = {}
        self.hear: Callable[[Part, int, int], None] | None = None
        self._begun: float = time.perf_counter()
        self._efforts: dict[Part, Effort] = {}
        self._parts: list[Part] = []
        self._since: float = 0.0

    @property
    def efforts(self) -> dict[Part, Effort]:
        """What each part has cost so far, in the order of `PARTS`; those that have not begun are left out."""
        return {name: self._efforts[name] for name in PARTS if name in self._efforts}

    @property
    def whole(self) -> Effort:
        """The sum of all parts."""
        return sum(self._efforts.values(), Effort())

    @contextmanager
    def part(self, name: Part) -> Iterator[None]:
        """Count what follows to this part; within another one, to this one alone."""
        self._pause()
        self._parts.append(name)
        self._efforts.setdefault(name, Effort())
        try:
            yield
        finally:
            self._pause()
            self._parts.pop()

    @property
    def at_work(self) -> Part | None:
        """The part of the work that is being done."""
        return self._parts[-1] if self._parts else None

    def allow(self, steps: float, what: str = "the next run") -> None:
        """Raise BudgetError if so many steps more do not fit the budget."""
        self._allow_steps(steps, what)
        whole, budget = self.whole, self.budget
        if budget.seconds is not None:
            taken = time.perf_counter() - self._begun
            needed = steps * whole.stepping / whole.steps if whole.steps else 0.0
            if taken + needed > budget.seconds:
                more = f"{what} takes about {seconds_words(needed)} more" if needed else "more time is needed"
                raise BudgetError(
                    f"the budget of {seconds_words(budget.seconds)} is spent: {seconds_words(taken)} are over, and {more}"
                )

    def _allow_steps(self, steps: float, what: str) -> None:
        taken = self.whole.steps
        if self.stopped is not None:
            raise BudgetError(f"interrupted: {taken:,} steps are taken")
        if self.budget.steps is not None and taken + steps > self.budget.steps:
            raise BudgetError(
                f"the budget of {self.budget.steps:,} steps is spent: {taken:,} are taken, and {what} takes "
                f"{math.ceil(steps):,} more"
            )

    def left(self) -> Budget:
        """What is left of the budget."""
        steps, seconds = self.budget.steps, self.budget.seconds
        return Budget(
            None if steps is None else max(0, steps - self.whole.steps),
            None if seconds is None else max(0.0, seconds - (time.perf_counter() - self._begun)),
        )

    @contextmanager
    def run(self, steps: float = 0.0) -> Iterator[list[Results]]:
        """Count a run of the plant, whose results are to be put into the list; one that fails counts with what it recorded.

        Raises BudgetError before it, if about so many steps do not fit. A Ctrl-C is heard so, too: what is known by then is kept.
        """
        self.allow(steps)
        made: list[Results] = []
        try:
            yield made
        except SimulationError as error:
            made += [error.results] if error.results is not None else []
            raise
        except KeyboardInterrupt as error:
            if type(error) is not KeyboardInterrupt:  # SIGTERM: there is no time for what is known
                raise
            self.stopped = error
            self.allow(0)
        finally:
            steps = sum(steps_of(one) for one in made)
            self.add(steps, sum(one.stepping_time for one in made))

    def add(self, steps: int, stepping: float = 0.0) -> None:
        """Count a run of so many steps; outside of all parts it belongs to none, and is not counted."""
        if self._parts:
            self._add(self._parts[-1], Effort(steps, 1, 0.0, stepping))
            self._tell(self._parts[-1])

    def _tell(self, part: Part) -> None:
        if self.hear is not None:
            self.hear(part, self._efforts[part].steps, self.expected.get(part, 0))

    def merge(self, efforts: Mapping[Part, Effort]) -> None:
        """Count what another meter has counted, too."""
        for name, effort in efforts.items():
            self._add(name, effort)

    def replay(self, log: Iterable[Entry], times: Iterable[tuple[Part, float]], *, checked: bool = True) -> None:
        """Count what another process has done, in its order.

        Raises BudgetError where the steps would not have been allowed here, unless not `checked`: the work of several processes is
        counted as if it had been done one after the other.
        """
        for part, seconds in times:
            self._add(part, Effort(seconds=seconds))
        for one in log:
            if one.part is not None:
                self._add(one.part, Effort(int(one.steps), 1, 0.0, one.stepping))
                self._tell(one.part)
            elif checked:
                self._allow_steps(one.steps, one.what)

    def _add(self, name: Part, effort: Effort) -> None:
        self._efforts[name] = self._efforts.get(name, Effort()) + effort

    def _pause(self) -> None:
        """Give the time since the last call to the part at work."""
        now = time.perf_counter()
        if self._parts:
            self._add(self._parts[-1], Effort(seconds=now - self._since))
        self._since = now


def steps_of(results: Results) -> int:
    """Steps between the recorded times; at an event, where both sides are recorded, time stands still."""
    return int(np.count_nonzero(np.diff(results.time) > 0.0))


def without_seconds(efforts: Mapping[Part, Effort]) -> dict[Part, Effort]:
    """The same with what is equal each time: the numbers of steps and runs."""
    return {name: replace(one, seconds=0.0, stepping=0.0) for name, one in efforts.items()}


def effort_words(efforts: Mapping[Part, Effort]) -> str:
    """What the parts have cost, in a sentence; "" without steps."""
    whole = sum(efforts.values(), Effort())
    if not whole.steps:
        return ""
    parts = [f"{name} {one.steps:,}" if one.steps else name for name, one in efforts.items()]
    times = [f"{seconds_words(one.seconds)}" for one in efforts.values()]
    told = ", ".join(f"{part} ({taken})" for part, taken in zip(parts, times, strict=True))
    cost = f", {seconds_words(whole.stepping / whole.steps)} each" if whole.stepping else ""
    return f"the plant took {whole.steps:,} steps{cost}, {seconds_words(whole.seconds)} in all: {told}"


def seconds_words(seconds: float) -> str:
    """A time with a unit that suits it, to two digits."""
    if seconds >= 120.0:
        minutes, rest = divmod(round(seconds), 60)
        return f"{minutes} min {rest} s"
    for unit, size in (("s", 1.0), ("ms", 1e-3)):
        if seconds >= size:
            return f"{seconds / size:.3g} {unit}"
    return f"{seconds / 1e-6:.2g} us"
