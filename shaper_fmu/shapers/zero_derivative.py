"""ZV, ZVD, ZVDD: zero vibration with zero derivatives of it, in closed form.

Smith 1958 (posicast, the ZV shaper); Singer and Seering 1990 (ZVD, ZVDD).
"""

from __future__ import annotations

import math


def damped_half_period(natural_frequency: float, damping_ratio: float) -> float:
    """Half the damped period, Td/2 = pi / (wn sqrt(1 - zeta^2)) [s], for wn in rad/s."""
    return math.pi / (natural_frequency * math.sqrt(1.0 - damping_ratio * damping_ratio))


def zero_derivative(amplitude, delay, order: int, natural_frequency: float, damping_ratio: float) -> int:
    """Write the sequence with `order` zero derivatives (0: ZV, 1: ZVD, 2: ZVDD); returns the number of impulses.

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
