"""Verification of several inputs: all commands at once, each behind its own shaper.

A mode that one input excites is seen in all outputs, and what two inputs excite may cancel, or add up. So the commands are given
with all signs, and the largest residual over the signs counts, shaped and unshaped. For a linear plant the unshaped one is at least
that of each input alone: half the peak-to-peak value of a sum or of the difference is no less than that of each term.
"""

from __future__ import annotations

import itertools
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Any

from shaper_fmu.errors import ArgumentError
from shaper_fmu.export.build import fmu_path
from shaper_fmu.master.system import System
from shaper_fmu.tune.choice.boxes import ModeBox
from shaper_fmu.tune.choice.search import Candidate
from shaper_fmu.tune.plant import Plant
from shaper_fmu.tune.verification.command import Case, Command
from shaper_fmu.tune.verification.commanded import CommandedRuns
from shaper_fmu.tune.verification.runs import ShapedRuns
from shaper_fmu.tune.verification.shares import Measured
from shaper_fmu.tune.verification.swing import SlowPart
from shaper_fmu.tune.verification.verify import Verification, verified_runs

MOST_INPUTS = 4
"""Of one verification: there are 2^(n - 1) signs."""
_UNSHAPED: Mapping[str, Any] = {"shaper": "none"}


@dataclass(frozen=True)
class Shaped:
    """An input with its command and its shaper.

    Attributes:
        plant: with this input.
        command: that leaves the plant at rest.
        candidate: whose shaper stands before the input; None for none.
    """

    plant: Plant
    command: Command
    candidate: Candidate | None

    @property
    def end(self) -> float:
        """When its shaped command has ended [s]."""
        return self.command.end + (self.candidate.delay if self.candidate is not None else 0.0)

    @property
    def start_values(self) -> Mapping[str, Any]:
        """Of its InputShaper."""
        return self.candidate.start_values() if self.candidate is not None else _UNSHAPED


@dataclass(frozen=True)
class CommandsTogether:
    """The commands of all inputs, with these signs. See `Command`."""

    inputs: tuple[Shaped, ...]
    signs: tuple[float, ...]

    @property
    def name(self) -> str:
        """Its name in messages."""
        return "command of all inputs"

    @property
    def start(self) -> float:
        """When the first one begins [s]."""
        return min(one.command.start for one in self.inputs)

    @property
    def end(self) -> float:
        """When the last one has ended, unshaped [s]."""
        return max(one.command.end for one in self.inputs)

    def cases(self, plant: Plant, candidate: Candidate) -> dict[str, Case]:
        """See `Command.cases`; plant and shapers are those of the inputs."""
        still = tuple(0.0 for _ in self.signs)
        return {
            "rest": Case(self._on(still, shaped=False), self.end),
            "before": Case(self._on(self.signs, shaped=False), self.end),
            "after": Case(self._on(self.signs, shaped=True), max(one.end for one in self.inputs)),
        }

    def stepping(self, plant: Plant) -> dict[str, Any]:
        """See `Command.stepping`."""
        return plant.stepping

    def _on(self, signs: Sequence[float], *, shaped: bool) -> System:
        system, names = shaped_system(self.inputs, shaped=shaped)
        for one, name, sign in zip(self.inputs, names, signs, strict=True):
            table = replace(one.command, amplitude=sign * one.command.amplitude).table()
            system.drive(f"{name}.command", table)
        return system


def shaped_system(
    inputs: Sequence[Shaped], *, shaped: bool = True, output: str = "shaped", fmu: Path | None = None
) -> tuple[System, list[str]]:
    """The plant with an InputShaper before each of its inputs, whose commands are free, and the shapers' instances.

    `fmu` is the InputShaper's, by default the one that comes with the package; `output` leads to the plant.
    """
    system, names = inputs[0].plant.system, []
    for one in inputs:
        instance, variable = system.split(one.plant.input)
        system.start_values[instance].pop(variable, None)
        name = free_name(system, f"shaper_{variable}")
        values = one.start_values if shaped else _UNSHAPED
        system.add(name, fmu or fmu_path("InputShaper", platforms=["this"]), values, initial_command=one.command.rest)
        system.connect(f"{name}.{output}", one.plant.input)
        names.append(name)
    return system, names


def free_name(system: System, wanted: str) -> str:
    """The name, without what an instance's name cannot have, or with a number that no instance has."""
    plain = "".join(letter if letter.isalnum() else "_" for letter in wanted).strip("_")
    names = itertools.chain([plain], (f"{plain}_{n}" for n in itertools.count(2)))
    return next(name for name in names if name not in system.fmus)


class TogetherRuns(ShapedRuns):
    """The plant with the commands of all inputs, with all signs. See `ShapedRuns`."""

    def __init__(
        self, inputs: Sequence[Shaped], outputs: Sequence[str], boxes: Sequence[ModeBox], tolerance: float, slow: SlowPart | None
    ):
        if not 2 <= len(inputs) <= MOST_INPUTS:
            raise ArgumentError(f"{len(inputs)} inputs: 2 to {MOST_INPUTS} can be verified together")
        longest = max((one for one in inputs if one.candidate is not None), key=lambda one: one.end, default=None)
        if longest is None or longest.candidate is None:
            raise ArgumentError("no input has a shaper, so that there is nothing to verify together")
        signs = [(1.0, *more) for more in itertools.product((1.0, -1.0), repeat=len(inputs) - 1)]
        plant, candidate = inputs[0].plant, longest.candidate
        commands = [CommandsTogether(tuple(inputs), one) for one in signs]
        super().__init__(plant, outputs, candidate, boxes, tolerance, commands[0], slow)
        self._signs = [self._runs, *(CommandedRuns(plant, outputs, candidate, boxes, one) for one in commands[1:])]

    def raw(self, values: Mapping[str, float]) -> Measured:
        """The largest residuals over the signs."""
        for one in self._signs:
            one.step = self._runs.step
        rest = self._runs.residuals("rest", values, self._runs.window)
        before, after = (
            [max(sizes) for sizes in zip(*(one.residuals(case, values, one.window) for one in self._signs), strict=True)]
            for case in ("before", "after")
        )
        found = Measured(values, tuple(before), tuple(after), 0.0, tuple(rest))
        return replace(found, share=max(found.shares))

    def look_at_rest(self, found: Measured) -> None:
        """See `ShapedRuns`. Raises ArgumentError where something would have to be separated from the vibration."""
        super().look_at_rest(found)
        if self._separation.needed:
            raise ArgumentError(
                "beside the vibration there is a lag, noise, or a motion without a command, which is separated for one input at a "
                "time, and not for all together; the verdicts of the inputs alone stand"
            )

    @property
    def steps(self) -> float:
        """That `measured` takes, about."""
        return len(self._signs) * super().steps


def verify_together(
    inputs: Sequence[Shaped],
    outputs: Sequence[str],
    boxes: Sequence[ModeBox],
    spread: Mapping[str, float],
    *,
    tolerance: float = 0.05,
    slow: SlowPart | None = None,
) -> Verification:
    """As `verify`, with the commands of all inputs at once, each behind its shaper: the worst signs at the worst place.

    Args:
        inputs: 2 to 4 of one plant.
        outputs, boxes, spread, tolerance, slow: see `verify`; the boxes are the modes of all inputs.

    Raises as `verify` does, and ArgumentError for lags, noise and motion without a command, which are not separated here.
    """
    return verified_runs(TogetherRuns(inputs, outputs, boxes, tolerance, slow), outputs, spread, tolerance, slow)
