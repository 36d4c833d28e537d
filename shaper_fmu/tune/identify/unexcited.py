"""Runs of a plant without excitation: how long it takes to rest, its noise, and a communication step that is stable."""

from __future__ import annotations

import math
from collections.abc import Mapping
from dataclasses import dataclass, field
from typing import Any

import numpy as np

from shaper_fmu.analysis.identification import noise_of
from shaper_fmu.errors import SimulationError
from shaper_fmu.tune.plant import Plant

LESS = 0.47
"""Of an excitation: all roundings would be the same at half of it, and would not be seen."""
BEGIN_AT_REST = "give a time after which it rests (settle, --settle), or values with which it begins at rest (start, --start)"
"""What helps a plant that moves by itself."""
_LOOKED = 101
"""Samples of the motion without excitation: no round number, or a periodic disturbance may seem to stand still."""
_MOST_DOUBLINGS = 7
_AT_REST = 1e-3
_OWN_STEPS = 6
_DIVIDED = 8
_JUST_BEFORE = 1.0 - 1e-7
"""Communication points come just before the FMU's own, so that rounding does not decide whether it takes a step."""
_QUARTERINGS = 6
"""Of the communication step, until it is stable."""
_GROWING = 1.5
"""Motion without excitation in the last window over that in the first one, from which on shorter steps are tried."""
_CALMER = 0.9
"""Decay at a shorter step over the one before, from which on the step is what keeps the plant moving."""
_LONGER = 1.3
"""How much longer than asked for the plant is seen to stand still, since other runs follow."""


