"""First estimates of poles by a subspace method: singular vectors of a block Hankel matrix, and their shift invariance.

ESPRIT (Roy and Kailath 1989), of which the matrix pencil method (Hua and Sarkar 1990) and the eigensystem realization
algorithm (Juang and Pappa 1985) are relatives. The rows of the Hankel matrix are pairs of neighbouring samples that are
spread over a third of the record, so that slow modes are seen without a large matrix, and fast ones without ambiguity.
"""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

_MOST_ROWS = 48
_MOST_COLUMNS = 2048
_BLOCK = 100
"""Rows that are multiplied at a time: so few that BLAS takes no threads, which cost more than they bring."""
_WINDOW_SHARE = 1.0 / 3.0
_NOISE_MARGIN = 1.3
_ROUNDING = 3e-8
"""Of singular values from squares, relative to the largest."""
_AT_ZERO = 0.5
"""Poles with |s| duration below this can be distinguished from 0 only by a polynomial."""


@dataclass(frozen=True)
class Subspace:
    """Left singular vectors of the rows of the first and the second sample of each pair, and the singular values."""

    first: np.ndarray
    second: np.ndarray
    values: np.ndarray
    shift: int
    step: float
    duration: float

    @property
    def order(self) -> int:
        """How many singular values stand out from noise: the most poles that are worth a try."""
        level = max(_ROUNDING * self.values[0], _NOISE_MARGIN * float(np.median(self.values)))
        return int(np.count_nonzero(self.values > level))


def subspace(y: np.ndarray, step: float, duration: float, weight: np.ndarray) -> Subspace:
    """Of columns y, shape (c, n), that share their poles; each divided by its `weight`."""
    scaled = (y / weight[:, None]).T
    n, columns = scaled.shape
    offsets, shift = _offsets(n, columns)
    length = n - int(offsets[-1]) - shift
    every = max(1, length // _MOST_COLUMNS)
    windows = [scaled[o : o + length : every] for o in np.concatenate([offsets, offsets + shift])]
    matrix = np.concatenate(windows, axis=1)  # (length, 2 L c): the Hankel matrix, transposed
    parts = [matrix[i : i + _BLOCK] for i in range(0, len(matrix), _BLOCK)]
    squares, vectors = np.linalg.eigh(sum((part.T @ part for part in parts), np.zeros((matrix.shape[1],) * 2)))
    values, vectors = np.sqrt(np.maximum(0.0, squares[::-1])), vectors[:, ::-1]
    half = len(offsets) * columns
    return Subspace(vectors[:half], vectors[half:], values, shift, step, duration)


def _offsets(n: int, columns: int) -> tuple[NDArray[np.int_], int]:
    """Offsets of the pairs' first samples, and the distance within a pair."""
    most = max(4, min(_MOST_ROWS // (2 * columns), int(n * _WINDOW_SHARE)))
    stride = max(1, int(n * _WINDOW_SHARE / most))
    return stride * np.arange(most), 1


def poles(found: Subspace, order: int) -> tuple[NDArray[np.complex128], np.ndarray, int]:
    """Pairs (Im > 0), real poles, and the number of those at 0, if the response has `order` poles."""
    first, second = found.first[:, :order], found.second[:, :order]
    z = np.linalg.eigvals(np.linalg.lstsq(first, second, rcond=None)[0]).astype(complex)
    z = z[np.abs(z) > 1e-3]
    s = np.log(z) / (found.shift * found.step)
    at_zero = np.abs(s) * found.duration < _AT_ZERO
    rest = s[~at_zero]
    alternating = np.abs(rest.imag) >= math.pi / (found.shift * found.step) * (1.0 - 1e-9)
    rest = rest[(np.abs(rest.real) < 4.0 / found.step) & ~alternating]
    real = np.abs(rest.imag) < 1e-9 * np.abs(rest)
    pairs = rest[~real & (rest.imag > 0.0)].astype(np.complex128)
    return pairs, np.real(rest[real]), int(np.count_nonzero(at_zero))
