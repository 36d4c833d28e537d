"""Maximum likelihood of the poles by variable projection: the residues are linear and drop out.

Golub and Pereyra 1973, with the Jacobian of Kaufman 1975, solved by the Levenberg-Marquardt method. White noise with a variance
of its own in each column is assumed; the Jacobian then gives the covariance (it is the Schur complement of Fisher's information).
"""

from __future__ import annotations

import math
from dataclasses import dataclass, replace

import numpy as np

from shaper_fmu.analysis.identification.basis import Model, basis, directions
from shaper_fmu.analysis.identification.record import Data

_SINGULAR = 1e-13
"""Squares of singular values of the basis, its columns of length 1, below this share of the largest count as 0."""
_STEPS = 60
_CONVERGED = 1e-3
"""Steps below this many standard deviations end the search."""
_STANDING = 1e-10
"""As do steps that lower the cost by less than this share."""
_REACHED = 1e-10
"""A Newton step that gains less than this, 1e-5 standard deviations, is not taken."""
_ROUNDED = 1e-2
"""A gain of this much, 0.1 standard deviations, may be lost in rounding where steps lower the cost no more, or hardly."""


@dataclass(frozen=True)
class Fit:
    """A model with its best coefficients.

    Attributes:
        model: poles.
        coefficients: of the basis, shape (order, c), in scaled units.
        noise: standard deviation of each column's residual, shape (c,), not below its floor.
        residual: shape (c, n).
        criterion: Bayesian information criterion, -2 log likelihood + parameters * log(values), poles counted twice.
        converged: whether the search has come to its end.
    """

    model: Model
    coefficients: np.ndarray
    noise: np.ndarray
    residual: np.ndarray
    criterion: float
    converged: bool = True


@dataclass(frozen=True)
class _Projected:
    """The basis, an orthonormal basis of its span (r, n), how that is made (r, order), coefficients and residuals (c, n)."""

    functions: np.ndarray
    span: np.ndarray
    change: np.ndarray
    coefficients: np.ndarray
    residual: np.ndarray


def project(m: Model, data: Data) -> _Projected:
    """The best coefficients for given poles; directions in which functions coincide are left out, so that they do no harm."""
    functions = basis(m, data.time)
    span, change = orthonormal(functions)
    inside = products(span, data.y)
    return _Projected(functions, span, change, change.T @ inside, data.y - mixed(inside.T, span))


