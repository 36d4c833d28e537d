"""Verification in the loop: the plant behind an InputShaper is simulated over a range of its parameters.

The residual is half the peak-to-peak value of an output from the last change of the command on, for one and a half periods of the
slowest mode; that of the shaped command over that of the unshaped one is compared with the tolerance. It is measured, not derived:
nonlinearity, and whatever the identified modes miss, is in it. Outputs must settle: a drift would count as vibration.
"""

from __future__ import annotations

import itertools
import math
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path
from types import TracebackType
from typing import Any

import numpy as np

from shaper_fmu.errors import ComponentError, ModelError, SimulationError
from shaper_fmu.export.build import fmu_path
from shaper_fmu.master.fmu import Fmu
from shaper_fmu.master.metrics import Residual
from shaper_fmu.master.simulation import Simulation
from shaper_fmu.master.system import System
from shaper_fmu.tune.boxes import ModeBox
from shaper_fmu.tune.choice import Candidate
from shaper_fmu.tune.experiment_plant import alone_system, copied

SHAPER = "input_shaper"
"""Name of the shaper's instance."""
_STEPS_PER_PERIOD = 160
"""Of the fastest mode: a sine's peak is missed by 2e-4 at most."""
_PERIODS = 1.5
_POINTS = {1: 9, 2: 5}
_MOST_PARAMETERS = 5
_FINEST = 1.0 / 128.0
_MOST_SEARCHED = 80
_GROWN = 1.4
_QUIET = 1e-9
"""Share of the liveliest output's residual below which an output does not vibrate."""


@dataclass(frozen=True)
class Measured:
    """Residuals at one set of parameters.

    Attributes:
        values: of the parameters that were varied, by name.
        before, after: residual of each output without and with the shaper, in its unit.
        share: the largest after / before, of the outputs that vibrate.
    """

    values: Mapping[str, float]
    before: tuple[float, ...]
    after: tuple[float, ...]
    share: float


@dataclass(frozen=True)
class Verification:
    """What simulations have shown.

    Attributes:
        outputs: names.
        nominal: with the parameters' nominal values.
        worst: where the share is largest, of all points and the local search from there.
        points: all that was simulated.
        failed: parameters at which the plant could not be run, and why.
        tolerance: of the share.
        reason: all this in words.
    """

    outputs: tuple[str, ...]
    nominal: Measured
    worst: Measured
    points: tuple[Measured, ...]
    failed: tuple[tuple[Mapping[str, float], str], ...]
    tolerance: float
    reason: str

    @property
    def holds(self) -> bool:
        """Whether the share is within the tolerance wherever it was simulated."""
        return self.worst.share <= self.tolerance and not self.failed


def verify(
    source: System | Fmu | Path | str,
    input: str,
    outputs: Sequence[str],
    candidate: Candidate,
    boxes: Sequence[ModeBox],
    spread: Mapping[str, float],
    *,
    tolerance: float = 0.05,
    amplitude: float = 1.0,
    rest: float = 0.0,
    settle_time: float = 0.0,
    start_values: Mapping[str, Any] | None = None,
) -> Verification:
    """Simulate a step of the command, shaped and unshaped, over a range of parameters, and search the worst case.

    Args:
        source: an FMU, or a system whose `input` is free; in a system, names are "instance.variable".
        outputs: real outputs that settle.
        candidate: whose shaper stands before the input.
        boxes: the modes, for step sizes and durations.
        spread: parameters of the plant and by which share each one varies: 0.1 for +-10 % of its start value.
        tolerance: of the share of the unshaped residual.
        amplitude, rest: of the command's step, and the input's value before it, in the input's unit.
        settle_time: until the plant rests, and the step comes [s].
        start_values: of an FMU given alone.

    All corners and points in between (9 for one parameter, 5 x 5 for two, 3 for each of more) are simulated, then a compass
    search goes on from the worst one. Raises ComponentError for a move's profile, ModelError for wrong names and parameters,
    SimulationError if the plant cannot be run with its nominal parameters.
    """
    if candidate.profile is not None:
        raise ComponentError(f"{candidate.name}: a move's profile is no shaper; simulate a MotionProfile instead")
    with _Runs(source, input, outputs, candidate, boxes, start_values or {}, (rest, amplitude, settle_time)) as runs:
        nominals = runs.nominals(spread)
        search = _Worst(runs, nominals, spread)
        nominal = search.measured((0.0,) * len(spread), needed=True)
        assert nominal is not None  # else the error was raised
        runs.check_settling(nominal.before)
        search.grid()
        search.compass()
    worst = max(search.points.values(), key=lambda one: one.share)
    found = Verification(
        tuple(outputs), nominal, worst, tuple(search.points.values()), tuple(search.failed), tolerance, ""
    )  # fmt: skip
    return Verification(**{**vars(found), "reason": _words(found, spread)})


