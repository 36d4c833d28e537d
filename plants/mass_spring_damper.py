"""Mass, spring and damper: the reference plant, propagated without error."""

from __future__ import annotations

import math

from shaper_fmu.component import Calculated, Component, Input, Output, Parameter, State


class MassSpringDamper(Component):
    """Mass on a spring and a damper: m x'' + c x' + k x = F, from rest, propagated exactly for a held force.

    The transition matrix of the communication step is computed in closed form (under-, over- and critically damped) and
    kept while the step stays the same.
    """

    continuous_states = ("position", "velocity")

    force = Input("N", "force on the mass")
    mass = Parameter(1.0, "kg", "moving mass", min=0.0, exclusive=True)
    stiffness = Parameter(100.0, "N/m", "spring stiffness", min=0.0, exclusive=True)
    damping = Parameter(1.0, "N.s/m", "viscous damping", min=0.0)
    natural_frequency = Calculated("rad/s", "undamped natural frequency sqrt(k/m)")
    damping_ratio = Calculated("", "damping ratio c / (2 sqrt(k m))")
    position = Output("m", "displacement from the spring's rest", depends=(), derivative="velocity")
    velocity = Output("m/s", "speed", depends=(), derivative="acceleration")
    acceleration = Output("m/s2", "acceleration", depends=("force",))

    known_step = State(-1.0)  # the step that the transition matrix belongs to
    transition = State(size=4)

    def start(self):
        self.natural_frequency = math.sqrt(self.stiffness / self.mass)
        self.damping_ratio = 0.5 * self.damping / math.sqrt(self.stiffness * self.mass)

    def step(self, t, h):
        if h > 0.0:
            if h != self.known_step:
                self.known_step = h
                oscillator_transition(self.transition, self.natural_frequency, self.damping_ratio, h)
            rest = self.force / self.stiffness
            deviation = self.position - rest
            speed = self.velocity
            self.position = rest + self.transition[0] * deviation + self.transition[1] * speed
            self.velocity = self.transition[2] * deviation + self.transition[3] * speed
        self.acceleration = (self.force - self.damping * self.velocity - self.stiffness * self.position) / self.mass


def oscillator_transition(transition, natural_frequency, damping_ratio, h):
    """Write exp(A h), row by row, for A = [[0, 1], [-wn^2, -2 zeta wn]]."""
    stiffness = natural_frequency * natural_frequency
    decay = damping_ratio * natural_frequency
    square = (damping_ratio * damping_ratio - 1.0) * stiffness * h * h
    if abs(square) < 1e-2:  # near critical damping the closed forms cancel; the series has converged at this order
        envelope = math.exp(-decay * h)
        cosine = envelope * (1.0 + square / 2.0 * (1.0 + square / 12.0 * (1.0 + square / 30.0 * (1.0 + square / 56.0))))
        sine = envelope * h * (1.0 + square / 6.0 * (1.0 + square / 20.0 * (1.0 + square / 42.0 * (1.0 + square / 72.0))))
    elif square < 0.0:
        damped = natural_frequency * math.sqrt(1.0 - damping_ratio * damping_ratio)
        envelope = math.exp(-decay * h)
        cosine = envelope * math.cos(damped * h)
        sine = envelope * math.sin(damped * h) / damped
    else:
        spread = natural_frequency * math.sqrt(damping_ratio * damping_ratio - 1.0)
        slow = math.exp(-stiffness / (decay + spread) * h)
        fast = math.exp(-(decay + spread) * h)
        cosine = 0.5 * (slow + fast)
        sine = 0.5 * (slow - fast) / spread
    transition[0] = cosine + decay * sine
    transition[1] = sine
    transition[2] = -stiffness * sine
    transition[3] = cosine - decay * sine
