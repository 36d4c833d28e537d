"""Responses to excitations at an operating point: settling time, amplitude in the linear range, step size."""

from __future__ import annotations

import math
from collections.abc import Mapping
from dataclasses import dataclass, field, replace
from typing import Any

import numpy as np

from shaper_fmu.analysis.identification import noise_of
from shaper_fmu.errors import SimulationError
from shaper_fmu.master.simulation import Simulation
from shaper_fmu.master.system import System
from shaper_fmu.tune.identify.excitation import Excitation
from shaper_fmu.tune.identify.state import SettledRuns, Settling
from shaper_fmu.tune.plant import Plant

LINEAR = 1e-4
"""Nonlinearity that is small enough, where it can be had."""
TOLERATED = 0.02
"""Nonlinearity from which on the plant is called too nonlinear."""
_HALF = 0.47
_LOOKED = 101
"""Samples of the motion without excitation: no round number, or a periodic disturbance may seem to stand still."""
_HUGE = 1e100
_DECADES = 9
_MOST_DOUBLINGS = 7
_AT_REST = 1e-3
_COUPLING = 1e-5
_HALF_COUPLING = 0.5 * _COUPLING
"""Of the first half of a response: what errs by each step has erred half as much there."""
_MOST_SUBSTEPS = 256
_MOST_RISES = 2
"""Halvings that may make it worse: solvers of FMUs err with each step, so that shorter ones need not be better."""
_OWN_STEPS = 6
_DIVIDED = 8
_JUST_BEFORE = 1.0 - 1e-7
"""Communication points come just before the FMU's own, so that rounding does not decide whether it takes a step."""
_QUARTERINGS = 6
"""Of the communication step, until it is stable."""
_SURELY = 1.15
_OF_HALVES = _SURELY * math.sqrt(1.0 + _HALF**-2 + (1.0 - 1.0 / _HALF) ** 2)
_OF_STEPS = _SURELY * 2.0
"""What noise makes of differences, in standard deviations, with what it may be more by chance."""
_RETRIES = 3
"""Quarterings of the communication step, where an excited plant fails."""
_GROWING = 1.5
"""Motion without excitation in the last window over that in the first one, from which on shorter steps are tried."""
_LONGER = 1.3
"""How much longer than asked for the plant is seen to stand still, since other runs follow."""
_WORTH = 0.1
"""Share of a run's steps in which the plant settles, from which on states are saved."""


@dataclass(frozen=True)
class Response:
    """How much the outputs differ from those without excitation.

    Attributes:
        time: from the first sample after the excitation's end on [s], shape (n,).
        values: shape (n, m), in the outputs' units.
        error: RMS of what does not scale with the amplitude, as far as it is tolerated, shape (m,).
        nonlinearity: that RMS over the RMS of the response, in the worst output that moves.
        coupling: what halving the communication step changes of the response, relative, where FMUs are coupled; else 0.
        excitation: that was applied.
        noise: standard deviation of white noise in `values`, shape (m,); 0 without.
    """

    time: np.ndarray
    values: np.ndarray
    error: np.ndarray
    nonlinearity: float
    coupling: float
    excitation: Excitation
    noise: np.ndarray


