"""Conditions on impulse sequences, as equations for Newton's method.

All for the natural frequency 1 rad/s; r is the ratio of a mode's frequency to it, with the same damping ratio. The sums
are weighted to the time of the last impulse, so that V = |cosine + j sine|.
"""

from __future__ import annotations

import math

from shaper_fmu.variable import Array, Values

_LARGEST_EXPONENT = 500.0  # far beyond any solution, but an attempt of Newton's method must not overflow


def vibration_sums(amplitude: Values, delay: Values, count: int, damping: float, ratio: float) -> tuple[float, float, float, float]:
    """The residual's cosine and sine sums and their derivatives by the frequency ratio."""
    damped = math.sqrt(1.0 - damping * damping)
    cosine = 0.0
    sine = 0.0
    cosine_slope = 0.0
    sine_slope = 0.0
    for i in range(count):
        age = delay[count - 1] - delay[i]
        weight = amplitude[i] * math.exp(min(_LARGEST_EXPONENT, -damping * ratio * age))
        c = weight * math.cos(damped * ratio * delay[i])
        s = weight * math.sin(damped * ratio * delay[i])
        cosine += c
        sine += s
        cosine_slope += -damping * age * c - damped * delay[i] * s
        sine_slope += -damping * age * s + damped * delay[i] * c
    return cosine, sine, cosine_slope, sine_slope


def zero_at(f: Array, row: int, amplitude: Values, delay: Values, count: int, damping: float, ratio: float) -> int:
    """Two equations from `row` on: no residual at this ratio; returns the next row."""
    cosine, sine, _, _ = vibration_sums(amplitude, delay, count, damping, ratio)
    f[row] = cosine
    f[row + 1] = sine
    return row + 2


def flat_zero_at(f: Array, row: int, amplitude: Values, delay: Values, count: int, damping: float, ratio: float) -> int:
    """Four equations: no residual and no first derivative of it at this ratio; returns the next row."""
    cosine, sine, cosine_slope, sine_slope = vibration_sums(amplitude, delay, count, damping, ratio)
    f[row] = cosine
    f[row + 1] = sine
    f[row + 2] = cosine_slope
    f[row + 3] = sine_slope
    return row + 4


def hump_at(
    f: Array, row: int, amplitude: Values, delay: Values, count: int, damping: float, ratio: float, tolerance: float
) -> int:
    """Two equations: V equals the tolerance and has an extremum at this ratio; returns the next row."""
    cosine, sine, cosine_slope, sine_slope = vibration_sums(amplitude, delay, count, damping, ratio)
    f[row] = (cosine * cosine + sine * sine) / tolerance - tolerance
    f[row + 1] = (cosine * cosine_slope + sine * sine_slope) / tolerance
    return row + 2


def rising(values: Values, first: int, last: int) -> bool:
    """Whether values[first] .. values[last] rise."""
    for i in range(first, last):
        if not values[i] < values[i + 1]:
            return False
    return True
