"""The exact optimum near a sequence of impulses, by Newton's method on the optimality conditions.

Successive linear programmes (polish) crawl where an optimum is no vertex, with fewer local maxima of V at the tolerance than
unknowns, and curvature decides. Here the conditions themselves are solved (Karush, Kuhn and Tucker): with g_i = V / tolerance - 1
at the i-th local maximum that matters, for the unknowns x of a layout that are not at a limit,

    grad D + sum_i lambda_i grad g_i + mu grad(sum A) = 0,     g_i = 0,     sum A = 1.

A maximum moves with x; grad g_i is the gradient of V there, and its differences, with the maximum followed, are second derivatives.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from scipy.optimize import nnls

from shaper_fmu.design.lp.exchange import Active, climb, peaks
from shaper_fmu.design.lp.layout import Band, GeneralLayout, Layout

_CLOSE = 2e-2
"""How much of its tolerance a local maximum may leave unused to come into question."""
_DIFFERENCE = 1e-5
_ROUNDS = 3
_BESIDE = 0.8
"""Maxima of V closer than this, over D, are one that has moved: V's ripple is 2 pi / D or longer."""
_ITERATIONS = 20
_FARTHEST = 0.1
_SOLVED = 3e-13
_NEARLY = 1e-9
"""Steps, relative to 1 for amplitudes and to D for times: too far, at rounding, and where rounding is larger."""
_ALLOWED = 1e-10
_MATTERS = 1e-9
_AT_LIMIT = 1e-12
_LEAST_SHARE = 0.0625
"""Of a step at which the residual would grow."""


@dataclass(frozen=True)
class _Peak:
    """A local maximum of V over a band: at frequency `w` [rad/s], which moves with the unknowns unless it is an end of the band."""

    band: Band
    w: float
    fixed: bool


def _peaks(x: np.ndarray, bands: Sequence[Band], layout: Layout) -> tuple[list[_Peak], np.ndarray]:
    """The local maxima over all bands, and V / tolerance - 1 there."""
    found, excess = [], []
    for band in bands:
        w, v = peaks(layout.along(x, band.damping_ratio), band.low, band.high, float(x[-1]))
        found += [_Peak(band, float(one), one in (band.low, band.high)) for one in w]
        excess.append(v / band.tolerance - 1.0)
    return found, np.concatenate(excess)


def _gradients(x: np.ndarray, chosen: Sequence[_Peak], layout: Layout) -> tuple[np.ndarray, np.ndarray]:
    """V / tolerance - 1 at these maxima, followed to where they are now, and its gradients by the unknowns."""
    values, rows = [], []
    for peak in chosen:
        band, w = peak.band, np.array([peak.w])
        if not peak.fixed:
            w = climb(layout.along(x, band.damping_ratio), w, np.array([band.low]), np.array([band.high]))
        s, by_unknown = layout.response(x, w, band.damping_ratio)
        values.append(float(np.abs(s[0])) / band.tolerance - 1.0)
        rows.append((np.conj(s[0]) / max(abs(s[0]), 1e-300) * by_unknown[0]).real / band.tolerance)
    return np.array(values), np.array(rows)


def stationary(x: np.ndarray, bands: Sequence[Band], layout: Layout, active: Sequence[Active] = ()) -> np.ndarray | None:
    """The unknowns of the optimum near x; None if Newton's method does not converge to one.

    `active`: where V limits the sequence, and how much, from the linear programme on the grid; without it, maxima of V near the
    tolerance come into question.
    """
    found, excess = _peaks(x, bands, layout)
    weights: dict[_Peak, float] = {}
    for band, w, multiplier in active:
        nearest = min((peak for peak in found if peak.band is band), key=lambda peak: abs(peak.w - w))
        weights[nearest] = weights.get(nearest, 0.0) + multiplier
    if not active:
        weights = {peak: 0.0 for peak, g in zip(found, excess, strict=True) if g > -_CLOSE}
    for _ in range(_ROUNDS if weights else 0):
        solved = _solved(x, list(weights), np.array(list(weights.values())), layout)
        if solved is None:
            return None
        x, multipliers = solved
        found, excess = _peaks(x, bands, layout)
        if excess.max() <= _ALLOWED:
            return x
        higher = [peak for peak, g in zip(found, excess, strict=True) if g > _ALLOWED]
        weights = _exchanged(multipliers, higher, _BESIDE / float(x[-1]))
    return None


def _exchanged(multipliers: dict[_Peak, float], higher: Sequence[_Peak], beside: float) -> dict[_Peak, float]:
    """The maxima that matter, with those that are higher: instead of one close by (an end of the band), or one more."""
    weights = dict(multipliers)
    for peak in higher:
        close = [one for one in weights if one.band is peak.band and abs(one.w - peak.w) <= beside]
        weights[peak] = sum(weights.pop(one) for one in close) or float(np.mean(list(multipliers.values())))
    return weights


