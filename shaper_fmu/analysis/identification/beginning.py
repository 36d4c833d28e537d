"""Finds the time from which a response is free, by comparing the modes of different beginnings.

Before the end of the excitation a sum of decaying exponentials can follow the motion, too, down to the noise; but its poles are of
no machine, and move when one begins later. A mode is confirmed where a beginning half of its period (or, if that is
shorter, a time constant) later shows the same pole.
"""

from __future__ import annotations

import math
from collections.abc import Iterator
from dataclasses import replace

import numpy as np

from shaper_fmu.analysis.identification.classify import FEWEST_PERIODS
from shaper_fmu.analysis.identification.findings import CONTRADICTING, disturbance
from shaper_fmu.analysis.identification.identify import identify, left_by
from shaper_fmu.analysis.identification.record import FEWEST_SAMPLES, FreeResponse, IdentificationError, free_response
from shaper_fmu.analysis.identification.result import Identification, Mode

BEGINNINGS = 32
"""Of equal distances that are tried, from the last to the first."""
_MOST_SAMPLES = 800
_MOST_POLES = 24
_FEWEST_PER_PERIOD = 8
"""Samples that are kept of the fastest motion, however many there are in all."""
_ENERGY = 0.999
"""Share of the energy below the frequency of the fastest motion."""
_PATIENCE = 2
"""Beginnings in a row that are not free, after which there is no earlier one."""
_SURE, _SAME, _FARTHEST = 5.0, 3e-3, 0.02
"""Two poles are the same within so many standard deviations and this share of them; strictly not farther apart than the last."""
_VISIBLE = 10.0
"""Amplitude of a mode over the standard deviation of its residue at a later beginning, from which on it must be seen there."""
_LATER = (1 / 16, 1 / 8, 1 / 4, 3 / 8, 1 / 2)
"""Beginnings, as shares of the record, where nothing may be seen that was not seen before."""
_SEEN = 0.05
"""Share of the vibration at a later beginning from which on a mode counts."""
_KNOWN = _FARTHEST / _SURE
"""Standard deviation of a pole, as a share of it, up to which it can be decided whether a mode is another one."""
_LARGE = 0.2
"""Share of a mode from which on bounds follow its pole: it must be known within `_FARTHEST` at a later beginning, too."""


