"""The transient deflection of a mode under a piecewise constant command, exact at all times."""

from __future__ import annotations

import cmath
import math
from collections.abc import Sequence


def peak_deflection(times: Sequence[float], levels: Sequence[float], natural_frequency: float, damping_ratio: float = 0.0) -> float:
    """Largest |x| of x'' + 2 zeta w x' + w^2 x = w^2 u at any time, from rest; u takes these levels from these times [s] on.

    In the unit of u, so that it is the static deflection of the level 1. Between switches x - u = Re(c exp(p s)); its extremes
    are where Re(c p exp(p s)) = 0, half a damped period apart, and the first one is the largest. natural_frequency in rad/s.
    """
    pole = natural_frequency * complex(-damping_ratio, math.sqrt(1.0 - damping_ratio * damping_ratio))
    peak, state, level = 0.0, 0j, 0.0
    for number, (begin, after) in enumerate(zip(times, levels, strict=True)):
        # x - u = Re c and x' = Re(c p): where u jumps by J, x - u jumps by -J and x' does not
        state -= (after - level) * complex(1.0, pole.real / pole.imag)
        level = after
        span = times[number + 1] - begin if number + 1 < len(times) else math.inf
        first = math.fmod(2.5 * math.pi - cmath.phase(state * pole), math.pi) / pole.imag if state else math.inf
        for k in range(2):  # above and below the level
            s = first + k * math.pi / pole.imag
            if s < span:
                peak = max(peak, abs(level + (state * cmath.exp(pole * s)).real))
        if span < math.inf:
            state *= cmath.exp(pole * span)
            peak = max(peak, abs(level + state.real))
        else:
            peak = max(peak, abs(level))
    return peak
