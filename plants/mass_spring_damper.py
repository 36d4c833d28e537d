"""Mass, spring and damper: the reference plant, propagated without error."""

from __future__ import annotations

import math
from typing import ClassVar

from shaper_fmu.component import Calculated, Component, Input, Output, Parameter, State, Variable
from shaper_fmu.propagation import oscillator_forcing, oscillator_transition


class MassSpringDamper(Component):
    """Mass on a spring and a damper: m x'' + c x' + k x = F, from rest, propagated exactly for a force held or linear over a step.

    The transition matrix of the communication step and the responses to the force are computed in closed form (under-, over-
    and critically damped) and kept while the step stays the same.
    """

    continuous_states: ClassVar[tuple[str, ...] | None] = ("position", "velocity")
    terminals: ClassVar[dict[str, dict[str, str]]] = {
        "plant": {"force": "force", "position": "position", "velocity": "velocity", "acceleration": "acceleration"},
    }

    force: Variable[float] = Input("N", "force on the mass", slope="force_slope")
    mass: Variable[float] = Parameter(1.0, "kg", "moving mass", min=0.0, exclusive=True, published=(1e-12, None))
    stiffness: Variable[float] = Parameter(100.0, "N/m", "spring stiffness", min=0.0, exclusive=True, published=(1e-9, None))
    damping: Variable[float] = Parameter(1.0, "N.s/m", "viscous damping", min=0.0)
    natural_frequency: Variable[float] = Calculated("rad/s", "undamped natural frequency sqrt(k/m)")
    damping_ratio: Variable[float] = Calculated("", "damping ratio c / (2 sqrt(k m))")
    position: Variable[float] = Output(
        "m", "displacement from the spring's rest", depends=(), derivative="velocity", nominal="usual_position"
    )
    velocity: Variable[float] = Output("m/s", "speed", depends=(), derivative="acceleration", nominal="usual_velocity")
    acceleration: Variable[float] = Output("m/s2", "acceleration", depends=("force",))

    usual_position: Variable[float] = State(1.0)  # of a force of 1 N
    usual_velocity: Variable[float] = State(1.0)
    force_slope: Variable[float] = State(0.0)
    known_step: Variable[float] = State(-1.0)  # the step that the transition matrix and the responses belong to
    transition: Variable[list[float]] = State(size=4)
    held_response: Variable[float] = State(0.0)
    ramp_response: Variable[float] = State(0.0)

    def start(self) -> None:
        self.natural_frequency = math.sqrt(self.stiffness / self.mass)
        self.usual_position = 1.0 / self.stiffness
        self.usual_velocity = self.natural_frequency / self.stiffness
        self.damping_ratio = 0.5 * self.damping / math.sqrt(self.stiffness * self.mass)

    def step(self, t: float, h: float) -> None:
        if h > 0.0:
            if h != self.known_step:
                self.known_step = h
                oscillator_transition(self.transition, self.natural_frequency, self.damping_ratio, h)
                held, ramp = oscillator_forcing(self.transition, self.natural_frequency, self.damping_ratio, h)
                self.held_response = held
                self.ramp_response = ramp
            unbalanced = (self.force - self.stiffness * self.position) / self.mass
            speed = self.velocity
            self.position += self.transition[1] * speed + self.held_response * unbalanced
            self.velocity = self.transition[3] * speed + self.transition[1] * unbalanced
            if self.force_slope != 0.0:
                growing = self.force_slope / self.mass
                self.position += self.ramp_response * growing
                self.velocity += self.held_response * growing
                self.force += self.force_slope * h
        self.acceleration = (self.force - self.damping * self.velocity - self.stiffness * self.position) / self.mass
