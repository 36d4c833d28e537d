"""Peaks between samples, by parabolas."""

from __future__ import annotations

import numpy as np


def peak_to_peak(time: np.ndarray, values: np.ndarray) -> float:
    """The largest less the smallest value of a smooth signal, also between its samples: times and values of shape (n,).

    The peak is that of the parabola through a sample that is larger than both its neighbours, and through these; of a sine with n
    samples per period it errs by (2 pi / n)^4 / 42 at most. Where the signal is jagged it is too large rather than too small.
    """
    return _peak(time, values) + _peak(time, -values)


def _peak(time: np.ndarray, values: np.ndarray) -> float:
    top = float(values.max())
    before, at, after = values[:-2], values[1:-1], values[2:]
    left, right = np.diff(time)[:-1], np.diff(time)[1:]
    here = (at >= np.maximum(before, after)) & (left > 0.0) & (right > 0.0)  # times are equal at a jump
    for end in (0, -1):  # a peak between the first two samples, or the last
        here[end : end + 1 or None] |= len(here) > 0 and left[end] > 0.0 and right[end] > 0.0
    if not here.any():
        return top
    before, at, after, left, right = (one[here] for one in (before, at, after, left, right))
    fall, rise = (at - before) / left, (at - after) / right
    curvature, slope = (fall + rise) / (left + right), (fall * right - rise * left) / (left + right)
    round_top = curvature > 0.0
    shift = slope[round_top] / (2.0 * curvature[round_top])
    inside = (-left[round_top] <= shift) & (shift <= right[round_top])
    tops = (at[round_top] + 0.5 * slope[round_top] * shift)[inside]
    return max(top, float(tops.max(initial=top)))
