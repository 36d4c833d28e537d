"""Integration of nonlinear plants inside a communication step, with error control.

Dormand and Prince 1980: the pair of orders 5 and 4, advanced with the fifth order.
"""

from __future__ import annotations

from collections.abc import Callable
from typing import ClassVar, TypeVar

from shaper_fmu.component import Component, State, Variable
from shaper_fmu.variable import Array

Plant = TypeVar("Plant", bound="Integrated")
Derivatives = Callable[[Plant, float, Array, Array], None]
"""derivatives(m, s, x, slope): writes the slopes of the states x at s [s] after the start of the step into slope."""
STATES = 8
STAGES = 7
TOLERANCE = 1e-10
"""Tolerated local error of each state: TOLERANCE (1 + |x|), in the state's SI unit."""

INTEGRATION_FAILED = 90
MARGIN_SPENT = 91
_SHORTEST = 1e-12
_MOST_SUBSTEPS = 1_000_000


class Integrated(Component):
    """A component with up to 8 continuous states x[0] .. x[STATES - 1], integrated by `integrate`."""

    messages: ClassVar[dict[int, str]] = {
        INTEGRATION_FAILED: "the equations cannot be integrated to the tolerance 1e-10; check the inputs and parameters"
    }

    x: Variable[list[float]] = State(size=STATES)
    x_stage: Variable[list[float]] = State(size=STATES)
    slope: Variable[list[float]] = State(size=STATES)
    slopes: Variable[list[float]] = State(size=STATES * STAGES)
    substep: Variable[float] = State(0.0)  # kept over the steps, as the first guess
    margin: Variable[float] = State(1.0)  # where `derivatives` writes it: the equations hold while it is positive


def integrate(m: Plant, derivatives: Derivatives[Plant], states: int, h: float) -> int:
    """Advance the first `states` of m.x by h > 0; `derivatives(m, s, x, slope)` writes the slopes at s in [0, h].

    Returns 0, INTEGRATION_FAILED, or MARGIN_SPENT, with m.x at the end of the first substep at which m.margin is not positive.
    """
    s = 0.0
    if m.substep <= 0.0:
        m.substep = h
    for _ in range(_MOST_SUBSTEPS):
        trial = min(m.substep, h - s)
        last = trial >= h - s
        error = _trial_step(m, derivatives, states, s, trial)
        if error <= 1.0:
            for i in range(states):
                m.x[i] = m.x_stage[i]
            if m.margin <= 0.0:  # of the last stage, which is the end of this substep
                return MARGIN_SPENT
            s += trial
            if last:
                if trial == m.substep:
                    m.substep = trial * _growth(error)
                return 0
            m.substep = trial * _growth(error)
        else:
            if not trial > _SHORTEST * h:
                return INTEGRATION_FAILED
            m.substep = trial * (_growth(error) if error < 1e30 else 0.1)
    return INTEGRATION_FAILED


def _growth(error: float) -> float:
    """Factor on the step for the next trial, from the error relative to the tolerance."""
    if error <= 1e-5:
        return 5.0
    return max(0.2, min(5.0, 0.9 * error ** (-0.2)))


def _trial_step(m: Plant, derivatives: Derivatives[Plant], states: int, s: float, h: float) -> float:
    """One step of the pair from m.x; the result of order 5 in m.x_stage; returns the error relative to the tolerance."""
    _stage(m, derivatives, states, 0, s, h, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0)
    _stage(m, derivatives, states, 1, s + h / 5, h, 1 / 5, 0.0, 0.0, 0.0, 0.0, 0.0)
    _stage(m, derivatives, states, 2, s + 3 * h / 10, h, 3 / 40, 9 / 40, 0.0, 0.0, 0.0, 0.0)
    _stage(m, derivatives, states, 3, s + 4 * h / 5, h, 44 / 45, -56 / 15, 32 / 9, 0.0, 0.0, 0.0)
    _stage(m, derivatives, states, 4, s + 8 * h / 9, h, 19372 / 6561, -25360 / 2187, 64448 / 6561, -212 / 729, 0.0, 0.0)
    _stage(m, derivatives, states, 5, s + h, h, 9017 / 3168, -355 / 33, 46732 / 5247, 49 / 176, -5103 / 18656, 0.0)
    _stage(m, derivatives, states, 6, s + h, h, 35 / 384, 0.0, 500 / 1113, 125 / 192, -2187 / 6784, 11 / 84)
    largest = 0.0
    for i in range(states):
        k = m.slopes
        error = h * (
            71 / 57600 * k[i] - 71 / 16695 * k[2 * STATES + i] + 71 / 1920 * k[3 * STATES + i]
            - 17253 / 339200 * k[4 * STATES + i] + 22 / 525 * k[5 * STATES + i] - 1 / 40 * k[6 * STATES + i]
        )  # fmt: skip
        relative = abs(error) / (TOLERANCE * (1.0 + abs(m.x_stage[i])))
        if not relative <= 1e30:  # also NaN: the trial went out of the equations' domain
            return 1e31
        largest = max(largest, relative)
    return largest


def _stage(
    m: Plant,
    derivatives: Derivatives[Plant],
    states: int,
    number: int,
    s: float,
    h: float,
    a0: float,
    a1: float,
    a2: float,
    a3: float,
    a4: float,
    a5: float,
) -> None:
    """The state of this stage from the slopes before it, into m.x_stage, and its slope."""
    k = m.slopes
    for i in range(states):
        m.x_stage[i] = m.x[i] + h * (
            a0 * k[i] + a1 * k[STATES + i] + a2 * k[2 * STATES + i]
            + a3 * k[3 * STATES + i] + a4 * k[4 * STATES + i] + a5 * k[5 * STATES + i]
        )  # fmt: skip
    derivatives(m, s, m.x_stage, m.slope)
    for i in range(states):
        k[number * STATES + i] = m.slope[i]
