"""Refines impulses on a grid to the shortest exact ones: successive linear programmes, then Newton's method.

The unknowns are those of a layout: amplitudes, free times, and the duration D as the last one. Constraints g(x) <= 0 are
linearised at their local maxima; each linear programme minimises D + penalty * violation within a trust region that shrinks
where the linearisation misleads. At the end a Gauss-Newton iteration with minimum-norm steps turns the active constraints
into equations solved to rounding, which fixes D to second order in the error that the programmes left.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence

import numpy as np
from scipy.optimize import linprog

from shaper_fmu.design.lp.exchange import peaks
from shaper_fmu.design.lp.layout import Band, GeneralLayout, Layout

Constraints = Callable[[np.ndarray], tuple[np.ndarray, np.ndarray]]

_PENALTY = 100.0
_CLUSTER_GAP = 1.5
_ACTIVE = 1e-4


def cluster(amplitudes: np.ndarray, positions: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Join impulses on neighbouring grid positions to one at their centre of mass; keep those at the ends of the grid there.

    The ends of the grid always belong to the result, with amplitude 0 if need be.
    """
    used = np.flatnonzero(amplitudes > 1e-7)
    gaps = np.flatnonzero(np.diff(used) > _CLUSTER_GAP) + 1
    groups = [group for group in np.split(used, gaps) if len(group)]
    joined = np.array([amplitudes[group].sum() for group in groups])
    centres = np.array([amplitudes[group] @ positions[group] / amplitudes[group].sum() for group in groups])
    last = len(amplitudes) - 1
    if groups[0][0] == 0:
        centres[0] = positions[0]
    else:
        joined, centres = np.append(0.0, joined), np.append(positions[0], centres)
    if groups[-1][-1] == last and len(centres) > 1:
        centres[-1] = positions[last]
    else:
        joined, centres = np.append(joined, 0.0), np.append(centres, positions[last])
    return joined / joined.sum(), centres


def starting_point(layout: Layout, amplitudes: np.ndarray, positions: np.ndarray, duration: float) -> np.ndarray:
    """Unknowns of a layout from a solution on the grid; pairs without amplitude at D/2 are left out."""
    joined, centres = cluster(amplitudes, positions)
    if layout is not GeneralLayout and joined[0] == 0.0:
        joined, centres = joined[1:], centres[1:]
    return layout.pack(joined, centres, duration)


