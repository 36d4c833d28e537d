"""Unity-magnitude shapers: impulses 1, -1, 1, ..., 1 - for actuators that are on or off.

Singhose, Singer and Seering 1997 (UM-ZV, UM-ZVD, UM-EI). The times solve the zero (derivative) or EI conditions.
"""

from __future__ import annotations

import math

from shaper_fmu.shapers.conditions import flat_zero_at, hump_at, rising, zero_at
from shaper_fmu.shapers.method import ShaperMethod
from shaper_fmu.shapers.newton import Equations, follow_damping, newton
from shaper_fmu.shapers.workspace import DesignWorkspace
from shaper_fmu.variable import Array

_UM_ZVD = (0.56242398, 2.30111484, 4.03980571, 4.60222969)  # rad: a guess, improved to the last bit
_TOLERANCE_STEPS = 20
_FADED = 1e-9  # where the first impulse has decayed this far, the last ones shrink to nothing and solve the equations trivially


def unity_magnitude_zv(m: DesignWorkspace, damping_ratio: float) -> int:
    """UM-ZV for 1 rad/s into m.factor_amplitude, m.factor_delay: 1, -1, 1; undamped at 0, T/6, T/3.

    Returns 3, or 0 if none is found.
    """
    _alternate(m, 3)
    m.unknown[0] = math.pi / 3.0
    m.unknown[1] = 2.0 * math.pi / 3.0
    return _solved(m, _zv_equations, 2, 3, damping_ratio)


def unity_magnitude_zvd(m: DesignWorkspace, damping_ratio: float) -> int:
    """UM-ZVD for 1 rad/s: 1, -1, 1, -1, 1 with zero residual and zero derivative. Returns 5, or 0 if none is found."""
    _alternate(m, 5)
    for i in range(4):
        m.unknown[i] = _UM_ZVD[i]
    return _solved(m, _zvd_equations, 4, 5, damping_ratio)


def unity_magnitude_ei(m: DesignWorkspace, damping_ratio: float) -> int:
    """UM-EI for 1 rad/s: 1, -1, 1, -1, 1 with V = m.vibration_tolerance and V' = 0 at the design frequency, zeros beside it.

    The undamped one is symmetric; it is followed from UM-ZVD in steps of the tolerance. Returns 5, or 0 if none is found.
    """
    if unity_magnitude_zvd(m, 0.0) == 0:
        return 0
    m.unknown[1] = m.factor_delay[2]
    m.unknown[0] = m.factor_delay[2] - m.factor_delay[1]
    sign = -1.0 if _symmetric_curvature(m.unknown) > 0.0 else 1.0
    m.damping = 0.0
    for i in range(_TOLERANCE_STEPS):
        m.tolerance = sign * m.vibration_tolerance * (i + 1.0) / _TOLERANCE_STEPS
        if not newton(m, _symmetric_equations, 2):
            return 0
    _unfold(m)
    count = _solved(m, _ei_equations, 6, 5, damping_ratio)
    if count > 0 and not (0.0 < m.unknown[4] < 1.0 < m.unknown[5]):
        return 0
    return count


def _symmetric_equations(m: DesignWorkspace, x: Array, f: Array) -> None:
    """The undamped sequence about its middle: 1 - 2 cos(x0 r) + 2 cos(x1 r) equals m.tolerance and is flat at r = 1."""
    f[0] = 1.0 - 2.0 * math.cos(x[0]) + 2.0 * math.cos(x[1]) - m.tolerance
    f[1] = 2.0 * x[0] * math.sin(x[0]) - 2.0 * x[1] * math.sin(x[1])


def _symmetric_curvature(x: Array) -> float:
    return 2.0 * x[0] * x[0] * math.cos(x[0]) - 2.0 * x[1] * x[1] * math.cos(x[1])


def _unfold(m: DesignWorkspace) -> None:
    """Delays from the symmetric offsets, and a guess of the zeros beside the maximum from its curvature."""
    inner = m.unknown[0]
    outer = m.unknown[1]
    spread = math.sqrt(2.0 * m.vibration_tolerance / abs(_symmetric_curvature(m.unknown)))
    m.unknown[0] = outer - inner
    m.unknown[1] = outer
    m.unknown[2] = outer + inner
    m.unknown[3] = 2.0 * outer
    m.unknown[4] = 1.0 - spread
    m.unknown[5] = 1.0 + spread


def _alternate(m: DesignWorkspace, count: int) -> None:
    sign = 1.0
    for i in range(count):
        m.factor_amplitude[i] = sign
        sign = -sign


def _solved(m: DesignWorkspace, equations: Equations, unknowns: int, count: int, damping_ratio: float) -> int:
    if not follow_damping(m, equations, unknowns, damping_ratio):
        return 0
    _unpack(m, m.unknown, count)
    if math.exp(-damping_ratio * m.factor_delay[count - 1]) < _FADED or not rising(m.factor_delay, 0, count - 1):
        return 0
    return count


def _unpack(m: DesignWorkspace, x: Array, count: int) -> None:
    m.factor_delay[0] = 0.0
    for i in range(1, count):
        m.factor_delay[i] = x[i - 1]


def _zv_equations(m: DesignWorkspace, x: Array, f: Array) -> None:
    _unpack(m, x, 3)
    zero_at(f, 0, m.factor_amplitude, m.factor_delay, 3, m.damping, 1.0)


def _zvd_equations(m: DesignWorkspace, x: Array, f: Array) -> None:
    _unpack(m, x, 5)
    flat_zero_at(f, 0, m.factor_amplitude, m.factor_delay, 5, m.damping, 1.0)


def _ei_equations(m: DesignWorkspace, x: Array, f: Array) -> None:
    _unpack(m, x, 5)
    row = zero_at(f, 0, m.factor_amplitude, m.factor_delay, 5, m.damping, x[4])
    row = hump_at(f, row, m.factor_amplitude, m.factor_delay, 5, m.damping, 1.0, m.vibration_tolerance)
    zero_at(f, row, m.factor_amplitude, m.factor_delay, 5, m.damping, x[5])


_PAPER = "Singhose, Singer and Seering 1997"
UM_ZV = ShaperMethod(
    name="um_zv",
    number=10,
    title="UM-ZV",
    impulses=unity_magnitude_zv,
    solved=True,
    negative=True,
    summary="impulses 1, -1, 1 without vibration, for actuators that are on or off",
    paper=_PAPER,
)
UM_ZVD = ShaperMethod(
    name="um_zvd",
    number=11,
    title="UM-ZVD",
    impulses=unity_magnitude_zvd,
    solved=True,
    negative=True,
    summary="impulses 1, -1, 1, -1, 1 with a zero derivative",
    paper=_PAPER,
)
UM_EI = ShaperMethod(
    name="um_ei",
    number=14,
    title="UM-EI",
    impulses=unity_magnitude_ei,
    solved=True,
    negative=True,
    tolerant=True,
    summary="impulses 1, -1, 1, -1, 1 with V at the tolerance, zeros beside it",
    paper=_PAPER,
)
