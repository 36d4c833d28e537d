"""The fields of a record in which the design kernels work."""

from __future__ import annotations

from shaper_fmu.component import Component, State
from shaper_fmu.shapers.newton import UNKNOWNS


class DesignWorkspace(Component):
    """Base of components that design shapers; an instance of it serves a design from Python."""

    factor_amplitude = State(size=UNKNOWNS)  # one mode's sequence
    factor_delay = State(size=UNKNOWNS)
    certificate_left = State(0.0)  # largest residual of the equations solved last
    unknown = State(size=UNKNOWNS)
    kept = State(size=UNKNOWNS)
    residual = State(size=UNKNOWNS)
    above = State(size=UNKNOWNS)
    below = State(size=UNKNOWNS)
    jacobian = State(size=UNKNOWNS * UNKNOWNS)
    damping = State(0.0)  # damping ratio that the continuation has reached
    tolerance = State(0.0)
    humps = State(0)
