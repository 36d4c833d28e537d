"""Impulses as the unknowns of a linear programme: bands to suppress, and the response as a function of amplitudes and times.

The response of a mode (w, zeta) is S(w) = sum_i A_i exp(zeta w (t_i - D)) exp(j wd t_i), wd = w sqrt(1 - zeta^2), where D is
the duration; the residual vibration of Singer and Seering 1990 is V = |S|. S is linear in the amplitudes; the times are
unknowns as well once a design is polished, and then the gradient of S is wanted.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Sequence
from dataclasses import dataclass

import numpy as np

from shaper_fmu.design.impulse_sequence import ImpulseSequence

_COINCIDENT = 1e-8
_NO_AMPLITUDE = 1e-15


@dataclass(frozen=True)
class Band:
    """V <= tolerance [-] for all natural frequencies from `low` to `high` [rad/s] at one damping ratio [-]."""

    low: float
    high: float
    tolerance: float
    damping_ratio: float = 0.0

    def scaled(self, factor: float) -> Band:
        """The same band with both of its frequencies multiplied by `factor`."""
        return Band(self.low * factor, self.high * factor, self.tolerance, self.damping_ratio)


Along = Callable[[np.ndarray], np.ndarray]
"""S, dS/dw and d2S/dw2 at an array of frequencies [rad/s]; complex, shape (3, n)."""


def _along(amplitudes: np.ndarray, rates: np.ndarray) -> Along:
    """Of sum A_i exp(w r_i)."""
    weights = amplitudes * np.array([np.ones(len(rates)), rates, rates * rates])
    return lambda w: weights @ np.exp(np.multiply.outer(rates, w))


def _along_pairs(amplitudes: np.ndarray, offsets: np.ndarray) -> Along:
    """Of sum A_i cos(w s_i)."""

    def values(w: np.ndarray) -> np.ndarray:
        angle = np.multiply.outer(offsets, w)
        even, odd = np.cos(angle), np.sin(angle)
        return np.array([amplitudes @ even, -(amplitudes * offsets) @ odd, -(amplitudes * offsets**2) @ even], complex)

    return values


class GeneralLayout:
    """Impulses at any times: the first at 0, the last at D. Unknowns x = (A_1 .. A_n, t_2 .. t_(n-1), D)."""

    phases: tuple[float, ...] = tuple(2.0 * math.pi * k / 16 for k in range(16))
    """First guess of the phases arg S of the constraints Re(exp(-j phase) S) <= tolerance: a polygon around the circle."""

    reach: float = 1.0
    """The impulses' positions fill the interval from 0 to this fraction of D."""

    @staticmethod
    def sampled(amplitudes: np.ndarray, positions: np.ndarray, duration: float, damping_ratio: float) -> Along:
        """Like `along`, for amplitudes at positions on a grid."""
        rates = complex(damping_ratio, math.sqrt(1.0 - damping_ratio * damping_ratio)) * positions - damping_ratio * duration
        return _along(amplitudes, rates)

    @staticmethod
    def columns(positions: np.ndarray, duration: float, w: np.ndarray, damping_ratio: float) -> np.ndarray:
        """Response at the frequencies w, one row each, of unit impulses at each of the positions, which are times."""
        rate = w * complex(damping_ratio, math.sqrt(1.0 - damping_ratio * damping_ratio))
        return np.exp(np.outer(rate, positions) - (damping_ratio * duration * w)[:, None])

    @classmethod
    def slope_columns(cls, positions: np.ndarray, duration: float, w: np.ndarray, damping_ratio: float) -> np.ndarray:
        """Like columns, of w t exp(...), the sum over which vanishes with dS/dw where S = 0."""
        return np.outer(w, positions) * cls.columns(positions, duration, w, damping_ratio)

    @staticmethod
    def pack(amplitudes: np.ndarray, positions: np.ndarray, duration: float) -> np.ndarray:
        """Unknowns from impulses sorted by position; an impulse is added at 0 and at D where there is none."""
        return np.concatenate((amplitudes, positions[1:-1], [duration]))

    @staticmethod
    def count(x: np.ndarray) -> int:
        """Number of amplitudes among the unknowns."""
        return (len(x) + 1) // 2

    @classmethod
    def impulses(cls, x: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
        """Amplitudes and times."""
        n = cls.count(x)
        return x[:n], np.concatenate(([0.0], x[n:]))

    @classmethod
    def response(cls, x: np.ndarray, w: np.ndarray, damping_ratio: float) -> tuple[np.ndarray, np.ndarray]:
        """S at each frequency, and its gradient by the unknowns, one row a frequency."""
        amplitudes, times = cls.impulses(x)
        rate = w * complex(damping_ratio, math.sqrt(1.0 - damping_ratio * damping_ratio))
        unit = cls.columns(times, float(x[-1]), w, damping_ratio)
        s = unit @ amplitudes
        by_time = rate[:, None] * unit * amplitudes
        by_time[:, -1] -= damping_ratio * w * s
        return s, np.hstack((unit, by_time[:, 1:]))

    @classmethod
    def slope(cls, x: np.ndarray, w: np.ndarray, damping_ratio: float) -> tuple[np.ndarray, np.ndarray]:
        """sum A_i w t_i exp(...) at each frequency, and its gradient by the unknowns."""
        amplitudes, times = cls.impulses(x)
        rate = w * complex(damping_ratio, math.sqrt(1.0 - damping_ratio * damping_ratio))
        unit = cls.columns(times, float(x[-1]), w, damping_ratio)
        weighted = np.outer(w, times) * unit
        s = weighted @ amplitudes
        by_time = amplitudes * (w[:, None] * unit + rate[:, None] * weighted)
        by_time[:, -1] -= damping_ratio * w * s
        return s, np.hstack((weighted, by_time[:, 1:]))

    @classmethod
    def along(cls, x: np.ndarray, damping_ratio: float) -> Along:
        """S and its first two derivatives by the frequency w, at an array of frequencies; shape (3, n)."""
        amplitudes, times = cls.impulses(x)
        return cls.sampled(amplitudes, times, float(x[-1]), damping_ratio)

    @classmethod
    def limits(cls, x: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
        """Smallest and largest admissible value of each unknown; times may not leave [0, D]."""
        n = cls.count(x)
        return np.zeros(len(x)), np.concatenate((np.ones(n), np.full(n - 2, x[-1]), [math.inf]))


class SymmetricLayout:
    """Impulses in pairs of equal amplitude around D/2, which is optimal without damping (S may be averaged with its mirror
    image). Unknowns x = (A_1 .. A_n, q_1 .. q_(n-1), D): pairs at D/2 +- sqrt(q_i), the last one at 0 and D; A_i is the sum
    of a pair. With the time origin at D/2, S = sum A_i cos(w sqrt(q_i)) is real, and smooth in q where a pair merges.
    """

    phases: tuple[float, float] = (0.0, math.pi)
    reach: float = 0.5

    @staticmethod
    def sampled(amplitudes: np.ndarray, positions: np.ndarray, duration: float, damping_ratio: float) -> Along:
        """Like `along`, for amplitudes at positions on a grid."""
        return _along_pairs(amplitudes, positions)

    @staticmethod
    def columns(positions: np.ndarray, duration: float, w: np.ndarray, damping_ratio: float) -> np.ndarray:
        """Response at the frequencies w, one row each, of unit pairs at each of the positions, which are distances from D/2."""
        return np.cos(np.outer(w, positions)).astype(complex)

    @staticmethod
    def slope_columns(positions: np.ndarray, duration: float, w: np.ndarray, damping_ratio: float) -> np.ndarray:
        """Like columns, of w s sin(w s) = -w d cos(w s) / dw."""
        angle = np.outer(w, positions)
        return (angle * np.sin(angle)).astype(complex)

    @staticmethod
    def pack(amplitudes: np.ndarray, positions: np.ndarray, duration: float) -> np.ndarray:
        """Unknowns from pairs sorted by position."""
        return np.concatenate((amplitudes, positions[:-1] ** 2, [duration]))

    @staticmethod
    def count(x: np.ndarray) -> int:
        """Number of amplitudes among the unknowns."""
        return len(x) // 2

    @classmethod
    def impulses(cls, x: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
        """Amplitudes and times of both halves."""
        n = cls.count(x)
        offsets = np.concatenate((np.sqrt(x[n:-1]), [0.5 * x[-1]]))
        return np.tile(0.5 * x[:n], 2), 0.5 * x[-1] + np.concatenate((offsets, -offsets))

    @classmethod
    def response(cls, x: np.ndarray, w: np.ndarray, damping_ratio: float) -> tuple[np.ndarray, np.ndarray]:
        """S at each frequency, and its gradient by the unknowns, one row a frequency."""
        n = cls.count(x)
        offsets = np.concatenate((np.sqrt(x[n:-1]), [0.5 * x[-1]]))
        angle = np.outer(w, offsets)
        unit = np.cos(angle)
        sinc = np.sinc(angle / math.pi)
        by_square = -0.5 * w[:, None] ** 2 * sinc * x[:n]  # d cos(w s) / d(s^2) = -w sin(w s) / (2 s)
        by_square[:, -1] *= 0.5 * x[-1]  # d(s^2) / dD = D / 2 for s = D / 2
        return (unit @ x[:n]).astype(complex), np.hstack((unit, by_square)).astype(complex)

    @classmethod
    def slope(cls, x: np.ndarray, w: np.ndarray, damping_ratio: float) -> tuple[np.ndarray, np.ndarray]:
        """sum A_i w s_i sin(w s_i) at each frequency, and its gradient by the unknowns."""
        n = cls.count(x)
        angle = np.outer(w, np.concatenate((np.sqrt(x[n:-1]), [0.5 * x[-1]])))
        weighted = angle * np.sin(angle)
        by_square = 0.5 * w[:, None] ** 2 * (np.sinc(angle / math.pi) + np.cos(angle)) * x[:n]
        by_square[:, -1] *= 0.5 * x[-1]
        return (weighted @ x[:n]).astype(complex), np.hstack((weighted, by_square)).astype(complex)

    @classmethod
    def along(cls, x: np.ndarray, damping_ratio: float) -> Along:
        """S and its first two derivatives by the frequency w, at an array of frequencies; shape (3, n)."""
        n = cls.count(x)
        return _along_pairs(x[:n], np.concatenate((np.sqrt(x[n:-1]), [0.5 * x[-1]])))

    @classmethod
    def limits(cls, x: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
        """Smallest and largest admissible value of each unknown; offsets may not leave [0, D/2]."""
        n = cls.count(x)
        return np.zeros(len(x)), np.concatenate((np.ones(n), np.full(n - 1, 0.25 * x[-1] ** 2), [math.inf]))


Layout = type[GeneralLayout] | type[SymmetricLayout]


def layout_for(damping_ratios: Sequence[float]) -> Layout:
    """The symmetric layout if no mode is damped, else the general one."""
    return GeneralLayout if any(damping_ratios) else SymmetricLayout


def to_sequence(amplitudes: np.ndarray, times: np.ndarray, unit: float) -> ImpulseSequence:
    """The sequence of these impulses, their times multiplied by `unit`: sorted, amplitudes made to add up to 1.

    Impulses closer than 1e-8 D are one at their centre of mass, which changes V by less than 1e-13 at up to ten periods.
    """
    merged: list[tuple[float, float]] = []
    duration = float(np.max(times))
    for k in np.argsort(times, kind="stable"):
        a, t = float(amplitudes[k]), float(times[k])
        if merged and t - merged[-1][1] <= _COINCIDENT * duration:
            earlier, start = merged.pop()
            a, t = a + earlier, start if a + earlier == 0.0 else (earlier * start + a * t) / (a + earlier)
        merged.append((a, t))
    kept = [(a, t) for a, t in merged[:-1] if a > _NO_AMPLITUDE] + merged[-1:]
    total = math.fsum(a for a, _ in kept)
    begin = kept[0][1]
    return ImpulseSequence(tuple(a / total for a, _ in kept), tuple((t - begin) * unit for _, t in kept))
