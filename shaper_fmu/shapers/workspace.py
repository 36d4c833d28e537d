"""The fields of a record in which the design kernels work."""

from __future__ import annotations

from shaper_fmu.component import Component, State, Variable

UNKNOWNS = 16
"""Most unknowns of the equations that define a shaper."""


class DesignWorkspace(Component):
    """Base of components that design shapers; an instance of it serves a design from Python."""

    factor_amplitude: Variable[list[float]] = State(size=UNKNOWNS)  # one mode's sequence
    factor_delay: Variable[list[float]] = State(size=UNKNOWNS)
    certificate_left: Variable[float] = State(0.0)  # largest residual of the equations solved last
    unknown: Variable[list[float]] = State(size=UNKNOWNS)
    kept: Variable[list[float]] = State(size=UNKNOWNS)
    residual: Variable[list[float]] = State(size=UNKNOWNS)
    above: Variable[list[float]] = State(size=UNKNOWNS)
    below: Variable[list[float]] = State(size=UNKNOWNS)
    jacobian: Variable[list[float]] = State(size=UNKNOWNS * UNKNOWNS)
    damping: Variable[float] = State(0.0)  # damping ratio that the continuation has reached
    tolerance: Variable[float] = State(0.0)
    humps: Variable[int] = State(0)
    vibration_tolerance: Variable[float]
    """Declared by the components that have it."""
