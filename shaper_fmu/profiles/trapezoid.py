"""Trapezoidal velocity: constant acceleration, cruise, constant deceleration; bang-bang where no cruise is left.

With ramps of the duration ta, V = 1/(T - ta) and A = V/ta for the unit distance. A duration alone does not fix ta: each
part takes a third, unless a limit would be broken; then ta is as near to T/3 as the limit allows. A speed limit makes
the ramps shorter, V = max_velocity; an acceleration limit makes them longer, at most T/2 (bang-bang).
The acceleration jumps at both ends of both ramps.
"""

from __future__ import annotations

import math

from shaper_fmu.profiles.method import ProfileMethod


def trapezoid(s: float, duration: float, ramp: float) -> tuple[float, float, float]:
    """Position [-], velocity [1/s] and acceleration [1/s2] at s in [0, duration] of a move over the unit distance.

    ramp: duration of the acceleration and of the deceleration [s]. Where the acceleration jumps, it is that on the right.
    """
    speed = 1.0 / (duration - ramp)
    left = duration - s
    if s < ramp:
        acceleration = speed / ramp
        return 0.5 * acceleration * s * s, acceleration * s, acceleration
    if s < duration - ramp:
        return speed * (s - 0.5 * ramp), speed, 0.0
    if left <= 0.0:
        return 1.0, 0.0, 0.0
    acceleration = speed / ramp
    return 1.0 - 0.5 * acceleration * left * left, acceleration * left, -acceleration


def trapezoid_ramp(duration: float, max_velocity: float, max_acceleration: float) -> float:
    """Duration of each ramp [s] for a permitted duration [s]; limits of the unit move in 1/s and 1/s2.

    1/(T - ta) <= v gives ta <= T - 1/v; 1/(ta (T - ta)) <= a gives ta >= (T - sqrt(T^2 - 4/a))/2.
    """
    root = math.sqrt(max(0.0, 1.0 - 4.0 / (max_acceleration * duration * duration)))
    shortest = 2.0 / (max_acceleration * duration * (1.0 + root))  # without the difference's cancellation
    longest = min(0.5 * duration, duration - 1.0 / max_velocity)
    return max(0.0, min(max(duration / 3.0, shortest), longest))


def trapezoid_peaks(duration: float, ramp: float) -> tuple[float, float]:
    """Peak speed [1/s] and peak acceleration [1/s2] of the unit move; the latter is infinite without a ramp."""
    speed = 1.0 / (duration - ramp)
    return speed, (speed / ramp if ramp > 0.0 else math.inf)


def trapezoid_shortest(max_velocity: float, max_acceleration: float) -> tuple[float, float, float]:
    """Shortest duration [s] for limits of the unit move in 1/s and 1/s2: 1/v + v/a with cruise, 2/sqrt(a) without."""
    if max_velocity * max_velocity < max_acceleration:
        return 1.0 / max_velocity + max_velocity / max_acceleration, 0.0, 0.0
    return 2.0 / math.sqrt(max_acceleration), 0.0, 0.0


def ramp_end(i: int, duration: float, ramp: float) -> float:
    """When the acceleration jumps within the move [s]: at the end of the first ramp, and at the start of the last."""
    return ramp if i == 0 else duration - ramp


def trapezoid_cruise_time(duration: float, ramp: float) -> float:
    """The distance over the speed between the ramps [s]."""
    return duration - ramp


TRAPEZOID = ProfileMethod(
    name="trapezoid",
    number=2,
    move=trapezoid,
    peaks=trapezoid_peaks,
    shortest=trapezoid_shortest,
    ramp=trapezoid_ramp,
    event=ramp_end,
    cruise_time=trapezoid_cruise_time,
    constant=("acceleration",),
    jumps_at_ends=True,
    summary="trapezoidal velocity, ramps of a third of the duration; shorter ones where max_velocity asks for it, longer ones, "
    "up to bang-bang, where max_acceleration does",
)
