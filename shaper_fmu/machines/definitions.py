"""The impulses that firmware makes of a kind, a frequency and a damping ratio, by the formulas that it publishes.

They are not always those of this project: firmware takes closed forms without damping and weakens later impulses, or fits.
K = exp(-pi zeta / sqrt(1 - zeta^2)) is what damping leaves of a swing after half a damped period.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Sequence

from shaper_fmu.design.impulse_sequence import ImpulseSequence

Impulses = Callable[[float, float], ImpulseSequence]
"""Of an undamped natural frequency [Hz] and a damping ratio."""

TOLERANCE = 0.05
"""Of the EI shapers, in all firmware that has them."""

TWO_HUMPS = (
    ((0.0, 0.0, 0.0, 0.0), (0.16054, 0.76699, 2.2656, -1.2275)),
    ((0.4989, 0.1627, -0.54262, 6.1618), (0.33911, 0.45081, -2.5808, 1.7365)),
    ((0.99748, 0.18382, -1.5827, 8.1712), (0.34089, -0.61533, -0.68765, 0.42261)),
    ((1.4992, -0.09297, -0.28338, 1.8571), (0.15997, -0.60246, 1.0028, -0.93145)),
)
"""The fit of Singhose, Porter, Tuttle and Singer 1997 for V = 5 %: for each impulse polynomials in zeta, of time and amplitude."""
THREE_HUMPS = (
    ((0.0, 0.0, 0.0, 0.0), (0.11275, 0.76632, 3.2916, -1.4438)),
    ((0.49974, 0.23834, 0.44559, 12.472), (0.23698, 0.61164, -2.5785, 4.8522)),
    ((0.99849, 0.29808, -2.3646, 23.399), (0.30008, -0.19062, -2.1456, 0.13744)),
    ((1.4987, 0.10306, -2.0139, 17.032), (0.23775, -0.73297, 0.46885, -2.0865)),
    ((1.9996, -0.28231, 0.61536, 5.4045), (0.11244, -0.45439, 0.96382, -1.46)),
)


def damped_period(frequency: float, zeta: float) -> float:
    """[s]."""
    return 1.0 / (frequency * math.sqrt(1.0 - zeta * zeta))


def left_after(share: float, zeta: float) -> float:
    """What damping leaves of a swing after so many half periods."""
    return math.exp(-share * math.pi * zeta / math.sqrt(1.0 - zeta * zeta))


def normalised(amplitudes: Sequence[float], delays: Sequence[float]) -> ImpulseSequence:
    """Amplitudes divided by their sum, as all firmware does."""
    total = math.fsum(amplitudes)
    return ImpulseSequence(tuple(a / total for a in amplitudes), tuple(delays))


def zero_derivatives(order: int) -> Impulses:
    """ZV (order 0), ZVD, ZVDD, ZVDDD: order + 2 impulses, half a damped period apart, binomial."""
    return weakened([math.comb(order + 1, i) for i in range(order + 2)], 0.5)


def weakened(undamped: Sequence[float], spacing: float) -> Impulses:
    """Impulses of an undamped mode, `spacing` damped periods apart, each weaker by what damping leaves until then."""

    def impulses(frequency: float, zeta: float) -> ImpulseSequence:
        k, step = left_after(2.0 * spacing, zeta), spacing * damped_period(frequency, zeta)
        return normalised([a * k**i for i, a in enumerate(undamped)], [i * step for i in range(len(undamped))])

    return impulses


MZV = weakened((1.0 - math.sqrt(0.5), math.sqrt(2.0) - 1.0, 1.0 - math.sqrt(0.5)), 0.375)


def undamped_ei(humps: int, v: float = TOLERANCE) -> tuple[float, ...]:
    """Amplitudes of EI shapers of one, two or three humps without damping (Singhose, Porter, Tuttle and Singer 1997)."""
    if humps == 1:
        a = 0.25 * (1.0 + v)
        return a, 1.0 - 2.0 * a, a
    if humps == 2:
        x = (v * v * (math.sqrt(1.0 - v * v) + 1.0)) ** (1.0 / 3.0)
        a = (3.0 * x * x + 2.0 * x + 3.0 * v * v) / (16.0 * x)
        return a, 0.5 - a, 0.5 - a, a
    a = (1.0 + 3.0 * v + 2.0 * math.sqrt(2.0 * (v + 1.0) * v)) / 16.0
    b = 0.25 * (1.0 - v)
    return a, b, 1.0 - 2.0 * (a + b), b, a


def weakened_ei(humps: int) -> Impulses:
    """EI shapers without damping, weakened: firmware before Klipper of February 2024, and what follows that."""
    return weakened(undamped_ei(humps), 0.5)


def fitted(table: Sequence[tuple[Sequence[float], Sequence[float]]], *, damped: bool) -> Impulses:
    """Polynomials in zeta; times count in damped or in undamped periods."""

    def impulses(frequency: float, zeta: float) -> ImpulseSequence:
        period = damped_period(frequency, zeta) if damped else 1.0 / frequency
        return normalised([_value(a, zeta) for _, a in table], [_value(t, zeta) * period for t, _ in table])

    return impulses


def fitted_ei(frequency: float, zeta: float, v: float = TOLERANCE) -> ImpulseSequence:
    """The EI shaper of Klipper since February 2024: fits in zeta and in the tolerance, times in damped periods."""
    first = (0.24968 + 0.24961 * v, 0.80008 + 1.23328 * v, 0.49599 + 3.17316 * v)
    last = (0.25149 + 0.21474 * v, -0.83249 + 1.41498 * v, 0.85181 - 4.90094 * v)
    middle = (0.4999, 0.46159 * v + 8.57843 * v * v, 4.26169 * v - 108.644 * v * v, 1.75601 * v + 336.989 * v * v)
    a1, t2, a3 = (_value(fit, zeta) for fit in (first, middle, last))
    period = damped_period(frequency, zeta)
    return normalised([a1, 1.0 - a1 - a3, a3], [0.0, t2 * period, period])


def _value(coefficients: Sequence[float], zeta: float) -> float:
    return sum(c * zeta**i for i, c in enumerate(coefficients))