def _multipliers(
    x: np.ndarray, layout: Layout, rows: np.ndarray, free: np.ndarray, weights: np.ndarray
) -> tuple[np.ndarray, float]:
    """The multipliers of the maxima, in the proportion of `weights` if these are known, and that of sum A.

    Their size follows from stretching the sequence: at an optimum that changes D only, as far as the maxima are concerned.
    """
    if not weights.any():
        total = (np.arange(len(x)) < layout.count(x)).astype(float)
        found = nnls(np.vstack((rows, total, -total))[:, free].T, -np.eye(len(x))[-1][free])[0]
        return found[:-2], float(found[-2] - found[-1])
    stretched = np.where(np.arange(len(x)) < layout.count(x), 0.0, 1.0 if layout is GeneralLayout else 2.0) * x / x[-1]
    stretched[-1] = 1.0
    by_stretching = float(weights @ rows @ stretched)
    return weights / max(-by_stretching, 1e-300), 0.0


def _solved(
    x: np.ndarray, chosen: list[_Peak], weights: np.ndarray, layout: Layout
) -> tuple[np.ndarray, dict[_Peak, float]] | None:
    """The optimum if only these maxima matter, and their multipliers; None if it is not an optimum."""
    rows = _gradients(x, chosen, layout)[1]
    multipliers, mu = _multipliers(x, layout, rows, x > _AT_LIMIT, weights)
    kept = multipliers > _MATTERS * multipliers.max(initial=0.0)
    conditions = _Conditions(layout, x, [peak for peak, one in zip(chosen, kept, strict=True) if one])
    unknowns = np.concatenate((x[conditions.free] / conditions.scale, multipliers[kept], [mu]))
    n, moved = len(conditions.scale), math.inf
    residual, jacobian = conditions.residual(unknowns)
    for _ in range(_ITERATIONS):
        system = np.block([[conditions.hessian(unknowns), jacobian.T], [jacobian, np.zeros((len(jacobian),) * 2)]])
        change = np.linalg.lstsq(system, -residual, rcond=1e-12)[0]
        moved = float(np.abs(change[:n]).max())
        if not moved <= _FARTHEST:
            return None
        before, share = float(np.linalg.norm(residual)), 1.0
        residual, jacobian = conditions.residual(unknowns + change)
        while not np.linalg.norm(residual) <= before and share > _LEAST_SHARE:
            share *= 0.5
            residual, jacobian = conditions.residual(unknowns + share * change)
        if not np.isfinite(residual).all():
            return None
        unknowns = unknowns + share * change
        if moved <= _SOLVED:
            break
    x = conditions.x_of(unknowns)
    inside = x.min() >= 0.0 and (x <= layout.limits(x)[1] * (1.0 + 1e-12)).all()
    if not (moved <= _NEARLY and inside and (unknowns[n:-1] > 0.0).all()):
        return None
    return x, dict(zip(conditions.chosen, unknowns[n:-1].tolist(), strict=True))


class _Conditions:
    """The conditions of optimality for unknowns (x that is free, over its scale; lambda; mu), with the other x at their limits."""

    def __init__(self, layout: Layout, x: np.ndarray, chosen: Sequence[_Peak]):
        self.free = x > _AT_LIMIT
        self._x, self._layout, self.chosen, self._count = x, layout, chosen, layout.count(x)
        self.scale = np.where(np.arange(len(x)) < self._count, 1.0, x[-1])[self.free]
        self._total = (np.arange(len(x)) < self._count).astype(float)[self.free]

    def x_of(self, unknowns: np.ndarray) -> np.ndarray:
        """All unknowns of the layout."""
        x = self._x.copy()
        x[self.free] = unknowns[: len(self.scale)] * self.scale
        return x

    def residual(self, unknowns: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
        """The residual of the optimality conditions, and the gradients of g_i and of sum A by the scaled unknowns."""
        x = self.x_of(unknowns)
        if x.min() < 0.0:  # outside of what the layout can be
            return np.full(len(unknowns), math.inf), np.zeros((len(unknowns) - len(self.scale), len(self.scale)))
        g, rows = _gradients(x, self.chosen, self._layout)
        jacobian = np.vstack((rows[:, self.free], self._total)) * self.scale
        gradient = unknowns[len(self.scale) :] @ jacobian
        gradient[-1] += self.scale[-1]
        return np.concatenate((gradient, g, [x[: self._count].sum() - 1.0])), jacobian

    def hessian(self, unknowns: np.ndarray) -> np.ndarray:
        """Second derivatives of sum_i lambda_i g_i by the scaled unknowns, by central differences of the gradients."""
        n = len(self.scale)
        columns = []
        for k in range(n):
            step = np.zeros(len(unknowns))
            step[k] = min(_DIFFERENCE, 0.5 * unknowns[k])
            ahead, behind = (self.residual(unknowns + sign * step)[0][:n] for sign in (1.0, -1.0))
            columns.append((ahead - behind) / (2.0 * step[k]))
        hessian = np.array(columns)
        return 0.5 * (hessian + hessian.T)
