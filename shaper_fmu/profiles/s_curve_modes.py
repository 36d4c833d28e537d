"""S-curve for up to three modes: smooth segments, each of which leaves all of them in quasi-static equilibrium, damped or not.

Ozokutan, Karadag, Kapucu and Kutuk 2025 announce several modes and damping. Their segment is a ramp with one harmonic; with n
harmonics it has n pairs of zeros to place. At x = u/tau, with H = 2 pi h, over the acceleration A,

    s = x + sum_h a_h sin(H x) + b_h (1 - cos(H x)),
    integral_0^1 s' exp(-q x) dx = (1 - exp(-q))/q prod_i (1 - q/q_i) (1 - q/q_i*) / prod_h (1 + q^2/H^2)

for q = p tau, where q_i = p_i tau are the n modes' poles: the product is any polynomial in q that is 1 at 0, so that it can have
its zeros just there. Partial fractions give a_h - j b_h = -1/H prod_(k not h) k^2/(k^2 - h^2) prod_i (1 - r^2 + 2 j zeta_i r),
r = H/(w_i tau). One mode is the paper's segment. Each segment takes the modes from rest to rest, so that constant acceleration
may follow it, and constant speed: for every duration of all parts nothing is left.

The parts: s, A, A - s, 0, -s, -A, s - A. With ta for the first three and tau for a segment, V = 1/(T - ta), A = V/(ta - tau).
"""

from __future__ import annotations

import math

from shaper_fmu.profiles.workspace import ModesWorkspace

Harmonics = tuple[float, float, float, float, float, float]


def mode_count(m: ModesWorkspace) -> int:
    """How many modes there are: a frequency of 0 is none."""
    return 1 + (1 if m.second_natural_frequency > 0.0 else 0) + (1 if m.third_natural_frequency > 0.0 else 0)


def segment_time_of(m: ModesWorkspace, ramp: float) -> float:
    """Duration of a segment [s] in a speeding-up that takes `ramp` [s]: half of it, or segment_time if that is less."""
    return min(0.5 * ramp, m.segment_time) if m.segment_time > 0.0 else 0.5 * ramp


def harmonics(m: ModesWorkspace, tau: float, natural_frequency: float, damping_ratio: float) -> Harmonics:
    """a_1, b_1, a_2, b_2, a_3, b_3 for segments of tau [s]."""
    count = mode_count(m)
    a1, b1 = harmonic(m, 1, count, tau, natural_frequency, damping_ratio)
    a2, b2 = harmonic(m, 2, count, tau, natural_frequency, damping_ratio)
    a3, b3 = harmonic(m, 3, count, tau, natural_frequency, damping_ratio)
    return a1, b1, a2, b2, a3, b3


def harmonic(
    m: ModesWorkspace, h: int, count: int, tau: float, natural_frequency: float, damping_ratio: float
) -> tuple[float, float]:
    """a_h and b_h, 0 beyond as many harmonics as there are modes."""
    if h > count:
        return 0.0, 0.0
    turns = 2.0 * math.pi * h
    real, imaginary = through_mode(1.0, 0.0, turns / (natural_frequency * tau), damping_ratio)
    if m.second_natural_frequency > 0.0:
        ratio = turns / (m.second_natural_frequency * tau)
        real, imaginary = through_mode(real, imaginary, ratio, m.second_damping_ratio)
    if m.third_natural_frequency > 0.0:
        ratio = turns / (m.third_natural_frequency * tau)
        real, imaginary = through_mode(real, imaginary, ratio, m.third_damping_ratio)
    scale = 1.0 / turns
    for k in range(1, count + 1):
        if k != h:
            scale *= k * k / float(k * k - h * h)
    return -scale * real, scale * imaginary


def through_mode(real: float, imaginary: float, ratio: float, damping_ratio: float) -> tuple[float, float]:
    """The number times 1 - r^2 + 2 j zeta r."""
    first = 1.0 - ratio * ratio
    second = 2.0 * damping_ratio * ratio
    return real * first - imaginary * second, real * second + imaginary * first


def smooth_segment(c: Harmonics, x: float) -> tuple[float, float, float]:
    """Acceleration, velocity and path of the first segment at x = u/tau, over A, A tau and A tau^2."""
    a1, b1, a2, b2, a3, b3 = c
    v1, v2, v3 = one_harmonic(a1, b1, 2.0 * math.pi, x)
    w1, w2, w3 = one_harmonic(a2, b2, 4.0 * math.pi, x)
    z1, z2, z3 = one_harmonic(a3, b3, 6.0 * math.pi, x)
    return x + (v1 + w1 + z1), 0.5 * x * x + (v2 + w2 + z2), x * x * x / 6.0 + (v3 + w3 + z3)


def one_harmonic(a: float, b: float, turns: float, x: float) -> tuple[float, float, float]:
    """a sin(H x) + b (1 - cos(H x)) and its two integrals."""
    if a == 0.0 and b == 0.0:
        return 0.0, 0.0, 0.0
    sine = math.sin(turns * x)
    versine = 1.0 - math.cos(turns * x)
    lag = x - sine / turns
    return a * sine + b * versine, a * versine / turns + b * lag, a * lag / turns + b * (0.5 * x * x - versine / (turns * turns))


def speeding_up(c: Harmonics, x: float, length: float) -> tuple[float, float, float]:
    """Acceleration, velocity and path of the speeding-up at x, over A, A tau and A tau^2; `length` is ta/tau."""
    hold = length - 2.0
    if x < 1.0:
        return smooth_segment(c, x)
    _, first, way = smooth_segment(c, 1.0)
    if x < 1.0 + hold:
        u = x - 1.0
        return 1.0, first + u, way + u * (first + 0.5 * u)
    u = max(0.0, x - 1.0 - hold)
    a, v, p = smooth_segment(c, u)
    begun = first + hold
    return 1.0 - a, begun + (u - v), way + hold * (first + 0.5 * hold) + (u * begun + (0.5 * u * u - p))


def s_curve_modes(
    m: ModesWorkspace, s: float, duration: float, ramp: float, natural_frequency: float, damping_ratio: float
) -> tuple[float, float, float]:
    """Position [-], velocity [1/s] and acceleration [1/s2] at s in [0, duration] of a move over the unit distance.

    ramp: duration of the speeding-up [s], at most half of the whole; natural_frequency in rad/s.
    """
    tau = segment_time_of(m, ramp)
    c = harmonics(m, tau, natural_frequency, damping_ratio)
    length = ramp / tau
    speed = 1.0 / (duration - ramp)
    share = speed / (length - 1.0)
    if s < ramp:
        a, v, p = speeding_up(c, s / tau, length)
        return share * tau * p, share * v, share / tau * a
    _, _, way = speeding_up(c, length, length)
    braking = duration - ramp
    if s < braking:
        return share * tau * way + speed * (s - ramp), speed, 0.0
    a, v, p = speeding_up(c, (s - braking) / tau, length)
    return share * tau * (way - p) + speed * (s - ramp), speed - share * v, -share / tau * a
