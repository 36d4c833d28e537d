"""Guaranteed extremes of sums of decaying oscillations, and the last time at which they leave a band.

e(tau) = Re sum_k c_k exp(p_k tau), tau >= 0, with Re p_k < 0. Between the ends of an interval of length h, e exceeds its
values there by h^2/8 max|e''| at most, with |e''| <= sum_k |p_k|^2 |c_k| exp(Re p_k tau) at the left end; nor does it exceed
the envelope sum_k |c_k| exp(Re p_k tau). Intervals are divided until this decides.
"""

from __future__ import annotations

import math

import numpy as np
from numpy.typing import NDArray

_POINTS = 257
_PARTS = 8
_LEVELS = 40

SHAPEABLE = 0.95
"""Pole pairs with a damping ratio below this can be shaped; others decay without swinging."""


class DecayingSum:
    """e(tau): coefficients c_k and poles p_k [1/s], complex arrays of shape (n,), all Re p_k < 0."""

    def __init__(self, coefficients: NDArray[np.complex128], poles: NDArray[np.complex128]):
        self.coefficients: NDArray[np.complex128] = coefficients
        self.poles: NDArray[np.complex128] = poles
        self._size = np.abs(coefficients)
        self._bend = np.square(np.abs(poles)) * self._size

    def __call__(self, tau: np.ndarray | float) -> np.ndarray:
        """e at the times tau [s]; an array of the shape of tau."""
        return (np.exp(np.multiply.outer(np.asarray(tau, float), self.poles)) @ self.coefficients).real

    def envelope(self, tau: float = 0.0) -> float:
        """sum_k |c_k| exp(Re p_k tau): |e| does not exceed it from tau on."""
        return float(self._size @ np.exp(self.poles.real * tau)) if len(self.poles) else 0.0

    def quiet_from(self, level: float) -> float:
        """A time [s] from which on |e| <= level, where level > 0."""
        total = self.envelope()
        if total <= level:
            return 0.0
        begin, end = 0.0, math.log(total / level) / float(np.min(-self.poles.real[self._size > 0.0]))
        for _ in range(30):
            middle = 0.5 * (begin + end)
            begin, end = (middle, end) if self.envelope(middle) > level else (begin, middle)
        return end

    def maximum(
        self,
        measure: float | None = None,
        shift: float = 0.0,
        until: float = math.inf,
        *,
        limit: float | None = None,
        precision: float = 1e-13,
    ) -> tuple[float, float]:
        """Bounds (low, high) of the supremum over [0, until] of |shift + e|, or with a `measure` of measure (shift + e).

        They are at most `precision` apart; with a `limit` only so near that it is decided: high <= limit or low > limit. Over an
        endless time the value shift at the end counts.
        """
        at_end = abs(shift) if measure is None else measure * shift
        low = max(float(self._measured(np.zeros(1), measure, shift)[0]), at_end if until == math.inf else -math.inf)
        high = at_end + self.envelope()
        if high <= low + precision or (limit is not None and (high <= limit or low > limit)):
            return low, max(low, high)
        first = np.linspace(0.0, min(until, 2.0 * math.pi / float(np.abs(self.poles).min())), _POINTS)
        low = max(low, float(self._measured(first, measure, shift).max()))
        left, width = self._grid(min(until, self.quiet_from(max(low - at_end, precision))))
        for _ in range(_LEVELS):
            values = np.maximum(self._measured(left, measure, shift), self._measured(left + width, measure, shift))
            bounds = self._bounds(left, width, values, at_end)
            low, high = max(low, float(values.max())), float(bounds.max())
            if high <= low + precision or (limit is not None and (high <= limit or low > limit)):
                break
            left = left[bounds > low + precision]
            width /= _PARTS
            left = np.add.outer(left, width * np.arange(_PARTS)).ravel()
        return low, max(low, high)

    def last_time_outside(self, band: float, shift: float = 0.0, until: float = math.inf) -> float | None:
        """The last time [s] in [0, until] with |shift + e| > band, to rounding; None if there is none.

        An endless time needs |shift| < band.
        """
        end = until if until < math.inf else self.quiet_from(band - abs(shift))
        if end == 0.0:
            return None
        left, width = self._grid(end)
        for i in np.flatnonzero(self._doubtful(left, width, band, shift))[::-1]:
            found = self._last_between(float(left[i]), float(left[i]) + width, band, shift)
            if found is not None:
                return min(found, end)
        return None

    def _last_between(self, begin: float, end: float, band: float, shift: float) -> float | None:
        if abs(shift + float(self(end))) > band:
            return end
        width = (end - begin) / _PARTS
        if width <= 1e-15 * (1.0 + end):
            return begin if abs(shift + float(self(begin))) > band else None
        left = begin + width * np.arange(_PARTS)
        for i in np.flatnonzero(self._doubtful(left, width, band, shift))[::-1]:
            found = self._last_between(float(left[i]), float(left[i]) + width, band, shift)
            if found is not None:
                return found
        return None

    def _doubtful(self, left: np.ndarray, width: float, band: float, shift: float) -> np.ndarray:
        """Whether |shift + e| may exceed the band in each interval [left, left + width]."""
        values = np.maximum(self._measured(left, None, shift), self._measured(left + width, None, shift))
        return self._bounds(left, width, values, abs(shift)) > band

    @staticmethod
    def _grid(end: float) -> tuple[np.ndarray, float]:
        return np.linspace(0.0, end, _POINTS)[:-1], end / (_POINTS - 1)

    def _measured(self, tau: np.ndarray, measure: float | None, shift: float) -> np.ndarray:
        value = shift + self(tau)
        return np.abs(value) if measure is None else measure * value

    def _bounds(self, left: np.ndarray, width: float, values: np.ndarray, at_end: float) -> np.ndarray:
        """Upper bounds of the measure in each interval [left, left + width], from the larger `values` at their ends."""
        decay = np.exp(np.multiply.outer(left, self.poles.real))
        return np.minimum(values + width * width / 8.0 * (decay @ self._bend), at_end + decay @ self._size)
