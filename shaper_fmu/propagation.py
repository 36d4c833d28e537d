"""Exact propagation of a damped oscillator, for inputs that are held or linear over a step.

For x'' + 2 zeta wn x' + wn^2 x = u(t) with u(s) = u + u' s on [0, h], and S the response to a unit impulse,

    x(h) = x + S v + P r + Q u',   v(h) = (S' - 2 zeta wn S) v + S r + P u',   r = u - wn^2 x,

where P and Q are the first and second integral of S from 0 to h: the responses to a unit step and to a unit ramp. Written
with the unbalanced acceleration r, what is at rest stays at rest exactly. S' is the impulse response's velocity; the
factor of v is the last element of exp(A h).
"""

from __future__ import annotations

import math

from shaper_fmu.variable import Array

_SERIES_TERMS = 24


def oscillator_transition(transition: Array, natural_frequency: float, damping_ratio: float, h: float) -> None:
    """Write exp(A h), row by row, for A = [[0, 1], [-wn^2, -2 zeta wn]], into an array of at least four elements."""
    stiffness = natural_frequency * natural_frequency
    decay = damping_ratio * natural_frequency
    square = (damping_ratio * damping_ratio - 1.0) * stiffness * h * h
    if abs(square) < 1e-2:  # near critical damping the closed forms cancel; the series has converged at this order
        envelope = math.exp(-decay * h)
        cosine = envelope * (1.0 + square / 2.0 * (1.0 + square / 12.0 * (1.0 + square / 30.0 * (1.0 + square / 56.0))))
        sine = envelope * h * (1.0 + square / 6.0 * (1.0 + square / 20.0 * (1.0 + square / 42.0 * (1.0 + square / 72.0))))
    elif square < 0.0:
        damped = natural_frequency * math.sqrt(1.0 - damping_ratio * damping_ratio)
        envelope = math.exp(-decay * h)
        cosine = envelope * math.cos(damped * h)
        sine = envelope * math.sin(damped * h) / damped
    else:
        spread = natural_frequency * math.sqrt(damping_ratio * damping_ratio - 1.0)
        slow = math.exp(-stiffness / (decay + spread) * h)
        fast = math.exp(-(decay + spread) * h)
        cosine = 0.5 * (slow + fast)
        sine = 0.5 * (slow - fast) / spread
    transition[0] = cosine + decay * sine
    transition[1] = sine
    transition[2] = -stiffness * sine
    transition[3] = cosine - decay * sine


def oscillator_forcing(transition: Array, natural_frequency: float, damping_ratio: float, h: float) -> tuple[float, float]:
    """Displacements P [s2] and Q [s3] after h > 0 from rest, under u = 1 and under u = s; `transition` belongs to this h.

    P = (1 - exp(A h)[0, 0]) / wn^2 and Q = (h - S - 2 zeta wn P) / wn^2, where they do not cancel.
    """
    stiffness = natural_frequency * natural_frequency
    damping = 2.0 * damping_ratio * natural_frequency
    if stiffness * h * h < 1.0 and damping * h < 1.0:
        return _forcing_series(stiffness * h * h, damping * h, h)
    if damping_ratio > 2.0:
        spread = natural_frequency * math.sqrt(damping_ratio * damping_ratio - 1.0)
        fast = 0.5 * damping + spread
        slow_once, slow_twice = _mean_decays(stiffness / fast * h)
        fast_once, fast_twice = _mean_decays(fast * h)
        return 0.5 * h * (slow_once - fast_once) / spread, 0.5 * h * h * (slow_twice - fast_twice) / spread
    held = (1.0 - transition[0]) / stiffness
    return held, (h - transition[1] - damping * held) / stiffness


def _forcing_series(stiffness: float, damping: float, h: float) -> tuple[float, float]:
    """P and Q by the power series of S, whose terms obey the equation of motion; arguments are wn^2 h^2, 2 zeta wn h, h."""
    earlier = 0.0
    term = 0.5 * h * h
    held = term
    ramp = term * h / 3.0
    for n in range(2, _SERIES_TERMS):
        following = -(damping * term + stiffness * earlier / n) / (n + 1)
        earlier = term
        term = following
        held += term
        ramp += term * h / (n + 2)
    return held, ramp


def _mean_decays(x: float) -> tuple[float, float]:
    """(1 - exp(-x)) / x and its like one order higher, (x - 1 + exp(-x)) / x^2, for x >= 0."""
    if x > 1.0:
        once = (1.0 - math.exp(-x)) / x
        return once, (1.0 - once) / x
    term = 0.5
    twice = 0.5
    for n in range(3, _SERIES_TERMS):
        term *= -x / n
        twice += term
    return 1.0 - x * twice, twice
