"""The command of the verification: a step, or a pulse or doublet if the plant would not rest after a step."""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from typing import Any

import numpy as np

from shaper_fmu.errors import ArgumentError
from shaper_fmu.master.system import System
from shaper_fmu.tune.choice.boxes import ModeBox
from shaper_fmu.tune.choice.search import Candidate
from shaper_fmu.tune.plant import Plant

_WIDTHS = 400
_LONGEST = 1.5
"""Of a pulse, in periods of the slowest mode."""
MOST_INTEGRATORS = 2


_UNSHAPED = {"shaper": "none"}


@dataclass(frozen=True)
class Case:
    """A system with its command in it.

    Attributes:
        system: to be simulated.
        end: when its command has ended, with all that a shaper makes of it [s].
        scale: what residuals are multiplied by.
    """

    system: System
    end: float
    scale: float = 1.0


@dataclass(frozen=True)
class Command:
    """An input's values, held from each change on.

    Attributes:
        rest: before the first change [the input's unit].
        amplitude: of the changes, in the same unit.
        start: time of the first change [s].
        width: between changes, of a pulse and a doublet [s].
        integrators: of the plant, which the command must leave at rest: 0 a step, 1 a pulse, 2 a doublet.
    """

    rest: float = 0.0
    amplitude: float = 1.0
    start: float = 0.0
    width: float = 0.0
    integrators: int = 0

    def __post_init__(self) -> None:
        if not 0 <= self.integrators <= MOST_INTEGRATORS:
            raise ArgumentError(
                f"there are {self.integrators} integrators between the input and the outputs; up to {MOST_INTEGRATORS} can be "
                "brought to rest by a command: name outputs that follow the input with fewer"
            )
        if self.integrators and not 0.0 < self.width < math.inf:
            raise ArgumentError(f"width = {self.width:g} s: a {self.name} needs one above 0")

    @property
    def name(self) -> str:
        """Its name in messages."""
        return ("step", "pulse", "doublet")[self.integrators]

    @property
    def end(self) -> float:
        """Time of the last change [s]."""
        return self.start + self.integrators * self.width

    def table(self) -> np.ndarray:
        """Times [s] and values from each of them on, shape (n, 2); the first time is 0."""
        rows = [[time, self.rest + self.amplitude * level] for time, level in zip(self.times(), self.levels(), strict=True)]
        return np.array(rows if self.start <= 0.0 else [[0.0, self.rest], *rows])

    def on(self, plant: Plant, shaper: Mapping[str, Any]) -> System:
        """A new system with the plant behind an InputShaper of these start values, and this command before it."""
        system = plant.behind(shaper, self.rest)
        system.drive(f"{plant.shaper}.command", self.table())
        return system

    def cases(self, plant: Plant, candidate: Candidate) -> dict[str, Case]:
        """The plant at rest, with the unshaped command, which is what residuals are compared with, and with the shaped one."""
        return {
            "rest": Case(replace(self, amplitude=0.0).on(plant, _UNSHAPED), self.end),
            "before": Case(self.on(plant, _UNSHAPED), self.end),
            "after": Case(self.on(plant, candidate.start_values()), self.end + candidate.delay),
        }

    def shown(self, plant: Plant, candidate: Candidate) -> tuple[Case, Case]:
        """What a report shows: the unshaped and the shaped command."""
        found = self.cases(plant, candidate)
        return found["before"], found["after"]

    def stepping(self, plant: Plant) -> dict[str, Any]:
        """Options of the runs: values are held, as the shaper's are."""
        return plant.stepping

    def levels(self) -> tuple[float, ...]:
        """The values after each change, on top of rest, in amplitudes."""
        return ((1.0,), (1.0, 0.0), (1.0, -1.0, 0.0))[self.integrators]

    def times(self) -> tuple[float, ...]:
        """Times of the changes [s]."""
        return tuple(self.start + k * self.width for k in range(self.integrators + 1))


def command_for(
    boxes: Sequence[ModeBox], rest: float = 0.0, amplitude: float = 1.0, start: float = 0.0, integrators: int = 0
) -> Command:
    """A command for a plant with these modes and so many integrators, which it leaves at rest."""
    return Command(rest, amplitude, start, even_width(boxes) if integrators else 0.0, integrators)


def even_width(boxes: Sequence[ModeBox]) -> float:
    """Width [s] for which a pulse excites all nominal modes as much as a step does, in proportion.

    A pulse is a step and its negative later, so that it excites a mode of pole p by |1 - exp(p width)| of a step; the width for
    which these shares differ least between modes, the shortest of equally good ones.
    """
    w, zeta = (np.array([getattr(box, name).nominal for box in boxes]) for name in ("natural_frequency", "damping_ratio"))
    poles = w * (-zeta + 1j * np.sqrt(1.0 - zeta * zeta))
    slowest = 2.0 * math.pi / float(poles.imag.min())
    widths = np.linspace(0.25 * slowest, _LONGEST * slowest, _WIDTHS)
    shares = np.abs(1.0 - np.exp(np.multiply.outer(poles, widths)))
    evenness = shares.min(axis=0) / shares.max(axis=0) * np.minimum(1.0, shares.min(axis=0))
    return float(widths[int(np.argmax(np.round(evenness, 6)))])
