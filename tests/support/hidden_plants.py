"""Plants with hidden random parameters, and their modes from matrices of their own, not from the FMUs."""

from __future__ import annotations

import math
from collections.abc import Callable
from dataclasses import dataclass
from typing import Any

import numpy as np
from scipy.linalg import eigh


@dataclass(frozen=True)
class Hidden:
    """An FMU's start values, where to excite and to look, and the poles with Im > 0 by rising frequency [rad/s]."""

    values: dict[str, Any]
    input: str
    outputs: list[str]
    poles: np.ndarray


def _log(rng: np.random.Generator, low: float, high: float) -> float:
    return float(math.exp(rng.uniform(math.log(low), math.log(high))))


def swinging(matrix: np.ndarray) -> np.ndarray:
    """Eigenvalues with Im > 0 by rising magnitude."""
    values = np.linalg.eigvals(matrix)
    found = values[values.imag > 1e-9 * np.abs(values).max()]
    return found[np.argsort(np.abs(found))]


def second_order(mass: np.ndarray, damping: np.ndarray, stiffness: np.ndarray) -> np.ndarray:
    """A of x' = A x for M q'' + C q' + K q = 0."""
    n = len(mass)
    inverse = np.linalg.inv(mass)
    return np.block([[np.zeros((n, n)), np.eye(n)], [-inverse @ stiffness, -inverse @ damping]])


def mass_spring_damper(rng: np.random.Generator) -> Hidden:
    m, w, zeta = _log(rng, 0.1, 10.0), _log(rng, 1.0, 100.0), _log(rng, 0.006, 0.2)
    k, c = m * w * w, 2.0 * zeta * w * m
    poles = swinging(second_order(np.array([[m]]), np.array([[c]]), np.array([[k]])))
    return Hidden({"mass": m, "stiffness": k, "damping": c}, "force", ["position"], poles)


def overhead_crane(rng: np.random.Generator) -> Hidden:
    """Small swings: l theta'' + 2 zeta w0 l theta' + g theta = 0."""
    length, zeta = rng.uniform(1.0, 10.0), _log(rng, 0.006, 0.1)
    w = math.sqrt(9.81 / length)
    values = {"initial_rope_length": length, "damping_ratio": zeta}
    return Hidden(values, "trolley_acceleration", ["swing_angle"], swinging(np.array([[0.0, 1.0], [-w * w, -2.0 * zeta * w]])))


def double_pendulum_crane(rng: np.random.Generator) -> Hidden:
    """Small swings of both angles: M and K by Lagrange's equations, and C = 2 zeta (K + w1 w2 M)/(w1 + w2)."""
    upper, lower, ratio = rng.uniform(2.0, 10.0), rng.uniform(1.0, 3.0), _log(rng, 0.3, 5.0)
    zeta = _log(rng, 0.006, 0.1)
    mass = np.array([[(1.0 + ratio) * upper * upper, ratio * upper * lower], [ratio * upper * lower, ratio * lower * lower]])
    stiffness = np.diag([(1.0 + ratio) * 9.81 * upper, ratio * 9.81 * lower])
    low, high = np.sqrt(eigh(stiffness, mass, eigvals_only=True))
    damping = 2.0 * zeta * (stiffness + low * high * mass) / (low + high)
    values = {
        "initial_rope_length": upper,
        "sling_length": lower,
        "hook_mass": 100.0,
        "load_mass": 100.0 * ratio,
        "damping_ratio": zeta,
    }
    poles = swinging(second_order(mass, damping, stiffness))
    return Hidden(values, "trolley_acceleration", ["hook_angle", "load_angle"], poles)


_SPRINGS = np.array([[-1.0, 1.0, 0.0], [0.0, -1.0, 1.0]])


