"""The rotating beam against finite elements, boundary-value problems, closed forms, matrix exponentials and balances."""

from __future__ import annotations

import math

import numpy as np
import pytest
from scipy.integrate import simpson, solve_bvp
from scipy.linalg import eigh, expm

from shaper_fmu import System, fmu_path
from shaper_fmu.errors import ComponentError
from shaper_fmu.plants.flexible_beam import FlexibleBeam
from shaper_fmu.plants.rotating_beam import RotatingBeam

RIGIDITY, LENGTH, MASS, TIP = 0.05, 0.25, 0.02, 0.015
"""EI, L and the masses of the default beam, the PMMA beam of Ozokutan et al. 2025."""


def beam(**values) -> RotatingBeam:
    made = RotatingBeam(**values)
    made.initialize()
    return made


def finite_elements(radius: float, tip: float) -> tuple[np.ndarray, np.ndarray, np.ndarray, float]:
    """Frequencies, participations at the tip, angular momenta per tip speed, and the straight beam's inertia, by cubic Hermite elements.

    The hub's rotation moves the node at x by (R + x), and turns it by 1: this field is one of the elements', so it is exact.
    """
    elements = 30
    h = LENGTH / elements
    k = np.array([[12, 6 * h, -12, 6 * h], [6 * h, 4 * h * h, -6 * h, 2 * h * h],
                  [-12, -6 * h, 12, -6 * h], [6 * h, 2 * h * h, -6 * h, 4 * h * h]]) * RIGIDITY / h**3  # fmt: skip
    m = np.array([[156, 22 * h, 54, -13 * h], [22 * h, 4 * h * h, 13 * h, -3 * h * h],
                  [54, 13 * h, 156, -22 * h], [-13 * h, -3 * h * h, -22 * h, 4 * h * h]]) * MASS / LENGTH * h / 420  # fmt: skip
    size = 2 * elements + 2
    stiffness, mass = np.zeros((size, size)), np.zeros((size, size))
    for e in range(elements):
        stiffness[2 * e : 2 * e + 4, 2 * e : 2 * e + 4] += k
        mass[2 * e : 2 * e + 4, 2 * e : 2 * e + 4] += m
    mass[-2, -2] += tip
    turned = np.ones(size)
    turned[::2] = radius + h * np.arange(elements + 1)
    squares, shapes = eigh(stiffness[2:, 2:], mass[2:, 2:], subset_by_index=[0, 4])
    forces = shapes.T @ (mass[2:, :] @ turned)
    return np.sqrt(squares), shapes[-2] * forces, forces / shapes[-2], float(turned @ mass @ turned)


@pytest.mark.parametrize("radius", [0.0, 0.05, 1.0])
@pytest.mark.parametrize("tip", [0.0, TIP, 0.2])
def test_modes_agree_with_finite_elements(radius, tip):
    """Elements of length h err by (beta h)^4 / 1440 in a frequency, at most 3.4e-5; participations by some hundred times that.

    Rounding in the eigenvalues, relative to the largest one, limits the first to about 2e-7.
    """
    frequencies, participation, momenta, inertia = finite_elements(radius, tip)
    found = beam(hub_radius=radius, tip_mass=tip)
    assert found.inertia == pytest.approx(inertia, rel=1e-9)
    for j in range(5):
        error = (math.sqrt(frequencies[j] / math.sqrt(RIGIDITY / (MASS * LENGTH**3))) / 30.0) ** 4 / 1440.0
        assert found.natural_frequency[j] == pytest.approx(frequencies[j], rel=1.1 * error + 5e-7)
        assert found.participation[j] == pytest.approx(participation[j], rel=200.0 * error + 2e-6)
        assert found.angular_mass[j] == pytest.approx(momenta[j], rel=200.0 * error + 2e-6)


@pytest.mark.parametrize("radius", [0.0, 0.05, 1.0])
@pytest.mark.parametrize("tip", [0.0, TIP, 0.2])
def test_modes_carry_the_static_deflection(radius, tip):
    """Under a steady angular acceleration: EI y'''' = -(m/L)(R + x) alpha, by SciPy's solve_bvp; sum of Gamma_j / w_j^2.

    Modes beyond the fifth carry 2e-5 of it at most.
    """

    def slopes(x, y):
        return np.vstack([y[1:], -MASS / LENGTH * (radius + x) / RIGIDITY])

    def ends(a, b):
        return np.array([a[0], a[1], b[2], b[3] - tip * (radius + LENGTH) / RIGIDITY])

    grid = np.linspace(0.0, LENGTH, 20)
    solved = solve_bvp(slopes, ends, grid, np.zeros((4, 20)), tol=1e-10)
    assert solved.success
    found = beam(hub_radius=radius, tip_mass=tip)
    modes = sum(g / w**2 for g, w in zip(found.participation, found.natural_frequency, strict=True))
    assert -modes == pytest.approx(solved.y[0, -1], rel=2e-5)


def test_all_modes_together_are_the_lever_arm():
    """R + L: a tip at rest does not feel at once that its hub turns. Five modes: within 1/(beta_5^2) of it."""
    for radius in (0.0, 0.05, 0.5):
        found = beam(hub_radius=radius)
        assert sum(found.participation) == pytest.approx(radius + LENGTH, rel=0.03)


