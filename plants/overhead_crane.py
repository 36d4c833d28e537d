"""Overhead crane: a load on a rope under a trolley, nonlinear."""

from __future__ import annotations

import math

from shaper_fmu.component import Calculated, Input, Output, Parameter, State
from shaper_fmu.integration import Integrated, integrate

ROPE_SPENT = 1


class OverheadCrane(Integrated):
    """Load on a massless rope of length l under a trolley that is moved with the acceleration a, nonlinear.

    l theta'' + 2 l' theta' + 2 zeta w0 l theta' + g sin theta + a cos theta = 0, load position p + l sin theta,
    l' = -hoist_speed, with w0 = sqrt(g / l0) of the initial rope length. From rest, hanging straight down. The trolley
    and the rope follow held inputs exactly; the swing is integrated with a local error below 1e-10 (rad, rad/s).
    """

    messages = {ROPE_SPENT: "hoisting at {hoist_speed} m/s leaves no rope (rope length {rope_length} m)"}
    default_stop_time = 30.0

    trolley_acceleration = Input("m/s2", "acceleration of the trolley")
    hoist_speed = Input("m/s", "speed at which the load is hoisted: the rope shortens")
    initial_rope_length = Parameter(5.0, "m", "rope length at the start", min=0.0, exclusive=True)
    damping_ratio = Parameter(0.0, "", "damping ratio of small swings at the initial rope length", min=0.0)
    gravity = Parameter(9.81, "m/s2", "acceleration of gravity", min=0.0, exclusive=True)
    natural_frequency = Calculated("rad/s", "frequency of small undamped swings at the initial rope length, sqrt(g/l0)")
    trolley_position = Output("m", "position of the trolley", depends=())
    rope_length = Output("m", "rope length", depends=())
    swing_angle = Output("rad", "swing angle, positive when the load is ahead of the trolley", depends=(), display_unit="deg")
    swing_rate = Output("rad/s", "rate of the swing angle", depends=(), display_unit="deg/s")
    load_position = Output("m", "horizontal position of the load", depends=())

    trolley_speed = State(0.0)

    def start(self):
        self.natural_frequency = math.sqrt(self.gravity / self.initial_rope_length)
        self.rope_length = self.initial_rope_length

    def step(self, t, h):
        if h > 0.0:
            if self.rope_length - self.hoist_speed * h <= 0.0:
                return ROPE_SPENT
            status = integrate(self, swing_derivatives, 2, h)
            if status:
                return status
            self.trolley_position += (self.trolley_speed + 0.5 * self.trolley_acceleration * h) * h
            self.trolley_speed += self.trolley_acceleration * h
            self.rope_length -= self.hoist_speed * h
        self.swing_angle = self.x[0]
        self.swing_rate = self.x[1]
        self.load_position = self.trolley_position + self.rope_length * math.sin(self.swing_angle)
        return 0


def swing_derivatives(m, s, x, slope):
    """Slopes of swing angle and rate, s after the start of the step."""
    length = m.rope_length - m.hoist_speed * s
    slope[0] = x[1]
    slope[1] = (
        -(m.gravity * math.sin(x[0]) + m.trolley_acceleration * math.cos(x[0]) - 2.0 * m.hoist_speed * x[1]) / length
        - 2.0 * m.damping_ratio * m.natural_frequency * x[1]
    )