@dataclass
class Unexcited:
    """A plant at an operating point, without excitation.

    Attributes:
        plant: to be run.
        point: start values of the operating point, by name.
        settle_time: until the outputs rest [s]; what is given is waited for at least.
        restored: whether runs begin in the settled states, where the FMUs save these; else each at the start.
        grid: internal step of an FMU that moves only in these [s], else 0.
        noise: standard deviation of the outputs' noise at rest; shape (m,).
    """

    plant: Plant
    point: Mapping[str, Any]
    settle_time: float = 0.0
    restored: bool = True
    grid: float = 0.0
    noise: np.ndarray = field(default_factory=lambda: np.zeros(1))
    _still: tuple[float, np.ndarray] | None = None
    _moves: bool = False

    @property
    def rest(self) -> float:
        """The input's value at rest."""
        return self.plant.rest_value(self.point)

    def find_grid(self, amplitude: float) -> None:
        """Find out whether an FMU moves only in internal steps, and their length [s]: see `on_grid`."""
        for own in self.plant.own_steps:
            step = np.array([[0.0, self.rest + LESS * amplitude]])
            values = self.plant.run(step, _OWN_STEPS * own, own / _DIVIDED, self.point)[1]
            moved = np.flatnonzero(np.any(np.diff(values, axis=0) != 0.0, axis=1))
            # not one that has come to rest after a few samples: a step that is told may be much longer than all that happens
            if len(moved) > 1 and np.diff(moved).min() >= _DIVIDED - 1:
                self.grid = max(self.grid, own * _JUST_BEFORE)

    def on_grid(self, step: float) -> float:
        """The next multiple of the FMU's internal step; the step itself if it has none [s]."""
        return max(1, math.ceil(step / self.grid - 1e-9)) * self.grid if self.grid else step

    def settle(self, window: float) -> str | None:
        """Find the time until the outputs rest over `window` [s], from the given one on; a sentence if they do not."""
        given = self.settle_time
        moved = self._until_rest(window, given)
        if moved is not None and self._calms_at_shorter_steps(given, window):
            moved = self._until_rest(window, given)
        if moved is None:
            return None
        self.settle_time, longest = given, given + 2.0**_MOST_DOUBLINGS * window
        worst = int(np.argmax(moved[:, 0] / np.maximum(moved[:, 1], 1e-300)))
        return (
            f"the plant does not come to rest: without excitation {self.plant.outputs[worst]} still moves by "
            f"{moved[worst, 0]:.3g} {self.plant.units[worst]} in the last {window:g} s of {longest:g} s; "
            f"responses are differences to that motion; if it should rest, {BEGIN_AT_REST}"
        )

    def _until_rest(self, window: float, given: float) -> np.ndarray | None:
        """Find the settle time; None, or how the outputs move (see `_motion`) in the last window of all, if they do not rest."""
        moved = np.ones((1, 3))
        for k in range(_MOST_DOUBLINGS + 1):
            settled = given + (2.0**k - 1.0) * window
            moved = self._stable_motion(settled, window)
            still = moved[:, 0] <= (_AT_REST * moved[:, 1] if settled > 0.0 else 1e-9 * moved[:, 2])
            if (still | (self.noise > 0.0)).all():
                self.settle_time = settled
                return None
        return moved

    def _calms_at_shorter_steps(self, given: float, window: float) -> bool:
        """Whether a motion that neither grows nor decays does decay at shorter steps, which are kept then.

        Euler's method takes damping away: at some step it has none left.
        """
        begun, decays = self.plant.longest_step, []
        if self.grid:
            return False
        for step in (begun, 0.25 * min(begun, window / _LOOKED)):
            self.plant.longest_step = step
            moved = self._motion_or_failure(given + window, window)
            if isinstance(moved, SimulationError):
                break
            decays.append(moved[:, 0] / moved[:, 3])
        if len(decays) == 2 and (decays[1] < _CALMER * decays[0]).any() and (decays[1] <= decays[0] / _CALMER).all():
            return True
        self.plant.longest_step = begun
        return False

    def _stable_motion(self, settled: float, window: float) -> np.ndarray:
        """As `_motion`, with communication steps so short that they do not make the motion grow: see `Plant.longest_step`.

        An explicit solver that takes the communication step for its own (Euler's method) diverges above some length of it. A plant
        that grows or fails at shorter steps, too, keeps the step that it had.
        """
        coarse, before = self._motion_or_failure(settled, window), self.plant.longest_step
        while not self.grid and (isinstance(coarse, SimulationError) or self._grows(coarse)):
            begun, seen = self.plant.longest_step, coarse
            for _ in range(_QUARTERINGS):
                self.plant.longest_step = 0.25 * min(self.plant.longest_step, window / _LOOKED)
                seen = self._motion_or_failure(settled, window)
                if not isinstance(seen, SimulationError) or not isinstance(coarse, SimulationError):
                    break
            if isinstance(seen, SimulationError) or (not isinstance(coarse, SimulationError) and not _is_calmer(seen, coarse)):
                self.plant.longest_step = begun
                break
            coarse = seen
        if isinstance(coarse, SimulationError):
            self.plant.longest_step = before
            raise coarse
        if self.plant.longest_step < before and not self._grows(coarse):
            self.plant.longest_step *= 0.25  # one that is just stable has all but no damping
            coarse = self._motion(settled, window)
        return coarse[:, :3]

    def _motion_or_failure(self, settled: float, window: float) -> np.ndarray | SimulationError:
        try:
            return self._motion(settled, window)
        except SimulationError as error:
            return error

    @staticmethod
    def _grows(moved: np.ndarray) -> bool:
        return bool((moved[:, 0] > _GROWING * moved[:, 3]).any())

    def _motion(self, settled: float, window: float) -> np.ndarray:
        """Without excitation peak-to-peak values over `window` after `settled` [s] and in all, magnitudes, and peak-to-peak values
        over the first `window`; shape (m, 4)."""
        rest = np.array([[0.0, self.rest]])
        step = self.on_grid(window / _LOOKED)
        values = self.plant.run(rest, settled + window, step, self.point, self.divided(step))[1]
        self._note_still(settled + window, values)
        size = np.maximum(np.abs(values).max(axis=0), 1e-300)
        late, early = np.ptp(values[round(settled / step) :], axis=0), np.ptp(values[: round(window / step) + 1], axis=0)
        self.noise = noise_of(values[round(settled / step) :])
        return np.column_stack([late, np.maximum(np.ptp(values, axis=0), 1e-9 * size), size, np.maximum(early, 1e-9 * size)])

    def divided(self, step: float) -> int:
        """Communication steps in a step of samples: as many as the plant needs to be stable."""
        return max(1, math.ceil(step / self.plant.longest_step - 1e-9))

    def stands_still(self, stop: float) -> bool:
        """Whether no output changes by a single bit without excitation: such a run need not be made at every step."""
        if (self._still is None or stop > self._still[0]) and not self._moves:
            step = self.on_grid(_LONGER * stop / _LOOKED)
            longer, rest = step * math.ceil(_LONGER * stop / step - 1e-9), np.array([[0.0, self.rest]])
            self._note_still(longer, self.plant.run(rest, longer, step, self.point, self.divided(step))[1])
        return not self._moves

    def _note_still(self, until: float, values: np.ndarray) -> None:
        self._moves = self._moves or bool((values != values[0]).any())
        if self._still is None or until > self._still[0]:
            self._still = until, values[0]


def _is_calmer(fine: np.ndarray, coarse: np.ndarray) -> bool:
    """Whether what grew at a coarse step grows much less at a fine one."""
    grown = coarse[:, 0] > _GROWING * coarse[:, 3]
    return bool((fine[grown, 0] * coarse[grown, 3] < 0.7 * coarse[grown, 0] * fine[grown, 3]).all())
