"""The five-switch on/off command of a given travel time with the smallest worst vibration over a band of frequencies.

The command switches at 0, t1, t2, t3 and the travel time T. No vibration at the design frequency takes two equations,
exp(s t1) + exp(s t3) = 1 + exp(s t2) + exp(s T) with s = zeta w + j wd; the remaining freedom minimizes the largest V
between (1 - band) w and (1 + band) w. With t2 (or t1) held, the angle of exp(s t1) (or exp(s t2)) gives that time, and
its modulus leaves one equation for t3, whose roots are bracketed by a scan. The best of the scans over the held time is
refined by a golden section search, in which Newton's method follows the other two. Both t2 and t1 are tried, because the
solutions hardly depend on one of them near a third and two thirds of the damped period, respectively.

With a band of 20 % this meets the lower bound that linear programming gives for all commands between 0 and 1 (see the
tests), so more switches would not help at half a damped period or below. For little damping, travel times above that of
UM-ZVD, 0.73 of the damped period, make the worst V larger again.
"""

from __future__ import annotations

import math

from shaper_fmu.component import NO_EVENT
from shaper_fmu.pulses.method import PulseMethod
from shaper_fmu.pulses.residual import switch_residual
from shaper_fmu.pulses.workspace import PulseWorkspace
from shaper_fmu.variable import Array

SWITCHES = 5
BAND = 0.2
"""Half width of the band of frequencies, relative."""
NONE = NO_EVENT
_SCAN = 80
_FREQUENCIES = 16  # intervals of the band
_GOLDEN = 0.6180339887498949


def minimax_switches(switch_time: Array, duration: float, natural_frequency: float, damping_ratio: float, band: float) -> float:
    """Switch times [s] for the travel time `duration` [s] into switch_time; natural_frequency in rad/s.

    Returns the largest V in the band, or 1e300 if there is no such command; durations from that of UM-ZV, about a third
    of the damped period, up to the damped period are served.
    """
    span = duration * natural_frequency  # times in 1/w from here on
    if span * math.sqrt(1.0 - damping_ratio * damping_ratio) > 2.0 * math.pi * (1.0 + 1e-12):
        return NONE
    switch_time[0] = 0.0
    switch_time[4] = span
    best = NONE
    best1 = 0.0
    best2 = 0.0
    best3 = 0.0
    for held in range(1, 3):
        worst, t1, t2, t3 = _scan(switch_time, held, span, damping_ratio, band)
        if worst < NONE:
            worst, t1, t2, t3 = _refine(switch_time, held, span, damping_ratio, band, worst, t1, t2, t3)
        if worst < best:
            best = worst
            best1 = t1
            best2 = t2
            best3 = t3
    switch_time[1] = best1 / natural_frequency
    switch_time[2] = best2 / natural_frequency
    switch_time[3] = best3 / natural_frequency
    switch_time[4] = duration
    return best


def _worst(switch_time: Array, span: float, damping_ratio: float, band: float) -> float:
    """The largest V in the band, at 17 frequencies; 1e300 if the switches are not in order."""
    if not 0.0 <= switch_time[1] <= switch_time[2] <= switch_time[3] <= span:
        return NONE
    worst = 0.0
    for i in range(_FREQUENCIES + 1):
        ratio = 1.0 + band * (2.0 * i / _FREQUENCIES - 1.0)
        worst = max(worst, switch_residual(switch_time, SWITCHES, span, ratio, damping_ratio))
    return worst


def _other_switch(held: int, value: float, t3: float, span: float, damping_ratio: float) -> tuple[float, float]:
    """t1 (t2 held) or t2 (t1 held) from the angle of its term, and by how much the modulus then misses.

    The terms are exp(s (t - T)): -(1 + exp(s T)) + exp(s t1) + exp(s t3) for t2, and so on.
    """
    damped = math.sqrt(1.0 - damping_ratio * damping_ratio)
    side = 1.0 if held == 2 else -1.0
    e0 = side * math.exp(-damping_ratio * span)
    e2 = math.exp(damping_ratio * (value - span))
    e3 = side * math.exp(damping_ratio * (t3 - span))
    real = e0 + e2 * math.cos(damped * value) - e3 * math.cos(damped * t3) + side * math.cos(damped * span)
    imaginary = e2 * math.sin(damped * value) - e3 * math.sin(damped * t3) + side * math.sin(damped * span)
    angle = math.atan2(imaginary, real)
    if angle < 0.0:
        angle += 2.0 * math.pi
    other = angle / damped
    return other, math.sqrt(real * real + imaginary * imaginary) - math.exp(damping_ratio * (other - span))


def _scan(switch_time: Array, held: int, span: float, damping_ratio: float, band: float) -> tuple[float, float, float, float]:
    """The best (worst V, t1, t2, t3) on a grid of the held time, with all t3 that a grid brackets."""
    best = NONE
    best1 = 0.0
    best2 = 0.0
    best3 = 0.0
    for i in range(1, _SCAN):
        value = span * i / _SCAN
        a = value
        _, miss_a = _other_switch(held, value, a, span, damping_ratio)
        for j in range(1, _SCAN + 1):
            left = 1.0 - j / _SCAN  # denser towards the end: with much damping, the last gap is short
            b = span - (span - value) * left * left * left
            _, miss_b = _other_switch(held, value, b, span, damping_ratio)
            if (miss_a > 0.0) != (miss_b > 0.0):
                other, t3 = _bisect(held, value, a, b, miss_a > 0.0, span, damping_ratio)
                switch_time[1] = other if held == 2 else value
                switch_time[2] = value if held == 2 else other
                switch_time[3] = t3
                worst = _worst(switch_time, span, damping_ratio, band)
                if worst < best:
                    best = worst
                    best1 = switch_time[1]
                    best2 = switch_time[2]
                    best3 = t3
            a = b
            miss_a = miss_b
    return best, best1, best2, best3


