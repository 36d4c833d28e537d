"""The fields of a record in which kernels of smoothers are designed and evaluated."""

from __future__ import annotations

from shaper_fmu.component import State, Variable
from shaper_fmu.shapers.workspace import UNKNOWNS, DesignWorkspace

TERMS = 216
"""Most terms of a kernel: six for each of three modes, convolved."""
HIGHEST_ORDER = 6
COEFFICIENTS = HIGHEST_ORDER + 1


class SmootherWorkspace(DesignWorkspace):
    """Base of components that shape with distributed delays; an instance of it serves a design from Python."""

    factor_order: Variable[list[int]] = State(0, size=UNKNOWNS)  # of one mode's terms
    kept_order: Variable[list[int]] = State(0, size=UNKNOWNS)
    terms: Variable[int] = State(0)
    term_amplitude: Variable[list[float]] = State(size=TERMS)
    term_delay: Variable[list[float]] = State(size=TERMS)
    term_order: Variable[list[int]] = State(0, size=TERMS)
    pieces: Variable[int] = State(0)  # of the kernel's step response, each a polynomial in the time since it begins
    piece_begin: Variable[list[float]] = State(size=TERMS)
    piece_coefficient: Variable[list[float]] = State(size=TERMS * COEFFICIENTS)
    piece_integral: Variable[list[float]] = State(size=TERMS)  # of the step response up to there [s]
    piece_second: Variable[list[float]] = State(size=TERMS)  # and the integral of that [s2]
    box_share: Variable[float]
    ramp_periods: Variable[float]
    """Declared by the components that have them."""