class _Runs:
    """The plant with the shaper, and without, to be run again and again."""

    def __init__(
        self, source: Any, input: str, outputs: Sequence[str], candidate: Candidate, boxes: Sequence[ModeBox],
        start_values: Mapping[str, Any], command: tuple[float, float, float],
    ):  # fmt: skip
        self.alone = not isinstance(source, System)
        self._plant = copied(source) if isinstance(source, System) else alone_system(source, start_values)
        if SHAPER in self._plant.fmus:
            raise ModelError([f"the system has an instance {SHAPER} of its own; give it another name"])
        self._input, self.outputs = self.full(input), [self.full(name) for name in outputs]
        slowest = 2.0 * math.pi / min(box.natural_frequency.low for box in boxes)
        self._step = 2.0 * math.pi / max(box.natural_frequency.high for box in boxes) / _STEPS_PER_PERIOD
        self._window, (self._rest, self._amplitude, self._settled) = _PERIODS * slowest, command
        self._delays = {"before": 0.0, "after": candidate.delay}
        self._simulations: dict[str, Simulation] = {}
        try:
            for case, values in (("before", {"shaper": "none"}), ("after", candidate.start_values())):
                system = self._wired(values)
                metrics = {name: Residual(name, f"{SHAPER}.shaped") for name in self.outputs}
                self._simulations[case] = Simulation(system, record=[], metrics=metrics)
        except BaseException:
            self.close()
            raise

    def __enter__(self) -> _Runs:
        return self

    def __exit__(self, kind: type[BaseException] | None, error: BaseException | None, trace: TracebackType | None) -> None:
        self.close()

    def close(self) -> None:
        """Free the instances."""
        for simulation in self._simulations.values():
            simulation.close()

    def full(self, name: str) -> str:
        """A name with its instance."""
        return f"plant.{name}" if self.alone and not name.startswith("plant.") else name

    def nominals(self, spread: Mapping[str, float]) -> dict[str, float]:
        """Nominal values of the parameters; raises ModelError for what cannot be varied."""
        if len(spread) > _MOST_PARAMETERS:
            raise ModelError([f"{len(spread)} parameters are to be varied; limit: {_MOST_PARAMETERS}"])
        found, problems = {}, []
        for name, share in spread.items():
            instance, variable = self._plant.split(self.full(name))
            told: Any = self._plant.start_values[instance].get(
                variable, self._plant.fmus[instance].variable(variable, "parameter").start
            )
            try:
                found[name] = float(told)
            except (TypeError, ValueError):
                problems.append(f"{name} has no start value that is a number; give it one")
            if not 0.0 <= share < math.inf or (found.get(name) == 0.0):
                problems.append(f"{name} = {told} cannot vary by +-{share:g} of it")
        if problems:
            raise ModelError(problems)
        return found

    def residuals(self, values: Mapping[str, float]) -> tuple[list[float], list[float]]:
        """Residuals before and after, of each output. Raises SimulationError."""
        found = []
        for case, simulation in self._simulations.items():
            stop = self._settled + self._delays[case] + self._window
            given = {self.full(name): value for name, value in values.items()}
            metrics = simulation.run(stop, self._step, start_values=given).metrics
            found.append([float(metrics[name]) for name in self.outputs])
        return found[0], found[1]

    def check_settling(self, before: Sequence[float]) -> None:
        """Raise ComponentError for outputs whose motion after the unshaped step goes on growing: a drift is no vibration."""
        metrics = self._simulations["before"].run(self._settled + 2.0 * self._window, self._step).metrics
        drifting = [n for n, known in zip(self.outputs, before, strict=True) if metrics[n] > _GROWN * known]
        if drifting:
            raise ComponentError(
                f"{', '.join(drifting)} does not settle after a step of {self._input}: in {2.0 * self._window:.3g} s it moves over "
                f"{_GROWN:g} times as far as in {self._window:.3g} s; name outputs that settle, such as a deflection"
            )

    def _wired(self, values: Mapping[str, Any]) -> System:
        system = copied(self._plant)
        instance, variable = system.split(self._input)
        system.start_values[instance].pop(variable, None)
        system.add(SHAPER, fmu_path("InputShaper"), values, initial_command=self._rest)
        system.connect(f"{SHAPER}.shaped", self._input)
        step = [[0.0, self._rest], [self._settled, self._rest + self._amplitude]]
        system.drive(f"{SHAPER}.command", np.array(step if self._settled > 0.0 else step[1:]))
        return system