def band_constraints(bands: Sequence[Band], layout: Layout) -> Constraints:
    """V / tolerance - 1 at every local maximum of V over the bands, with its gradient by the unknowns."""

    def constraints(x: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
        values, gradients = [], []
        for band in bands:
            found, v = peaks(layout.along(x, band.damping_ratio), band.low, band.high, float(x[-1]))
            s, by_unknown = layout.response(x, found, band.damping_ratio)
            direction = np.conj(s) / np.maximum(np.abs(s), 1e-300)
            values.append(v / band.tolerance - 1.0)
            gradients.append((direction[:, None] * by_unknown).real / band.tolerance)
        return np.concatenate(values), np.vstack(gradients)

    return constraints


def _step(x: np.ndarray, layout: Layout, g: np.ndarray, jacobian: np.ndarray, radius: float) -> tuple[np.ndarray, float]:
    """The best step within the trust region, and the merit that the linearisation promises for it."""
    lowest, highest = layout.limits(x)
    n = len(x)
    extent = np.concatenate((np.ones(layout.count(x)), np.full(n - layout.count(x), x[-1])))
    if layout is not GeneralLayout:
        extent[layout.count(x) : -1] = 0.25 * x[-1] ** 2
    extent *= radius
    low = np.clip((lowest - x) / extent, -1.0, 0.0)
    high = np.clip((highest - x) / extent, 0.0, 1.0)
    matrix = np.hstack((jacobian * extent / radius, -np.ones((len(g), 1))))
    cost = np.zeros(n + 1)
    cost[n - 1], cost[n] = extent[-1] / radius, _PENALTY * x[-1]
    total = np.zeros((1, n + 1))
    total[0, : layout.count(x)] = 1.0
    bounds = [*zip(low, high, strict=True), (0.0, None)]
    result = linprog(cost, matrix, -g / radius, total, [(1.0 - x[: layout.count(x)].sum()) / radius], bounds, method="highs")
    if result.x is None:
        return np.zeros(n), 0.0
    return result.x[:n] * extent, radius * float(result.fun)


def _corrected(x: np.ndarray, layout: Layout, g: np.ndarray, jacobian: np.ndarray) -> np.ndarray:
    """x moved by the least step that satisfies its violated constraints to first order."""
    violated = g > 0.0
    total = (np.arange(len(x)) < layout.count(x)).astype(float)
    free = x > 1e-12
    change = np.zeros(len(x))
    matrix = np.vstack((jacobian[violated], total))[:, free]
    change[free] = np.linalg.lstsq(matrix, np.append(-g[violated], 1.0 - total @ x), rcond=1e-10)[0]
    return np.clip(x + change, *layout.limits(x + change))


def shorten(x: np.ndarray, layout: Layout, constraints: Constraints) -> np.ndarray:
    """A local minimum of D under the constraints by successive linear programmes, from unknowns that nearly satisfy them.

    A step that the curvature of the constraints spoils gets a second-order correction before the trust region shrinks.
    """
    penalty = _PENALTY * x[-1]

    def merit_of(point: np.ndarray, g: np.ndarray) -> float:
        total = abs(1.0 - float(point[: layout.count(point)].sum()))
        return float(point[-1]) + penalty * (max(0.0, float(g.max())) + total)

    radius = 0.03
    g, jacobian = constraints(x)
    merit = merit_of(x, g)
    for _ in range(80):
        change, promised = _step(x, layout, g, jacobian, radius)
        predicted = merit - (x[-1] + promised)
        if predicted <= 1e-13 * x[-1] or radius < 1e-10:
            break
        candidate = np.clip(x + change, *layout.limits(x + change))
        new_g, new_jacobian = constraints(candidate)
        if merit - merit_of(candidate, new_g) < 0.75 * predicted and new_g.max() > 0.0:
            candidate = _corrected(candidate, layout, new_g, new_jacobian)
            new_g, new_jacobian = constraints(candidate)
        gain = (merit - merit_of(candidate, new_g)) / predicted
        if gain > 0.0:
            x, g, jacobian, merit = candidate, new_g, new_jacobian, merit_of(candidate, new_g)
        radius = min(0.1, 2.0 * radius) if gain > 0.75 else radius if gain > 0.25 else 0.25 * radius
    return x


def restore(x: np.ndarray, layout: Layout, constraints: Constraints) -> np.ndarray:
    """Solve the active constraints, g = 0, and sum A = 1 by minimum-norm Newton steps; returns the best point met.

    Unknowns at a limit (no amplitude, a pair merged at D/2) stay there.
    """
    best, least = x, np.inf
    for _ in range(12):
        g, jacobian = constraints(x)
        worst = max(0.0, float(g.max())) + abs(1.0 - float(x[: layout.count(x)].sum()))
        if not worst < least:
            break
        best, least = x, worst
        free = x > 1e-12
        active = g > -_ACTIVE
        matrix = np.vstack((jacobian[active], (np.arange(len(x)) < layout.count(x)).astype(float)))[:, free]
        target = np.append(-g[active], 1.0 - x[: layout.count(x)].sum())
        x = x.copy()
        x[free] += np.linalg.lstsq(matrix, target, rcond=1e-10)[0]
        if not np.all(np.isfinite(x)) or x.min() < 0.0:
            break
    return best


def polished(
    layout: Layout, amplitudes: np.ndarray, positions: np.ndarray, duration: float, constraints: Constraints
) -> np.ndarray:
    """The exact local optimum near a solution on the grid, as unknowns of the layout."""
    start = starting_point(layout, amplitudes, positions, duration)
    return restore(shorten(start, layout, constraints), layout, constraints)
