"""A proven bound of the residual vibration of impulse and pulse sequences over a box of frequencies and damping ratios.

A grid of V misses what lies between its points. Here a bound is proven, by two facts.

**The maximum is on the boundary.** With p = -zeta w + j wd and the impulses' distances s_i = T - t_i >= 0 from the end of the
command, V = |F(p)|, F(p) = sum_i a_i exp(p s_i) (for impulses of an input shaper up to conjugation, which changes no modulus).
A box [w1, w2] x [zeta1, zeta2] is a sector of a ring in the plane of p, since p = w exp(j (pi/2 + phi)) with sin(phi) = zeta.
F is analytic, so by the maximum modulus principle |F| is largest on the sector's boundary: two rays, along which w changes
at zeta1 or zeta2, and two arcs, along which zeta changes at w1 or w2.

**Along an edge, Taylor's formula bounds it.** Let f(x) = F(p(x)) with x = w or x = phi, and let a cell be |x - m| <= h. Then
|f(x)| <= |f(m) + f'(m) (x - m)| + K h^2 / 2, where the first term is convex in x and so largest at an end of the cell, and K
bounds |f''| in the cell:

    x = w:    |f''| <= S2,                S_k = sum_i |a_i| s_i^k exp(-sigma s_i)
    x = phi:  |f''| <= w^2 S2 + w S1,     sigma the least zeta w of the cell

The bound of a cell is at most K h^2 more than |f| at one of its ends, so halving the cells that could hold more than the largest
value found so far (plus the tolerance) comes to an end: branch and bound. Rounding is counted: each f(m) and f'(m) is widened by
its error, some units of the last place of S_k, times 1 + w T for the angle's rounding.
"""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np

from shaper_fmu.design.impulse_sequence import ImpulseSequence
from shaper_fmu.design.pulse_sequence import PulseSequence
from shaper_fmu.errors import ArgumentError

_ULPS = 16.0 * 2.0**-53
"""Relative error of a term, in which exp, cos and sin may be wrong by 4 units of the last place, and of each addition."""

_MOST_CELLS = 1_000_000
_CHUNK = 1 << 22
"""Numbers that are held for an evaluation: cells times impulses."""


@dataclass(frozen=True)
class Guarantee:
    """The proven bound of V over a box.

    Attributes:
        bound: V is nowhere larger.
        attained: V at `at`, the largest that was found; bound - attained is at most the tolerance.
        at: natural frequency [rad/s] and damping ratio there.
        evaluations: how many cells were bounded.
    """

    bound: float
    attained: float
    at: tuple[float, float]
    evaluations: int


