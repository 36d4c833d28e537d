"""Verification: simulates the plant with an InputShaper over a range of its parameters.

The residual is half the peak-to-peak value of an output from the last change of the command on, for one and a half periods of the
slowest mode; that of the shaped command over that of the unshaped one is compared with the tolerance. It is measured, not derived:
nonlinearity, and whatever the identified modes miss, is in it. Outputs must settle, and rest before the step: a drift and motion
from before would count as vibration. Communication steps are halved until they do not matter, be it for the coupling of FMUs or for
solvers that take them for their own.
"""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any

from shaper_fmu.errors import ArgumentError
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
from shaper_fmu.tune.verification.worst_case import WorstCase


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
    return verified_runs(runs, outputs, spread, tolerance, slow)


def verified_runs(
    runs: ShapedRuns, outputs: Sequence[str], spread: Mapping[str, float], tolerance: float, slow: SlowPart | None
) -> Verification:
    """The verification with these runs; see `verify`."""
    nominals = runs.nominals(spread)
    runs.look_at_rest(runs.raw({}))
    first = runs.settled()
    runs.check_rest(first)
    change = runs.refine(first)
    search = WorstCase(runs, nominals, spread)
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
    units = [runs.plant.display_unit(name) for name in outputs]
    return Verification(**{**vars(found), "reason": _reason(found, spread, units)})


def _reason(found: Verification, spread: Mapping[str, float], units: Sequence[tuple[str, float]]) -> str:
    """The verification in words, with amplitudes in the units for people, of which each output's name and factor are given."""
    over = " and ".join(f"{name} +-{100.0 * share:.3g} %" for name, share in spread.items()) or "the nominal parameters"
    worst = found.worst
    where = ", ".join(f"{name} = {value:.4g}" for name, value in worst.values.items())
    sizes = [
        f"{name} {abs(factor) * a:.3g} before, {f'{abs(factor) * b:.3g} {unit}'.rstrip()} after"
        for name, a, b, (unit, factor) in zip(found.outputs, worst.before, worst.after, units, strict=True)
    ]
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
