"""EI, two-hump EI and three-hump EI: a tolerated residual V buys the widest band of frequencies.

Singhose, Seering and Singer 1994 (EI); Singhose, Porter, Tuttle and Singer 1997 (multi-hump). With k humps there are
k + 2 impulses; V has k + 1 zeros, and between them k maxima equal to the tolerance. For an odd k the middle maximum lies
at the design frequency, for an even k the middle zero. Undamped designs are closed forms; damped ones solve these
conditions (4 k + 3 equations) from them.
"""

from __future__ import annotations

import math

from shaper_fmu.shapers.conditions import hump_at, rising, zero_at
from shaper_fmu.shapers.method import ShaperMethod
from shaper_fmu.shapers.newton import follow_damping
from shaper_fmu.shapers.workspace import DesignWorkspace
from shaper_fmu.variable import Array


def extra_insensitive(m: DesignWorkspace, humps: int, damping_ratio: float) -> int:
    """Write the sequence for 1 rad/s into m.factor_amplitude, m.factor_delay; returns the number of impulses, 0 if none is found.

    Reads m.vibration_tolerance (0 < V < 1).
    """
    m.humps = humps
    count = humps + 2
    _undamped_impulses(m, humps)
    for i in range(count):
        m.factor_delay[i] = math.pi * i
    _pack(m, count)
    _undamped_marks(m, humps, 2 * count - 1)
    if not follow_damping(m, _equations, 4 * humps + 3, damping_ratio):
        return 0
    unpack(m, m.unknown, count)
    marks = 2 * count - 1
    if not rising(m.factor_delay, 0, count - 1) or not rising(m.unknown, marks, marks + 2 * humps - 1):
        return 0
    return count


def _undamped_impulses(m: DesignWorkspace, humps: int) -> None:
    v = m.vibration_tolerance
    a = m.factor_amplitude
    if humps == 1:
        a[0] = (1.0 + v) / 4.0
        a[1] = (1.0 - v) / 2.0
        a[2] = a[0]
    elif humps == 2:
        x = (v * v * (math.sqrt(1.0 - v * v) + 1.0)) ** (1.0 / 3.0)
        a[0] = (3.0 * x * x + 2.0 * x + 3.0 * v * v) / (16.0 * x)
        a[1] = 0.5 - a[0]
        a[2] = a[1]
        a[3] = a[0]
    else:
        a[0] = (1.0 + 3.0 * v + 2.0 * math.sqrt(2.0 * (v * v + v))) / 16.0
        a[1] = (1.0 - v) / 4.0
        a[2] = 1.0 - 2.0 * (a[0] + a[1])
        a[3] = a[1]
        a[4] = a[0]


def _undamped_marks(m: DesignWorkspace, humps: int, first: int) -> None:
    """Zeros and maxima of V from left to right, without the middle one, which lies at the ratio 1."""
    a = m.factor_amplitude
    x = m.unknown
    if humps == 1:  # V = |a1 + 2 a0 cos(pi r)|
        x[first] = math.acos(-a[1] / (2.0 * a[0])) / math.pi
    elif humps == 2:  # V = |c (8 a0 c^2 - 6 a0 + 2 a1)| with c = cos(pi r / 2)
        zero = math.sqrt((6.0 * a[0] - 2.0 * a[1]) / (8.0 * a[0]))
        x[first] = math.acos(zero) * 2.0 / math.pi
        x[first + 1] = math.acos(zero / math.sqrt(3.0)) * 2.0 / math.pi
    else:  # V = |4 a0 c^2 + 2 a1 c + a2 - 2 a0| with c = cos(pi r)
        middle = -a[1] / (4.0 * a[0])
        spread = math.sqrt(max(0.0, middle * middle - (a[2] - 2.0 * a[0]) / (4.0 * a[0])))
        x[first] = math.acos(middle + spread) / math.pi
        x[first + 1] = math.acos(middle) / math.pi
        x[first + 2] = math.acos(middle - spread) / math.pi
    for i in range(humps):
        x[first + 2 * humps - 1 - i] = 2.0 - x[first + i]


def _pack(m: DesignWorkspace, count: int) -> None:
    for i in range(count):
        m.unknown[i] = m.factor_amplitude[i]
        if i > 0:
            m.unknown[count + i - 1] = m.factor_delay[i]


def unpack(m: DesignWorkspace, x: Array, count: int) -> None:
    """Amplitudes and delays from the unknowns: all amplitudes, then all delays but the first."""
    m.factor_delay[0] = 0.0
    for i in range(count):
        m.factor_amplitude[i] = x[i]
        if i > 0:
            m.factor_delay[i] = x[count + i - 1]


def _equations(m: DesignWorkspace, x: Array, f: Array) -> None:
    """Sum 1, then zeros and maxima of V alternately, from the lowest frequency to the highest."""
    count = m.humps + 2
    unpack(m, x, count)
    total = 0.0
    for i in range(count):
        total += m.factor_amplitude[i]
    f[0] = total - 1.0
    row = 1
    mark = 2 * count - 1
    for k in range(2 * m.humps + 1):
        ratio = 1.0
        if k != m.humps:
            ratio = x[mark]
            mark += 1
        if k % 2 == 0:
            row = zero_at(f, row, m.factor_amplitude, m.factor_delay, count, m.damping, ratio)
        else:
            row = hump_at(f, row, m.factor_amplitude, m.factor_delay, count, m.damping, ratio, m.vibration_tolerance)


def _one_hump(m: DesignWorkspace, damping_ratio: float) -> int:
    return extra_insensitive(m, 1, damping_ratio)


def _two_humps(m: DesignWorkspace, damping_ratio: float) -> int:
    return extra_insensitive(m, 2, damping_ratio)


def _three_humps(m: DesignWorkspace, damping_ratio: float) -> int:
    return extra_insensitive(m, 3, damping_ratio)


EI = ShaperMethod(
    name="ei",
    number=7,
    title="EI",
    impulses=_one_hump,
    solved=True,
    tolerant=True,
    summary="extra-insensitive: V at the design frequency is the tolerance, zeros beside it",
    paper="Singhose, Seering and Singer 1994",
)
TWO_HUMP_EI = ShaperMethod(
    name="two_hump_ei",
    number=8,
    title="two-hump EI",
    impulses=_two_humps,
    solved=True,
    tolerant=True,
    summary="extra-insensitive with two maxima at the tolerance",
    paper="Singhose, Porter, Tuttle and Singer 1997",
)
THREE_HUMP_EI = ShaperMethod(
    name="three_hump_ei",
    number=9,
    title="three-hump EI",
    impulses=_three_humps,
    solved=True,
    tolerant=True,
    summary="extra-insensitive with three maxima at the tolerance",
    paper="Singhose, Porter, Tuttle and Singer 1997",
)
