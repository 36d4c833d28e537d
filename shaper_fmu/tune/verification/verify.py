"""Verification: simulates the plant with an InputShaper over a range of its parameters.

The residual is half the peak-to-peak value of an output from the last change of the command on, for one and a half periods of the
slowest mode; that of the shaped command over that of the unshaped one is compared with the tolerance. It is measured, not derived:
nonlinearity, and whatever the identified modes miss, is in it. Outputs must settle, and rest before the step: a drift and motion
from before would count as vibration. Communication steps are halved until they do not matter, be it for the coupling of FMUs or for
solvers that take them for their own.
"""

from __future__ import annotations

import itertools
import math
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np

from shaper_fmu.errors import ArgumentError, ComponentError, SimulationError
from shaper_fmu.master.fmu import Fmu
from shaper_fmu.master.system import System
from shaper_fmu.tune.choice.boxes import ModeBox
from shaper_fmu.tune.choice.choice import Candidate
from shaper_fmu.tune.meter import BudgetError
from shaper_fmu.tune.plant import Plant
from shaper_fmu.tune.verification.command import Command
from shaper_fmu.tune.verification.move import MoveCommand
from shaper_fmu.tune.verification.runs import STAYS, ShapedRuns
from shaper_fmu.tune.verification.shares import Measured
from shaper_fmu.tune.verification.swing import SlowPart

_POINTS = {1: 9, 2: 5}
_FEWEST_POINTS = 3
_LITTLE = 0.2
"""Of what a share may change by: a search ends where there is no more to gain."""
_FINEST = 1.0 / 128.0
_MOST_SEARCHED = 80


@dataclass(frozen=True)
class Verification:
    """The result of the verification.

    Attributes:
        outputs: names.
        nominal: with the parameters' nominal values.
        worst: where the share is largest, of all points and the local search from there.
        points: all that was simulated.
        failed: parameters at which the plant could not be run, and why.
        tolerance: of the share.
        reason: the result as a sentence.
        step: communication step of all runs [s].
        step_change: by how much halving the step to this one has changed a share at the nominal point.
        doubt: what noise may hide of a share, at most over all points.
        noise: standard deviation of each output's noise, in its unit; 0 without.
        subtracted: whether the motion without a command was taken away from the others, as the plant is linear.
        slow: what was separated from the vibration, in words; "" for nothing.
    """

    outputs: tuple[str, ...]
    nominal: Measured
    worst: Measured
    points: tuple[Measured, ...]
    failed: tuple[tuple[Mapping[str, float], str], ...]
    tolerance: float
    reason: str
    step: float = math.nan
    step_change: float = 0.0
    doubt: float = 0.0
    noise: tuple[float, ...] = ()
    subtracted: bool = False
    slow: str = ""

    @property
    def uncertainty(self) -> float:
        """Of all shares: what noise may hide, and where the communication step still matters, what halving it has changed."""
        return self.doubt + (self.step_change if self.step_change > STAYS * self.tolerance else 0.0)

    @property
    def holds(self) -> bool:
        """Whether the share is within the tolerance, with its uncertainty, at every place; not where the plant failed at one."""
        return self.worst.share + self.uncertainty <= self.tolerance and not self.failed