class Beginnings:
    """The modes of a response from several beginnings on, each identified once, from the means of neighbouring samples."""

    def __init__(self, response: FreeResponse, smallest_share: float):
        self._response, self._share = response, smallest_share
        self._seen: dict[int, Identification | None] = {}
        self._widest = max(1, int(1.0 / (_FEWEST_PER_PERIOD * max(1e-300, _fastest(response)) * response.step)))

    def seen(self, first: int) -> Identification | None:
        """The identification from the sample `first` on; None if there is none."""
        if first not in self._seen:
            self._seen[first] = self._identified(first)
        return self._seen[first]

    def _identified(self, first: int) -> Identification | None:
        values = self._response.values[first:]
        every = min(self._widest, max(1, math.ceil(len(values) / _MOST_SAMPLES)))
        if len(values) < FEWEST_SAMPLES * every:
            return None
        means = values[: len(values) // every * every].reshape(-1, every, values.shape[1]).mean(axis=1)
        one = self._response
        record = free_response(means, one.step * every, one.names, one.floor / math.sqrt(every))
        try:
            found = identify(record, smallest_share=self._share, most_poles=_MOST_POLES)
        except IdentificationError:
            return None
        if every > 1 and found.has("too_fast"):  # for the means of so many samples, not for the record
            self._widest = max(1, every // 2)
            return self._identified(first)
        return found

    def lost(self, first: int, *, strict: bool) -> Mode | None:
        """A mode seen from `first` on that is not the same half of its period or a time constant later; None if all are.

        Without `strict` modes that need no longer be visible there are passed over.
        """
        found = self.seen(first)
        for mode in found.modes if found is not None else ():
            longer = [] if strict else [d for d in (mode.period, 2.0 * mode.period) if self._lasts(first, d, mode)]
            delays = [_shortest(mode), *longer]
            if not all(self._stays(mode, first, delay, strict) for delay in delays if strict or _visible(mode, delay)):
                return mode
        return None

    def contradicted(self, first: int) -> Mode | None:
        """A mode found from `first` on that a later beginning contradicts; None if there is none.

        That is one that does not stay (`lost`), is hardly known there, or is seen later and was not before: sums of strongly
        damped exponentials follow an excitation, and hide in their shares the modes that remain of it.
        """
        found = self.seen(first)
        if found is None:
            return None
        return self.lost(first, strict=False) or self._vague(found, first) or self._appearing(found, first)

    def _vague(self, found: Identification, first: int) -> Mode | None:
        """A mode of a large share that is known worse than bounds need it, half of its period or a time constant later."""
        for mode in found.modes:
            there = self._later(first, _shortest(mode))
            same = [other for other in there.modes if _is_same(mode, other, False)] if there is not None else []
            if mode.share > _LARGE and not any(_spread(other) < _FARTHEST * abs(other.pole) for other in same):
                return mode
        return None

    def _appearing(self, found: Identification, first: int) -> Mode | None:
        """A mode that is seen later in the record, well, and not from `first` on."""
        duration = (len(self._response.values) - first) * self._response.step
        for share in _LATER:
            there = self._later(first, share * duration)
            for mode in there.modes if there is not None else ():
                well = mode.share > _SEEN and _spread(mode) < _KNOWN * abs(mode.pole)
                if well and not any(_is_same(mode, other, True) for other in found.modes):
                    return mode
        return None

    def _lasts(self, first: int, delay: float, mode: Mode) -> bool:
        """Whether enough periods of a mode remain after a delay to identify it."""
        left = (len(self._response.values) - first) * self._response.step - delay
        return left >= (FEWEST_PERIODS + 0.5) * mode.period

    def _later(self, first: int, delay: float) -> Identification | None:
        return self.seen(first + max(1, math.ceil(delay / self._response.step)))

    def _stays(self, mode: Mode, first: int, delay: float, strict: bool) -> bool:
        there = self._later(first, delay)
        return there is not None and any(_is_same(mode, other, strict) for other in there.modes)

    def explained(self, first: int, found: Identification) -> bool:
        """Whether poles leave no more of the response at its beginning, from `first` on, than later."""
        return not disturbance(left_by(cut(self._response, first), found))

    def is_free(self, first: int) -> bool:
        """Whether there are modes, all of them stay, and no finding contradicts the fit."""
        found = self.seen(first)
        if found is None or not found.modes or any(found.has(code) for code in CONTRADICTING):
            return False
        return self.lost(first, strict=True) is None


def _fastest(response: FreeResponse) -> float:
    """The frequency [Hz] below which nearly all of the outputs' energy lies."""
    values = response.values - response.values.mean(axis=0)
    power = np.abs(np.fft.rfft(values * np.hanning(len(values))[:, None], axis=0)) ** 2
    share = np.cumsum(power / np.maximum(power.sum(axis=0), 1e-300), axis=0)
    last = max(int(np.searchsorted(column, _ENERGY * column[-1])) for column in share.T)
    return last / (len(values) * response.step)


def _visible(mode: Mode, delay: float) -> bool:
    left = np.abs(mode.residues) * math.exp(mode.pole.real * delay)
    return bool((left > _VISIBLE * mode.residue_std)[mode.residue_std > 0.0].any())


def _shortest(mode: Mode) -> float:
    """Half of its period, or a time constant if that is shorter [s]."""
    return min(0.5 * mode.period, -1.0 / mode.pole.real if mode.pole.real < 0.0 else math.inf)


def _spread(mode: Mode) -> float:
    """Standard deviation of a pole [rad/s]."""
    return math.hypot(mode.natural_frequency_std, mode.damping_ratio_std * mode.natural_frequency)


def _is_same(one: Mode, other: Mode, strict: bool) -> bool:
    most = _SURE * math.hypot(_spread(one), _spread(other)) + _SAME * abs(one.pole)
    return abs(one.pole - other.pole) <= (min(most, _FARTHEST * abs(one.pole)) if strict else most)


def first_free(response: FreeResponse, smallest_share: float, looks: Beginnings | None = None) -> int | None:
    """The first sample from which on a response is free, judged by its modes; None if there is no such sample.

    `looks`, what is known of this response already, saves time.
    """
    looks = looks or Beginnings(response, smallest_share)
    if looks.is_free(0) and looks.contradicted(0) is None:
        return 0
    free, before = None, 0
    for first in _places(len(response.values)):
        if looks.is_free(first):
            free, before = first, 0
        elif free is not None:
            before += 1
            if before >= _PATIENCE:
                break
    return _earlier(looks, free, max(0, free - _distance(response))) if free else free


def _earlier(looks: Beginnings, free: int, least: int) -> int:
    """The first sample from `least` on, from which the poles seen from `free` on explain the response, no worse than later."""
    found = looks.seen(free)
    assert found is not None  # it is free
    low, high = least - 1, free  # not free, free
    while high - low > 1:
        middle = (low + high) // 2
        low, high = (low, middle) if looks.explained(middle, found) else (middle, high)
    return high


def _distance(response: FreeResponse) -> int:
    return math.ceil((len(response.values) - FEWEST_SAMPLES) / BEGINNINGS)


def _places(count: int) -> Iterator[int]:
    """Beginnings, the last one first."""
    most = count - FEWEST_SAMPLES
    yield from (most * k // BEGINNINGS for k in range(BEGINNINGS - 1, -1, -1))


def cut(response: FreeResponse, first: int) -> FreeResponse:
    """The response from the sample `first` on."""
    return replace(response, values=response.values[first:])
