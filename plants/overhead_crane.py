"""Overhead crane: a load on a rope under a trolley, nonlinear."""

from __future__ import annotations

import math
from typing import ClassVar

from shaper_fmu.component import Calculated, Input, Local, Output, Parameter, State, Variable
from shaper_fmu.integration import Integrated, integrate
from shaper_fmu.variable import Array

ROPE_SPENT = 1


class OverheadCrane(Integrated):
    """Load on a massless rope of length l under a trolley that is moved with the acceleration a, nonlinear.

    l theta'' + 2 l' theta' + 2 zeta w0 l theta' + g sin theta + a cos theta = 0, load position p + l sin theta,
    l' = -hoist_speed, with w0 = sqrt(g / l0) of the initial rope length. From rest, hanging straight down. The trolley
    and the rope follow held inputs exactly; the swing is integrated with a local error below 1e-10 (rad, rad/s).
    """

    messages: ClassVar[dict[int, str]] = {ROPE_SPENT: "hoisting at {hoist_speed} m/s leaves no rope (rope length {rope_length} m)"}
    default_stop_time: ClassVar[float] = 30.0
    continuous_states: ClassVar[tuple[str, ...] | None] = (
        "trolley_position",
        "trolley_speed",
        "rope_length",
        "swing_angle",
        "swing_rate",
    )
    terminals: ClassVar[dict[str, dict[str, str]]] = {
        "command": {"acceleration": "trolley_acceleration", "hoist_speed": "hoist_speed"},
        "plant": {
            "trolley_position": "trolley_position",
            "rope_length": "rope_length",
            "swing_angle": "swing_angle",
            "swing_rate": "swing_rate",
            "load_position": "load_position",
        },
    }

    trolley_acceleration: Variable[float] = Input("m/s2", "acceleration of the trolley")
    hoist_speed: Variable[float] = Input("m/s", "speed at which the load is hoisted: the rope shortens")
    initial_rope_length: Variable[float] = Parameter(
        5.0, "m", "rope length at the start", min=0.0, exclusive=True, published=(1e-9, None)
    )
    damping_ratio: Variable[float] = Parameter(0.0, "", "damping ratio of small swings at the initial rope length", min=0.0)
    gravity: Variable[float] = Parameter(9.81, "m/s2", "acceleration of gravity", min=0.0, exclusive=True, published=(1e-9, None))
    natural_frequency: Variable[float] = Calculated(
        "rad/s", "frequency of small undamped swings at the initial rope length, sqrt(g/l0)"
    )
    trolley_position: Variable[float] = Output(
        "m", "position of the trolley", depends=(), derivative="trolley_speed", nominal="usual_position"
    )
    rope_length: Variable[float] = Output("m", "rope length", depends=(), derivative="rope_speed", nominal="initial_rope_length")
    swing_angle: Variable[float] = Output(
        "rad",
        "swing angle, positive when the load is ahead of the trolley",
        depends=(),
        display_unit="deg",
        derivative="swing_rate",
        nominal="usual_angle",
    )
    swing_rate: Variable[float] = Output(
        "rad/s",
        "rate of the swing angle",
        depends=(),
        display_unit="deg/s",
        derivative="swing_acceleration",
        nominal="usual_rate",
    )
    load_position: Variable[float] = Output("m", "horizontal position of the load", depends=())
    trolley_speed: Variable[float] = Local("m/s", "speed of the trolley", derivative="trolley_speed_rate", nominal="usual_speed")
    trolley_speed_rate: Variable[float] = Local("m/s2", "acceleration of the trolley")
    rope_speed: Variable[float] = Local("m/s", "speed at which the rope gets longer")
    swing_acceleration: Variable[float] = Local("rad/s2", "acceleration of the swing angle")

    usual_position: Variable[float] = State(1.0)  # under 0.1 m/s2
    usual_speed: Variable[float] = State(1.0)
    usual_angle: Variable[float] = State(1.0)
    usual_rate: Variable[float] = State(1.0)

    def start(self) -> None:
        self.natural_frequency = math.sqrt(self.gravity / self.initial_rope_length)
        self.usual_position = 0.1 * self.initial_rope_length / self.gravity
        self.usual_angle = 0.1 / self.gravity
        self.usual_rate = self.usual_angle * self.natural_frequency
        self.usual_speed = self.usual_rate * self.initial_rope_length
        self.rope_length = self.initial_rope_length

    def step(self, t: float, h: float) -> int:
        if h > 0.0:
            if self.rope_length - self.hoist_speed * h <= 0.0:
                return ROPE_SPENT
            self.x[0] = self.swing_angle
            self.x[1] = self.swing_rate
            status = integrate(self, swing_derivatives, 2, h)
            if status:
                return status
            self.swing_angle = self.x[0]
            self.swing_rate = self.x[1]
            self.trolley_position += (self.trolley_speed + 0.5 * self.trolley_acceleration * h) * h
            self.trolley_speed += self.trolley_acceleration * h
            self.rope_length -= self.hoist_speed * h
        self.trolley_speed_rate = self.trolley_acceleration
        self.rope_speed = -self.hoist_speed
        self.swing_acceleration = swing_acceleration(self, 0.0, self.swing_angle, self.swing_rate)
        self.load_position = self.trolley_position + self.rope_length * math.sin(self.swing_angle)
        return 0


def swing_derivatives(m: OverheadCrane, s: float, x: Array, slope: Array) -> None:
    """Slopes of swing angle and rate, s after the start of the step."""
    slope[0] = x[1]
    slope[1] = swing_acceleration(m, s, x[0], x[1])


def swing_acceleration(m: OverheadCrane, s: float, angle: float, rate: float) -> float:
    """Acceleration of the swing angle [rad/s2], s after the time of m.rope_length."""
    length = m.rope_length - m.hoist_speed * s
    return (
        -(m.gravity * math.sin(angle) + m.trolley_acceleration * math.cos(angle) - 2.0 * m.hoist_speed * rate) / length
        - 2.0 * m.damping_ratio * m.natural_frequency * rate
    )
