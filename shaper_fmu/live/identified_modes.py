"""Some modes as a plant of the page: what a tuning has identified, or a design is for."""

from __future__ import annotations

import math

from shaper_fmu.component import Component, Input, Output, Parameter, State, Variable

MOST = 4


class IdentifiedModes(Component):
    """Damped modes in parallel, each driven by the command: x'' + 2 zeta w x' + w^2 x = w^2 u, exact for a command that is held."""

    command: Variable[float] = Input("", "command")
    modes: Variable[int] = Parameter(1, "", "number of modes", min=1, max=MOST)
    natural_frequency: Variable[list[float]] = Parameter(1.0, "rad/s", "natural frequencies", size=MOST, min=0.0, exclusive=True)
    damping_ratio: Variable[list[float]] = Parameter(0.0, "", "damping ratios", size=MOST, min=0.0, max=1.0, exclusive="max")
    share: Variable[list[float]] = Parameter([1.0, 0.0, 0.0, 0.0], "", "share of each mode in the response", size=MOST)
    response: Variable[float] = Output("", "response")
    place: Variable[list[float]] = State(size=MOST)
    speed: Variable[list[float]] = State(size=MOST)

    def step(self, t: float, h: float) -> None:
        self.response = 0.0
        for i in range(self.modes):
            w = self.natural_frequency[i]
            decay = self.damping_ratio[i] * w
            damped = w * math.sqrt(1.0 - self.damping_ratio[i] * self.damping_ratio[i])
            left = math.exp(-decay * h)
            cosine = left * math.cos(damped * h)
            sine = left * math.sin(damped * h) / damped
            x = self.place[i] - self.command
            v = self.speed[i]
            self.place[i] = self.command + cosine * x + sine * (v + decay * x)
            self.speed[i] = cosine * v - sine * (decay * v + w * w * x)
            self.response += self.share[i] * self.place[i]
