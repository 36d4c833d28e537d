"""Rotating beam: a flexible beam with a tip mass on a hub that turns."""

from __future__ import annotations

from typing import ClassVar

from shaper_fmu.component import Calculated, Input, Local, Output, Parameter, State, Variable
from shaper_fmu.plants.beam_modes import (
    MODES,
    SLOWEST,
    ModalBeam,
    advance_mode,
    find_responses,
    modal_acceleration,
    modal_share,
    note_usual_sizes,
    participation_factor,
    shape_constant,
    start_modes,
)


class RotatingBeam(ModalBeam):
    """Euler-Bernoulli beam with a tip mass, clamped to a hub that turns, in up to five modes, from rest.

    The beam begins at the hub's radius R; the hub turns with the input acceleration alpha, in the plane in which the beam bends.
    Mode j adds q_j to the tip's deflection against the turning straight line,

    q_j'' + 2 zeta_j w_j q_j' + w_j^2 q_j = -Gamma_j alpha,

    w_j solves the frequency equation of a clamped beam with a point mass at its end, and Gamma_j, in m, takes the place of a
    lever arm: all of them together are R + L. Modes and hub are propagated exactly for inputs that are held or linear over a step.
    Small deflections, and a hub that turns slowly against w_1: the centrifugal stiffening is left out.
    """

    continuous_states: ClassVar[tuple[str, ...] | None] = ("hub_angle", "hub_speed", "modal_deflection", "modal_velocity")
    terminals: ClassVar[dict[str, dict[str, str]]] = {
        "command": {"angular_acceleration": "hub_acceleration"},
        "plant": {
            "hub_angle": "hub_angle",
            "tip_deflection": "tip_deflection",
            "tip_position": "tip_position",
            "tip_acceleration": "tip_acceleration",
        },
    }

    hub_acceleration: Variable[float] = Input("rad/s2", "angular acceleration of the hub", slope="hub_acceleration_slope")
    hub_radius: Variable[float] = Parameter(0.05, "m", "distance of the clamped end from the axis of rotation", min=0.0)
    participation: Variable[list[float]] = Calculated(
        "m", "participation factor of each mode at the tip; all modes together: hub_radius + length", size=MODES
    )
    hub_angle: Variable[float] = Output(
        "rad", "angle of the hub", depends=(), display_unit="deg", derivative="hub_speed", nominal="usual_hub_angle"
    )
    tip_deflection: Variable[float] = Output(
        "m", "deflection of the tip against the hub's direction", depends=(), derivative="tip_deflection_rate"
    )
    tip_position: Variable[float] = Output(
        "m",
        "position of the tip along its arc, (hub_radius + length) hub_angle + tip_deflection",
        depends=(),
        derivative="tip_velocity",
    )
    tip_acceleration: Variable[float] = Output(
        "m/s2", "acceleration of the tip along its arc, that of the hub included", depends=("hub_acceleration",)
    )
    hub_torque: Variable[float] = Output(
        "N.m", "torque that beam and tip mass need from the hub, without the hub's own inertia", depends=("hub_acceleration",)
    )
    hub_speed: Variable[float] = Local(
        "rad/s", "speed of the hub", display_unit="deg/s", derivative="hub_speed_rate", nominal="usual_hub_speed"
    )
    hub_speed_rate: Variable[float] = Local("rad/s2", "angular acceleration of the hub")
    tip_velocity: Variable[float] = Local(
        "m/s", "speed of the tip along its arc, that of the hub included", derivative="tip_acceleration"
    )
    tip_deflection_rate: Variable[float] = Local("m/s", "speed of the tip against the hub's direction")

    usual_hub_angle: Variable[float] = State(1.0)  # under 0.1 rad/s2
    usual_hub_speed: Variable[float] = State(1.0)
    inertia: Variable[float] = State(0.0)  # of the straight beam and the tip mass about the axis [kg.m2]
    angular_mass: Variable[list[float]] = State(size=MODES)  # angular momentum per speed of the tip in a mode [kg.m]
    hub_acceleration_slope: Variable[float] = State(0.0)

    def start(self) -> int:
        status = start_modes(self)
        if status:
            return status
        ratio = self.tip_mass / self.beam_mass
        reach = self.hub_radius + self.length
        for j in range(MODES):
            self.participation[j] = participation_factor(self.root[j], ratio) * lever_arm(self, self.root[j])
            self.angular_mass[j] = 0.25 * self.beam_mass * modal_share(self.root[j], ratio) * self.participation[j]
            note_usual_sizes(self, j, 0.1 * abs(self.participation[j]))
        middle = self.hub_radius + 0.5 * self.length
        self.inertia = self.beam_mass * (middle * middle + self.length * self.length / 12.0) + self.tip_mass * reach * reach
        self.usual_hub_speed = 0.1 / max(self.natural_frequency[0], SLOWEST)
        self.usual_hub_angle = self.usual_hub_speed / max(self.natural_frequency[0], SLOWEST)
        return 0

    def step(self, t: float, h: float) -> int:
        if h > 0.0:
            find_responses(self, h)
            push = self.hub_acceleration
            rise = self.hub_acceleration_slope
            for j in range(self.modes):
                advance_mode(self, j, -self.participation[j] * push, -self.participation[j] * rise)
            self.hub_angle += (self.hub_speed + (0.5 * push + rise * h / 6.0) * h) * h
            self.hub_speed += (push + 0.5 * rise * h) * h
            self.hub_acceleration += rise * h
        reach = self.hub_radius + self.length
        self.hub_speed_rate = self.hub_acceleration
        self.tip_deflection = 0.0
        self.tip_deflection_rate = 0.0
        self.tip_acceleration = reach * self.hub_acceleration
        self.hub_torque = self.inertia * self.hub_acceleration
        for j in range(self.modes):
            self.modal_acceleration[j] = modal_acceleration(self, j, -self.participation[j] * self.hub_acceleration)
            self.tip_deflection += self.modal_deflection[j]
            self.tip_deflection_rate += self.modal_velocity[j]
            self.tip_acceleration += self.modal_acceleration[j]
            self.hub_torque += self.angular_mass[j] * self.modal_acceleration[j]
        self.tip_position = reach * self.hub_angle + self.tip_deflection
        self.tip_velocity = reach * self.hub_speed + self.tip_deflection_rate
        return 0


def lever_arm(m: RotatingBeam, beta: float) -> float:
    """(integral of (R + x) phi dm + tip mass (R + L) phi(L)) / (integral of phi dm + tip mass phi(L)) of a mode shape [m].

    By the equation of the mode itself the integral of x phi, with the tip mass, is 2 m L / beta^2, that of phi 2 gamma m / beta.
    """
    return m.hub_radius + m.length / (shape_constant(beta) * beta)
