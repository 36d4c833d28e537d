"""Residual vibration that an on/off command leaves on one mode, and the shortest time between its switches."""

from __future__ import annotations

import math

from shaper_fmu.component import NO_EVENT
from shaper_fmu.variable import Array

NO_WIDTH = NO_EVENT
"""The shortest time between two switches of a command that has only one [s]."""


def switch_sum(switch_time: Array, count: int, end: float, natural_frequency: float, damping_ratio: float) -> tuple[float, float]:
    """Real and imaginary part of exp(p end) S with S = sum_i A_i exp(-p t_i), A = 1, -1, 1, ..., p = -zeta w + j wd.

    Its magnitude is the residual envelope at `end` [s] over that of a step at time zero; the part with the time of
    `end` in its phase is left out. natural_frequency in rad/s. The imaginary part has the opposite sign.
    """
    decay = damping_ratio * natural_frequency
    damped = natural_frequency * math.sqrt(1.0 - damping_ratio * damping_ratio)
    real = 0.0
    imaginary = 0.0
    sign = 1.0
    for i in range(count):
        weight = sign * math.exp(decay * (switch_time[i] - end))
        real += weight * math.cos(damped * switch_time[i])
        imaginary += weight * math.sin(damped * switch_time[i])
        sign = -sign
    return real, imaginary


def switch_residual(switch_time: Array, count: int, end: float, natural_frequency: float, damping_ratio: float) -> float:
    """V of Singer and Seering 1990 of the command that ends at `end` [s]: |exp(p end) S|; for frequency in rad/s."""
    real, imaginary = switch_sum(switch_time, count, end, natural_frequency, damping_ratio)
    return math.sqrt(real * real + imaginary * imaginary)


def shortest_width(switch_time: Array, count: int) -> float:
    """Shortest time between two switches, of a pulse or of a gap [s]; 1e300 for a single switch."""
    shortest = NO_WIDTH
    for i in range(1, count):
        shortest = min(shortest, switch_time[i] - switch_time[i - 1])
    return shortest
