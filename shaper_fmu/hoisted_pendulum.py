"""Small swings of a load on a rope whose length is linear in time: Taylor series, right to rounding.

l theta'' + 2 l' theta' + 2 sigma l theta' + g theta = 0. With the momentum p = l^2 theta' (per kg of load) it reads
theta' = p / l^2, p' = -g l theta - 2 sigma p, without l': theta and p go on where a held rope jumps.
"""

from __future__ import annotations

import math

from shaper_fmu.component import NO_EVENT, Component, Parameter, State, Variable
from shaper_fmu.variable import Array

TERMS = 24
FEW_TERMS = 10
SHORT = 0.02
"""Of a substep so short, in units of the pendulum's time, FEW_TERMS of the series are right to rounding."""
MOST_SUBSTEPS = 1_000_000
NEARLY_CRITICAL = 0.998
"""Square of the largest damping ratio at which a swing's zeros are looked for."""


class HoistedPendulum(Component):
    """A component with the series of a swing: angle and momentum are sums of coefficients times (s / substep)^k."""

    gravity: Variable[float] = Parameter(9.81, "m/s2", "acceleration of gravity", min=0.0, exclusive=True, published=(1e-9, None))

    decay: Variable[float] = State(0.0)  # sigma, the rate at which a swing decays [1/s]
    angle_series: Variable[list[float]] = State(size=TERMS + 1)
    momentum_series: Variable[list[float]] = State(size=TERMS + 1)


def substep_of(m: HoistedPendulum, length: float, speed: float) -> float:
    """A time [s] over which the series converges fast: half a radian of the swing, a fifth of the rope."""
    swing = 0.5 * math.sqrt(length / m.gravity)
    if abs(speed) * swing <= 0.2 * length:
        return swing
    return 0.2 * length / abs(speed)


def find_series(m: HoistedPendulum, angle: float, momentum: float, length: float, speed: float, h: float) -> int:
    """The series from this state, over the substep h, with the rope length + speed s; returns the number of terms."""
    a, b = m.angle_series, m.momentum_series
    gain = speed * h
    area = length * length
    few = m.gravity * h * h <= SHORT * SHORT * length and abs(gain) <= SHORT * length and m.decay * h <= SHORT
    terms = TERMS
    if few:
        terms = FEW_TERMS
    a[0] = angle
    b[0] = momentum
    before = 0.0  # the coefficient of the angle before the last one
    for k in range(terms):
        a[k + 1] = (h * b[k] - 2.0 * length * gain * k * a[k] - gain * gain * (k - 1.0) * before) / (area * (k + 1.0))
        b[k + 1] = -h * (m.gravity * (length * a[k] + gain * before) + 2.0 * m.decay * b[k]) / (k + 1.0)
        before = a[k]
    return terms


def total(series: Array, terms: int) -> float:
    """The sum of the series' coefficients, which is its value at the end of the substep."""
    found = 0.0
    for i in range(terms + 1):
        found += series[terms - i]
    return found


def carried(m: HoistedPendulum, angle: float, momentum: float, length: float, speed: float, span: float) -> tuple[float, float]:
    """Angle and momentum after the time span [s], over which the rope is length + speed s."""
    s = 0.0
    for _ in range(MOST_SUBSTEPS):
        here = length + speed * s
        h = substep_of(m, here, speed)
        last = h >= span - s
        if last:
            h = span - s
        terms = find_series(m, angle, momentum, here, speed, h)
        angle = total(m.angle_series, terms)
        momentum = total(m.momentum_series, terms)
        if last:
            break
        s += h
    return angle, momentum


def time_to_zero(m: HoistedPendulum, angle: float, momentum: float, length: float, slope: float, left: float) -> float:
    """Time [s] until the load next passes straight down, ahead; 0 if it just has.

    The rope is length + slope s in the first `left` seconds. Later it is a guess, which goes on to half or double its length.
    """
    shortest = 0.5 * length
    longest = 2.0 * length
    if m.decay > 0.0:
        longest = min(longest, NEARLY_CRITICAL * m.gravity / (m.decay * m.decay))
    s = 0.0
    for _ in range(MOST_SUBSTEPS):
        if s >= left and not shortest < length < longest:
            slope = 0.0
        h = substep_of(m, length, slope)
        if s < left:
            h = min(h, left - s)
        terms = find_series(m, angle, momentum, length, slope, h)
        angle = total(m.angle_series, terms)
        momentum = total(m.momentum_series, terms)
        if angle >= 0.0 and momentum > 0.0:
            return s + h * zero_share(m.angle_series, terms)
        length += slope * h
        s += h
    return NO_EVENT


def zero_share(series: Array, terms: int) -> float:
    """The share of the substep at which the series rises through zero; 0 if it has before. Newton's method in a bracket."""
    if series[0] >= 0.0:
        return 0.0
    low = 0.0
    high = 1.0
    share = 0.5
    for _ in range(80):
        value = series[terms]
        slope = 0.0
        for i in range(terms):
            slope = slope * share + value
            value = value * share + series[terms - 1 - i]
        if value < 0.0:
            low = share
        else:
            high = share
        tried = share - value / slope if slope != 0.0 else low
        if not low <= tried <= high:
            tried = 0.5 * (low + high)
        if abs(tried - share) <= 1e-16:
            return tried
        share = tried
    return share
