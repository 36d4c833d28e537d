"""Flexible beam: a cantilever with a tip mass on a base that is moved across it."""

from __future__ import annotations

from typing import ClassVar

from shaper_fmu.component import Calculated, Input, Local, Output, State, Variable
from shaper_fmu.plants.beam_modes import (
    MODES,
    SLOWEST,
    ModalBeam,
    advance_mode,
    find_responses,
    modal_acceleration,
    note_usual_sizes,
    participation_factor,
    start_modes,
)


class FlexibleBeam(ModalBeam):
    """Euler-Bernoulli cantilever with a tip mass on a moving base, in up to five modes, from rest.

    The base moves across the beam with the input acceleration a. Mode j adds q_j to the tip's deflection,

    q_j'' + 2 zeta_j w_j q_j' + w_j^2 q_j = -Gamma_j a,

    and w_j solves the frequency equation of a beam with a point mass at its end. All five frequencies and participation
    factors Gamma_j are computed; the first `modes` modes move. Modes and base are propagated exactly for inputs that are held
    or linear over a step. The defaults are the PMMA beam of Ozokutan, Karadag, Kapucu and Kutuk (2025), with its first mode.
    """

    continuous_states: ClassVar[tuple[str, ...] | None] = ("base_position", "base_velocity", "modal_deflection", "modal_velocity")
    terminals: ClassVar[dict[str, dict[str, str]]] = {
        "command": {"acceleration": "base_acceleration"},
        "plant": {
            "base_position": "base_position",
            "tip_deflection": "tip_deflection",
            "tip_position": "tip_position",
            "tip_acceleration": "tip_acceleration",
        },
    }

    base_acceleration: Variable[float] = Input("m/s2", "acceleration of the base, across the beam", slope="base_acceleration_slope")
    participation: Variable[list[float]] = Calculated(
        "", "participation factor of each mode at the tip; all modes together: 1", size=MODES
    )
    base_position: Variable[float] = Output(
        "m", "position of the base", depends=(), derivative="base_velocity", nominal="usual_base_position"
    )
    tip_deflection: Variable[float] = Output(
        "m", "deflection of the tip against the base", depends=(), derivative="tip_deflection_rate"
    )
    tip_position: Variable[float] = Output("m", "position of the tip", depends=(), derivative="tip_velocity")
    tip_acceleration: Variable[float] = Output(
        "m/s2", "acceleration of the tip, that of the base included", depends=("base_acceleration",)
    )
    base_velocity: Variable[float] = Local(
        "m/s", "speed of the base", derivative="base_velocity_rate", nominal="usual_base_velocity"
    )
    base_velocity_rate: Variable[float] = Local("m/s2", "acceleration of the base")
    tip_velocity: Variable[float] = Local("m/s", "speed of the tip, that of the base included", derivative="tip_acceleration")
    tip_deflection_rate: Variable[float] = Local("m/s", "speed of the tip against the base")

    usual_base_position: Variable[float] = State(1.0)  # under 0.1 m/s2
    usual_base_velocity: Variable[float] = State(1.0)
    base_acceleration_slope: Variable[float] = State(0.0)

    def start(self) -> int:
        status = start_modes(self)
        if status:
            return status
        for j in range(MODES):
            self.participation[j] = participation_factor(self.root[j], self.tip_mass / self.beam_mass)
            note_usual_sizes(self, j, 0.1 * abs(self.participation[j]))
        self.usual_base_velocity = 0.1 / max(self.natural_frequency[0], SLOWEST)
        self.usual_base_position = self.usual_base_velocity / max(self.natural_frequency[0], SLOWEST)
        return 0

    def step(self, t: float, h: float) -> int:
        if h > 0.0:
            find_responses(self, h)
            push = self.base_acceleration
            rise = self.base_acceleration_slope
            for j in range(self.modes):
                advance_mode(self, j, -self.participation[j] * push, -self.participation[j] * rise)
            self.base_position += (self.base_velocity + (0.5 * push + rise * h / 6.0) * h) * h
            self.base_velocity += (push + 0.5 * rise * h) * h
            self.base_acceleration += rise * h
        self.base_velocity_rate = self.base_acceleration
        self.tip_deflection = 0.0
        self.tip_deflection_rate = 0.0
        self.tip_acceleration = self.base_acceleration
        for j in range(self.modes):
            self.modal_acceleration[j] = modal_acceleration(self, j, -self.participation[j] * self.base_acceleration)
            self.tip_deflection += self.modal_deflection[j]
            self.tip_deflection_rate += self.modal_velocity[j]
            self.tip_acceleration += self.modal_acceleration[j]
        self.tip_position = self.base_position + self.tip_deflection
        self.tip_velocity = self.base_velocity + self.tip_deflection_rate
        return 0
