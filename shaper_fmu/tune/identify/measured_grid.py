"""Samples of a recording at equal distances, and the rounding of its values."""

from __future__ import annotations

import math

import numpy as np
from scipy.interpolate import CubicSpline

from shaper_fmu.analysis.identification import IdentificationError

_UNIFORM = 1e-3
_GAP = 4.0
_FEWEST_ROWS = 3
_LEVELS = 0.5
"""Different values over samples, up to which a sensor may give them in steps."""


def quantisation(values: np.ndarray) -> np.ndarray:
    """Standard deviation of the rounding of values that a sensor gives in steps; 0 where they are not, shape (m,)."""
    found = np.zeros(values.shape[1])
    for j, column in enumerate(values.T):
        levels = np.unique(column)
        if 2 <= len(levels) <= _LEVELS * len(column):
            step = float(np.diff(levels).min())
            multiples = (levels - levels[0]) / step
            if np.abs(multiples - np.round(multiples)).max() < 0.01:
                found[j] = step / math.sqrt(12.0)
    return found


def check_times(t: np.ndarray) -> None:
    """Raise IdentificationError for times [s] that are too few, no numbers, or do not increase."""
    if len(t) < _FEWEST_ROWS:
        rows = "one row" if len(t) == 1 else f"{len(t)} rows"
        raise IdentificationError(f"the table has {rows} of numbers, which is too few for a recording")
    steps = np.diff(t)
    if not (steps > 0.0).all():
        row = int(np.argmax(~(steps > 0.0)))
        raise IdentificationError(f"time does not increase from row {row + 1} on ({t[row]:g} s)")


def uniform_samples(t: np.ndarray, values: np.ndarray) -> tuple[np.ndarray, np.ndarray, str]:
    """The response at equal distances, and a note where it had to be interpolated. Raises IdentificationError for gaps."""
    steps = np.diff(t)
    usual = float(np.median(steps))
    if steps.max() > _GAP * usual:
        row = int(np.argmax(steps))
        raise IdentificationError(
            f"samples are missing: from {t[row]:g} s to {t[row + 1]:g} s there are none, otherwise every {usual:.3g} s; "
            "use the part before or after"
        )
    even = np.linspace(t[0], t[-1], len(t))
    if np.abs(t - even).max() <= _UNIFORM * usual or _is_rounded(t, even, usual):
        return even, values, ""
    grid = np.linspace(t[0], t[-1], max(2, round((t[-1] - t[0]) / usual) + 1))
    note = (
        f"samples are not at equal distances ({steps.min():.3g} s to {steps.max():.3g} s): they were interpolated by cubic "
        "splines, so that uncertainties are approximate"
    )
    return grid, CubicSpline(t, values)(grid), note


def _is_rounded(t: np.ndarray, even: np.ndarray, usual: float) -> bool:
    """Whether times lie on an even grid but for their last written digit, which is much less than a step."""
    return bool(np.abs(t - even).max() <= 0.02 * usual)
