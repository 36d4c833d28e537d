"""ZV, ZVD, ZVDD, ZVDDD: zero vibration with zero derivatives of it, in closed form.

Smith 1958 (posicast, the ZV shaper); Singer and Seering 1990 (ZVD, ZVDD).
"""

from __future__ import annotations

import math

from shaper_fmu.shapers.method import ShaperMethod
from shaper_fmu.shapers.workspace import DesignWorkspace
from shaper_fmu.variable import Array


def damped_half_period(natural_frequency: float, damping_ratio: float) -> float:
    """Half the damped period, Td/2 = pi / (wn sqrt(1 - zeta^2)) [s], for wn in rad/s."""
    return math.pi / (natural_frequency * math.sqrt(1.0 - damping_ratio * damping_ratio))


def zero_derivative(amplitude: Array, delay: Array, order: int, natural_frequency: float, damping_ratio: float) -> int:
    """Write the sequence with `order` zero derivatives (0: ZV, 1: ZVD, ...); returns the number of impulses.

    A_i = C(n, i) K^i / (1 + K)^n at t_i = i Td/2 with n = order + 1 and K = exp(-zeta pi / sqrt(1 - zeta^2)).
    """
    n = order + 1
    k = math.exp(-damping_ratio * math.pi / math.sqrt(1.0 - damping_ratio * damping_ratio))
    half_period = damped_half_period(natural_frequency, damping_ratio)
    weight = 1.0
    for _ in range(n):
        weight /= 1.0 + k
    for i in range(n + 1):
        amplitude[i] = weight
        delay[i] = i * half_period
        weight *= k * (n - i) / (i + 1)
    return n + 1


def _zv(m: DesignWorkspace, damping_ratio: float) -> int:
    return zero_derivative(m.factor_amplitude, m.factor_delay, 0, 1.0, damping_ratio)


def _zvd(m: DesignWorkspace, damping_ratio: float) -> int:
    return zero_derivative(m.factor_amplitude, m.factor_delay, 1, 1.0, damping_ratio)


def _zvdd(m: DesignWorkspace, damping_ratio: float) -> int:
    return zero_derivative(m.factor_amplitude, m.factor_delay, 2, 1.0, damping_ratio)


def _zvddd(m: DesignWorkspace, damping_ratio: float) -> int:
    return zero_derivative(m.factor_amplitude, m.factor_delay, 3, 1.0, damping_ratio)


_PAPER = "Singer and Seering 1990"
ZV = ShaperMethod(name="zv", number=2, title="ZV", impulses=_zv, summary="zero vibration", paper="Smith 1958")
ZVD = ShaperMethod(name="zvd", number=3, title="ZVD", impulses=_zvd, summary="with a zero derivative", paper=_PAPER)
ZVDD = ShaperMethod(name="zvdd", number=4, title="ZVDD", impulses=_zvdd, summary="with two zero derivatives", paper=_PAPER)
ZVDDD = ShaperMethod(name="zvddd", number=5, title="ZVDDD", impulses=_zvddd, summary="with three zero derivatives", paper=_PAPER)
