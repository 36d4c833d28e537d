"""Kernels and moves as impulses: a density by Gauss-Legendre quadrature, exact to rounding for all modes up to a frequency."""

from __future__ import annotations

import math
from collections.abc import Callable, Sequence
from itertools import pairwise

import numpy as np

_NODES, _WEIGHTS = np.polynomial.legendre.leggauss(16)
_PANEL = 2.0
"""Radians of the fastest mode, and nepers of its decay, for each panel of the quadrature: exact to rounding."""


def as_masses(
    pieces: Sequence[float], density: Callable[[np.ndarray], np.ndarray], highest: float
) -> tuple[np.ndarray, np.ndarray]:
    """Times [s] and masses of a density [1/s] that is smooth between `pieces` [s], for modes up to `highest` [rad/s]."""
    times, masses = [np.zeros(0)], [np.zeros(0)]
    for begin, end in pairwise(pieces):
        if not end > begin:
            continue
        ends = np.linspace(begin, end, 1 + max(4, math.ceil(highest * (end - begin) / _PANEL)))
        half = 0.5 * np.diff(ends)[:, None]
        inside = (0.5 * (ends[1:] + ends[:-1])[:, None] + half * _NODES).ravel()
        times.append(inside)
        masses.append((half * _WEIGHTS).ravel() * density(inside))
    return np.concatenate(times), np.concatenate(masses)
