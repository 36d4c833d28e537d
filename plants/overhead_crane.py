"""Overhead crane: a load on a rope under a trolley, nonlinear."""

from __future__ import annotations

import math
from typing import ClassVar

from shaper_fmu.component import Calculated, Input, Local, Output, Parameter, State, Variable
from shaper_fmu.integration import MARGIN_SPENT, Integrated, integrate
from shaper_fmu.plants.hoist import gained, most_hoisted, travelled
from shaper_fmu.variable import Array

ROPE_SPENT = 1
ROPE_PUSHES = 2


class OverheadCrane(Integrated):
    """Load on a massless rope of length l under a trolley that is moved with the acceleration a, nonlinear.

    l theta'' + 2 l' theta' + 2 zeta w0 l theta' + g sin theta + a cos theta = 0, load position p + l sin theta,
    l' = -hoist_speed, with w0 = sqrt(g / l0) of the initial rope length. From rest, hanging straight down. The trolley
    and the rope follow inputs that are held or linear over a step exactly; the swing is integrated with a local error below
    1e-10 (rad, rad/s). The rope's tension is m (g cos theta + l theta'^2 - a sin theta - l''); a rope cannot push, so that it
    must stay positive.
    """

    messages: ClassVar[dict[int, str]] = {
        ROPE_SPENT: "hoisting at {hoist_speed} m/s leaves no rope (rope length {rope_length} m)",
        ROPE_PUSHES: "the rope would have to push: its tension is {rope_tension} N and must be greater than 0 N (swing angle "
        "{swing_angle} rad, trolley acceleration {trolley_acceleration} m/s2); a real one goes slack. Move or lower more gently",
    }
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
            "rope_tension": "rope_tension",
        },
    }

    trolley_acceleration: Variable[float] = Input("m/s2", "acceleration of the trolley", slope="trolley_acceleration_slope")
    hoist_speed: Variable[float] = Input("m/s", "speed at which the load is hoisted: the rope shortens", slope="hoist_speed_slope")
    initial_rope_length: Variable[float] = Parameter(
        5.0, "m", "rope length at the start", min=0.0, exclusive=True, published=(1e-9, None)
    )
    damping_ratio: Variable[float] = Parameter(0.0, "", "damping ratio of small swings at the initial rope length", min=0.0)
    gravity: Variable[float] = Parameter(9.81, "m/s2", "acceleration of gravity", min=0.0, exclusive=True, published=(1e-9, None))
    load_mass: Variable[float] = Parameter(
        1.0, "kg", "mass of the load, for the rope's tension alone", min=0.0, exclusive=True, published=(1e-9, None)
    )
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
    rope_tension: Variable[float] = Output("N", "tension of the rope, which must stay positive", depends=("trolley_acceleration",))
    trolley_speed: Variable[float] = Local("m/s", "speed of the trolley", derivative="trolley_speed_rate", nominal="usual_speed")
    trolley_speed_rate: Variable[float] = Local("m/s2", "acceleration of the trolley")
    rope_speed: Variable[float] = Local("m/s", "speed at which the rope gets longer")
    swing_acceleration: Variable[float] = Local("rad/s2", "acceleration of the swing angle")

    usual_position: Variable[float] = State(1.0)  # under 0.1 m/s2
    usual_speed: Variable[float] = State(1.0)
    usual_angle: Variable[float] = State(1.0)
    usual_rate: Variable[float] = State(1.0)
    trolley_acceleration_slope: Variable[float] = State(0.0)
    hoist_speed_slope: Variable[float] = State(0.0)

    def start(self) -> None:
        self.natural_frequency = math.sqrt(self.gravity / self.initial_rope_length)
        self.usual_position = 0.1 * self.initial_rope_length / self.gravity
        self.usual_angle = 0.1 / self.gravity
        self.usual_rate = self.usual_angle * self.natural_frequency
        self.usual_speed = self.usual_rate * self.initial_rope_length
        self.rope_length = self.initial_rope_length

    def step(self, t: float, h: float) -> int:
        if h > 0.0:
            status = advance(self, h)
            if status:
                return status
        if self.rope_length <= 0.0:
            return ROPE_SPENT
        self.trolley_speed_rate = self.trolley_acceleration
        self.rope_speed = -self.hoist_speed
        self.swing_acceleration, pull = swing(self, 0.0, self.swing_angle, self.swing_rate)
        self.load_position = self.trolley_position + self.rope_length * math.sin(self.swing_angle)
        self.rope_tension = self.load_mass * pull
        return ROPE_PUSHES if pull <= 0.0 else 0


def advance(m: OverheadCrane, h: float) -> int:
    """Advance all states by h > 0; returns 0 or a status."""
    if m.rope_length - most_hoisted(m.hoist_speed, m.hoist_speed_slope, h) <= 0.0:
        return ROPE_SPENT
    m.x[0] = m.swing_angle
    m.x[1] = m.swing_rate
    _, m.margin = swing(m, 0.0, m.x[0], m.x[1])
    status = MARGIN_SPENT
    if m.margin > 0.0:
        status = integrate(m, swing_derivatives, 2, h)
    m.swing_angle = m.x[0]
    m.swing_rate = m.x[1]
    if status == MARGIN_SPENT:
        m.rope_tension = m.load_mass * m.margin
        return ROPE_PUSHES
    if status:
        return status
    m.trolley_position += travelled(m.trolley_speed, m.trolley_acceleration, m.trolley_acceleration_slope, h)
    m.trolley_speed += gained(m.trolley_acceleration, m.trolley_acceleration_slope, h)
    m.rope_length -= gained(m.hoist_speed, m.hoist_speed_slope, h)
    m.trolley_acceleration += m.trolley_acceleration_slope * h
    m.hoist_speed += m.hoist_speed_slope * h
    return 0


def swing_derivatives(m: OverheadCrane, s: float, x: Array, slope: Array) -> None:
    """Slopes of swing angle and rate, s after the start of the step; the rope's pull is the margin."""
    slope[0] = x[1]
    slope[1], m.margin = swing(m, s, x[0], x[1])


def swing(m: OverheadCrane, s: float, angle: float, rate: float) -> tuple[float, float]:
    """Acceleration of the swing angle [rad/s2], and the rope's tension per kg of load, s after the time of m.rope_length."""
    length = m.rope_length - gained(m.hoist_speed, m.hoist_speed_slope, s)
    push = m.trolley_acceleration + m.trolley_acceleration_slope * s
    hoist_speed = m.hoist_speed + m.hoist_speed_slope * s
    sine = math.sin(angle)
    cosine = math.cos(angle)
    acceleration = (
        -(m.gravity * sine + push * cosine - 2.0 * hoist_speed * rate) / length - 2.0 * m.damping_ratio * m.natural_frequency * rate
    )
    return acceleration, m.gravity * cosine + length * rate * rate - push * sine + m.hoist_speed_slope