def verify(
    source: Plant | System | Fmu | Path | str,
    input: str,
    outputs: Sequence[str],
    candidate: Candidate,
    boxes: Sequence[ModeBox],
    spread: Mapping[str, float],
    *,
    tolerance: float = 0.05,
    command: Command | MoveCommand | None = None,
    start_values: Mapping[str, Any] | None = None,
    slow: SlowPart | None = None,
) -> Verification:
    """Simulate a command, shaped and unshaped, over a range of parameters, and search the worst case.

    Args:
        source: a `Plant`, an FMU, or a system whose `input` is free; in a system, names are "instance.variable".
        outputs: real outputs that settle.
        candidate: whose shaper stands before the input.
        boxes: the modes, for step sizes and durations.
        spread: parameters of the plant and by which share each one varies: 0.1 for +-10 % of its start value.
        tolerance: of the share of the unshaped residual.
        command: after which the plant rests but for vibration; a step of 1 at the time 0 by default. For a move `move_command`.
        start_values: of an FMU given alone.
        slow: poles of the modes and of what is no vibration, which is separated; None to take all motion for vibration.

    All corners and points in between (9 for one parameter, 5 x 5 for two, 3 for each of more) are simulated, then a compass
    search goes on from the worst one. The communication step is halved at the nominal point until no share changes by more than a
    thousandth of the tolerance. Raises ArgumentError for a move's profile and for outputs that do not vibrate, settle or rest
    before the step, ModelError for wrong names and parameters, BudgetError
    where the plant's budget is spent, SimulationError if the plant cannot be run nominally.
    """
    if (candidate.profile is not None) != isinstance(command, MoveCommand):
        raise ArgumentError(f"{candidate.name}: a move's profile needs a `move_command`, and a shaper alone needs none")
    plant = Plant.of(source, input, outputs, start_values)
    runs = ShapedRuns(plant, outputs, candidate, boxes, tolerance, command or Command(), slow)
    nominals = runs.nominals(spread)
    runs.look_at_rest(runs.raw({}))
    first = runs.settled()
    runs.check_rest(first)
    change = runs.refine(first)
    search = _Worst(runs, nominals, spread)
    nominal = search.measured((0.0,) * len(spread), needed=True)
    assert nominal is not None  # else the error was raised
    try:
        search.grid()
        search.compass()
    except BudgetError as error:
        most = max(one.share for one in search.points.values())
        seen = f"{len(search.points)} points were simulated before; the worst of them leaves {100.0 * most:.3g} %"
        raise BudgetError(f"{error}. {seen}") from None
    worst = max(search.points.values(), key=lambda one: one.share)
    found = Verification(
        tuple(outputs), nominal, worst, tuple(search.points.values()), tuple(search.failed), tolerance, "",
        runs.step, change, max(one.doubt for one in search.points.values()), tuple(runs.noise.tolist()), runs.subtracted,
        slow.text if slow is not None and slow.moves else "",
    )  # fmt: skip
    return Verification(**{**vars(found), "reason": _reason(found, spread)})


class _Worst:
    """A search for the largest share, over places in [-1, 1]^n."""

    def __init__(self, runs: ShapedRuns, nominals: Mapping[str, float], spread: Mapping[str, float]):
        self._runs, self._nominals, self._spread = runs, nominals, spread
        self.points: dict[tuple[float, ...], Measured] = {}
        self.failed: list[tuple[Mapping[str, float], str]] = []
        self._tried: set[tuple[float, ...]] = set()

    def measured(self, place: tuple[float, ...], needed: bool = False) -> Measured | None:
        """The measured shares at a point; None if the plant could not be run."""
        if place in self._tried:
            return self.points.get(place)
        self._tried.add(place)
        values = {
            name: value * (1.0 + x * self._spread[name]) for (name, value), x in zip(self._nominals.items(), place, strict=True)
        }
        try:
            found = self._runs.measured(values)
            self._runs.check_rest(found)
        except (SimulationError, ComponentError) as error:
            if needed:
                raise
            self.failed.append((values, str(error)))
            return None
        self.points[place] = found
        return self.points[place]

    def grid(self) -> None:
        """Corners and points between them."""
        count = _POINTS.get(len(self._spread), _FEWEST_POINTS)
        for place in itertools.product(np.linspace(-1.0, 1.0, count).tolist(), repeat=len(self._spread)):
            self.measured(place)

    def compass(self) -> None:
        """From the worst place on to the worst of its neighbours, with ever smaller steps, as long as these can matter."""
        place = max(self.points, key=lambda one: self.points[one].share)
        step, begun = 0.5, len(self._tried)
        spacing = 2.0 / (_POINTS.get(len(self._spread), _FEWEST_POINTS) - 1)
        while step >= _FINEST and len(self._tried) - begun < _MOST_SEARCHED and place:
            around = [(near, self.measured(near)) for near in _neighbours(place, step)]
            better = [(found.share, near) for near, found in around if found is not None and found.share > self.points[place].share]
            if better:
                place = max(better)[1]
            elif step < spacing and self._to_gain(place, step) <= _LITTLE * STAYS * self._runs.tolerance:
                break
            else:
                step *= 0.5

    def _to_gain(self, place: tuple[float, ...], step: float) -> float:
        """What the parabolas through a place and two of its neighbours on each axis, both sides or two on one, rise above it."""
        gain = 0.0
        for k, at in enumerate(place):
            inside = [x for x in (at - step, at + step) if -1.0 <= x <= 1.0]
            inside = inside if len(inside) > 1 else [inside[0], 2.0 * inside[0] - at]
            seen = [self.points.get((*place[:k], x, *place[k + 1 :])) for x in inside]
            if None in seen:
                return math.inf
            shares = [self.points[place].share, *(one.share for one in seen if one is not None)]
            gain = max(gain, _rise([0.0, *(x - at for x in inside)], shares))
        return gain


