"""Measures the residual vibration of the shaped and the unshaped command on a plant, at a step that does not matter."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import replace

import numpy as np

from shaper_fmu.errors import ArgumentError, ModelError
from shaper_fmu.tune.choice.boxes import ModeBox
from shaper_fmu.tune.choice.choice import Candidate
from shaper_fmu.tune.identify.unexcited import BEGIN_AT_REST
from shaper_fmu.tune.plant import Plant
from shaper_fmu.tune.verification.commanded import AnyCommand, CommandedRuns
from shaper_fmu.tune.verification.separation import AT_REST, Separation
from shaper_fmu.tune.verification.shares import QUIET, Measured, is_first_order, moved, unshaped_moved
from shaper_fmu.tune.verification.swing import SlowPart

_MOST_PARAMETERS = 5
_GROWN = 1.4
_SETTLING_STEPS = 3
"""Steps that are tried, each half of the one before, until the outputs settle."""
STAYS = 1e-3
"""Share of the tolerance by which halving the step may change a share."""
_TOLD = 0.02
"""Change of the unshaped residual by halving the step that is borne: it matters little to a small share, but it is told, too."""
_MOST_PER_PERIOD = 20480
_NEAR = 10.0
"""Times what `STAYS` allows: a solver of the first order is not driven further, since each halving doubles the time."""
_SURELY = 1.0 + 1e-9
_MOST_RISES = 2
_MOST_IN_NOISE = 8
"""Halvings of the step, in noise: to 6144 steps in the fastest mode's period."""
_DOUBT = 0.1
"""Share of the tolerance that noise may hide, before shorter steps are taken."""


