"""Finds a swept excitation: a motion whose frequency rises or falls steadily over the record is driven, and no free response."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from shaper_fmu.analysis.identification.record import FreeResponse

_WINDOWS = 40
"""Of the record, half overlapping."""
_FEWEST_SAMPLES = 48
_QUIET = 1e-2
"""Share of the largest amplitude in a window below which there is nothing to see."""
_FEWEST = 9
"""Windows of different frequencies in a row..."""
_MOSTLY = 0.75
"""... that are this share of those around them."""
_RATIO = 1.3
"""Of the frequencies at both ends, at least."""
_PADDED = 4


@dataclass(frozen=True)
class Sweep:
    """A swept motion, from `begin` to `end` [s] after the first sample, and its frequencies there [Hz]."""

    begin: float
    end: float
    first: float
    last: float


def find_sweep(response: FreeResponse) -> Sweep | None:
    """A sweep in any of the outputs; None if there is none.

    The strongest frequency of each window lies on a line over time, or its logarithm does. A ring-down of several modes has few
    different ones, and they do not lie on a line.
    """
    for column in response.values.T:
        found = _of_column(column, response.step)
        if found is not None:
            return found
    return None


def _of_column(values: np.ndarray, step: float) -> Sweep | None:
    length = max(_FEWEST_SAMPLES, 2 * len(values) // _WINDOWS)
    if len(values) < _FEWEST * length // 2 + length:
        return None
    starts = np.arange(0, len(values) - length + 1, length // 2)
    frequency, amplitude = _strongest(values, starts, length, step)
    seen = amplitude > _QUIET * amplitude.max()
    middle = (starts + 0.5 * length) * step
    resolution = 1.0 / (length * step)
    for axis in (frequency, np.log(np.maximum(frequency, 0.1 * resolution))):
        inside = _on_a_line(middle, axis, frequency, seen, resolution)
        if inside is None:
            continue
        first, last = frequency[inside[0]], frequency[inside[-1]]
        if max(first, last) > _RATIO * min(first, last) and abs(last - first) > _FEWEST * 0.5 * resolution:
            return Sweep(float(starts[inside[0]] * step), float((starts[inside[-1]] + length) * step), float(first), float(last))
    return None


def _strongest(values: np.ndarray, starts: np.ndarray, length: int, step: float) -> tuple[np.ndarray, np.ndarray]:
    """The strongest frequency [Hz] of each window, and its amplitude."""
    window = np.hanning(length)
    parts = np.array([values[start : start + length] for start in starts])
    spectra = np.abs(np.fft.rfft((parts - parts.mean(axis=1, keepdims=True)) * window, _PADDED * length, axis=1))
    peaks = np.argmax(spectra, axis=1)
    return peaks / (_PADDED * length * step), spectra[np.arange(len(starts)), peaks]


def _on_a_line(time: np.ndarray, axis: np.ndarray, frequency: np.ndarray, seen: np.ndarray, resolution: float) -> np.ndarray | None:
    """The windows on the line that most of them are on; None if they are too few, or do not differ."""
    places = np.flatnonzero(seen)
    if len(places) < _FEWEST:
        return None
    pairs = [(i, j) for k, i in enumerate(places) for j in places[k + 1 :] if j - i >= 3]
    slopes = np.array([(axis[j] - axis[i]) / (time[j] - time[i]) for i, j in pairs])
    slope = float(np.median(slopes)) if len(slopes) else 0.0
    offset = float(np.median(axis[places] - slope * time[places]))
    spread = abs(slope) * float(time[places[-1]] - time[places[0]])
    near = np.abs(axis - offset - slope * time) < 0.06 * spread
    inside = places[near[places]]
    if len(inside) < _FEWEST or len(inside) < _MOSTLY * np.count_nonzero(seen[inside[0] : inside[-1] + 1]):
        return None
    different = len(np.unique(np.round(frequency[inside] / resolution)))
    return inside if different >= _FEWEST - 2 else None