def _neighbours(place: tuple[float, ...], step: float) -> Iterator[tuple[float, ...]]:
    for k, sign in itertools.product(range(len(place)), (-1.0, 1.0)):
        yield (*place[:k], min(1.0, max(-1.0, place[k] + sign * step)), *place[k + 1 :])


def _rise(places: Sequence[float], values: Sequence[float]) -> float:
    """How much the parabola through three points rises above the first one, between the outer ones."""
    second, first, level = np.polyfit(places, values, 2)
    if second >= 0.0:
        return 0.0
    top = min(max(-0.5 * first / second, min(places)), max(places))
    return float(max(0.0, (second * top + first) * top + level - values[0]))


def _reason(found: Verification, spread: Mapping[str, float]) -> str:
    over = " and ".join(f"{name} +-{100.0 * share:.3g} %" for name, share in spread.items()) or "the nominal parameters"
    worst = found.worst
    where = ", ".join(f"{name} = {value:.4g}" for name, value in worst.values.items())
    sizes = [f"{name} {a:.3g} before, {b:.3g} after" for name, a, b in zip(found.outputs, worst.before, worst.after, strict=True)]
    verdict = "holds" if found.holds else "does not hold" if worst.share > found.tolerance else "is not shown to hold"
    text = (
        f"over {over} the shaped plant leaves at most {100.0 * worst.share:.3g} % of the unshaped vibration"
        f"{f' (at {where})' if where else ''}, nominally {100.0 * found.nominal.share:.3g} %: the tolerance of "
        f"{100.0 * found.tolerance:.3g} % {verdict}. Half peak to peak there: {'; '.join(sizes)}"
    )
    if found.slow:
        text += f". The vibration is the swing around the slow part ({found.slow}), which is none"
    if found.subtracted:
        text += ". The plant moves without a command; that motion was taken away from the others, since it is linear"
    if any(found.noise):
        sizes = ", ".join(f"{name} {size:.2g}" for name, size in zip(found.outputs, found.noise, strict=True) if size > 0.0)
        text += (
            f". Noise (standard deviation: {sizes}) is no vibration; it may hide {100.0 * found.doubt:.2g} % of the unshaped one, "
            "which is counted"
        )
    if found.uncertainty > found.doubt:
        text += (
            f". The communication step still matters: halving it to {found.step:.3g} s changes the nominal share by "
            f"{100.0 * found.step_change:.2g} %"
        )
    if found.failed:
        text += f". At {len(found.failed)} other places the plant could not be run; the first: {found.failed[0][1]}"
    return text