def _bisect(held: int, value: float, a: float, b: float, above: bool, span: float, damping_ratio: float) -> tuple[float, float]:
    """The other time, and t3 in [a, b] where the modulus is met; -1 if the sign changes by a jump of the angle."""
    for _ in range(50):
        middle = 0.5 * (a + b)
        _, miss = _other_switch(held, value, middle, span, damping_ratio)
        if (miss > 0.0) == above:
            a = middle
        else:
            b = middle
    other, miss = _other_switch(held, value, a, span, damping_ratio)
    if abs(miss) > 1e-9:
        other = -1.0
    return other, a


def _follow(switch_time: Array, held: int, span: float, damping_ratio: float) -> bool:
    """Solve for the two times of t1, t2, t3 that are not held by Newton's method from those given; false if it fails."""
    damped = math.sqrt(1.0 - damping_ratio * damping_ratio)
    free = 3 - held
    real = 1.0
    imaginary = 1.0
    for _ in range(20):
        real = 0.0
        imaginary = 0.0
        for i in range(SWITCHES):
            weight = math.exp(damping_ratio * (switch_time[i] - span))
            if i % 2:
                weight = -weight
            real += weight * math.cos(damped * switch_time[i])
            imaginary += weight * math.sin(damped * switch_time[i])
        if abs(real) + abs(imaginary) < 1e-15:
            return True
        a1, b1 = _slope(switch_time[free], free, span, damping_ratio)
        a3, b3 = _slope(switch_time[3], 3, span, damping_ratio)
        determinant = a1 * b3 - a3 * b1
        if abs(determinant) < 1e-9 * math.sqrt((a1 * a1 + b1 * b1) * (a3 * a3 + b3 * b3)):
            return False
        switch_time[free] -= (real * b3 - imaginary * a3) / determinant
        switch_time[3] -= (imaginary * a1 - real * b1) / determinant
        if not (abs(switch_time[free]) < 2.0 * span and abs(switch_time[3]) < 2.0 * span):
            return False
    return abs(real) + abs(imaginary) < 1e-13


def _slope(time: float, index: int, span: float, damping_ratio: float) -> tuple[float, float]:
    """Derivative of the term of switch `index` with respect to its time."""
    damped = math.sqrt(1.0 - damping_ratio * damping_ratio)
    weight = math.exp(damping_ratio * (time - span))
    if index % 2:
        weight = -weight
    cosine = weight * math.cos(damped * time)
    sine = weight * math.sin(damped * time)
    return damping_ratio * cosine - damped * sine, damping_ratio * sine + damped * cosine


def _tried(
    switch_time: Array, held: int, value: float, span: float, damping_ratio: float, band: float, t1: float, t2: float, t3: float
) -> float:
    """The worst V with the held time at `value`, the others followed from t1, t2, t3 into switch_time; 1e300 if impossible."""
    switch_time[1] = t1
    switch_time[2] = t2
    switch_time[3] = t3
    switch_time[held] = value
    if not _follow(switch_time, held, span, damping_ratio):
        return NONE
    return _worst(switch_time, span, damping_ratio, band)


def _refine(
    switch_time: Array, held: int, span: float, damping_ratio: float, band: float, best: float, t1: float, t2: float, t3: float
) -> tuple[float, float, float, float]:
    """Golden section search for the held time between its neighbours on the grid, from the solution given."""
    known = t2 if held == 2 else t1
    a = known - span / _SCAN
    b = known + span / _SCAN
    for _ in range(45):
        left = b - _GOLDEN * (b - a)
        right = a + _GOLDEN * (b - a)
        at_left = _tried(switch_time, held, left, span, damping_ratio, band, t1, t2, t3)
        at_right = _tried(switch_time, held, right, span, damping_ratio, band, t1, t2, t3)
        if at_left >= NONE and at_right >= NONE:  # keep the side of the solution that is known
            if left < known:
                a = left
            else:
                b = right
        elif at_left < at_right:
            b = right
        else:
            a = left
    at_known = _tried(switch_time, held, known, span, damping_ratio, band, t1, t2, t3)
    if at_known >= NONE:
        return best, t1, t2, t3
    at_middle = _tried(switch_time, held, 0.5 * (a + b), span, damping_ratio, band, t1, t2, t3)
    if at_middle > at_known:
        at_middle = _tried(switch_time, held, known, span, damping_ratio, band, t1, t2, t3)
    return at_middle, switch_time[1], switch_time[2], switch_time[3]


def minimax(m: PulseWorkspace, room: int) -> int:
    """The five switches into m.switch_time."""
    worst = minimax_switches(m.switch_time, m.duration, m.natural_frequency, m.damping_ratio, BAND)
    if worst >= NONE:
        return 0
    m.certificate_left = switch_residual(m.switch_time, SWITCHES, m.duration, m.natural_frequency, m.damping_ratio)
    return SWITCHES


MINIMAX = PulseMethod(
    name="minimax",
    number=3,
    switches=minimax,
    failure="no five-switch command without vibration takes {duration} s; use between a third of the damped period and "
    "the whole one, here {damped_period} s",
    summary="five switches: none at the design frequency, the least within 20 % around it",
)
