"""Derivatives of vector functions by central differences, extrapolated, each with an estimate of its error."""

from __future__ import annotations

from collections.abc import Callable

import numpy as np

from shaper_fmu.errors import SimulationError

Function = Callable[[np.ndarray], np.ndarray]

_STEP = np.finfo(float).eps ** 0.2
"""Times a variable's magnitude: it balances rounding, eps / h, and what is left after the extrapolation, h^4."""
_FACTORS = (1.0, 1e-2, 1e-4)
"""Of the steps that are tried: a nominal value may be too large for a variable."""
_BETTER = 0.1
"""Errors of a shorter step must be less by this: where there is but rounding, the longest step is best."""
_LEVELS = np.array([1.0, 2.0, 4.0])


def jacobian(function: Function, at: np.ndarray, scale: np.ndarray, row_scale: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """d function / d variables at a point and bounds of the errors, both of shape (rows, len(at)).

    Args:
        function: of the variables, shape (n,), to values of shape (rows,).
        at: the point, shape (n,).
        scale: magnitudes of the variables, shape (n,), > 0.
        row_scale: magnitudes of the values, shape (rows,), > 0, in which the errors of different steps are compared.

    The differences over 2 h, 4 h and 8 h are extrapolated to h = 0 (Richardson); what the last step of that changes is the error's
    estimate. Of three sizes of h the shorter ones are taken where they err less. Raises SimulationError where the function raises
    it at all of them.
    """
    columns = [_column(function, at, k, scale[k], row_scale) for k in range(len(at))]
    found, error = (np.column_stack([column[i] for column in columns]) for i in (0, 1))
    steps = np.array([step for _, _, step in columns])
    terms = np.abs(found) @ (np.abs(at) + _LEVELS[-1] * steps)  # they may cancel, but not their roundings
    return found, error + 2.0 * np.finfo(float).eps * terms[:, None] / steps


def _column(
    function: Function, at: np.ndarray, k: int, scale: float, row_scale: np.ndarray
) -> tuple[np.ndarray, np.ndarray, float]:
    """The column of one variable, its errors, and the step that was taken."""
    best: tuple[np.ndarray, np.ndarray, float] | None = None
    least = np.inf
    failure: SimulationError | None = None
    for factor in _FACTORS:
        step = factor * _STEP * scale
        try:
            values, error = _extrapolated(function, at, k, step)
        except SimulationError as caught:  # beyond the variable's domain, perhaps
            failure = caught
            continue
        size = float(np.max(error / row_scale))
        if size < _BETTER * least:
            best, least = (values, error, step), size
    if best is None:
        assert failure is not None
        raise failure
    return best


def _extrapolated(function: Function, at: np.ndarray, k: int, step: float) -> tuple[np.ndarray, np.ndarray]:
    found, size = [], 0.0
    for level in _LEVELS:
        up, down = at.copy(), at.copy()
        up[k] += level * step
        down[k] -= level * step
        above, below = function(up), function(down)
        found.append((above - below) / (up[k] - down[k]))
        size = np.maximum(size, np.maximum(np.abs(above), np.abs(below)))
    fine, coarse = ((4.0 * found[i] - found[i + 1]) / 3.0 for i in (0, 1))
    return fine, np.abs(fine - coarse) + 2.0 * np.finfo(float).eps * size / step
