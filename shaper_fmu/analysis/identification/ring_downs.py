"""Cuts a recording of repeated hits into its ring-downs.

A free response of any number of modes is a linear prediction of itself: each sample is a sum of the ones before with fixed weights.
A hit is none, and stands out of the prediction's error; beats and slow rises of several modes do not. Where the motion behind such
a place is much larger than before, a ring-down begins; a smaller disturbance ends the one before, which is not free any more.
"""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np

from shaper_fmu.analysis.identification.record import FreeResponse

_ORDER = 24
"""Samples by which the next one is predicted."""
_PER_PERIOD = 12
"""Samples kept of the period of the fastest motion."""
_ENERGY = 0.999
_STANDS_OUT = 12.0
_OF_LARGEST = 0.02
"""Times the usual error of the prediction, and share of the largest one, from which on an error is a hit."""
_GROWS = 2.0
"""Motion in a period after a hit over that before, from which on a ring-down begins."""
_LARGE = 0.1
"""Motion after a hit over that after the largest one, from which on a ring-down is worth having."""
_FEWEST_PERIODS = 4.0


@dataclass(frozen=True)
class RingDown:
    """A part of a recording: the samples from `first` on, before `last`."""

    first: int
    last: int


def ring_downs(response: FreeResponse) -> list[RingDown]:
    """The ring-downs of a recording with several hits, in their order; [] where there are not at least two."""
    highest = _highest(response)
    if len(response.values) < 8 * _ORDER or not highest > 0.0:
        return []
    every = max(1, int(1.0 / (_PER_PERIOD * highest * response.step)))
    values = response.values[: len(response.values) // every * every].reshape(-1, every, response.values.shape[1]).mean(axis=1)
    error = _prediction_error(values)
    if error is None:
        return []
    usual = 1.4826 * float(np.median(error[_ORDER:]))
    hits = _clusters(np.flatnonzero(error > max(_STANDS_OUT * usual, _OF_LARGEST * float(error.max()))), _ORDER)
    window = max(4, round(1.0 / (max(1e-300, _loudest(response)) * response.step * every)))
    ends = [begin for begin, _ in hits] + [len(values)]
    parts: list[tuple[float, RingDown]] = []
    if hits and hits[0][0] > window:  # it rings from its first sample on
        parts.append((_size(values[:window]), RingDown(0, hits[0][0] * every)))
    for (begin, end), until in zip(hits, ends[1:], strict=True):
        after = _size(values[end + 1 : end + 1 + window])
        if after > _GROWS * _size(values[max(0, begin - window) : begin]):
            parts.append((after, RingDown((end + 1) * every, until * every)))
    largest = max((size for size, _ in parts), default=0.0)
    fewest = _FEWEST_PERIODS * window * every
    found = [part for size, part in parts if size >= _LARGE * largest and part.last - part.first >= fewest]
    return found if len(found) > 1 else []


def _prediction_error(values: np.ndarray) -> np.ndarray | None:
    """The error of the best prediction of each sample from `_ORDER` ones before, over all outputs, shape (n,); None for too few."""
    if len(values) < 8 * _ORDER:
        return None
    total = np.zeros(len(values))
    for column in ((values - values.mean(axis=0)) / np.maximum(values.std(axis=0), 1e-300)).T:
        before = np.lib.stride_tricks.sliding_window_view(column, _ORDER)[:-1]
        wanted, kept = column[_ORDER:], np.ones(len(column) - _ORDER, bool)
        error = wanted
        for _ in range(3):  # hits are no part of what is to be predicted
            weights = np.linalg.lstsq(before[kept], wanted[kept], rcond=1e-10)[0]
            error = np.abs(wanted - before @ weights)
            kept = error <= max(np.quantile(error, 0.9), 1e-12)
        total[_ORDER:] += error**2
    return np.sqrt(total)


def _clusters(places: np.ndarray, apart: int) -> list[tuple[int, int]]:
    """The first and the last of places that are no farther apart."""
    if not len(places):
        return []
    groups = np.split(places, np.flatnonzero(np.diff(places) > apart) + 1)
    return [(int(one[0]), int(one[-1])) for one in groups]


def _size(values: np.ndarray) -> float:
    """RMS about the mean, over all outputs."""
    return math.sqrt(float(np.sum(np.var(values, axis=0)))) if len(values) else 0.0


def _spectrum(response: FreeResponse) -> np.ndarray:
    values = (response.values - response.values.mean(axis=0)) / np.maximum(response.values.std(axis=0), 1e-300)
    return np.sum(np.abs(np.fft.rfft(values, axis=0)) ** 2, axis=1)


def _highest(response: FreeResponse) -> float:
    """The frequency [Hz] below which nearly all energy lies."""
    share = np.cumsum(_spectrum(response))
    return int(np.searchsorted(share, _ENERGY * share[-1])) / (len(response.values) * response.step)


def _loudest(response: FreeResponse) -> float:
    """The frequency [Hz] of the largest line."""
    return max(1, int(np.argmax(_spectrum(response)))) / (len(response.values) * response.step)
