"""Models of a free response: its poles, and the time functions that belong to them."""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray


@dataclass(frozen=True)
class Model:
    """Poles of a response, y(t) = sum_k Re(r_k exp(s_k t)) + sum_i a_i exp(d_i t) + polynomial.

    Attributes:
        pairs: s_k with Im > 0, one of each complex pair [rad/s], shape (p,).
        reals: d_i [1/s], shape (q,).
        degree: of the polynomial that poles at 0 leave: -1 none, 0 constant, 1 drift, 2 constant acceleration.
    """

    pairs: NDArray[np.complex128]
    reals: np.ndarray
    degree: int = 1

    @property
    def order(self) -> int:
        """Number of poles, those at 0 among them."""
        return 2 * len(self.pairs) + len(self.reals) + self.degree + 1

    @property
    def parameters(self) -> np.ndarray:
        """Real and imaginary part of each pair, then the real poles; shape (2 p + q,)."""
        return np.concatenate([np.column_stack([self.pairs.real, self.pairs.imag]).ravel(), self.reals])

    def with_parameters(self, values: np.ndarray) -> Model:
        """The same model with other poles."""
        split = 2 * len(self.pairs)
        parts = values[:split].reshape(-1, 2)
        return replace(self, pairs=parts[:, 0] + 1j * np.abs(parts[:, 1]), reals=values[split:].copy())

    def joined(self, pairs: np.ndarray, reals: np.ndarray) -> Model:
        """The model with further poles."""
        return replace(self, pairs=np.append(self.pairs, pairs), reals=np.append(self.reals, reals))


def model(pairs: object = (), reals: object = (), degree: int = 1) -> Model:
    """A model of given poles."""
    return Model(np.array(pairs, complex).reshape(-1), np.array(reals, float).reshape(-1), degree)


def basis(m: Model, time: np.ndarray) -> np.ndarray:
    """Rows cos, -sin of each pair with its decay, the real exponentials, and the polynomial; shape (order, n).

    A pair's coefficients are real and imaginary part of its residue. Growing ones are 1 at the end, so nothing overflows.
    """
    end = float(time[-1])
    found = np.empty((m.order, len(time)))
    p, q = len(m.pairs), len(m.reals)
    for k, s in enumerate(m.pairs):
        size = np.exp(s.real * time - max(0.0, s.real) * end)
        found[2 * k] = size * np.cos(s.imag * time)
        found[2 * k + 1] = -size * np.sin(s.imag * time)
    for i, rate in enumerate(m.reals):
        found[2 * p + i] = np.exp(rate * time - max(0.0, rate) * end)
    u = 2.0 * time / end - 1.0
    powers = [1.0, u, 0.5 * (3.0 * u * u - 1.0)]
    for i in range(m.degree + 1):
        found[2 * p + q + i] = powers[i]
    return found


def growth(m: Model, end: float) -> np.ndarray:
    """Factors for each pair's and real pole's coefficients, since growing functions are 1 at the `end` [s]."""
    return np.exp(-np.maximum(0.0, np.concatenate([m.pairs.real, m.reals])) * end)


def directions(m: Model, coefficients: np.ndarray) -> np.ndarray:
    """Derivatives of the response by the parameters, in multiples of t times the basis' first rows; shape (k, k, c).

    The derivative of column c with respect to parameter j is the sum over i of t basis_i directions[i, j, c]. That of a growing
    function lacks a multiple of the function itself, which lies in the basis and is projected away.
    """
    p, k = len(m.pairs), len(m.parameters)
    found = np.zeros((k, k, coefficients.shape[1]))
    for i in range(0, 2 * p, 2):
        real, imaginary = coefficients[i], coefficients[i + 1]
        found[i, i], found[i + 1, i] = real, imaginary
        found[i, i + 1], found[i + 1, i + 1] = -imaginary, real
    for i in range(2 * p, k):
        found[i, i] = coefficients[i]
    return found
