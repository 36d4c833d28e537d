"""Runs of a plant with an InputShaper: measures the residual vibration of the shaped and the unshaped command."""

from __future__ import annotations

import itertools
import math
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace

import numpy as np

from shaper_fmu.analysis.identification import noise_of
from shaper_fmu.errors import ArgumentError, ModelError
from shaper_fmu.master.events import treat_events
from shaper_fmu.master.results import Results
from shaper_fmu.master.simulation import Simulation
from shaper_fmu.tune.choice.boxes import ModeBox
from shaper_fmu.tune.choice.choice import Candidate
from shaper_fmu.tune.plant import Plant
from shaper_fmu.tune.verification.command import Case, Command
from shaper_fmu.tune.verification.move import MoveCommand
from shaper_fmu.tune.verification.peaks import peak_to_peak
from shaper_fmu.tune.verification.swing import SlowPart, Swing, swing_of

_STEPS_OF_MOVE = 160
"""The same where the input moves: an abrupt move of a 20th of the period is one of eight steps."""
STEPS_PER_PERIOD = 24
"""Of the fastest mode, at first: a parabola through three samples misses a sine's peak by 1.1e-4 at most."""
_PERIODS = 1.5
_MOST_PARAMETERS = 5
_GROWN = 1.4
_SETTLING_STEPS = 3
"""Steps that are tried, each half of the one before, until the outputs settle."""
_QUIET = 1e-9
"""Share of the liveliest output's residual below which an output does not vibrate."""
_AT_REST = 0.1
"""Share of the tolerance that motion without a step may have of the unshaped residual."""
STAYS = 1e-3
"""Share of the tolerance by which halving the step may change a share."""
_TOLD = 0.02
"""Change of the unshaped residual by halving the step that is borne: it matters little to a small share, but it is told, too."""
_MOST_PER_PERIOD = 20480
_FIRST_ORDER = 0.4, 0.6
"""Change by halving the step, over the change before, of a solver of the first order: what remains is as much again."""
_NEAR = 10.0
"""Times what `STAYS` allows: such a solver is not driven further, since each halving doubles the time."""
_SURELY = 1.0 + 1e-9
_MOST_RISES = 2
_LESS = 0.47
"""Of the command, to find out whether the plant is linear."""
_PER_PERIOD_IN_NOISE = 640
"""Steps of the fastest mode's period in noise: each is a further look at it."""
_MOST_IN_NOISE = 3
"""Halvings of the step, in noise."""
_DOUBT = 0.1
"""Share of the tolerance that noise may hide, before shorter steps are taken."""
_ON_GRID = 1e-3
_SAME_TIME = 1e-6
"""Share of a step by which times may differ that are the same."""


@dataclass(frozen=True)
class Measured:
    """Residuals at one set of parameters.

    Attributes:
        values: of the parameters that were varied, by name.
        before, after: residual of each output without and with the shaper, in its unit.
        share: the largest after / before, of the outputs that vibrate.
        rest: the same without a step; all but 0 for a plant at rest.
        doubt: what noise may hide of the share.
    """

    values: Mapping[str, float]
    before: tuple[float, ...]
    after: tuple[float, ...]
    share: float
    rest: tuple[float, ...] = ()
    doubt: float = 0.0

    @property
    def shares(self) -> list[float]:
        """after / before of each output; 0 for one that does not vibrate."""
        least = _QUIET * max(self.before)
        return [b / a if a > least else 0.0 for a, b in zip(self.before, self.after, strict=True)]


