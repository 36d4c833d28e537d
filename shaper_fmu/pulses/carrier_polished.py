"""Newton correction of a carrier's switch times: no residual vibration at all, by the smallest shifts.

The shifts d_i of the switches solve S(t + d) = 0 with the least sum of squares: with the 2 x n matrix J of derivatives
of the real and imaginary part of S, d = J' (J J')^-1 (J d - S) is iterated to its fixed point, where d is orthogonal to
the directions that leave S = 0 unchanged. A switch at the end of the travel stays there. Switches may not cross nor
leave [0, duration]: a pulse or gap that would turn inside out is left out, a switch that would leave is held at the end.
"""

from __future__ import annotations

import math

from shaper_fmu.pulses.carrier import carrier, profile_reference
from shaper_fmu.pulses.method import PulseMethod
from shaper_fmu.pulses.minimum_width import enforce_minimum_width, remove_pair
from shaper_fmu.pulses.residual import shortest_width, switch_residual
from shaper_fmu.pulses.workspace import PulseWorkspace
from shaper_fmu.variable import Array

SOLVED = 1e-12
"""The largest V that counts as none."""
_NEAREST_STEPS = 30
_NEWTON_STEPS = 10


def polish_switches(
    switch_time: Array, original: Array, count: int, duration: float, natural_frequency: float, damping_ratio: float
) -> int:
    """Shift `count` switches [s] so that V = 0; `original` is room for as many. natural_frequency in rad/s.

    Returns the number of switches that remain, or 0 if no shift within the bounds was found.
    """
    for i in range(count):
        original[i] = switch_time[i]
    begin = 0
    end = count - 1 if switch_time[count - 1] >= duration else count
    while end - begin >= 2:
        for i in range(begin, end):
            switch_time[i] = original[i]
        if not _shift(switch_time, original, begin, end, count, duration, natural_frequency, damping_ratio):
            return 0
        crossing = _worst_crossing(switch_time, count)
        if crossing >= 0:
            remove_pair(original, count, crossing)
            count = remove_pair(switch_time, count, crossing)
            begin = min(begin, crossing)  # the held switch at 0 may be one of the pair
            end = count - 1 if original[count - 1] >= duration else count
        elif switch_time[0] < 0.0:
            switch_time[0] = original[0] = 0.0
            begin = 1
        elif switch_time[count - 1] > duration:
            switch_time[count - 1] = original[count - 1] = duration
            end = count - 1
        else:
            return count
    return 0


def _worst_crossing(switch_time: Array, count: int) -> int:
    """Index of the first switch of the pair that crossed most, or -1."""
    worst = -1
    least = 0.0
    for i in range(count - 1):
        width = switch_time[i + 1] - switch_time[i]
        if width < least or (width == 0.0 and worst < 0):
            least = width
            worst = i
    return worst


def _shift(
    switch_time: Array,
    original: Array,
    begin: int,
    end: int,
    count: int,
    duration: float,
    natural_frequency: float,
    damping_ratio: float,
) -> bool:
    """Shift the switches begin .. end - 1 to V = 0, as near to the original ones as can be; false if that fails."""
    for k in range(_NEAREST_STEPS + _NEWTON_STEPS):
        if switch_residual(switch_time, count, duration, natural_frequency, damping_ratio) < 1e-2 * SOLVED:
            return True
        nearest = k < _NEAREST_STEPS
        if not _correct(switch_time, original, begin, end, count, duration, natural_frequency, damping_ratio, nearest):
            return False
    return switch_residual(switch_time, count, duration, natural_frequency, damping_ratio) < SOLVED


def _correct(
    switch_time: Array,
    original: Array,
    begin: int,
    end: int,
    count: int,
    duration: float,
    natural_frequency: float,
    damping_ratio: float,
    nearest: bool,
) -> bool:
    """One step to S = 0: of the smallest distance to the original times, or (not nearest) of the smallest length."""
    damped = natural_frequency * math.sqrt(1.0 - damping_ratio * damping_ratio)
    decay = damping_ratio * natural_frequency
    real = 0.0
    imaginary = 0.0
    g11 = 0.0
    g12 = 0.0
    g22 = 0.0
    for i in range(count):
        weight = math.exp(decay * (switch_time[i] - duration))
        if i % 2:
            weight = -weight
        cosine = weight * math.cos(damped * switch_time[i])
        sine = weight * math.sin(damped * switch_time[i])
        real -= cosine
        imaginary -= sine
        if begin <= i < end:
            a = decay * cosine - damped * sine
            b = decay * sine + damped * cosine
            g11 += a * a
            g12 += a * b
            g22 += b * b
            if nearest:
                real += a * (switch_time[i] - original[i])
                imaginary += b * (switch_time[i] - original[i])
    determinant = g11 * g22 - g12 * g12
    if not determinant > 1e-12 * g11 * g22:
        return False
    first = (g22 * real - g12 * imaginary) / determinant
    second = (g11 * imaginary - g12 * real) / determinant
    limit = 0.25 * duration
    for i in range(begin, end):
        weight = math.exp(decay * (switch_time[i] - duration))
        if i % 2:
            weight = -weight
        cosine = weight * math.cos(damped * switch_time[i])
        sine = weight * math.sin(damped * switch_time[i])
        shift = (decay * cosine - damped * sine) * first + (decay * sine + damped * cosine) * second
        base = original[i] if nearest else switch_time[i]
        switch_time[i] = base + max(-limit, min(limit, shift))
    return True


def polish_until_wide(
    switch_time: Array, original: Array, count: int, duration: float, natural_frequency: float, damping_ratio: float, limit: float
) -> int:
    """Polish, and again without the pulses and gaps that are shorter than `limit` [s], until V = 0 and none is.

    Returns the number of switches that remain, or 0 if that is not possible.
    """
    while count > 0:
        count = enforce_minimum_width(switch_time, count, limit)
        count = polish_switches(switch_time, original, count, duration, natural_frequency, damping_ratio)
        if shortest_width(switch_time, count) >= limit:
            return count
    return 0


def polished(m: PulseWorkspace, room: int) -> int:
    """The carrier's switches, polished, into m.switch_time; returns their number."""
    count = carrier(m, room)
    if count <= 0:
        return count
    count = polish_until_wide(
        m.switch_time,
        m.original_time,
        count,
        m.duration,
        m.natural_frequency,
        m.damping_ratio,
        m.minimum_pulse_width_limit,
    )
    m.certificate_left = switch_residual(m.switch_time, count, m.duration, m.natural_frequency, m.damping_ratio)
    return count


CARRIER_POLISHED = PulseMethod(
    name="carrier_polished",
    number=2,
    switches=polished,
    failure="no shift of the switches leaves no vibration with frequency_ratio = {frequency_ratio}, duration = {duration} s and "
    "minimum_pulse_width_limit = {minimum_pulse_width_limit} s; use a larger frequency_ratio",
    reference=profile_reference,
    jumps_at_start=False,
    keeps_width=True,
    summary="the same with the smallest shifts of the switches that leave no vibration",
)
