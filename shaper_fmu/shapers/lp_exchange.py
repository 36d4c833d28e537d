"""Shortest duration of a positive shaper on a grid of impulse times: linear programmes with exchanged constraints.

For a duration D the least s is sought for which amplitudes A >= 0, sum A = 1, on the grid satisfy
Re(exp(-j phase) S(w)) <= s tolerance for the constraints (w, phase) known so far; at the largest violations of V = |S| over
the bands, found by local maximisation, further constraints are added until none is left. D is feasible if s <= 1; it is
bisected. (Singhose, Seering and Singer 1996 state the problem; Remez' exchange solves it.)
"""

from __future__ import annotations

import math
from collections.abc import Callable, Sequence

import numpy as np
from scipy.optimize import linprog

from shaper_fmu.errors import ComponentError
from shaper_fmu.shapers.lp_layout import Band, Layout

_GRID_PER_PERIOD = 48
_SAMPLES_PER_HUMP = 12
_LONGEST = 64.0
_EXCESS = 1e-5  # by which the solution on the grid may exceed the tolerances, relative
_GOLDEN = 0.5 * (math.sqrt(5.0) - 1.0)


def peaks(level: Callable[[np.ndarray], np.ndarray], low: float, high: float, duration: float) -> tuple[np.ndarray, np.ndarray]:
    """Local maxima over [low, high], both ends included, of `level`, a function of an array of frequencies [rad/s].

    The samples are dense against the fastest ripple that impulses within `duration` [s] can cause; golden section then gives
    each maximum to the last bits of its value.
    """
    if high <= low:
        w = np.array([low])
        return w, level(w)
    count = 16 + math.ceil(_SAMPLES_PER_HUMP * duration * (high - low) / math.pi)
    w = np.linspace(low, high, count)
    v = level(w)
    inner = 1 + np.flatnonzero((v[1:-1] >= v[:-2]) & (v[1:-1] >= v[2:]))
    left, right = w[np.maximum(inner - 1, 0)], w[np.minimum(inner + 1, count - 1)]
    for _ in range(40 if len(inner) else 0):
        first, second = right - _GOLDEN * (right - left), left + _GOLDEN * (right - left)
        rising = level(first) < level(second)
        left, right = np.where(rising, first, left), np.where(rising, right, second)
    found = np.concatenate(([low], 0.5 * (left + right), [high]))
    return found, level(found)


class GridProgramme:
    """The linear programmes of one design; constraints that were found are kept from one duration to the next."""

    def __init__(self, bands: Sequence[Band], layout: Layout):
        self.bands = bands
        self.layout = layout
        self.highest = max(band.high for band in bands)
        self.rows: list[tuple[Band, float, float]] = []
        """Constraints: band, frequency [rad/s] and phase [rad]."""

    def positions(self, duration: float) -> np.ndarray:
        """The grid of impulse positions for a duration [s]."""
        reach = self.layout.reach * duration
        count = max(24, math.ceil(_GRID_PER_PERIOD * reach * self.highest / (2.0 * math.pi)))
        return np.linspace(0.0, reach, count + 1)

    def feasible(self, duration: float) -> np.ndarray | None:
        """Amplitudes on the grid with V <= tolerance over all bands, or None if there are none for this duration [s]."""
        positions = self.positions(duration)
        if not self.rows:
            self._begin(duration)
        for _ in range(60):
            amplitudes, scale = self._solve(positions, duration)
            if scale > 1.0 + 1e-7:
                return None
            if not self._exchange(amplitudes, positions, duration):
                return amplitudes
        return None

    def _begin(self, duration: float) -> None:
        for band in self.bands:
            count = 3 + math.ceil(3.0 * duration * (band.high - band.low) / math.pi)
            for w in np.linspace(band.low, band.high, count if band.high > band.low else 1):
                self.rows.extend((band, float(w), phase) for phase in self.layout.phases)

    def _solve(self, positions: np.ndarray, duration: float) -> tuple[np.ndarray, float]:
        n = len(positions)
        matrix = np.empty((len(self.rows), n + 1))
        for band in self.bands:
            chosen = [i for i, row in enumerate(self.rows) if row[0] is band]
            w, phase = np.array([self.rows[i][1:] for i in chosen]).T
            response = self.layout.columns(positions, duration, w, band.damping_ratio)
            matrix[chosen, :n] = (np.exp(-1j * phase)[:, None] * response).real / band.tolerance
        matrix[:, n] = -1.0
        cost = np.concatenate((np.zeros(n), [1.0]))
        total = np.concatenate((np.ones(n), [0.0]))[None]
        result = linprog(cost, matrix, np.zeros(len(matrix)), total, [1.0], method="highs")
        if result.x is None:
            raise ComponentError(f"the linear programme of the shaper was not solved: {result.message}")
        return result.x[:n], float(result.x[n])

    def _exchange(self, amplitudes: np.ndarray, positions: np.ndarray, duration: float) -> int:
        """Add the constraints that the amplitudes violate; returns how many."""
        used = amplitudes > 0.0
        a, p = amplitudes[used], positions[used]
        before = len(self.rows)
        for band in self.bands:

            def response(w: np.ndarray, band: Band = band) -> np.ndarray:
                return self.layout.columns(p, duration, w, band.damping_ratio) @ a

            def level(w: np.ndarray, response: Callable[[np.ndarray], np.ndarray] = response) -> np.ndarray:
                return np.abs(response(w))

            found, v = peaks(level, band.low, band.high, duration)
            worst = found[v > band.tolerance * (1.0 + _EXCESS)]
            self.rows.extend((band, float(w), float(phase)) for w, phase in zip(worst, np.angle(response(worst)), strict=True))
        return len(self.rows) - before


def shortest_on_grid(bands: Sequence[Band], layout: Layout, precision: float) -> tuple[float, np.ndarray, np.ndarray]:
    """Shortest feasible duration [s] to a relative precision, with the amplitudes and positions on the grid.

    Raises ComponentError if no duration up to 64 periods of the lowest frequency is enough.
    """
    programme = GridProgramme(bands, layout)
    infeasible, feasible = 0.0, 0.5 * math.pi / programme.highest
    amplitudes = None
    longest = _LONGEST * 2.0 * math.pi / min(band.low for band in bands)
    while amplitudes is None:
        if feasible > longest:
            raise ComponentError(
                f"no positive shaper of at most {_LONGEST:g} periods of the lowest frequency meets these tolerances"
            )
        programme.rows.clear()
        amplitudes = programme.feasible(feasible)
        if amplitudes is None:
            infeasible, feasible = feasible, 1.5 * feasible
    while feasible - infeasible > precision * feasible:
        middle = 0.5 * (infeasible + feasible)
        candidate = programme.feasible(middle)
        if candidate is None:
            infeasible = middle
        else:
            feasible, amplitudes = middle, candidate
    return feasible, amplitudes, programme.positions(feasible)