def test_a_large_hub_moves_the_beam_along_a_line():
    """R alpha = a for R of a thousand lengths: the FlexibleBeam's participations, and its response."""
    straight = FlexibleBeam(modes=5, base_acceleration=2.0)
    straight.initialize()
    turned = beam(modes=5, hub_radius=2500.0, hub_acceleration=2.0 / 2500.0)
    for i in range(100):
        straight.do_step(0.01 * i, 0.01)
        turned.do_step(0.01 * i, 0.01)
    assert turned.natural_frequency == straight.natural_frequency
    assert [g / 2500.0 for g in turned.participation] == pytest.approx(straight.participation, rel=2e-4)
    assert turned.tip_deflection == pytest.approx(straight.tip_deflection, rel=3e-4)


@pytest.mark.parametrize("zeta", [0.0, 0.02])
@pytest.mark.parametrize("step", [0.001, 0.007, 0.05])
def test_the_response_is_the_matrix_exponential(zeta, step):
    """Three linear pieces of hub acceleration, against exp of the augmented matrix with the finite elements' participations."""
    frequencies, participation, momenta, inertia = finite_elements(0.1, TIP)
    found = beam(modes=2, modal_damping=[zeta] * 2, hub_radius=0.1)
    x, v, hub = np.zeros(2), np.zeros(2), np.zeros(2)
    t, span = 0.0, 0.35
    for acceleration, slope in [(30.0, 0.0), (30.0, -200.0), (-40.0, 90.0)]:
        found.hub_acceleration = acceleration
        for _ in range(round(span / step)):
            found.hub_acceleration_slope = slope
            found.do_step(t, step)
            t += step
        found.hub_acceleration_slope = 0.0
        for j in range(2):
            w = frequencies[j]
            matrix = np.zeros((4, 4))
            matrix[0, 1] = matrix[2, 3] = 1.0
            matrix[1, :3] = [-w * w, -2 * zeta * w, -participation[j]]
            x[j], v[j] = (expm(matrix * span) @ [x[j], v[j], acceleration, slope])[:2]
        hub[0] += hub[1] * span + acceleration * span**2 / 2 + slope * span**3 / 6
        hub[1] += acceleration * span + slope * span**2 / 2
        end = acceleration + slope * span
        bent = [-participation[j] * end - 2 * zeta * w * v[j] - w * w * x[j] for j, w in enumerate(frequencies[:2])]
        assert [found.hub_angle, found.hub_speed] == pytest.approx([*hub], abs=1e-11)
        assert found.tip_deflection == pytest.approx(x.sum(), abs=2e-6)
        assert found.tip_position == pytest.approx(0.35 * hub[0] + x.sum(), abs=2e-6)
        assert found.tip_acceleration == pytest.approx(0.35 * end + sum(bent), rel=1e-4, abs=1e-3)
        assert found.hub_torque == pytest.approx(inertia * end + momenta[:2] @ bent, rel=1e-4, abs=1e-6)


def test_the_hubs_torque_gives_the_energy_of_beam_and_tip():
    """Work of the torque on the hub's turn = energy of rotation, bending and vibration in the five modes, at the end of a push.

    Kinetic: J s^2/2 + s sum L_j q_j' + sum m_j q_j'^2/2, potential: sum m_j w_j^2 q_j^2/2, m_j = L_j / Gamma_j. Native FMU, Simpson's rule.
    """
    system = System()
    system.add("beam", fmu_path("RotatingBeam", platforms=["this"]), modes=5)
    system.drive("beam.hub_acceleration", 20.0)
    names = ["hub_speed", "hub_torque", *(f"modal_{kind}[{j}]" for kind in ("deflection", "velocity") for j in range(1, 6))]
    results = system.simulate(0.5, 5e-5, record=[f"beam.{name}" for name in names])
    speed, torque, *modal = (results[f"beam.{name}"] for name in names)
    found = beam(modes=5)
    q, rate = np.array(modal[:5])[:, -1], np.array(modal[5:])[:, -1]
    w, gamma, momentum = (np.array(x) for x in (found.natural_frequency, found.participation, found.angular_mass))
    share = momentum / gamma
    energy = 0.5 * found.inertia * speed[-1] ** 2 + speed[-1] * (momentum @ rate) + 0.5 * share @ (rate**2 + (w * q) ** 2)
    assert simpson(torque * speed, x=results.time) == pytest.approx(energy, rel=1e-6)


@pytest.mark.parametrize(
    ("values", "words"),
    [
        ({"hub_radius": -0.1}, "hub_radius = -0.1 m must be at least 0 m"),
        ({"length": 0.0}, "length = 0 m must be greater than 0 m"),
        ({"modes": 6}, "modes = 6 must be at most 5"),
        ({"tip_mass": 1.0, "beam_mass": 1e-13}, r"tip_mass = 1 kg is more than 1e12 times beam_mass = 1e-13 kg"),
        ({"hub_acceleration": math.nan}, "hub_acceleration is nan; it must be a finite number"),
    ],
)
def test_values_outside_their_domain_are_named(values, words):
    with pytest.raises(ComponentError, match=words):
        beam(**values)
