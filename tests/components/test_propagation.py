"""Exact propagation of oscillators against the matrix exponential and against power series in 60 digits."""

from __future__ import annotations

import math
from decimal import Decimal, localcontext

import numpy as np
import pytest
from scipy.linalg import expm

from shaper_fmu.plants.mass_spring_damper import MassSpringDamper
from shaper_fmu.propagation import oscillator_forcing, oscillator_transition

DAMPING = [0.0, 0.1, 0.9, 0.999999, 1.0, 1.000001, 1.2, 1.99, 2.01, 50.0, 1000.0]
CASES = [
    (w, zeta, h)
    for w in (1e-6, 7.3, 2000.0)
    for zeta in DAMPING
    for h in (1e-6, 1e-3, 0.02, 0.3)
    if max(1.0, 2.0 * zeta) * w * h < 700.0  # beyond, the series needs too many digits
]


def forcing_in_digits(w: float, zeta: float, h: float) -> tuple[float, float]:
    """P and Q as power series of x'' = u - 2 zeta w x' - w^2 x, summed in so many digits that nothing cancels."""
    with localcontext() as context:
        context.prec = 60 + int(max(w * h, 2.0 * zeta * w * h))
        step, stiffness, damping = Decimal(h), Decimal(w) ** 2, 2 * Decimal(zeta) * Decimal(w)
        earlier, term = Decimal(0), step * step / 2
        held, ramp, n = term, term * step / 3, 2
        while n < 20 or max(abs(term), abs(earlier)) > abs(held) * Decimal(10) ** -30:
            earlier, term = term, -(damping * step * term + stiffness * step * step * earlier / n) / (n + 1)
            held, ramp, n = held + term, ramp + term * step / (n + 2), n + 1
        return float(held), float(ramp)


@pytest.mark.parametrize(("w", "zeta", "h"), CASES)
def test_forcing_is_exact_at_any_damping_and_step(w, zeta, h):
    transition = [0.0] * 4
    oscillator_transition(transition, w, zeta, h)
    assert oscillator_forcing(transition, w, zeta, h) == pytest.approx(forcing_in_digits(w, zeta, h), rel=3e-14, abs=0)


@pytest.mark.parametrize("zeta", [0.0, 0.05, 1.0, 3.0])
@pytest.mark.parametrize("step", [0.001, 0.007, 0.05])
def test_a_linear_force_is_followed_exactly(zeta, step):
    """Against exp of the augmented matrix (x, v, F, F'), for a force of three linear pieces."""
    mass, stiffness = 0.7, 90.0
    damping = 2.0 * zeta * math.sqrt(stiffness * mass)
    plant = MassSpringDamper(mass=mass, stiffness=stiffness, damping=damping)
    plant.initialize()
    matrix = np.zeros((4, 4))
    matrix[0, 1] = matrix[2, 3] = 1.0
    matrix[1, :3] = [-stiffness / mass, -damping / mass, 1.0 / mass]
    x = np.zeros(4)
    t, span = 0.0, 0.35
    for force, slope in [(2.0, -3.0), (0.0, 11.0), (-1.0, 0.0)]:
        plant.force = force
        for _ in range(round(span / step)):
            plant.force_slope = slope
            plant.do_step(t, step)
            t += step
        x = expm(matrix * span) @ [*x[:2], force, slope]
        assert [plant.position, plant.velocity, plant.force] == pytest.approx(x[:3], abs=1e-13)
        assert plant.acceleration == pytest.approx((x[2] - damping * x[1] - stiffness * x[0]) / mass, abs=1e-12)


def test_what_rests_stays_at_rest():
    plant = MassSpringDamper(mass=0.5, stiffness=64.0, damping=0.3, force=16.0)
    plant.initialize()
    plant.position = 0.25  # F / k
    for i in range(1000):
        plant.do_step(0.01 * i, 0.01)
    assert (plant.position, plant.velocity) == (0.25, 0.0)