def orthonormal(functions: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """An orthonormal basis of the rows, shape (r, n), and the matrix (r, order) that makes it of them.

    By the eigenvectors of the Gram matrix, twice, since the second time takes away what rounding has left.
    """
    size = np.sqrt(np.einsum("ij,ij->i", functions, functions))
    size[size == 0.0] = 1.0
    span, change = functions, np.diag(1.0 / size)
    for _ in range(2 if len(functions) else 0):
        span = mixed(change, functions)
        values, vectors = np.linalg.eigh(products(span, span))
        kept = values > _SINGULAR * values[-1]
        turn = (vectors[:, kept] / np.sqrt(values[kept])).T
        change, span = turn @ change, mixed(turn, span)
    return span, change


def products(a: np.ndarray, b: np.ndarray) -> np.ndarray:
    """Inner products of the rows, long ones, of a and b. Not by BLAS: its threads cost more than such small products."""
    return np.einsum("in,jn->ij", a, b)


def mixed(weights: np.ndarray, rows: np.ndarray) -> np.ndarray:
    """weights @ rows, where rows are long."""
    return np.einsum("ij,jn->in", weights, rows)


def fit(m: Model, data: Data) -> Fit:
    """The model with these very poles."""
    found = project(m, data)
    squares = np.einsum("ij,ij->i", found.residual, found.residual)
    columns, n = data.y.shape
    free = max(1.0, n - m.order - len(m.parameters) / columns)
    deviation = np.sqrt(np.maximum(squares / n, data.floor**2))
    unknowns = 2 * len(m.parameters) + m.order * columns  # poles twice: they are sought among many (Djuric 1996)
    criterion = 2.0 * n * float(np.log(deviation).sum()) + unknowns * math.log(n * columns)
    noise = np.maximum(np.sqrt(squares / free), data.floor)
    return Fit(m, found.coefficients, noise, found.residual, criterion)


def polish(m: Model, data: Data, rounds: int = 3, steps: int = _STEPS) -> Fit:
    """The poles of greatest likelihood near the given ones; the columns' noise is estimated anew in each round of some steps."""
    best = fit(m, data)
    if not len(m.parameters):
        return best
    for _ in range(rounds):
        moved, converged = _minimised(best.model, data, best.noise, steps)
        found = replace(fit(moved, data), converged=converged)
        change = float(np.abs(found.noise / best.noise - 1.0).max())
        if not found.criterion <= best.criterion + 1e-9 * abs(best.criterion):
            return best
        best = found
        if change < 0.02:
            break
    return best


def _minimised(m: Model, data: Data, noise: np.ndarray, steps: int) -> tuple[Model, bool]:
    """Levenberg-Marquardt on the weighted sum of squares; whether it has come to its end."""
    values, damping = m.parameters, 1e-3
    found = project(m, data)
    cost, gain = _cost(found, noise), math.inf
    for _ in range(steps):
        information, gradient = _normal_equations(m.with_parameters(values), found, data, noise)
        size = np.sqrt(np.maximum(np.diag(information), 1e-300))
        scaled_information, scaled_gradient = information / np.outer(size, size), gradient / size
        gain = float(scaled_gradient @ np.linalg.lstsq(scaled_information, scaled_gradient, rcond=1e-14)[0])
        if gain < _REACHED:
            return m.with_parameters(values), True
        while damping < 1e9:
            move = np.linalg.lstsq(scaled_information + damping * np.eye(len(size)), scaled_gradient, rcond=1e-14)[0]
            trial = values + move / size
            if _allowed(trial, m, data):
                candidate = m.with_parameters(trial)
                there = project(candidate, data)
                lower = _cost(there, noise)
                if lower <= cost:
                    break
            damping *= 8.0
        else:
            return m.with_parameters(values), gain < _ROUNDED
        values, found = candidate.parameters, there
        ended = np.abs(move).max() < _CONVERGED or cost - lower <= _STANDING * cost
        cost = lower
        damping = max(1e-12, damping / 10.0)
        if ended and damping < 1.0:
            return m.with_parameters(values), True
    return m.with_parameters(values), gain < _ROUNDED


def _cost(found: _Projected, noise: np.ndarray) -> float:
    return float(np.einsum("ij,ij->i", found.residual, found.residual) @ noise**-2)


def _allowed(values: np.ndarray, m: Model, data: Data) -> bool:
    """Whether no pole runs away: beyond the Nyquist frequency, or so that it decays or grows within a sample."""
    rate = 5.0 / data.step
    p = len(m.pairs)
    real = np.concatenate([values[: 2 * p : 2], values[2 * p :]])
    return bool(
        np.isfinite(values).all() and (np.abs(real) < rate).all() and (np.abs(values[1 : 2 * p : 2]) < np.pi / data.step).all()
    )


def _normal_equations(m: Model, found: _Projected, data: Data, noise: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Fisher's information of the poles (unit noise after weighting), and minus half the gradient of the cost."""
    late = found.functions[: len(m.parameters)] * data.time
    late -= mixed(products(late, found.span), found.span)
    weighted = directions(m, found.coefficients / noise)
    information = np.einsum("ikc,ij,jlc->kl", weighted, products(late, late), weighted, optimize=True)
    return information, np.einsum("ikc,ic->k", weighted, products(late, found.residual) / noise)


@dataclass(frozen=True)
class Covariance:
    """Of the parameters, shape (k, k), and standard deviations of the coefficients, shape (order, c), in scaled units."""

    parameters: np.ndarray
    coefficients: np.ndarray


def covariance(found: Fit, data: Data) -> Covariance:
    """Covariance at the optimum, from the Jacobian, for white noise of the fit's deviations."""
    m, projected = found.model, project(found.model, data)
    own = np.einsum("ij,ij->j", projected.change, projected.change)
    variance = np.multiply.outer(own, found.noise**2)
    count = len(m.parameters)
    if not count:
        return Covariance(np.zeros((0, 0)), np.sqrt(variance))
    information, _ = _normal_equations(m, projected, data, found.noise)
    scale = np.sqrt(np.maximum(np.diag(information), 1e-300))
    parameters = np.linalg.pinv(information / np.outer(scale, scale), rcond=1e-14, hermitian=True) / np.outer(scale, scale)
    late = projected.functions[:count] * data.time
    moved = projected.change.T @ products(projected.span, late)  # minus what the coefficients gain, for t basis_i
    leverage = np.einsum("oi,ijc->ojc", moved, directions(m, projected.coefficients))
    variance += np.einsum("oic,ij,ojc->oc", leverage, parameters, leverage)
    return Covariance(parameters, np.sqrt(np.maximum(0.0, variance)))
