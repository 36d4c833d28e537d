"""Residual vibration of an impulse sequence on one mode, and the width of the band in which it is tolerated."""

from __future__ import annotations

import math

from shaper_fmu.variable import Values

_HIGHEST_RATIO = 10.0
_SCAN_STEP = 0.005
_RIPPLE_SHARE = 0.5  # V changes over frequency ratios of 2 pi / (w T): no faster than a scan in steps of 0.5 / (w T) sees
_ROUNDING = 3e-16  # of V
_BEFORE_ONE = 1.0 - 2.0**-53
_TOUCHING = 1.0 + 1e-9  # a maximum that touches the tolerance, as an EI shaper's does, is no crossing


def residual_vibration(amplitude: Values, delay: Values, count: int, natural_frequency: float, damping_ratio: float) -> float:
    """V of Singer and Seering 1990: the residual envelope at the last impulse over a unit impulse's at time zero.

    V = exp(-zeta w t_n) |sum_i A_i exp(zeta w t_i) exp(j wd t_i)|, for frequency in rad/s and delays in s.
    """
    decay = damping_ratio * natural_frequency
    damped = natural_frequency * math.sqrt(1.0 - damping_ratio * damping_ratio)
    real = 0.0
    imaginary = 0.0
    for i in range(count):
        weight = amplitude[i] * math.exp(decay * (delay[i] - delay[count - 1]))
        real += weight * math.cos(damped * delay[i])
        imaginary += weight * math.sin(damped * delay[i])
    return math.sqrt(real * real + imaginary * imaginary)


def insensitivity(
    amplitude: Values, delay: Values, count: int, natural_frequency: float, damping_ratio: float, tolerance: float
) -> float:
    """Width of the band of w / natural_frequency around 1 with V <= tolerance; 0 if V exceeds it at 1.

    The nearest crossing on each side is bracketed by a scan and found to V's rounding; the band ends at 0 and 10.
    """
    if residual_vibration(amplitude, delay, count, natural_frequency, damping_ratio) > _TOUCHING * tolerance:
        return 0.0
    step = min(_SCAN_STEP, _RIPPLE_SHARE / max(1e-9, natural_frequency * delay[count - 1]))
    above = _crossing(amplitude, delay, count, natural_frequency, damping_ratio, tolerance, step)
    below = _crossing(amplitude, delay, count, natural_frequency, damping_ratio, tolerance, -step)
    return above - below


def _crossing(
    amplitude: Values, delay: Values, count: int, natural_frequency: float, damping_ratio: float, tolerance: float, step: float
) -> float:
    inside = _calm(amplitude, delay, count, damping_ratio * natural_frequency, tolerance)
    if inside < 1.0 and step > 0.0:
        return _HIGHEST_RATIO
    if inside <= -step:  # less than a step of the scan is left
        return 0.0
    outside = inside + step
    below = _excess(amplitude, delay, count, natural_frequency, damping_ratio, tolerance, inside)
    above = _excess(amplitude, delay, count, natural_frequency, damping_ratio, tolerance, outside)
    while above <= (_TOUCHING - 1.0) * tolerance:
        inside, below = outside, above
        outside += step
        if outside <= 0.0:
            return 0.0
        if outside >= _HIGHEST_RATIO:
            return _HIGHEST_RATIO
        above = _excess(amplitude, delay, count, natural_frequency, damping_ratio, tolerance, outside)
    side = 0
    middle = outside
    for _ in range(60):  # the secant's zero, which the Illinois rule keeps from creeping from one side
        share = below / (below - above) if below < 0.0 < above else 0.5
        middle = inside + share * (outside - inside)
        excess = _excess(amplitude, delay, count, natural_frequency, damping_ratio, tolerance, middle)
        if abs(excess) <= _ROUNDING:
            return middle
        if excess <= 0.0:
            inside, below = middle, excess
            above *= 0.5 if side < 0 else 1.0
            side = -1
        else:
            outside, above = middle, excess
            below *= 0.5 if side > 0 else 1.0
            side = 1
    return middle


def _calm(amplitude: Values, delay: Values, count: int, decay: float, tolerance: float) -> float:
    """The least frequency ratio from which on all impulses together have decayed to the tolerance at the last one, whatever
    their phases; 1 if they have not at 1. A scan of a damped mode's long shaper would not come to an end there."""
    low = 0.0
    high = 1.0
    for i in range(60):
        ratio = high if i == 0 else 0.5 * (low + high)
        most = 0.0
        for k in range(count):
            most += abs(amplitude[k]) * math.exp(ratio * decay * (delay[k] - delay[count - 1]))
        if most <= tolerance:
            high = ratio
        elif i == 0:
            return 1.0
        else:
            low = ratio
    return min(high, _BEFORE_ONE)


def _excess(
    amplitude: Values, delay: Values, count: int, natural_frequency: float, damping_ratio: float, tolerance: float, ratio: float
) -> float:
    """V - tolerance at this frequency ratio."""
    return residual_vibration(amplitude, delay, count, ratio * natural_frequency, damping_ratio) - tolerance
