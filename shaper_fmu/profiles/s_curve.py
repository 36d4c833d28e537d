"""S-curve: five acceleration segments, each of which leaves the mode in quasi-static equilibrium.

Ozokutan, Karadag, Kapucu and Kutuk 2025. With segments of the duration tau and a cruise of T3 = T - 4 tau, the
acceleration is s(u), A - s(u), 0, -s(u), -A + s(u), where u is the time within the segment (eq. 14 prints wrong times
in the last two). A = V/tau and V = D/(T - 2 tau). For a given cruise speed V, tau = (T V - D)/(2 V); where no cruise
would be left, tau = T/4. With x = u/tau, r = Tn/tau and the damping ratio zeta,

    s = A [x - (1 - r^2)/(2 pi) sin 2 pi x + (2 zeta r)/(2 pi) (1 - cos 2 pi x)],

which for zeta = 0 is the paper's segment, A2 = A (1 - r^2), and with damping is the profile of Kilic and Kapucu 2011
as an acceleration: so the residual is zero for a damped mode too, for every duration. Position and velocity are the
segments' integrals. For tau below about 0.24 Tn the speed swings beyond V within the segments.
"""

from __future__ import annotations

import math


def s_curve(s: float, duration: float, ramp: float, natural_frequency: float, damping_ratio: float) -> tuple[float, float, float]:
    """Position [-], velocity [1/s] and acceleration [1/s2] at s in [0, duration] of a move over the unit distance.

    ramp: duration of a segment [s], at most a quarter of the whole; natural_frequency in rad/s.
    """
    tau = ramp
    ratio = 2.0 * math.pi / (natural_frequency * tau)
    lead = damping_ratio * ratio / math.pi  # by how much the acceleration's first half does more than the second
    end = 1.0 / 6.0 - (1.0 - ratio * ratio) / (4.0 * math.pi * math.pi) + 0.5 * lead  # path of the first segment
    whole = duration / tau - 2.0
    braking = duration - 2.0 * tau
    if s < tau:
        acceleration, velocity, position = segment(s / tau, ratio, damping_ratio)
    elif s < 2.0 * tau:
        x = s / tau - 1.0
        a, v, p = segment(x, ratio, damping_ratio)
        acceleration = 1.0 - a
        velocity = 0.5 + lead + x - v
        position = end + x * (0.5 + lead + 0.5 * x) - p
    elif s < braking:
        acceleration = 0.0
        velocity = 1.0
        position = lead + s / tau - 1.0
    elif s < braking + tau:
        x = (s - braking) / tau
        a, v, p = segment(x, ratio, damping_ratio)
        acceleration = -a
        velocity = 1.0 - v
        position = whole - 1.0 + lead + x - p
    else:
        x = (s - braking) / tau - 1.0
        a, v, p = segment(x, ratio, damping_ratio)
        acceleration = a - 1.0
        velocity = 0.5 - lead - x + v
        position = whole + lead - end + x * (0.5 - lead - 0.5 * x) + p
    speed = 1.0 / braking
    return position * (speed * tau), velocity * speed, acceleration * (speed / tau)


def s_curve_boundary(i: int, duration: float, ramp: float) -> float:
    """Time [s] of the i-th (0 .. 3) boundary between two parts, where the acceleration has a kink."""
    return (i + 1.0) * ramp if i < 2 else duration - (4.0 - i) * ramp


def segment(x: float, ratio: float, damping_ratio: float) -> tuple[float, float, float]:
    """Acceleration, velocity and path of the first segment at x = u/tau, over A, A tau and A tau^2; ratio is Tn/tau."""
    angle = 2.0 * math.pi * x
    sine = math.sin(angle) / (2.0 * math.pi)
    versine = (1.0 - math.cos(angle)) / (2.0 * math.pi)
    cycloid_part = 1.0 - ratio * ratio
    versine_part = damping_ratio * ratio / math.pi
    return (
        x - cycloid_part * sine + versine_part * 2.0 * math.pi * versine,
        0.5 * x * x - cycloid_part * versine / (2.0 * math.pi) + versine_part * (x - sine),
        x * x * x / 6.0
        - cycloid_part * (x - sine) / (4.0 * math.pi * math.pi)
        + versine_part * (0.5 * x * x - versine / (2.0 * math.pi)),
    )


def s_curve_segment_time(duration: float, max_velocity: float) -> float:
    """Duration of a segment [s], eqs. (21) and (23), for a cruise speed [1/s] of the unit move; 0 if it is too slow."""
    return max(0.0, min(0.25 * duration, 0.5 * duration - 0.5 / max_velocity))
