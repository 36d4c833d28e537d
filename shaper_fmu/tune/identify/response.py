"""Responses to excitations at an operating point: amplitude in the linear range, step size."""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass, field, replace
from typing import Any

import numpy as np

from shaper_fmu.errors import SimulationError
from shaper_fmu.master.system import System
from shaper_fmu.tune.identify.excitation import Excitation
from shaper_fmu.tune.identify.state import SettledRuns, Settling
from shaper_fmu.tune.identify.unexcited import LESS, Unexcited
from shaper_fmu.tune.kept_runs import run_key

LINEAR = 1e-4
"""Nonlinearity that is small enough, where it can be had."""
TOLERATED = 0.02
"""Nonlinearity from which on the plant is called too nonlinear."""
_HUGE = 1e100
_DECADES = 9
_STUCK = 0.1
"""Of the response for its excitation, what a weaker one leaves where the plant sticks."""
_COUPLING = 1e-5
_HALF_COUPLING = 0.5 * _COUPLING
"""Of the first half of a response: what errs by each step has erred half as much there."""
_MOST_SUBSTEPS = 256
_MOST_RISES = 2
"""Halvings that may make it worse: solvers of FMUs err with each step, so that shorter ones need not be better."""
_SURELY = 1.15
_OF_HALVES = _SURELY * math.sqrt(1.0 + LESS**-2 + (1.0 - 1.0 / LESS) ** 2)
_OF_STEPS = _SURELY * 2.0
"""What noise makes of differences, in standard deviations, with what it may be more by chance."""
_RETRIES = 3
"""Quarterings of the communication step, where an excited plant fails."""
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
class Experiment(Unexcited):
    """Runs of a plant at one operating point; runs without excitation are kept, and so are the states in which it has settled.

    Close it at the end.
    """

    settling: Settling = field(init=False)
    _rests: dict[tuple[float, ...], np.ndarray] = field(default_factory=dict)
    _stateless: tuple[tuple[float, ...], SettledRuns] | None = None
    """The last run without excitation, to be made again if states of it are needed, since only its outputs were kept."""
    _fails_at_shorter_steps: bool = False

    def __post_init__(self) -> None:
        self.settling = Settling(self.plant.meter)

    def close(self) -> None:
        """Free the states."""
        self.settling.close()

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
        substeps *= self.divided(step)
        key = (step, stop, substeps, excitation.rest)
        unexcited = np.array([[0.0, excitation.rest]])
        if key not in self._rests:
            if len(self._rests) > 8:
                self._rests.clear()
            settled = round(excitation.start / step * substeps) - 1  # the excitation begins with the step after
            self._rests[key] = self._unexcited(key, unexcited, settled)
        rest, system = self._rests[key], self.plant.driven(excitation.table())
        excited = self._from_states(key, system, unexcited, rest)
        if excited is None:
            excited = self._run(system, stop, step / substeps)
        return np.clip((excited - rest)[::substeps][first : first + samples], -_HUGE, _HUGE)

    def _run(self, system: System, stop: float, step: float) -> np.ndarray:
        return self.plant.values(self.plant.made(system, self.plant.outputs, stop, step, self.point))

    def _unexcited(self, key: tuple[float, ...], table: np.ndarray, settled: int) -> np.ndarray:
        """Outputs at every communication step without excitation; states after `settled` steps are kept where that is worth it."""
        system = self.plant.driven(table)
        step, stop, self._stateless = key[0] / key[2], key[1], None
        if self.stands_still(stop):
            assert self._still is not None
            return np.tile(self._still[1], (number_of_rows(stop, step), 1))
        worth = settled >= _WORTH * stop / step and self.restored and self.settling.problem is None
        if worth and SettledRuns.serves(system):
            runs = SettledRuns(system, self.plant.outputs, settled)
            kept = self._kept(system, key, "at rest") if self.plant.kept else None
            if kept is not None:
                self.settling.close()
                self._stateless = key, runs
                return kept
            return self._saving(key, runs, system)
        return self._run(system, stop, step)

    def _saving(self, key: tuple[float, ...], runs: SettledRuns, system: System) -> np.ndarray:
        """Outputs without excitation, of a run in which states are saved, if they can be."""
        step, stop = key[0] / key[2], key[1]
        found = self.settling.unexcited(key, runs, lambda: self.plant.values(self.plant.simulate(runs, stop, step, self.point)))
        if found is None:
            return self._run(system, stop, step)
        self._keep(system, key, "at rest", found)
        return found

    def _from_states(self, key: tuple[float, ...], system: System, unexcited: np.ndarray, rest: np.ndarray) -> np.ndarray | None:
        """Outputs with the excitation in a system, from the states saved on the way of the run without it; None without states.

        Where such a run is kept but the states are not, which end with the process, that without excitation is made again.
        """
        stateless, still = self._stateless, self.plant.driven(unexcited)
        if stateless is not None and stateless[0] != key:
            self._stateless = None
        if self.plant.kept is not None and (self._stateless is not None or self.settling.holds(key)):
            kept = self._kept(system, key, "excited")
            if kept is not None:
                return kept
        if self._stateless is not None:
            runs, self._stateless = self._stateless[1], None
            self._saving(key, runs, still)
        found = self.settling.excited(key, system, still, rest)
        if found is not None:
            self._keep(system, key, "excited", found)
        return found

    def _kept(self, system: System, *key: Any) -> np.ndarray | None:
        assert self.plant.kept is not None
        known = self.plant.kept.found(self._key(system, key))
        return known[0] if known is not None else None

    def _keep(self, system: System, *key_and_values: Any) -> None:
        if self.plant.kept is not None:
            *key, values = key_and_values
            self.plant.kept.keep(self._key(system, key), values)

    def _key(self, system: System, key: Sequence[Any]) -> str:
        return run_key(system, self.plant.outputs, sorted(self.plant.checked_point(self.point).items()), *key)

    def rounding(self) -> np.ndarray:
        """Size of the outputs' rounding errors in the runs without excitation, shape (m,)."""
        sizes = [np.abs(values[:: int(key[2])]).max(axis=0) for key, values in self._rests.items()]
        return 4.0 * np.finfo(float).eps * np.max(sizes, axis=0)

    def respond(self, excitation: Excitation, step: float, samples: int, *, search: bool = True) -> Response:
        """The response at an amplitude that is as large as linearity allows: from the given one down by factors of 10.

        Not one at which the plant sticks: in friction, a dead zone or an encoder's step no output moves by more than a tenth of
        what its response to more would be in proportion, and that is no linear motion. Without `search` at the given amplitude.
        Raises SimulationError if every amplitude makes the plant fail.
        """
        best: Response | None = None
        most = np.zeros(len(self.plant.outputs))
        failure: SimulationError | None = None
        for k in range(_DECADES if search else 1):
            weaker = replace(excitation, amplitude=excitation.amplitude * 10.0**-k)
            try:
                found = self._halved(weaker, step, samples)
            except SimulationError as error:
                failure = error
                continue
            gain = _rms(found.values) / abs(weaker.amplitude)
            if best is not None and (gain < _STUCK * most)[most > 0.0].all():
                break
            most = np.maximum(most, gain)
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
        half = self.difference(replace(excitation, amplitude=LESS * excitation.amplitude), step, samples)
        # noise is in both, and twice in the run without excitation that is taken from them
        error = np.hypot(_beyond(_rms(whole - half / LESS), _OF_HALVES * self.noise), self.rounding())
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
        most = _MOST_SUBSTEPS / self.divided(step)
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


def _rms(values: np.ndarray) -> np.ndarray:
    return np.sqrt(np.mean(values * values, axis=0))
