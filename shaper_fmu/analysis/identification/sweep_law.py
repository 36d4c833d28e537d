"""The law of a swept excitation that was not recorded, from the response to it: its frequency over time.

The strongest frequency of the response lies on a straight line over time; short windows along it refine the line.
"""

from __future__ import annotations

import math
from dataclasses import dataclass, replace

import numpy as np

from shaper_fmu.analysis.identification.record import FreeResponse
from shaper_fmu.analysis.identification.swept import Sweep

_ROUNDS = 5
_NEAR = 2.5
"""Distance from the line [resolutions of a window] within which the frequency of a window is looked for."""
_ON = 0.2
"""Share of a window's power near the line, from which on the excitation is there: as much as a square wave's fundamental leaves
beside a mode that a harmonic of it excites."""
_FEWEST = 12
_SMOOTHED = 5
_EDGE, _RIPPLED = 2.0, 2.5
"""Distance from the ends of the band that is not looked at [Hz], and that times the root of the rate."""
_STRAIGHT = 1.0
"""Median distance of the windows from the line [resolutions], at most."""


@dataclass(frozen=True)
class SweepLaw:
    """A sweep whose frequency is a straight line over time.

    Attributes:
        begin, end: [s] after the first sample.
        first: frequency at its begin [Hz].
        rate: [Hz/s], negative for one that falls.
        stepped: whether the frequency stays for half a period each, as Klipper's test makes it; else it is continuous.
        growing: whether its amplitude is proportional to its frequency, as in Klipper's test; else it is constant.
    """

    begin: float
    end: float
    first: float
    rate: float
    stepped: bool = False
    growing: bool = True

    @property
    def last(self) -> float:
        """Frequency at its end [Hz]."""
        return self.first + self.rate * (self.end - self.begin)

    @property
    def band(self) -> tuple[float, float]:
        """Lowest and highest frequency [Hz]."""
        return min(self.first, self.last), max(self.first, self.last)

    @property
    def seen(self) -> tuple[float, float]:
        """The frequencies whose response is known well: away from both ends, where the spectrum of a sweep ripples [Hz]."""
        edge = max(_EDGE, _RIPPLED * math.sqrt(abs(self.rate)))
        return self.band[0] + edge, self.band[1] - edge

    def command(self, time: np.ndarray) -> np.ndarray:
        """Its fundamental at these times, shape (n,), of amplitude 1, or its frequency in Hz; 0 before and after it."""
        inside = (time >= self.begin) & (time <= self.end)
        s = np.where(inside, time - self.begin, 0.0)
        frequency = self.first + self.rate * s
        cycles = (self.first + 0.5 * self.rate * s) * s
        if self.stepped:  # over half a period the frequency is that of its begin, a quarter of a period behind the mean
            cycles = cycles - 0.25 * np.log(frequency / self.first)
        return np.where(inside, (frequency if self.growing else 1.0) * np.sin(2.0 * math.pi * cycles), 0.0)


def law_of(response: FreeResponse, found: Sweep) -> tuple[SweepLaw, int] | None:
    """The law, and the column that moves most along it; None where the frequency is no straight line over time."""
    rate = (found.last - found.first) / max(1e-300, found.end - found.begin)
    start = SweepLaw(found.begin, found.end, found.first, rate)
    laws = [_on_line(column, response.step, start) for column in response.values.T]
    known = [(one[1], j, one[0]) for j, one in enumerate(laws) if one is not None]
    if not known:
        return None
    _, column, law = max(known, key=lambda one: one[0])
    return law, column


def _on_line(values: np.ndarray, step: float, law: SweepLaw) -> tuple[SweepLaw, float] | None:
    """The line through the frequencies of short windows, and their power along it; None if they are on none."""
    length = max(16, round(1.0 / (math.sqrt(abs(law.rate)) * step)))
    starts = np.arange(0, len(values) - length + 1, max(1, length // 2))
    if len(starts) < _FEWEST:
        return None
    window = np.hanning(length)
    parts = np.array([values[start : start + length] for start in starts])
    power = np.abs(np.fft.rfft((parts - parts.mean(axis=1, keepdims=True)) * window, 2 * length, axis=1)) ** 2
    frequency, time = np.arange(power.shape[1]) / (2 * length * step), (starts + 0.5 * length) * step
    resolution = 1.0 / (length * step)
    middle, rate = law.first - law.rate * law.begin, law.rate
    kept = np.zeros(len(time), bool)
    centre = share = np.zeros(len(time))
    for _ in range(_ROUNDS):
        line = middle + rate * time
        near = np.abs(frequency - line[:, None]) < _NEAR * resolution
        weight = np.where(near, power, 0.0)
        total = weight.sum(axis=1)
        share = total / np.maximum(power.sum(axis=1), 1e-300)
        centre = (weight * frequency).sum(axis=1) / np.maximum(total, 1e-300)
        kept = _longest(np.convolve(share > _ON, np.ones(_SMOOTHED) / _SMOOTHED, "same") > 0.5) & (line > 0.0)
        if np.count_nonzero(kept) < _FEWEST:
            return None
        used = kept & (share > _ON)
        rate, middle = np.polyfit(time[used], centre[used], 1)
    used = kept & (share > _ON)
    if np.median(np.abs(centre - middle - rate * time)[used]) > _STRAIGHT * resolution:
        return None
    begin, end = float(time[kept][0]), float(time[kept][-1])
    strength = float(np.sum(power[kept] * (np.abs(frequency - (middle + rate * time)[kept, None]) < _NEAR * resolution)))
    return replace(law, begin=begin, end=end, first=float(middle + rate * begin), rate=float(rate)), strength


def _longest(flags: np.ndarray) -> np.ndarray:
    """The longest run of true ones."""
    edges = np.flatnonzero(np.diff(np.concatenate([[0], flags.astype(int), [0]])))
    found = np.zeros(len(flags), bool)
    if len(edges):
        runs = edges.reshape(-1, 2)
        first, last = runs[int(np.argmax(runs[:, 1] - runs[:, 0]))]
        found[first:last] = True
    return found