class ShapedRuns:
    """The plant without a command, behind an unshaped one and behind a shaped one, to be run again and again.

    Args:
        plant: to be wired with a shaper.
        outputs, candidate, boxes, tolerance: see `verify`.
        command: that leaves the plant at rest, but for vibration.

    Attributes:
        outputs: names with instances.
        step: communication step of all runs [s].
        tolerance: see `verify`.
    """

    def __init__(
        self,
        plant: Plant,
        outputs: Sequence[str],
        candidate: Candidate,
        boxes: Sequence[ModeBox],
        tolerance: float,
        command: Command | MoveCommand,
        slow: SlowPart | None = None,
    ):
        self.plant: Plant = plant
        self.outputs: list[str] = [self.plant.full(name) for name in outputs]
        fastest = 2.0 * math.pi / max(box.natural_frequency.high for box in boxes)
        per_period = _STEPS_OF_MOVE if isinstance(command, MoveCommand) else STEPS_PER_PERIOD
        self.step: float = min(fastest / per_period, plant.longest_step)
        self._finest = fastest / _MOST_PER_PERIOD
        self._window = _PERIODS * 2.0 * math.pi / min(box.natural_frequency.low for box in boxes)
        self.tolerance: float = tolerance
        self._command, self._candidate = command, candidate
        self._cases = command.cases(plant, candidate)
        self._known: dict[tuple[float, ...], Measured] = {}
        self._slow = slow
        self._noise = np.zeros(len(outputs))
        self._subtracted = False
        self._later = np.zeros(len(outputs))

    def nominals(self, spread: Mapping[str, float]) -> dict[str, float]:
        """Nominal values of the parameters; raises ModelError for what cannot be varied."""
        if len(spread) > _MOST_PARAMETERS:
            raise ModelError([f"{len(spread)} parameters are to be varied; limit: {_MOST_PARAMETERS}"])
        return self.plant.nominal_values(spread)

    def measured(self, values: Mapping[str, float]) -> Measured:
        """The measured shares at these parameters. Raises SimulationError, and ComponentError if nothing vibrates."""
        key = (self.step, *values.values())
        if key not in self._known:
            self._known[key] = self._separated(values) if self.separates else self.raw(values)
        self._check_vibrates(self._known[key])
        return self._known[key]

    def _check_vibrates(self, found: Measured) -> None:
        if not max(found.before) > 0.0:
            raise ArgumentError(f"no output vibrates after the unshaped {self._command.name}: {', '.join(self.outputs)}")

    def raw(self, values: Mapping[str, float]) -> Measured:
        """As `measured`, where all motion is taken for vibration."""
        rest, before, after = (self._residuals(case, values, self._window) for case in ("rest", "before", "after"))
        found = Measured(values, tuple(before), tuple(after), 0.0, tuple(rest))
        return replace(found, share=max(found.shares))

    @property
    def separates(self) -> bool:
        """Whether the vibration has to be separated from a slow part, noise, or a motion that is there without a command."""
        return self._slow is not None and (self._slow.moves or self._subtracted or bool(self._noise.any()))

    @property
    def noise(self) -> np.ndarray:
        """Standard deviation of each output's noise, 0 without; shape (outputs,)."""
        return self._noise

    @property
    def subtracted(self) -> bool:
        """Whether the motion without a command is taken away from the others."""
        return self._subtracted

    def look_at_rest(self, found: Measured) -> None:
        """Find out what moves without a command: noise, or a motion that can be taken away since the plant is linear.

        `found` are the residuals at the nominal parameters, as they are.
        """
        limit = np.maximum(_QUIET * max(found.before), _AT_REST * self.tolerance * np.array(found.before))
        if self._slow is None or not (np.array(found.rest) > limit).any():
            if not self.separates:
                self._known[(self.step,)] = found
            return
        coarse = self.step
        self.step = min(self.step, self._finest * _MOST_PER_PERIOD / _PER_PERIOD_IN_NOISE)  # a level takes many looks
        begin, record = self._record("rest", {}, self._long)
        self._noise = noise_of(record[begin:])
        if not self._noise.any():
            self.step = coarse
        moving = (np.array(found.rest) > limit) & (self._noise == 0.0)
        self._subtracted = bool(moving.any()) and self._superposes()

    def _superposes(self) -> bool:
        """Whether 0.47 of the command makes 0.47 of the difference to the motion without it."""
        if not isinstance(self._command, Command):
            return False
        less = replace(self._command, amplitude=_LESS * self._command.amplitude).cases(self.plant, self._candidate)
        self._cases["less"] = less["before"]
        begin, rest = self._record("rest", {}, self._long)
        whole, part = (self._record(case, {}, self._long)[1] - rest for case in ("before", "less"))
        apart = np.ptp((part / _LESS - whole)[begin:], axis=0)
        return bool((apart <= _AT_REST * self.tolerance * np.ptp(whole[begin:], axis=0)).all())

    @property
    def _long(self) -> float:
        """Duration of a record in which the vibration is separated [s]."""
        return self._window * (4.0 if self._noise.any() else 2.0)

    def _separated(self, values: Mapping[str, float]) -> Measured:
        """As `measured`, of the vibration alone."""
        assert self._slow is not None
        found: dict[str, Swing] = {}
        for case in ("before", "after"):
            begin, record = self._record(case, values, self._long)
            if self._subtracted:
                rest = self._record("rest", values, self._long + self._cases[case].end - self._cases["rest"].end)[1]
                record = record - rest[: len(record)]
            known = found["before"].poles if found else None
            scale = self._cases[case].scale
            noise = scale * self._noise * (math.sqrt(2.0) if self._subtracted else 1.0)
            found[case] = swing_of(scale * record[begin:], self.step, self._slow, self._window, noise, known)
        before, after = found["before"], found["after"]
        sizes = before.half
        seen = sizes > _QUIET * max(sizes)
        doubt = float(np.max((after.doubt[seen] + before.doubt[seen] * after.half[seen] / sizes[seen]) / sizes[seen], initial=0.0))
        self._later = before.later
        measured = Measured(values, tuple(sizes.tolist()), tuple(after.half.tolist()), 0.0, self._moving(values), doubt)
        return replace(measured, share=max(measured.shares))

    def _moving(self, values: Mapping[str, float]) -> tuple[float, ...]:
        """Residuals without a command but for noise; 0 where they are taken away."""
        if self._subtracted:
            return (0.0,) * len(self.outputs)
        begin, record = self._record("rest", values, self._long)
        half = 0.5 * self._cases["rest"].scale * np.ptp(record[begin:], axis=0)
        return tuple(np.where(noise_of(record[begin:]) > 0.0, 0.0, half).tolist())

    def _record(self, case: str, values: Mapping[str, float], window: float) -> tuple[int, np.ndarray]:
        """The first row after the last change of the command, and the outputs at every communication step, shape (n, m)."""
        wanted = self._cases[case]
        found = self._run(wanted, values, wanted.end + window)
        grid = np.flatnonzero(np.diff(found.time, append=math.inf) > _SAME_TIME * self.step)  # of two values at a jump the last
        rows = self._on_grid(found.time[grid])
        kept = grid[rows]
        begin = int(np.searchsorted(found.time[kept], wanted.end + (1.0 + _SAME_TIME) * self.step, "right"))
        return begin, np.column_stack([found[name][kept] for name in self.outputs])

    def _on_grid(self, time: np.ndarray) -> np.ndarray:
        """Rows at multiples of the step; others are those of events."""
        apart = time / self.step
        return np.flatnonzero(np.abs(apart - np.round(apart)) < _ON_GRID)

    def check_rest(self, found: Measured) -> None:
        """Raise ComponentError for outputs that move without a step, too, by so much that shares mean little."""
        for name, without, before in zip(self.outputs, found.rest, found.before, strict=True):
            if before > _QUIET * max(found.before) and without > _AT_REST * self.tolerance * before:
                raise ArgumentError(
                    f"the plant does not rest at {self._command.start:g} s, when the {self._command.name} comes: without it "
                    f"{self.plant.short(name)} swings by +-{without:.3g} {self.plant.unit(name)}, {without / before:.2g} of what "
                    f"the unshaped {self._command.name} excites; give start values at which it rests, or a settle time after "
                    "which it does"
                )

    def settled(self) -> Measured:
        """The measured shares at the nominal parameters, once the outputs settle.

        Raises ArgumentError for outputs whose motion after the unshaped command goes on growing at shorter steps, too: a drift is
        no vibration. At a long step a move that is sampled leaves some speed in a plant that integrates an acceleration.
        """
        drifting: list[str] = []
        for _ in range(_SETTLING_STEPS):
            found = self.measured({})
            later = self._later.tolist() if self.separates else self._residuals("before", {}, 2.0 * self._window)
            drifting = [n for n, known, size in zip(self.outputs, found.before, later, strict=True) if size > _GROWN * known]
            if not drifting:
                return found
            self.step *= 0.5
        raise ArgumentError(
            f"{', '.join(drifting)} does not settle after a {self._command.name} of {self.plant.input}: in "
            f"{2.0 * self._window:.3g} s it moves over {_GROWN:g} times as far as in {self._window:.3g} s; name outputs "
            "that settle, such as a deflection"
        )

    def refine(self, found: Measured) -> float:
        """Halve the step until the residuals at the nominal point stay; by how much halving the step has changed the shares.

        The step is the longer one of the two, if neither residual of any output has changed by more than matters to the share, and
        the unshaped one by 2 % at most: that a share stays by chance is not enough. A solver of the first order (Euler's method)
        ends sooner, with an uncertainty. Where shorter steps are no better, since solvers of FMUs err with each, the step that has
        changed least is taken. In noise it is halved until noise hides little.
        """
        if self._noise.any():
            for _ in range(_MOST_IN_NOISE):
                if found.doubt <= _DOUBT * self.tolerance:
                    break
                self.step *= 0.5
                found = self.measured({})
            return 0.0
        changes: list[tuple[float, float]] = []  # by halving to a step [s]
        rises, limit = 0, STAYS * self.tolerance
        while (self.step > _SURELY * self._finest or not changes) and rises < _MOST_RISES:
            self.step *= 0.5
            coarse, found = found, self.measured({})
            change = max(abs(a - b) for a, b in zip(coarse.shares, found.shares, strict=True))
            rises = rises + 1 if changes and change >= changes[-1][0] else 0
            changes.append((change, self.step))
            if _moved(coarse, found) <= limit and _unshaped_moved(coarse, found) <= _TOLD:
                self.step *= 2.0
                return change
            if len(changes) > 2 and change <= _NEAR * limit and _is_first_order([one[0] for one in changes[-3:]]):
                return change
        least, self.step = min(changes)
        return least

    def _residuals(self, case: str, values: Mapping[str, float], window: float) -> list[float]:
        """Half the peak-to-peak value of each output over a window [s] from the last change of the command on.

        An output that follows the input at once has two values at that change, and solvers that step on beyond the communication
        points tell a wrong one there when the input has been set: of such outputs the window begins with the next value.
        """
        wanted = self._cases[case]
        system, last = wanted.system, wanted.end
        exact = treat_events(system, None).exact
        found = self._run(wanted, values, last + window)
        begin = last if exact else last + self.step  # without events the change comes a step later
        after = int(np.searchsorted(found.time, begin + _SAME_TIME * self.step, "right"))
        at = min(after - 1, int(np.searchsorted(found.time, last - _SAME_TIME * self.step))) if exact else after - 1
        firsts = [after if self.plant.follows(name) else at for name in self.outputs]
        half = 0.5 * wanted.scale
        return [half * peak_to_peak(found.time[n:], found[name][n:]) for name, n in zip(self.outputs, firsts, strict=True)]

    def _run(self, wanted: Case, values: Mapping[str, float], stop: float) -> Results:
        system = wanted.system
        given = {self.plant.full(name): value for name, value in values.items()}
        options = {"start_values": given, "everywhere": treat_events(system, None).exact, **self._command.stepping(self.plant)}
        with self.plant.meter.run(stop / self.step) as made, Simulation(system, record=self.outputs) as simulation:
            made.append(simulation.run(stop, self.step, **options))  # a new one: not every FMU is like new after its reset
        return made[0]


def _is_first_order(changes: Sequence[float]) -> bool:
    low, high = _FIRST_ORDER
    return all(low * a <= b <= high * a for a, b in itertools.pairwise(changes))


def _unshaped_moved(coarse: Measured, fine: Measured) -> float:
    """The largest relative change of an output's residual after the unshaped command."""
    pairs = [(a, b) for a, b in zip(coarse.before, fine.before, strict=True) if b > _QUIET * max(fine.before)]
    return max((abs(b - a) / b for a, b in pairs), default=0.0)


def _moved(coarse: Measured, fine: Measured) -> float:
    """By how much an output's residuals have changed, in what each change alone makes of the share; of the worst output."""
    least = _QUIET * max(fine.before)
    changes = (
        abs(fine_after - after) / fine_before + fine_after / fine_before * abs(fine_before - before) / fine_before
        for before, fine_before, after, fine_after in zip(coarse.before, fine.before, coarse.after, fine.after, strict=True)
        if fine_before > least
    )
    return max(changes, default=0.0)
