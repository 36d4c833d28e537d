"""The command of the verification of a move: the plant's input follows a motion, and is compared with an abrupt one."""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np

from shaper_fmu.design.profiles import Profile, profile
from shaper_fmu.errors import ModelError
from shaper_fmu.master.motion import is_position
from shaper_fmu.ssp.template import OUTPUTS
from shaper_fmu.tune.choice.boxes import ModeBox
from shaper_fmu.tune.choice.moves import fastest_move
from shaper_fmu.tune.choice.requirements import Move
from shaper_fmu.tune.choice.search import Candidate
from shaper_fmu.tune.plant import Plant
from shaper_fmu.tune.verification.command import Case

_ABRUPT = 0.05
"""Duration of the abrupt move, in periods of the fastest mode: it excites that mode by 0.16 % less than a step."""
_PEAKS = (1.0, 2.0, 2.0 * math.pi)
"""Largest position, speed and acceleration of a cycloid over a distance of 1 in a duration of 1."""


@dataclass(frozen=True)
class MoveCommand:
    """A rest-to-rest move of the plant's input.

    V of a move is what it leaves over what a step of the position over the same distance leaves. A plant may not bear that step: it
    gets an abrupt move over a small distance instead, whose residuals are scaled to the distance.

    Attributes:
        move: distance and limits, in the input's unit of length or angle.
        rest: the input's value at rest.
        start: time at which the moves begin [s].
        order: what the input is: 0 the position, 1 the speed, 2 the acceleration.
        abrupt: duration of the abrupt move [s].
        amplitude: the largest value of the input in the abrupt move, beyond `rest`.
    """

    move: Move
    rest: float
    start: float
    order: int
    abrupt: float
    amplitude: float

    @property
    def name(self) -> str:
        """Its name in messages."""
        return "move"

    @property
    def end(self) -> float:
        """When the abrupt move ends [s]."""
        return self.start + self.abrupt

    @property
    def small(self) -> float:
        """Distance of the abrupt move."""
        return abs(self.amplitude) * self.abrupt**self.order / _PEAKS[self.order]

    def cases(self, plant: Plant, candidate: Candidate) -> dict[str, Case]:
        """The plant at rest, with the abrupt move, and with the candidate's."""
        still = plant.behind({"shaper": "none"}, self.rest)
        still.drive(f"{plant.shaper}.command", np.array([[0.0, self.rest]]))
        abrupt = profile("cycloid", self.small, self.abrupt)
        return {
            "rest": Case(still, self.end),
            "before": Case(self._moved(plant, abrupt), self.end, abs(self.move.distance) / self.small),
            "after": self._chosen(plant, candidate),
        }

    def shown(self, plant: Plant, candidate: Candidate) -> tuple[Case, Case]:
        """What a report shows: the fastest move within the limits, which leaves vibration, and the candidate's."""
        fastest = fastest_move(self.move)
        return Case(self._moved(plant, fastest), self.start + fastest.duration), self._chosen(plant, candidate)

    def stepping(self, plant: Plant) -> dict[str, Any]:
        """Options of the runs: the input follows the motion within a step, too."""
        return {**plant.stepping, "algorithm": "gauss_seidel", "interpolation": "linear"}

    def input_of(self, law: Profile, t: np.ndarray) -> np.ndarray:
        """The plant's input in a motion, at times after its begin."""
        return self.rest + (law.position, law.velocity, law.acceleration)[self.order](t)

    def _chosen(self, plant: Plant, candidate: Candidate) -> Case:
        assert candidate.profile is not None  # of every candidate for a move
        shaper = candidate.start_values() if candidate.design.factors else None
        end = self.start + candidate.profile.duration + candidate.sequence.duration
        return Case(self._moved(plant, candidate.profile, shaper), end)

    def _moved(self, plant: Plant, law: Profile, shaper: dict[str, Any] | None = None) -> Any:
        return plant.moved({**law.start_values(), "start_time": self.start}, OUTPUTS[self.order], self.rest, shaper)


def move_command(
    plant: Plant, move: Move, boxes: Sequence[ModeBox], rest: float = 0.0, start: float = 0.0, amplitude: float = 1.0
) -> MoveCommand:
    """The command for a move of a plant with these modes. Raises ModelError as `order_of_input` does."""
    fastest = 2.0 * math.pi / max(box.natural_frequency.high for box in boxes)
    return MoveCommand(move, rest, start, order_of_input(plant, move), _ABRUPT * fastest, amplitude)


def order_of_input(plant: Plant, move: Move) -> int:
    """0 for a position, 1 for a speed, 2 for an acceleration.

    Raises ModelError for an input that is none of these by its unit, and for a speed or an acceleration that would have to jump.
    """
    order = plant.input_order
    if order == 0 and plant.input_unit and not is_position(*plant.fmu_of(plant.input)):
        raise ModelError(
            [
                f"{plant.short(plant.input)} [{plant.input_unit}] is no position, speed or acceleration, so that it "
                "cannot follow a move; tune a shaper for it (without a move), or name an input in m, rad or deg, or in their rates"
            ]
        )
    if order and fastest_move(move).duration == 0.0:
        limits = "give max_acceleration, on the command line --max-acceleration"
        raise ModelError([f"{plant.short(plant.input)} [{plant.input_unit}] cannot jump, so the move needs limits: {limits}"])
    return order
