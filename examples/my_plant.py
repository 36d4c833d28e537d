"""A component of one's own: this file is all there is to write."""

import math

from shaper_fmu import Calculated, Component, Input, Output, Parameter


class CoupledTank(Component):
    """A tank filled by a pump and emptied through a hole: A level' = q - k level, propagated exactly for a held inflow."""

    inflow = Input("m3/s", "what the pump delivers")
    area = Parameter(0.5, "m2", "base area", min=0.0, exclusive=True)
    outflow_coefficient = Parameter(0.1, "m2/s", "outflow per level", min=0.0, exclusive=True)
    time_constant = Calculated("s", "area over outflow coefficient")
    level = Output("m", "level of the liquid", depends=())

    def start(self):
        self.time_constant = self.area / self.outflow_coefficient

    def step(self, t, h):
        rest = self.inflow / self.outflow_coefficient
        self.level = rest + (self.level - rest) * math.exp(-h / self.time_constant)
