"""Recordings of machines with known modes, made with scipy: swept and other commands, ring-downs, hum, noise, rounding."""

from __future__ import annotations

import math
from collections.abc import Sequence

import numpy as np
from scipy.signal import StateSpace, chirp, lsim


def pole(hertz: float, damping_ratio: float) -> complex:
    """Of a mode of this natural frequency [Hz]."""
    w = 2.0 * math.pi * hertz
    return complex(-damping_ratio * w, w * math.sqrt(1.0 - damping_ratio**2))


def driven_by(u: np.ndarray, t: np.ndarray, modes: Sequence[tuple[float, float, float]]) -> np.ndarray:
    """Sum of q_k, q'' + 2 zeta w q' + w^2 q = gain w^2 u from rest, u linear between samples; modes (hertz, damping ratio, gain)."""
    total = np.zeros(len(t))
    for hertz, zeta, gain in modes:
        w = 2.0 * math.pi * hertz
        system = StateSpace([[0.0, 1.0], [-w * w, -2.0 * zeta * w]], [[0.0], [gain * w * w]], [[1.0, 0.0]], [[0.0]])
        total += np.asarray(lsim(system, u, t)[1])
    return total


def swept(t: np.ndarray, low: float, high: float, method: str = "linear") -> np.ndarray:
    """A sine that sweeps over the whole time [Hz]."""
    return np.asarray(chirp(t, low, float(t[-1]), high, method=method))


def ringing(t: np.ndarray, modes: Sequence[tuple[float, float, float]], begin: float = 0.0) -> np.ndarray:
    """Sum of gain exp(-zeta w s) cos(w_d s), s = t - begin, 0 before."""
    s = np.maximum(0.0, t - begin)
    values = sum(gain * np.real(np.exp(pole(hertz, zeta) * s)) for hertz, zeta, gain in modes)
    return np.where(t >= begin, values, 0.0)