class _Worst:
    """A search for the largest share, over places in [-1, 1]^n."""

    def __init__(self, runs: _Runs, nominals: Mapping[str, float], spread: Mapping[str, float]):
        self._runs, self._nominals, self._spread = runs, nominals, spread
        self.points: dict[tuple[float, ...], Measured] = {}
        self.failed: list[tuple[Mapping[str, float], str]] = []
        self._tried: set[tuple[float, ...]] = set()

    def measured(self, place: tuple[float, ...], needed: bool = False) -> Measured | None:
        """What is measured at a place; None where the plant could not be run."""
        if place in self._tried:
            return self.points.get(place)
        self._tried.add(place)
        values = {
            name: value * (1.0 + x * self._spread[name]) for (name, value), x in zip(self._nominals.items(), place, strict=True)
        }
        try:
            before, after = self._runs.residuals(values)
        except SimulationError as error:
            if needed:
                raise
            self.failed.append((values, str(error)))
            return None
        shares = [b / a if a > _QUIET * max(before) else math.nan for a, b in zip(before, after, strict=True)]
        if all(math.isnan(share) for share in shares):
            raise SimulationError(f"no output vibrates after the unshaped step: {', '.join(self._runs.outputs)}")
        self.points[place] = Measured(values, tuple(before), tuple(after), max(s for s in shares if not math.isnan(s)))
        return self.points[place]

    def grid(self) -> None:
        """Corners and what is between them."""
        count = _POINTS.get(len(self._spread), 3)
        for place in itertools.product(np.linspace(-1.0, 1.0, count).tolist(), repeat=len(self._spread)):
            self.measured(place)

    def compass(self) -> None:
        """From the worst place on to the worst of its neighbours, with ever smaller steps."""
        place = max(self.points, key=lambda one: self.points[one].share)
        step, begun = 0.5, len(self._tried)
        while step >= _FINEST and len(self._tried) - begun < _MOST_SEARCHED and place:
            around = [(near, self.measured(near)) for near in _neighbours(place, step)]
            better = [(found.share, near) for near, found in around if found is not None and found.share > self.points[place].share]
            if better:
                place = max(better)[1]
            else:
                step *= 0.5


def _neighbours(place: tuple[float, ...], step: float) -> Iterator[tuple[float, ...]]:
    for k, sign in itertools.product(range(len(place)), (-1.0, 1.0)):
        yield (*place[:k], min(1.0, max(-1.0, place[k] + sign * step)), *place[k + 1 :])


def _words(found: Verification, spread: Mapping[str, float]) -> str:
    over = " and ".join(f"{name} +-{100.0 * share:.3g} %" for name, share in spread.items()) or "the nominal parameters"
    worst = found.worst
    where = ", ".join(f"{name} = {value:.4g}" for name, value in worst.values.items())
    sizes = [f"{name} {a:.3g} before, {b:.3g} after" for name, a, b in zip(found.outputs, worst.before, worst.after, strict=True)]
    verdict = "holds" if worst.share <= found.tolerance else "does not hold"
    text = (
        f"over {over} the shaped plant leaves at most {100.0 * worst.share:.3g} % of the unshaped vibration"
        f"{f' (at {where})' if where else ''}, nominally {100.0 * found.nominal.share:.3g} %: the tolerance of "
        f"{100.0 * found.tolerance:.3g} % {verdict}. Half peak to peak there: {'; '.join(sizes)}"
    )
    if found.failed:
        text += f". At {len(found.failed)} other places the plant could not be run; the first: {found.failed[0][1]}"
    return text