class ShapedRuns:
    """The plant without a command, behind an unshaped one and behind a shaped one, and what of their motion is vibration.

    Args:
        plant: to be wired with a shaper.
        outputs, candidate, boxes, tolerance: see `verify`.
        command: that leaves the plant at rest, but for vibration.
        slow: see `verify`.

    Attributes:
        tolerance: see `verify`.
    """

    def __init__(
        self,
        plant: Plant,
        outputs: Sequence[str],
        candidate: Candidate,
        boxes: Sequence[ModeBox],
        tolerance: float,
        command: AnyCommand,
        slow: SlowPart | None = None,
    ):
        self.tolerance: float = tolerance
        self._runs = CommandedRuns(plant, outputs, candidate, boxes, command)
        self._separation = Separation(self._runs, slow, tolerance)
        self._known: dict[tuple[float, ...], Measured] = {}

    @property
    def step(self) -> float:
        """Communication step of all runs [s]."""
        return self._runs.step

    @property
    def plant(self) -> Plant:
        """The plant."""
        return self._runs.plant

    @property
    def steps(self) -> float:
        """That `measured` takes, about."""
        return self._runs.steps

    @property
    def noise(self) -> np.ndarray:
        """Standard deviation of each output's noise, 0 without; shape (outputs,)."""
        return self._separation.noise

    @property
    def subtracted(self) -> bool:
        """Whether the motion without a command is taken away from the others."""
        return self._separation.subtracted

    def nominals(self, spread: Mapping[str, float]) -> dict[str, float]:
        """Nominal values of the parameters; raises ModelError for what cannot be varied."""
        if len(spread) > _MOST_PARAMETERS:
            raise ModelError([f"{len(spread)} parameters are to be varied; limit: {_MOST_PARAMETERS}"])
        return self._runs.plant.nominal_values(spread)

    def measured(self, values: Mapping[str, float]) -> Measured:
        """The measured shares at these parameters. Raises SimulationError, and ComponentError if nothing vibrates."""
        key = (self.step, *values.values())
        if key not in self._known:
            self._known[key] = self._separation.measured(values) if self._separation.needed else self.raw(values)
        found, runs = self._known[key], self._runs
        if not max(found.before) > 0.0:
            raise ArgumentError(f"no output vibrates after the unshaped {runs.command.name}: {', '.join(runs.outputs)}")
        return found

    def raw(self, values: Mapping[str, float]) -> Measured:
        """As `measured`, where all motion is taken for vibration."""
        runs = self._runs
        rest, before, after = (runs.residuals(case, values, runs.window) for case in ("rest", "before", "after"))
        found = Measured(values, tuple(before), tuple(after), 0.0, tuple(rest))
        return replace(found, share=max(found.shares))

    def look_at_rest(self, found: Measured) -> None:
        """Find out what moves without a command; `found` are the residuals at the nominal parameters, as they are."""
        self._separation.look(found, STAYS * self.tolerance)
        if not self._separation.needed:
            self._known[(self.step,)] = found

    def check_rest(self, found: Measured) -> None:
        """Raise ComponentError for outputs that move without a step, too, by so much that shares mean little."""
        runs = self._runs
        plant, command = runs.plant, runs.command
        for name, without, before in zip(runs.outputs, found.rest, found.before, strict=True):
            if before > QUIET * max(found.before) and without > AT_REST * self.tolerance * before:
                raise ArgumentError(
                    f"the plant does not rest at {command.start:g} s, when the {command.name} comes: without it "
                    f"{plant.short(name)} swings by +-{without:.3g} {plant.unit(name)}, {without / before:.2g} of what "
                    f"the unshaped {command.name} excites; {BEGIN_AT_REST}"
                )

    def settled(self) -> Measured:
        """The measured shares at the nominal parameters, once the outputs settle.

        Raises ArgumentError for outputs whose motion after the unshaped command goes on growing at shorter steps, too: a drift is
        no vibration. At a long step a move that is sampled leaves some speed in a plant that integrates an acceleration.
        """
        drifting: list[str] = []
        runs, separation = self._runs, self._separation
        for _ in range(_SETTLING_STEPS):
            found = self.measured({})
            later = separation.later.tolist() if separation.needed else runs.residuals("before", {}, 2.0 * runs.window)
            drifting = [n for n, known, size in zip(runs.outputs, found.before, later, strict=True) if size > _GROWN * known]
            if not drifting:
                return found
            runs.step *= 0.5
        raise ArgumentError(
            f"{', '.join(drifting)} does not settle after a {runs.command.name} of {runs.plant.input}: in "
            f"{2.0 * runs.window:.3g} s it moves over {_GROWN:g} times as far as in {runs.window:.3g} s; name outputs "
            "that settle, such as a deflection"
        )

    def refine(self, found: Measured) -> float:
        """Halve the step until the residuals at the nominal point stay; by how much halving the step has changed the shares.

        The step is the longer one of the two, if neither residual of any output has changed by more than matters to the share, and
        the unshaped one by 2 % at most: that a share stays by chance is not enough. A solver of the first order (Euler's method)
        ends sooner, with an uncertainty. Where shorter steps are no better, since solvers of FMUs err with each, the step that has
        changed least is taken.
        """
        if self.noise.any():
            return self._refine_in_noise(found)
        changes: list[tuple[float, float]] = []  # by halving to a step [s]
        rises, limit, runs = 0, STAYS * self.tolerance, self._runs
        while (self.step > _SURELY * runs.fastest / _MOST_PER_PERIOD or not changes) and rises < _MOST_RISES:
            runs.step *= 0.5
            coarse, found = found, self.measured({})
            change = _apart(coarse, found)
            rises = rises + 1 if changes and change >= changes[-1][0] else 0
            changes.append((change, self.step))
            if moved(coarse, found) <= limit and unshaped_moved(coarse, found) <= _TOLD:
                runs.step *= 2.0
                return change
            if len(changes) > 2 and change <= _NEAR * limit and is_first_order([one[0] for one in changes[-3:]]):
                return change
        least, runs.step = min(changes)
        return least

    def _refine_in_noise(self, found: Measured) -> float:
        """As `refine`: until noise hides little, and halving changes no more than noise may.

        Each step is a further look at the noise, unless it is held over some time: then its steps are short enough.
        """
        runs, beyond = self._runs, 0.0
        for _ in range(_MOST_IN_NOISE):
            runs.step *= 0.5
            if not self._separation.stays_white():
                runs.step *= 2.0
                break
            coarse, found = found, self.measured({})
            beyond = max(0.0, _apart(coarse, found) - coarse.doubt - found.doubt)
            if beyond > 0.0 or unshaped_moved(coarse, found) > _TOLD:
                continue
            if coarse.doubt <= _DOUBT * self.tolerance:
                runs.step *= 2.0
                break
            if found.doubt <= _DOUBT * self.tolerance:
                break
        return beyond


def _apart(one: Measured, other: Measured) -> float:
    """The largest difference of an output's shares."""
    return max(abs(a - b) for a, b in zip(one.shares, other.shares, strict=True))
