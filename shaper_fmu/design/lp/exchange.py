"""The shortest positive shaper on a grid of impulse times, by linear programmes with constraint exchange.

For a duration D the least s is sought for which amplitudes A >= 0, sum A = 1, on the grid satisfy
Re(exp(-j phase) S(w)) <= s tolerance for the constraints (w, phase) known so far; at the largest violations of V = |S| over
the bands, found by local maximisation, further constraints are added until none is left. D is feasible if s <= 1; the least
such D is found by secants. (Singhose, Seering and Singer 1996 state the problem; Remez' exchange solves it.)
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from scipy.optimize import linprog

from shaper_fmu.design.lp.layout import Along, Band, Layout
from shaper_fmu.errors import ArgumentError

_GRID_PER_PERIOD = 48
_SAMPLES_PER_HUMP = 12
_LONGEST = 64.0
_FIRST = 0.9
"""The first duration that is tried, as a share of what one frequency needs."""
_GROWTH = 1.5
_PATIENCE = 10
_LEAST_SCALE = 1e-3
_NO_MULTIPLIER = 1e-9
_NEAR = 0.5
"""Constraints that leave more of the tolerance unused than this are forgotten from one duration to the next."""
_EXCESS = 1e-5  # by which the solution on the grid may exceed the tolerances, relative
_NEWTON = 40
_STEP = 1e-9
"""Relative step after which a maximum is known to the last bits of its value."""


def peaks(along: Along, low: float, high: float, duration: float) -> tuple[np.ndarray, np.ndarray]:
    """Local maxima of V = |S| over [low, high], both ends included: frequencies [rad/s] and V there.

    The samples are dense against the fastest ripple that impulses within `duration` [s] can cause; each maximum is then found to
    the last bits of its value.
    """
    if high <= low:
        w = np.array([low])
        return w, np.abs(along(w)[0])
    count = 16 + math.ceil(_SAMPLES_PER_HUMP * duration * (high - low) / math.pi)
    w = np.linspace(low, high, count)
    v = np.abs(along(w)[0])
    inner = 1 + np.flatnonzero((v[1:-1] >= v[:-2]) & (v[1:-1] >= v[2:]))
    tops = climb(along, w[inner], w[inner - 1], w[inner + 1]) if len(inner) else w[inner]
    found = np.concatenate(([low], tops, [high]))
    return found, np.abs(along(found)[0])


def climb(along: Along, w: np.ndarray, left: np.ndarray, right: np.ndarray) -> np.ndarray:
    """The local maximum of |S| near each of these frequencies, between `left` and `right`: where d|S|^2/dw changes its sign.

    Newton's method, with bisection where it would leave the bracket.
    """
    for _ in range(_NEWTON):
        s, slope, curvature = along(w)
        first = (np.conj(s) * slope).real
        second = np.abs(slope) ** 2 + (np.conj(s) * curvature).real
        left, right = np.where(first > 0.0, w, left), np.where(first > 0.0, right, w)
        following = w - first / np.where(second < 0.0, second, -np.inf)
        inside = (second < 0.0) & (left <= following) & (following <= right)
        following = np.where(inside, following, 0.5 * (left + right))
        done = np.abs(following - w) <= _STEP * w
        w = following
        if done.all():
            break
    return w


Active = tuple[Band, float, float]


@dataclass(frozen=True)
class GridSolution:
    """A sequence on a grid of impulse positions: duration [s], amplitudes and positions, each of shape (n,).

    `active` are the constraints that limit it: bands, frequencies [rad/s] and multipliers, those that are not 0.
    """

    duration: float
    amplitudes: np.ndarray
    positions: np.ndarray
    active: tuple[Active, ...]


class GridProgramme:
    """The linear programmes of one design; constraints that were found are kept from one duration to the next."""

    def __init__(self, bands: Sequence[Band], layout: Layout):
        self.bands = bands
        self.layout = layout
        self.highest: float = max(band.high for band in bands)
        self.rows: list[np.ndarray] = []
        """Constraints of each band: frequencies [rad/s] and phases [rad], shape (2, n)."""

    def positions(self, duration: float) -> np.ndarray:
        """The grid of impulse positions for a duration [s]."""
        reach = self.layout.reach * duration
        count = max(24, math.ceil(_GRID_PER_PERIOD * reach * self.highest / (2.0 * math.pi)))
        return np.linspace(0.0, reach, count + 1)

    def least(self, duration: float) -> tuple[float, GridSolution | None]:
        """The least s for which V <= s tolerance over all bands, and the solution; if s > 1, a lower bound of it, and None."""
        positions = self.positions(duration)
        if not self.rows:
            self._begin(duration)
        for _ in range(60):
            amplitudes, scale, slack, multipliers = self._solve(positions, duration)
            going_on = scale <= 1.0 + 1e-7
            active = self._active(multipliers) if going_on else ()
            if not (going_on and self._exchange(amplitudes, positions, duration)):
                self._keep_near(slack)
                return scale, GridSolution(duration, amplitudes, positions, active) if going_on else None
        return math.inf, None

    def _active(self, multipliers: np.ndarray) -> tuple[Active, ...]:
        every = [(band, float(w)) for band, (frequencies, _) in zip(self.bands, self.rows, strict=True) for w in frequencies]
        return tuple((*every[k], float(multipliers[k])) for k in np.flatnonzero(multipliers > _NO_MULTIPLIER))

    def _begin(self, duration: float) -> None:
        for band in self.bands:
            count = 3 + math.ceil(3.0 * duration * (band.high - band.low) / math.pi)
            w = np.linspace(band.low, band.high, count if band.high > band.low else 1)
            phases = np.array(self.layout.phases)
            self.rows.append(np.array([np.repeat(w, len(phases)), np.tile(phases, len(w))]))

    def _solve(self, positions: np.ndarray, duration: float) -> tuple[np.ndarray, float, np.ndarray, np.ndarray]:
        """Amplitudes, s, and for each constraint how far it is from being used, as a share of its tolerance, and its multiplier."""
        n = len(positions)
        parts = []
        for band, (w, phase) in zip(self.bands, self.rows, strict=True):
            response = self.layout.columns(positions, duration, w, band.damping_ratio)
            parts.append((np.exp(-1j * phase)[:, None] * response).real / band.tolerance)
        matrix = np.hstack((np.vstack(parts), np.full((sum(map(len, parts)), 1), -1.0)))
        cost = np.concatenate((np.zeros(n), [1.0]))
        total = np.concatenate((np.ones(n), [0.0]))[None]
        result = linprog(cost, matrix, np.zeros(len(matrix)), total, [1.0], method="highs")
        if result.x is None:
            raise ArgumentError(f"the linear programme of the shaper was not solved: {result.message}")
        return result.x[:n], float(result.x[n]), -(matrix @ result.x), -result.ineqlin.marginals

    def _keep_near(self, slack: np.ndarray) -> None:
        """Forget constraints that are far from being used; those that are needed after all will be found again."""
        ends = np.cumsum([rows.shape[1] for rows in self.rows])[:-1]
        near = np.split(slack <= _NEAR, ends)
        self.rows = [rows[:, kept] for rows, kept in zip(self.rows, near, strict=True)]

    def _exchange(self, amplitudes: np.ndarray, positions: np.ndarray, duration: float) -> int:
        """Add the constraints that the amplitudes violate; returns how many."""
        used = amplitudes > 0.0
        a, p = amplitudes[used], positions[used]
        before = sum(rows.shape[1] for rows in self.rows)
        for k, band in enumerate(self.bands):
            along = self.layout.sampled(a, p, duration, band.damping_ratio)
            found, v = peaks(along, band.low, band.high, duration)
            worst = found[v > band.tolerance * (1.0 + _EXCESS)]
            self.rows[k] = np.hstack((self.rows[k], [worst, np.angle(along(worst)[0])]))
        return sum(rows.shape[1] for rows in self.rows) - before


@dataclass(frozen=True)
class _Trial:
    """A duration [s], log s there, and the solution if s <= 1."""

    duration: float
    level: float
    found: GridSolution | None = None


def shortest_on_grid(bands: Sequence[Band], layout: Layout, precision: float) -> tuple[float, np.ndarray, np.ndarray]:
    """Shortest feasible duration [s] to a relative precision, with the amplitudes and positions on the grid.

    Raises ArgumentError if no duration up to 64 periods of the lowest frequency is enough.
    """
    found = grid_solution(bands, layout, precision)
    return found.duration, found.amplitudes, found.positions


def grid_solution(bands: Sequence[Band], layout: Layout, precision: float) -> GridSolution:
    """The shortest sequence on the grid; see shortest_on_grid.

    log s falls nearly evenly with the duration, so that a secant through an infeasible and a feasible duration soon meets s = 1.
    """
    programme = GridProgramme(bands, layout)
    longest = _LONGEST * 2.0 * math.pi / min(band.low for band in bands)
    duration = _FIRST * max(2.0 * math.acos(band.tolerance) / band.high for band in bands)  # two impulses for one frequency
    short, long = _Trial(0.0, math.inf), None
    steps, rising = 0, True
    while long is None or long.duration - short.duration > precision * long.duration:
        scale, found = programme.least(duration)
        trial = _Trial(duration, math.log(max(scale, _LEAST_SCALE)), found)
        steps += 1
        if long is None and found is None:
            short, duration = trial, _longer(short, trial)
            if duration > longest:
                raise ArgumentError(
                    f"no positive shaper of at most {_LONGEST:g} periods of the lowest frequency meets these tolerances"
                )
            continue
        rising = found is None
        short, long = (trial, long) if rising else (short, trial)
        assert long is not None
        duration = _between(short, long, precision, rising, steps)
    assert long.found is not None
    return long.found


def _longer(before: _Trial, now: _Trial) -> float:
    """The next duration after two that are infeasible: a little beyond where s = 1 is expected."""
    if before.duration == 0.0 or not now.level < before.level:
        return _GROWTH * now.duration
    expected = now.duration + 1.02 * now.level * (now.duration - before.duration) / (before.level - now.level)
    return min(max(expected, 1.02 * now.duration), _GROWTH * now.duration)


def _between(short: _Trial, long: _Trial, precision: float, rising: bool, steps: int) -> float:
    """The next duration between an infeasible and a feasible one: where s = 1 is expected, beside it on the side that was not
    found last, so that both close in on it. Now and then, should that not come to an end, the middle."""
    width = long.duration - short.duration
    if short.duration == 0.0 or math.isinf(short.level) or steps % _PATIENCE == 0:
        return short.duration + 0.5 * width
    expected = short.duration + width * short.level / (short.level - long.level)
    expected += (0.4 if rising else -0.4) * precision * long.duration
    return min(max(expected, short.duration + 0.05 * width), long.duration - 0.05 * width)
