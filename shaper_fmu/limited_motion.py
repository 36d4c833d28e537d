"""The quickest motion of a double integrator within limits of speed and acceleration, from any state; kernel functions.

Time-optimal are the largest acceleration, the largest speed and the largest deceleration, each for as long as it takes. In closed
form: with D the way to the target and v the speed, both counted towards the side where the load would not yet come to rest by
braking at once, the peak speed p without cruise obeys (2 p^2 - v^2)/(2 a) = D.
"""

from __future__ import annotations

import math


def quickest(way: float, speed: float, max_velocity: float, max_acceleration: float) -> tuple[float, float, float, float, float]:
    """The quickest motion to rest `way` [m] from here, at `speed` [m/s], where |speed| <= max_velocity.

    Returns the side to which it accelerates first (1 or -1), the peak speed on that side [m/s], and the times of acceleration,
    cruise and deceleration [s].
    """
    side = 1.0 if way >= 0.5 * speed * abs(speed) / max_acceleration else -1.0
    v = side * speed
    square = max(0.0, side * way * max_acceleration + 0.5 * v * v)
    peak = max(v, 0.0, min(max_velocity, math.sqrt(square)))
    left = side * way - (2.0 * peak * peak - v * v) / (2.0 * max_acceleration)
    cruise = left / peak if left > 0.0 and peak >= max_velocity else 0.0
    return side, peak, (peak - v) / max_acceleration, cruise, peak / max_acceleration