@dataclass
class Experiment:
    """Runs of a plant at one operating point; runs without excitation are kept, and so are the states in which it has settled.

    Close it at the end. With `restored` False each run begins at the start.
    """

    plant: Plant
    point: Mapping[str, Any]
    settle_time: float = 0.0
    restored: bool = True
    grid: float = 0.0
    noise: np.ndarray = field(default_factory=lambda: np.zeros(1))
    """Standard deviation of the outputs' noise at rest; shape (m,)."""
    settling: Settling = field(init=False)
    _still: tuple[float, np.ndarray] | None = None
    _moves: bool = False
    _rests: dict[tuple[float, ...], np.ndarray] = field(default_factory=dict)
    _fails_at_shorter_steps: bool = False

    def __post_init__(self) -> None:
        self.settling = Settling(self.plant.meter)

    def close(self) -> None:
        """Free the states."""
        self.settling.close()

    @property
    def rest(self) -> float:
        """The input's value at rest."""
        return self.plant.rest_value(self.point)

    def find_grid(self, amplitude: float) -> None:
        """Find out whether an FMU moves only in internal steps, and their length [s]: see `on_grid`."""
        for own in self.plant.own_steps:
            step = np.array([[0.0, self.rest + _HALF * amplitude]])
            values = self.plant.run(step, _OWN_STEPS * own, own / _DIVIDED, self.point)[1]
            moved = np.flatnonzero(np.any(np.diff(values, axis=0) != 0.0, axis=1))
            # not one that has come to rest after a few samples: a step that is told may be much longer than all that happens
            if len(moved) > 1 and np.diff(moved).min() >= _DIVIDED - 1:
                self.grid = max(self.grid, own * _JUST_BEFORE)

    def on_grid(self, step: float) -> float:
        """The next multiple of the FMU's internal step; the step itself if it has none [s]."""
        return max(1, math.ceil(step / self.grid - 1e-9)) * self.grid if self.grid else step

    def settle(self, window: float) -> str | None:
        """Find the time until the outputs rest over `window` [s]; a sentence if they do not."""
        moved = np.ones((1, 3))
        for k in range(_MOST_DOUBLINGS + 1):
            settled = (2.0**k - 1.0) * window
            moved = self._stable_motion(settled, window)
            still = moved[:, 0] <= (_AT_REST * moved[:, 1] if k else 1e-9 * moved[:, 2])
            if (still | (self.noise > 0.0)).all():
                self.settle_time = settled
                return None
        self.settle_time = 0.0
        worst = int(np.argmax(moved[:, 0] / np.maximum(moved[:, 1], 1e-300)))
        return (
            f"the plant does not come to rest: without excitation {self.plant.outputs[worst]} still moves by "
            f"{moved[worst, 0]:.3g} {self.plant.units[worst]} in the last {window:g} s of {2.0**_MOST_DOUBLINGS * window:g} s; "
            "responses are differences to that motion"
        )

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
        values = self.plant.run(rest, settled + window, step, self.point, self._divided(step))[1]
        self._note_still(settled + window, values)
        size = np.maximum(np.abs(values).max(axis=0), 1e-300)
        late, early = np.ptp(values[round(settled / step) :], axis=0), np.ptp(values[: round(window / step) + 1], axis=0)
        self.noise = noise_of(values[round(settled / step) :])
        return np.column_stack([late, np.maximum(np.ptp(values, axis=0), 1e-9 * size), size, np.maximum(early, 1e-9 * size)])

    def _divided(self, step: float) -> int:
        """Communication steps in a step of samples: as many as the plant needs to be stable."""
        return max(1, math.ceil(step / self.plant.longest_step - 1e-9))

    def excitation(self, kind: Any, amplitude: float, width: float, grid: float) -> Excitation:
        """An excitation once the plant has settled, at a multiple of the `grid` [s]."""
        start = math.ceil(self.settle_time / grid - 1e-9) * grid
        return Excitation(kind, amplitude, width, start, self.rest, grid)

    def difference(self, excitation: Excitation, step: float, samples: int, substeps: int = 1) -> np.ndarray:
        """Outputs less those without excitation from a step after its end on, shape (samples, m). The end is on the grid.

        Where that fails, shorter communication steps are tried, once for all: see `Plant.longest_step`.
        """
        try:
            return self._difference(excitation, step, samples, substeps)
        except SimulationError:
            before = self.plant.longest_step
            if self.grid or self._fails_at_shorter_steps:
                raise
            for k in range(1, _RETRIES + 1):
                self.plant.longest_step = min(before, step / substeps) * 0.25**k
                try:
                    return self._difference(excitation, step, samples, substeps)
                except SimulationError:
                    continue
            self.plant.longest_step, self._fails_at_shorter_steps = before, True
            raise

    def _difference(self, excitation: Excitation, step: float, samples: int, substeps: int) -> np.ndarray:
        first = round(excitation.end / step) + 1
        stop = (first + samples - 1) * step
        substeps *= self._divided(step)
        key = (step, stop, substeps, excitation.rest)
        unexcited = np.array([[0.0, excitation.rest]])
        if key not in self._rests:
            if len(self._rests) > 8:
                self._rests.clear()
            settled = round(excitation.start / step * substeps) - 1  # the excitation begins with the step after
            self._rests[key] = self._unexcited(key, unexcited, settled)
        rest, system = self._rests[key], self.plant.driven(excitation.table())
        excited = self.settling.excited(key, system, self.plant.driven(unexcited), rest)
        if excited is None:
            excited = self._run(system, stop, step / substeps)
        return np.clip((excited - rest)[::substeps][first : first + samples], -_HUGE, _HUGE)

    def _run(self, system: System, stop: float, step: float) -> np.ndarray:
        with Simulation(system, record=self.plant.outputs) as simulation:
            return self.plant.values(self.plant.simulate(simulation, stop, step, self.point))

    def _unexcited(self, key: tuple[float, ...], table: np.ndarray, settled: int) -> np.ndarray:
        """Outputs at every communication step without excitation; states after `settled` steps are kept where that is worth it."""
        system = self.plant.driven(table)
        step, stop = key[0] / key[2], key[1]
        if self._stands_still(stop):
            assert self._still is not None
            return np.tile(self._still[1], (number_of_rows(stop, step), 1))
        worth = settled >= _WORTH * stop / step and self.restored and self.settling.problem is None
        if worth and SettledRuns.serves(system):
            runs = SettledRuns(system, self.plant.outputs, settled)
            found = self.settling.unexcited(key, runs, lambda: self.plant.values(self.plant.simulate(runs, stop, step, self.point)))
            if found is not None:
                return found
        return self._run(system, stop, step)

    def _stands_still(self, stop: float) -> bool:
        """Whether no output changes by a single bit without excitation: such a run need not be made at every step."""
        if (self._still is None or stop > self._still[0]) and not self._moves:
            step = self.on_grid(_LONGER * stop / _LOOKED)
            longer, rest = step * math.ceil(_LONGER * stop / step - 1e-9), np.array([[0.0, self.rest]])
            self._note_still(longer, self.plant.run(rest, longer, step, self.point, self._divided(step))[1])
        return not self._moves

    def _note_still(self, until: float, values: np.ndarray) -> None:
        self._moves = self._moves or bool((values != values[0]).any())
        if self._still is None or until > self._still[0]:
            self._still = until, values[0]

    def rounding(self) -> np.ndarray:
        """Size of the outputs' rounding errors in the runs without excitation, shape (m,)."""
        sizes = [np.abs(values[:: int(key[2])]).max(axis=0) for key, values in self._rests.items()]
        return 4.0 * np.finfo(float).eps * np.max(sizes, axis=0)

    def respond(self, excitation: Excitation, step: float, samples: int, *, search: bool = True) -> Response:
        """The response at an amplitude that is as large as linearity allows: from the given one down by factors of 10.

        Without `search` at the given amplitude. Raises SimulationError if every amplitude makes the plant fail.
        """
        best: Response | None = None
        failure: SimulationError | None = None
        for k in range(_DECADES if search else 1):
            weaker = replace(excitation, amplitude=excitation.amplitude * 10.0**-k)
            try:
                found = self._halved(weaker, step, samples)
            except SimulationError as error:
                failure = error
                continue
            if best is None or found.nonlinearity < 0.5 * best.nonlinearity:
                best = found
            elif found.nonlinearity > 2.0 * best.nonlinearity:
                break  # rounding and solvers' errors weigh more and more
            if best.nonlinearity <= LINEAR:
                break
        if best is None:
            assert failure is not None
            raise failure
        return best

    def _halved(self, excitation: Excitation, step: float, samples: int) -> Response:
        """The response, and its deviation from proportionality to the response to about half the amplitude.

        Not to half of it: all roundings are the same then, and would not be seen.
        """
        whole = self.difference(excitation, step, samples)
        half = self.difference(replace(excitation, amplitude=_HALF * excitation.amplitude), step, samples)
        # noise is in both, and twice in the run without excitation that is taken from them
        error = np.hypot(_beyond(_rms(whole - half / _HALF), _OF_HALVES * self.noise), self.rounding())
        size = _rms(whole)
        moves = size > 1e-9 * np.max(size, initial=0.0)
        share = float(np.max(error[moves] / size[moves])) if moves.any() else 0.0
        error = np.minimum(error, TOLERATED * size)  # beyond, a finding tells of it, and the fit shall see the response
        time = step * np.arange(samples)
        return Response(time, whole, error, share, 0.0, excitation, math.sqrt(2.0) * self.noise)

    def converged(self, found: Response, step: float) -> Response:
        """The response with communication steps so short that they do not matter, by halving and Richardson's extrapolation."""
        samples, substeps, order, rises = len(found.values), 1, 0, 0
        coarse, previous = found.values, math.inf
        best, least, share = found.values, math.inf, 1.0
        most = _MOST_SUBSTEPS / self._divided(step)
        while not self.grid and substeps < most and rises < _MOST_RISES:
            if substeps == 1 and not self.plant.coupled and self._is_same_halved(found, step):
                return found  # an FMU alone, as most are: its own steps do not matter
            substeps *= 2
            fine = self.difference(found.excitation, step, samples, substeps)
            if max(np.abs(fine).max(), np.abs(coarse).max()) >= _HUGE:  # so coarse a step makes it diverge
                coarse = fine
                continue
            moved = _beyond(_rms(fine - coarse), _OF_STEPS * self.noise)
            change = float(np.max(moved / np.maximum(_rms(fine), 1e-300)))
            order = round(math.log2(previous / change)) if 0.0 < change < previous < math.inf else 0
            gain = 1.0 / (2.0**order - 1.0) if order in (1, 2) else 0.0
            rises = rises + 1 if least <= change < 1.0 else 0
            if change < least:
                best, least, share = fine + gain * (fine - coarse), change, 0.1 if gain else 1.0
            if least < _COUPLING:
                break
            coarse, previous = fine, change
        if np.abs(best).max() >= _HUGE:
            raise SimulationError(
                f"the response grows beyond {_HUGE:g} with communication steps of {step / substeps:.3g} s, too: the plant, or the "
                "coupling of its FMUs, is unstable"
            )
        change = 0.0 if math.isinf(least) else least
        known = found.error * _rms(best) / np.maximum(_rms(found.values), 1e-300)  # too coarse a response may be far too large
        error = np.hypot(known, share * change * _rms(best))
        return replace(found, values=best, error=error, coupling=share * change)

    def _is_same_halved(self, found: Response, step: float) -> bool:
        """Whether the first half of a response stays at half the communication step."""
        samples = len(found.values) // 2
        fine, coarse = self.difference(found.excitation, step, samples, 2), found.values[:samples]
        return bool((_rms(fine - coarse) < _HALF_COUPLING * np.maximum(_rms(fine), 1e-300)).all())


def number_of_rows(stop: float, step: float) -> int:
    """Of a run with steps of this length."""
    return round(stop / step) + 1


def _beyond(sizes: np.ndarray, noise: np.ndarray) -> np.ndarray:
    """What exceeds noise, in the mean square."""
    return np.sqrt(np.maximum(0.0, sizes**2 - noise**2))


def _is_calmer(fine: np.ndarray, coarse: np.ndarray) -> bool:
    """Whether what grew at a coarse step grows much less at a fine one."""
    grown = coarse[:, 0] > _GROWING * coarse[:, 3]
    return bool((fine[grown, 0] * coarse[grown, 3] < 0.7 * coarse[grown, 0] * fine[grown, 3]).all())


def _rms(values: np.ndarray) -> np.ndarray:
    return np.sqrt(np.mean(values * values, axis=0))
