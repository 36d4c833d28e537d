"""Two modes at once: the shortest positive sequence that leaves both without vibration, instead of a convolution.

Hyde and Seering 1991 solve the conditions of several modes together; the result is at most as long as the convolution of one
shaper for each mode, and usually shorter. Conditions at both modes, with wd = w sqrt(1 - zeta^2):

    S = sum A_i exp(zeta w (t_i - D)) exp(j wd t_i) = 0, and for "zvd" also dS/dw = 0;  A_i >= 0, sum A_i = 1.

On a grid of impulse times a linear programme decides whether a duration D allows this, and D is bisected; then the impulse
times are set free, D is shortened, and the conditions are solved by Newton's method with minimum-norm steps.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import replace

import numpy as np
from scipy.optimize import linprog

from shaper_fmu.design.impulse_sequence import ImpulseSequence, convolve_all
from shaper_fmu.design.lp.layout import GeneralLayout, Layout, layout_for, to_sequence
from shaper_fmu.design.lp.polish import Constraints, polished
from shaper_fmu.design.specified_bands import FARTHEST, MOST_DAMPED
from shaper_fmu.errors import ArgumentError, NoSolutionError
from shaper_fmu.shapers.zero_derivative import zero_derivative

_ORDERS = {"zv": 0, "zvd": 1}
_CERTIFIED = 1e-11
_GRID_PER_PERIOD = 48
_FINEST_GRID = 240
_PRECISION = 1e-6
_SOLVED = 1e-8


def direct_two_mode(
    frequencies: Sequence[float], damping_ratios: Sequence[float] = (0.0, 0.0), shaper: str = "zv"
) -> ImpulseSequence:
    """Shortest positive sequence without residual vibration at two modes, V = 0, and for "zvd" also dV/dw = 0.

    It is never longer than the convolution of the ZV or ZVD shapers of both modes: should the search not find a sequence that
    is shorter and solves the conditions to 1e-11, the convolution itself is returned.

    Args:
        frequencies: natural frequencies of both modes [rad/s], different and within a factor of 30.
        damping_ratios: of both modes [-], 0 to 0.5.
        shaper: "zv" or "zvd".

    Returns:
        The sequence; its certificate is the largest |S|, and for "zvd" |sum A_i w t_i exp(...)|, at both modes.

    Raises:
        ArgumentError: if an argument is out of these limits.
    """
    modes = _checked(frequencies, damping_ratios, shaper)
    order = _ORDERS[shaper]
    unit = 1.0 / modes[-1][0]  # times in radians of the faster mode
    scaled = [(w * unit, zeta) for w, zeta in modes]
    convolution = _convolution(modes, order)
    layout = layout_for([zeta for _, zeta in modes])
    amplitudes, positions, duration = _shortest_on_grid(scaled, order, layout, convolution.duration / unit)
    x = polished(layout, amplitudes, positions, duration, _constraints(scaled, order, layout))
    direct = to_sequence(*layout.impulses(x), unit)
    certificate = residual(direct, modes, order)
    if certificate < _CERTIFIED and direct.duration <= convolution.duration and min(direct.amplitudes) >= 0.0:
        return replace(direct, certificate=certificate)
    return replace(convolution, certificate=residual(convolution, modes, order))


def _checked(frequencies: Sequence[float], damping_ratios: Sequence[float], shaper: str) -> list[tuple[float, float]]:
    if shaper not in _ORDERS:
        raise ArgumentError(f"shaper {shaper!r}: must be one of {', '.join(_ORDERS)}")
    if len(frequencies) != 2 or len(damping_ratios) != 2:
        raise ArgumentError(f"{len(frequencies)} frequencies and {len(damping_ratios)} damping ratios: two of each are needed")
    modes = sorted((float(w), float(zeta)) for w, zeta in zip(frequencies, damping_ratios, strict=True))
    (low, _), (high, _) = modes
    if not all(0.0 < w < math.inf for w, _ in modes):
        raise ArgumentError(f"frequencies {low:g} and {high:g} rad/s: must be positive and finite")
    if not low * (1.0 + 1e-6) < high <= FARTHEST * low:
        raise ArgumentError(f"frequencies {low:g} and {high:g} rad/s: must differ, by a factor of {FARTHEST:g} at most")
    for _, zeta in modes:
        if not 0.0 <= zeta <= MOST_DAMPED:
            raise ArgumentError(f"damping ratio {zeta:g}: must be 0 to {MOST_DAMPED:g}")
    return modes


def _convolution(modes: Sequence[tuple[float, float]], order: int) -> ImpulseSequence:
    sequences = []
    for w, zeta in modes:
        amplitudes, delays = [0.0] * 3, [0.0] * 3
        count = zero_derivative(amplitudes, delays, order, w, zeta)
        sequences.append(ImpulseSequence(tuple(amplitudes[:count]), tuple(delays[:count]), 0.0))
    return convolve_all(sequences)


def residual(sequence: ImpulseSequence, modes: Sequence[tuple[float, float]], order: int) -> float:
    """The largest |S|, and for order 1 also |sum A_i w t_i exp(...)|, of a sequence at modes (w [rad/s], zeta)."""
    amplitudes, delays = np.array(sequence.amplitudes), np.array(sequence.delays)
    worst = 0.0
    for w, zeta in modes:
        for columns in (GeneralLayout.columns, GeneralLayout.slope_columns)[: order + 1]:
            worst = max(worst, abs(complex((columns(delays, sequence.duration, np.array([w]), zeta) @ amplitudes)[0])))
    return worst


def _shortest_on_grid(
    modes: Sequence[tuple[float, float]], order: int, layout: Layout, longest: float
) -> tuple[np.ndarray, np.ndarray, float]:
    """Amplitudes and positions on a grid, and the least duration, a little more than `longest` at most, that allows them."""
    infeasible, feasible = 0.0, 1.001 * longest
    amplitudes, positions, _ = _least_residual(modes, order, layout, feasible)
    while feasible - infeasible > _PRECISION * feasible:
        middle = 0.5 * (infeasible + feasible)
        candidate, grid, left = _least_residual(modes, order, layout, middle)
        if left > _SOLVED:
            infeasible = middle
        else:
            feasible, amplitudes, positions = middle, candidate, grid
    return amplitudes, positions, feasible


def _least_residual(
    modes: Sequence[tuple[float, float]], order: int, layout: Layout, duration: float
) -> tuple[np.ndarray, np.ndarray, float]:
    """Amplitudes and positions on a grid of the sequence of this duration whose largest residual is least, and the residual."""
    reach = layout.reach * duration
    count = max(_FINEST_GRID, math.ceil(_GRID_PER_PERIOD * reach / (2.0 * math.pi)))
    positions = np.linspace(0.0, reach, count + 1)
    rows = []
    for w, zeta in modes:
        for columns in (layout.columns, layout.slope_columns)[: order + 1]:
            row = columns(positions, duration, np.array([w]), zeta)[0]
            rows.extend((row.real, row.imag) if layout is GeneralLayout else (row.real,))
    matrix = np.array(rows + [-row for row in rows])
    matrix = np.hstack((matrix, -np.ones((len(matrix), 1))))
    n = len(positions)
    cost = np.concatenate((np.zeros(n), [1.0]))
    options = {"primal_feasibility_tolerance": 1e-10, "dual_feasibility_tolerance": 1e-10}
    result = linprog(cost, matrix, np.zeros(len(matrix)), 1.0 - cost[None], [1.0], method="highs", options=options)
    if result.x is None:
        raise NoSolutionError(f"the linear programme of the shaper was not solved: {result.message}")
    return result.x[:n], positions, float(result.x[n])


def _constraints(modes: Sequence[tuple[float, float]], order: int, layout: Layout) -> Constraints:
    """Both signs of every condition, each to be <= 0, with gradients by the unknowns."""

    def constraints(x: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
        values, gradients = [], []
        for w, zeta in modes:
            for function in (layout.response, layout.slope)[: order + 1]:
                s, gradient = function(x, np.array([w]), zeta)
                for part in (np.real, np.imag) if layout is GeneralLayout else (np.real,):
                    values.append(part(s))
                    gradients.append(part(gradient))
        g, jacobian = np.concatenate(values), np.vstack(gradients)
        return np.concatenate((g, -g)), np.vstack((jacobian, -jacobian))

    return constraints