def three_mass_chain(rng: np.random.Generator) -> Hidden:
    """Until both damping ratios are above 0.006, below 0.2, and the frequencies are 20 % apart."""
    while True:
        mass = [_log(rng, 2.0, 20.0) for _ in range(3)]
        stiffness = [_log(rng, 100.0, 3000.0) for _ in range(2)]
        damping = [_log(rng, 0.5, 20.0) for _ in range(2)]
        k, c = (_SPRINGS.T @ np.diag(values) @ _SPRINGS for values in (stiffness, damping))
        poles = swinging(second_order(np.diag(mass), c, k))
        ratios = -np.real(poles) / np.abs(poles)
        if len(poles) == 2 and (ratios > 0.006).all() and (ratios < 0.2).all() and abs(poles[1]) > 1.2 * abs(poles[0]):
            values = {"mass": mass, "stiffness": stiffness, "damping": damping}
            return Hidden(values, "force", [f"position[{i}]" for i in (1, 2, 3)], poles)


def beam_eigenvalues(ratio: float, count: int, elements: int = 20) -> np.ndarray:
    """w / sqrt(EI / (m L^3)) of a cantilever with a tip mass of ratio * m, by cubic Hermite elements.

    They are too high by (beta / elements)^4 / 1440 of themselves: 2e-6 in the second mode.
    """
    h = 1.0 / elements
    k = np.array([[12, 6 * h, -12, 6 * h], [6 * h, 4 * h * h, -6 * h, 2 * h * h],
                  [-12, -6 * h, 12, -6 * h], [6 * h, 2 * h * h, -6 * h, 4 * h * h]]) / h**3  # fmt: skip
    m = np.array([[156, 22 * h, 54, -13 * h], [22 * h, 4 * h * h, 13 * h, -3 * h * h],
                  [54, 13 * h, 156, -22 * h], [-13 * h, -3 * h * h, -22 * h, 4 * h * h]]) * h / 420  # fmt: skip
    stiffness, mass = np.zeros((2 * elements + 2,) * 2), np.zeros((2 * elements + 2,) * 2)
    for e in range(elements):
        stiffness[2 * e : 2 * e + 4, 2 * e : 2 * e + 4] += k
        mass[2 * e : 2 * e + 4, 2 * e : 2 * e + 4] += m
    mass[-2, -2] += ratio
    return np.sqrt(eigh(stiffness[2:, 2:], mass[2:, 2:], eigvals_only=True, subset_by_index=[0, count - 1]))


def flexible_beam(rng: np.random.Generator) -> Hidden:
    """Two modes, seen in the tip's deflection and acceleration."""
    length, thickness, mass = _log(rng, 0.15, 0.5), _log(rng, 0.001, 0.004), _log(rng, 0.005, 0.05)
    ratio, ratios = _log(rng, 0.1, 3.0), [_log(rng, 0.006, 0.05) for _ in range(2)]
    w = math.sqrt(3e9 * 0.025 * thickness**3 / 12.0 / (mass * length**3)) * beam_eigenvalues(ratio, 2)
    poles = np.concatenate([swinging(np.array([[0.0, 1.0], [-a * a, -2.0 * z * a]])) for a, z in zip(w, ratios, strict=True)])
    values = {"length": length, "thickness": thickness, "beam_mass": mass, "tip_mass": ratio * mass, "modes": 2}
    return Hidden({**values, "modal_damping": ratios}, "base_acceleration", ["tip_deflection", "tip_acceleration"], poles)


def rotating_beam(rng: np.random.Generator) -> Hidden:
    """The modes of the flexible beam, which do not depend on the hub."""
    found = flexible_beam(rng)
    return Hidden({**found.values, "hub_radius": rng.uniform(0.0, 0.2)}, "hub_acceleration", found.outputs, found.poles)


HIDDEN: dict[str, Callable[[np.random.Generator], Hidden]] = {
    "MassSpringDamper": mass_spring_damper,
    "OverheadCrane": overhead_crane,
    "ThreeMassChain": three_mass_chain,
    "FlexibleBeam": flexible_beam,
    "DoublePendulumCrane": double_pendulum_crane,
    "RotatingBeam": rotating_beam,
}
