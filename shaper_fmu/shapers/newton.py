"""Newton's method with continuation in the damping ratio, for the equations that define a damped shaper.

A design keeps its unknowns in `m.unknown` and writes the residuals of its equations by a function system(m, x, f).
The undamped design is known in closed form; the damped one is reached from it in steps of the damping ratio.
"""

from __future__ import annotations

from collections.abc import Callable

from shaper_fmu.shapers.workspace import UNKNOWNS, DesignWorkspace
from shaper_fmu.variable import Array

Equations = Callable[[DesignWorkspace, Array, Array], None]
"""system(m, x, f): writes the residuals of the equations at x into f."""
CERTIFIED = 1e-11
"""Largest residual of the equations that a solution may leave."""

_FARTHEST = 100.0  # no delay [rad], amplitude or frequency ratio lies beyond
_ROUNDING = 2e-15
_DIFFERENCE = 1e-6
_MOST_ITERATIONS = 15
_LARGEST_STEP = 0.05
_SMALLEST_STEP = 1e-3


def follow_damping(m: DesignWorkspace, system: Equations, unknowns: int, damping_ratio: float) -> bool:
    """Solve at damping 0 from the guess in m.unknown, then follow the solution to `damping_ratio`; True if it gets there.

    m.damping is the damping ratio that the system function reads; the residual that is left is in m.certificate_left.
    """
    m.damping = 0.0
    if not newton(m, system, unknowns):
        return False
    reached = 0.0
    step = _LARGEST_STEP
    while reached < damping_ratio:
        if step < _SMALLEST_STEP:
            m.damping = reached
            return False
        for i in range(unknowns):
            m.kept[i] = m.unknown[i]
        m.damping = min(damping_ratio, reached + step)
        if newton(m, system, unknowns) and _near(m.unknown, m.kept, unknowns):
            reached = m.damping
            step = min(_LARGEST_STEP, 1.5 * step)
        else:
            step *= 0.5
            for i in range(unknowns):
                m.unknown[i] = m.kept[i]
    return True


def _near(values: Array, before: Array, count: int) -> bool:
    """Whether a solution is the continuation of the one before, and not another branch."""
    for i in range(count):
        if not abs(values[i] - before[i]) <= 0.3 * (1.0 + abs(before[i])):
            return False
    return True


def newton(m: DesignWorkspace, system: Equations, unknowns: int) -> bool:
    """Improve m.unknown until the residuals are below CERTIFIED and fall no further; True if they are."""
    last = 1e300
    for _ in range(_MOST_ITERATIONS):
        system(m, m.unknown, m.residual)
        worst = _largest(m.residual, unknowns)
        m.certificate_left = worst
        if worst <= _ROUNDING or (worst < CERTIFIED and worst > 0.1 * last):
            return True
        if not worst < 1e3:
            return False
        last = worst
        _differentiate(m, system, unknowns)
        if not _solve(m.jacobian, m.residual, unknowns):
            return False
        for i in range(unknowns):
            m.unknown[i] -= m.residual[i]
        if not _largest(m.unknown, unknowns) < _FARTHEST:
            return False
    return m.certificate_left < CERTIFIED


def _largest(values: Array, count: int) -> float:
    worst = 0.0
    for i in range(count):
        if not abs(values[i]) <= worst:  # also NaN
            worst = abs(values[i])
    return worst


def _differentiate(m: DesignWorkspace, system: Equations, unknowns: int) -> None:
    """The Jacobian by central differences, row by row, in m.jacobian."""
    for j in range(unknowns):
        value = m.unknown[j]
        m.unknown[j] = value + _DIFFERENCE
        system(m, m.unknown, m.above)
        m.unknown[j] = value - _DIFFERENCE
        system(m, m.unknown, m.below)
        m.unknown[j] = value
        for i in range(unknowns):
            m.jacobian[i * UNKNOWNS + j] = (m.above[i] - m.below[i]) / (2.0 * _DIFFERENCE)


def _solve(a: Array, b: Array, n: int) -> bool:
    """Solve a x = b in place by elimination with partial pivoting, x in b; False if a is singular."""
    for k in range(n):
        pivot = k
        for i in range(k + 1, n):
            if abs(a[i * UNKNOWNS + k]) > abs(a[pivot * UNKNOWNS + k]):
                pivot = i
        if not abs(a[pivot * UNKNOWNS + k]) > 1e-13:
            return False
        for j in range(n):
            value = a[k * UNKNOWNS + j]
            a[k * UNKNOWNS + j] = a[pivot * UNKNOWNS + j]
            a[pivot * UNKNOWNS + j] = value
        value = b[k]
        b[k] = b[pivot]
        b[pivot] = value
        for i in range(k + 1, n):
            factor = a[i * UNKNOWNS + k] / a[k * UNKNOWNS + k]
            for j in range(k, n):
                a[i * UNKNOWNS + j] -= factor * a[k * UNKNOWNS + j]
            b[i] -= factor * b[k]
    for k in range(n - 1, -1, -1):
        for j in range(k + 1, n):
            b[k] -= a[k * UNKNOWNS + j] * b[j]
        b[k] /= a[k * UNKNOWNS + k]
    return True