@dataclass(frozen=True)
class _Edge:
    """A ray (w from `low` to `high` at phi = `fixed`), or an arc (phi from `low` to `high` at w = `fixed`)."""

    ray: bool
    fixed: float
    low: float
    high: float

    def polar(self, x: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
        """w and phi at x."""
        fixed = np.full_like(x, self.fixed)
        return (x, fixed) if self.ray else (fixed, x)


def guarantee(
    command: ImpulseSequence | PulseSequence,
    natural_frequency: tuple[float, float],
    damping_ratio: tuple[float, float] = (0.0, 0.0),
    *,
    tolerance: float = 1e-9,
) -> Guarantee:
    """A bound of V (Singer and Seering 1990, as `residual_vibration` gives it) over a box, at most `tolerance` above V's maximum.

    `natural_frequency` [rad/s] and `damping_ratio` are the box's low and high values, which may be equal. Raises ArgumentError
    for a box outside 0 < w, 0 <= zeta < 1, for a command that is no sequence, and for a tolerance that is finer than rounding.
    """
    low, high = _interval("natural_frequency", natural_frequency, math.ulp(0.0), math.inf)
    light, heavy = _interval("damping_ratio", damping_ratio, 0.0, 1.0)
    amplitudes, distances = _terms(command)
    rounding = _ULPS * (len(amplitudes) + 8.0) * (1.0 + high * float(distances[0])) * float(np.abs(amplitudes).sum())
    if not tolerance >= 16.0 * rounding:
        raise ArgumentError(f"tolerance = {tolerance:g} is finer than rounding allows here: at least {16.0 * rounding:.2g}")
    phi = math.asin(light), math.asin(heavy)
    search = _Search(amplitudes, distances, tolerance - 8.0 * rounding)
    for edge in _edges((low, high), phi):
        search.edge(edge)
    w, angle = search.place
    at = min(max(w, low), high), min(max(math.sin(angle), light), heavy)
    attained = command.residual_vibration(*at)
    # 4 times: of the bounds' own places, of asin and sin, and of what residual_vibration may add
    return Guarantee(search.bound + 4.0 * rounding, attained, at, search.evaluations)


def _interval(name: str, given: tuple[float, float], least: float, limit: float) -> tuple[float, float]:
    low, high = float(given[0]), float(given[1])
    if not least <= low <= high < limit:
        domain = "0 <= low <= high < 1" if limit == 1.0 else "0 < low <= high, finite"
        raise ArgumentError(f"{name} = ({low:g}, {high:g}) must be (low, high) with {domain}")
    return low, high


def _terms(command: ImpulseSequence | PulseSequence) -> tuple[np.ndarray, np.ndarray]:
    """Amplitudes a_i and distances s_i from the end [s], the longest first; shape (n,)."""
    if isinstance(command, ImpulseSequence):
        return np.array(command.amplitudes), command.duration - np.array(command.delays)
    if isinstance(command, PulseSequence):
        jumps = np.diff([0.0, *command.levels]) / abs(command.levels[-1])
        return jumps, command.travel_time - np.array(command.switch_times)
    raise ArgumentError(f"a guarantee is for sequences of impulses and of pulses, not for {type(command).__name__}")


def _edges(w: tuple[float, float], phi: tuple[float, float]) -> list[_Edge]:
    """The box's boundary: all that is left of it where an interval is a single value."""
    rays = [_Edge(True, angle, *w) for angle in dict.fromkeys(phi)] if w[0] < w[1] or phi[0] == phi[1] else []
    arcs = [_Edge(False, one, *phi) for one in dict.fromkeys(w)] if phi[0] < phi[1] else []
    return rays + arcs


class _Search:
    """Branch and bound over edges, with the largest value found so far."""

    def __init__(self, amplitudes: np.ndarray, distances: np.ndarray, tolerance: float):
        self._a, self._s, self._tolerance = amplitudes, distances, tolerance
        self.bound, self.best, self.place, self.evaluations = 0.0, -1.0, (0.0, 0.0), 0

    def edge(self, edge: _Edge) -> None:
        """Bound |F| along an edge."""
        middle, half = np.array([0.5 * (edge.low + edge.high)]), np.array([0.5 * (edge.high - edge.low)])
        while middle.size:
            if middle.size > _MOST_CELLS:
                raise ArgumentError(f"a tolerance of {self._tolerance:g} needs more than {_MOST_CELLS} cells; give a larger one")
            width = half + 8.0 * np.spacing(np.abs(middle) + half)  # the cells overlap, so that rounding leaves no gap
            bounds = self._bounded(edge, middle, width)
            going_on = bounds > self.best + self._tolerance
            self.bound = max(self.bound, float(bounds[~going_on].max(initial=0.0)))
            middle, half = middle[going_on], 0.5 * half[going_on]
            middle, half = np.concatenate([middle - half, middle + half]), np.concatenate([half, half])

    def _bounded(self, edge: _Edge, middle: np.ndarray, width: np.ndarray) -> np.ndarray:
        """The cells' bounds, shape (n,), after the values at their middles and ends were noted."""
        found = []
        for part in np.array_split(np.arange(middle.size), 1 + middle.size * self._a.size // _CHUNK):
            found.append(self._cells(edge, middle[part], width[part]))
            ends = np.concatenate([middle[part] + width[part], middle[part] - width[part]])
            w, phi = edge.polar(np.clip(ends, edge.low, edge.high))
            self._record(w, phi, self._exponentials(w, phi) @ self._a)
        self.evaluations += middle.size
        return np.concatenate(found)

    def _cells(self, edge: _Edge, middle: np.ndarray, width: np.ndarray) -> np.ndarray:
        w, phi = edge.polar(middle)
        lowest_w, lowest_phi = edge.polar(np.maximum(middle - width, 0.0))
        terms = self._exponentials(w, phi)
        direction = 1j * np.exp(1j * phi) * (1.0 if edge.ray else 1j * w)
        value, slope = terms @ self._a, direction * (terms @ (self._a * self._s))
        self._record(w, phi, value)
        sigma = lowest_w * np.sin(lowest_phi) * (1.0 - 1e-12)
        unit = _ULPS * (self._a.size + 8.0) * (1.0 + w * self._s[0])
        s0, s1, s2 = (self._sizes(sigma, power) * (1.0 + unit) for power in range(3))
        curvature = s2 if edge.ray else w * (w * s2 + s1)
        rounding = unit * (s0 + width * s1 * (1.0 if edge.ray else w))
        ends = np.maximum(np.abs(value + slope * width), np.abs(value - slope * width))
        return (ends + 0.5 * curvature * width * width) * (1.0 + unit) + rounding

    def _exponentials(self, w: np.ndarray, phi: np.ndarray) -> np.ndarray:
        """exp(p s_i), shape (n, impulses)."""
        return np.exp(np.multiply.outer(w * (-np.sin(phi) + 1j * np.cos(phi)), self._s))

    def _sizes(self, sigma: np.ndarray, power: int) -> np.ndarray:
        """S_k for each sigma, shape (n,)."""
        return np.exp(-np.multiply.outer(sigma, self._s)) @ (np.abs(self._a) * self._s**power)

    def _record(self, w: np.ndarray, phi: np.ndarray, values: np.ndarray) -> None:
        """Keep the largest of |F| at these places, if it is the largest so far."""
        sizes = np.abs(values)
        at = int(np.argmax(sizes))
        if sizes[at] > self.best:
            self.best, self.place = float(sizes[at]), (float(w[at]), float(phi[at]))
