"""The flexible beam against the paper's numbers, a finite element model, matrix exponentials and balances of energy."""

from __future__ import annotations

import math
from itertools import pairwise

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from scipy.integrate import solve_ivp
from scipy.linalg import eigh, expm
from scipy.optimize import brentq

from shaper_fmu.errors import ComponentError
from shaper_fmu.master.system import System
from shaper_fmu.plants.beam_modes import frequency_parameter
from shaper_fmu.plants.flexible_beam import FlexibleBeam

RATIOS = [0.0, 0.75, 5.0]


def beam(**values) -> FlexibleBeam:
    made = FlexibleBeam(**values)
    made.initialize()
    return made


def test_the_papers_beam_has_the_papers_frequency():
    """Ozokutan et al. 2025, section 4: beta = 1.3202, w = 22.0487 rad/s; further modes by the same equation (7)."""
    found = beam()
    assert frequency_parameter(0, 0.75) == pytest.approx(1.3202, abs=1e-4)
    assert found.natural_frequency[0] == pytest.approx(22.0487, abs=5e-5)
    assert [frequency_parameter(j, 0.75) for j in range(3)] == pytest.approx([1.3202665, 4.0600797, 7.1538115], rel=3e-8)
    assert found.natural_frequency[:3] == pytest.approx([22.048710, 208.511064, 647.343773], rel=3e-8)


def boundary_determinant(beta: float, ratio: float) -> float:
    """Determinant of the four boundary conditions for phi = a cosh + b sinh + c cos + d sin: clamped, no moment, tip force."""
    ch, sh, c, s = math.cosh(beta), math.sinh(beta), math.cos(beta), math.sin(beta)
    k = ratio * beta
    rows = [
        [1.0, 0.0, 1.0, 0.0],
        [0.0, 1.0, 0.0, 1.0],
        [ch, sh, -c, -s],
        [sh + k * ch, ch + k * sh, s + k * c, -c + k * s],
    ]
    return float(np.linalg.det(np.array(rows) / np.array([[1.0], [1.0], [ch], [ch]])))


@pytest.mark.parametrize("ratio", RATIOS)
def test_frequencies_are_the_roots_of_the_boundary_conditions(ratio):
    """scipy's Brent method on another form of the equation, scanned for its first five changes of sign."""
    grid = np.linspace(0.05, 15.0, 3000)
    values = [boundary_determinant(b, ratio) for b in grid]
    places = [i for i in range(len(grid) - 1) if values[i] * values[i + 1] < 0.0]
    roots = [brentq(boundary_determinant, grid[i], grid[i + 1], args=(ratio,), xtol=1e-14) for i in places[:5]]
    assert [frequency_parameter(j, ratio) for j in range(5)] == pytest.approx(roots, rel=1e-9)


@given(st.integers(0, 4), st.floats(-9.0, 6.0))
def test_roots_are_exact_to_rounding_for_any_tip_mass(j, exponent):
    """The left side of eq. (7) in extended precision changes its sign within 1e-14 of the root."""
    ratio = 10.0**exponent
    beta = np.longdouble(frequency_parameter(j, ratio))
    signs = []
    for b in (beta * (1 - np.longdouble(1e-14)), beta * (1 + np.longdouble(1e-14))):
        difference = np.cos(b) * np.sinh(b) - np.sin(b) * np.cosh(b)
        signs.append(np.sign(1 + np.cos(b) * np.cosh(b) + b * np.longdouble(ratio) * difference))
    assert signs[0] * signs[1] == -1
    assert j * math.pi < beta < (j + 1) * math.pi  # the other roots are elsewhere


def finite_elements(elements: int, ratio: float) -> tuple[np.ndarray, np.ndarray]:
    """sqrt of the first five eigenvalues and the participations at the tip, by cubic Hermite elements; EI = L = m = 1."""
    h = 1.0 / elements
    k = np.array([[12, 6 * h, -12, 6 * h], [6 * h, 4 * h * h, -6 * h, 2 * h * h],
                  [-12, -6 * h, 12, -6 * h], [6 * h, 2 * h * h, -6 * h, 4 * h * h]]) / h**3  # fmt: skip
    m = np.array([[156, 22 * h, 54, -13 * h], [22 * h, 4 * h * h, 13 * h, -3 * h * h],
                  [54, 13 * h, 156, -22 * h], [-13 * h, -3 * h * h, -22 * h, 4 * h * h]]) * h / 420  # fmt: skip
    size = 2 * elements + 2
    stiffness, mass = np.zeros((size, size)), np.zeros((size, size))
    for e in range(elements):
        stiffness[2 * e : 2 * e + 4, 2 * e : 2 * e + 4] += k
        mass[2 * e : 2 * e + 4, 2 * e : 2 * e + 4] += m
    mass[-2, -2] += ratio
    rigid = np.zeros(size)
    rigid[::2] = 1.0
    squares, shapes = eigh(stiffness[2:, 2:], mass[2:, 2:], subset_by_index=[0, 4])
    forces = mass[2:, :] @ rigid  # the clamped node moves with the base, too
    return np.sqrt(squares), shapes[-2] * (shapes.T @ forces)


@pytest.mark.parametrize("ratio", RATIOS)
def test_modes_agree_with_a_finite_element_model(ratio):
    """Hermite elements of length h err by (beta h)^4 / 1440 in a frequency: by 3.4e-5 in the fifth, with 30 of them.

    Rounding in the eigenvalues, relative to the largest one, limits the first to about 5e-8.
    """
    frequencies, participation = finite_elements(30, ratio)
    found = beam(length=2.0, thickness=0.03, width=0.05, youngs_modulus=7e10, beam_mass=3.0, tip_mass=3.0 * ratio)
    scale = math.sqrt(7e10 * 0.05 * 0.03**3 / 12.0 / (3.0 * 2.0**3))
    errors = [(frequency_parameter(j, ratio) / 30.0) ** 4 / 1440.0 for j in range(5)]
    for j in range(5):
        assert found.natural_frequency[j] == pytest.approx(scale * frequencies[j], rel=1.1 * errors[j] + 1e-7)
        assert found.participation[j] == pytest.approx(participation[j], rel=200.0 * errors[j] + 1e-6)


@pytest.mark.parametrize("ratio", [0.0, 0.3, 0.999, 1.001, 20.0, 1e6, 1e12])
def test_modes_carry_the_static_deflection(ratio):
    """Under a steady acceleration a the tip bends by -a (tip mass L^3 / 3 EI + m L^3 / 8 EI): sum of Gamma_j / w_j^2.

    Modes beyond the fifth carry 1.5e-5 of it at most (a beam without tip mass).
    """
    found = beam(beam_mass=0.02, tip_mass=0.02 * ratio)
    static = (0.02 * ratio / 3.0 + 0.02 / 8.0) * 0.25**3 / 0.05
    modes = sum(g / w**2 for g, w in zip(found.participation, found.natural_frequency, strict=True))
    assert modes == pytest.approx(static, rel=1.5e-5)
    first = found.participation[0] / found.natural_frequency[0] ** 2
    assert first == pytest.approx(static, rel=0.02 / (1.0 + ratio) + 1e-12)


@pytest.mark.parametrize("zeta", [0.0, 0.02, 0.4])
@pytest.mark.parametrize("step", [0.001, 0.007, 0.05])
def test_the_response_is_the_matrix_exponential(zeta, step):
    """Three linear pieces of base acceleration, against exp of the augmented matrix of the modal equations."""
    found = beam(modes=3, modal_damping=[zeta] * 3)
    x, v, base = np.zeros(3), np.zeros(3), np.zeros(2)
    t, span = 0.0, 0.35
    for acceleration, slope in [(3.0, 0.0), (3.0, -20.0), (-4.0, 9.0)]:
        found.base_acceleration = acceleration
        for _ in range(round(span / step)):
            found.base_acceleration_slope = slope
            found.do_step(t, step)
            t += step
        found.base_acceleration_slope = 0.0
        for j in range(3):
            w, gamma = found.natural_frequency[j], found.participation[j]
            matrix = np.zeros((4, 4))
            matrix[0, 1] = matrix[2, 3] = 1.0
            matrix[1, :3] = [-w * w, -2 * zeta * w, -gamma]
            x[j], v[j] = (expm(matrix * span) @ [x[j], v[j], acceleration, slope])[:2]
        base[0] += base[1] * span + acceleration * span**2 / 2 + slope * span**3 / 6
        base[1] += acceleration * span + slope * span**2 / 2
        end = acceleration + slope * span
        assert [found.base_position, found.base_velocity, found.base_acceleration] == pytest.approx([*base, end], abs=1e-13)
        assert found.modal_deflection[:3] == pytest.approx(x, abs=1e-13)
        assert found.modal_velocity[:3] == pytest.approx(v, abs=2e-11)
        assert found.tip_deflection == pytest.approx(x.sum(), abs=1e-13)
        assert found.tip_position == pytest.approx(base[0] + x.sum(), abs=1e-13)
        assert found.tip_velocity == pytest.approx(base[1] + v.sum(), abs=2e-11)
        restoring = [2 * zeta * w * v[j] + w * w * x[j] for j, w in enumerate(found.natural_frequency[:3])]
        expected = end - sum(found.participation[:3]) * end - sum(restoring)
        assert found.tip_acceleration == pytest.approx(expected, abs=1e-8)


def driven(step: float, linear: bool, modes: int = 5) -> list[list[float]]:
    """Outputs every 0.35 s of a beam whose base acceleration jumps, or changes linearly, from one such time to the next."""
    found = beam(modes=modes, modal_damping=[0.0, 0.01, 0.02, 0.0, 0.1])
    rows = []
    for begin, end in pairwise([2.0, -1.0, 0.0, 3.0]):
        found.base_acceleration = begin
        for i in range(round(0.35 / step)):
            found.base_acceleration_slope = (end - begin) / 0.35 if linear else 0.0
            found.do_step(i * step, step)
        found.base_acceleration_slope = 0.0
        rows.append([found.base_position, found.tip_deflection, found.tip_position, 1e-4 * found.tip_acceleration])
    return rows


@pytest.mark.parametrize("linear", [False, True])
def test_the_communication_step_does_not_matter(linear):
    """1, 7 and 50 ms; the tip's acceleration, up to 1e2 m/s2 from modes of 2270 rad/s, to 1e-8 m/s2."""
    expected = driven(0.001, linear)
    assert expected[0] != expected[1]
    for step in (0.007, 0.05):
        for row, other in zip(driven(step, linear), expected, strict=True):
            assert row == pytest.approx(other, abs=1e-12, rel=0)


def test_an_undamped_beam_gains_what_the_base_does_on_it():
    """Kinetic and strain energy of each mode against the work -M Gamma a q' of the inertia force, exact for a held one.

    M is the modal mass for a unit deflection of the tip, by quadrature.
    """
    found, h = beam(modes=3), 1e-4
    masses = [modal_mass(frequency_parameter(j, 0.75)) for j in range(3)]
    work = np.zeros(3)
    for i in range(2000):
        found.base_acceleration = 3.0 if i < 1200 else -5.0
        before = np.array(found.modal_deflection[:3])
        found.do_step(i * h, h)
        force = -np.array(masses) * found.participation[:3] * found.base_acceleration
        work += force * (np.array(found.modal_deflection[:3]) - before)
    for j, w in enumerate(found.natural_frequency[:3]):
        energy = 0.5 * masses[j] * (found.modal_velocity[j] ** 2 + (w * found.modal_deflection[j]) ** 2)
        assert energy == pytest.approx(work[j], rel=1e-9)
        assert energy > 1e-9


def modal_mass(beta: float, beam_mass: float = 0.02, tip_mass: float = 0.015) -> float:
    """Integral of phi^2 dm with the tip mass, for phi(L) = 1, by Gauss-Legendre quadrature of eq. (3) [kg]."""
    gamma = (math.cosh(beta) + math.cos(beta)) / (math.sinh(beta) + math.sin(beta))

    def shape(x):
        return np.cosh(beta * x) - np.cos(beta * x) - gamma * (np.sinh(beta * x) - np.sin(beta * x))

    points, weights = np.polynomial.legendre.leggauss(40)
    x = 0.5 * (points + 1.0)
    return beam_mass * float(np.sum(0.5 * weights * (shape(x) / shape(1.0)) ** 2)) + tip_mass


@pytest.mark.parametrize("j", range(5))
def test_participation_is_the_papers_ratio_of_integrals(j):
    """Eqs. (3) to (5) and (8) by quadrature; Gamma_j = phi_j(L) times the paper's Lambda_j, its sign aside."""
    beta = frequency_parameter(j, 0.75)
    gamma = (math.cosh(beta) + math.cos(beta)) / (math.sinh(beta) + math.sin(beta))
    points, weights = np.polynomial.legendre.leggauss(40)
    x = 0.5 * (points + 1.0)
    shape = np.cosh(beta * x) - np.cos(beta * x) - gamma * (np.sinh(beta * x) - np.sin(beta * x))
    tip = math.cosh(beta) - math.cos(beta) - gamma * (math.sinh(beta) - math.sin(beta))
    lever = 0.02 * float(np.sum(0.5 * weights * shape)) / tip + 0.015
    assert beam().participation[j] == pytest.approx(lever / modal_mass(beta), rel=1e-8)


def test_the_tips_acceleration_follows_the_base_at_once():
    """A step of length zero: at the start nothing has moved, so the tip has (1 - sum Gamma) of the base's acceleration."""
    found = beam(modes=2)
    found.base_acceleration = 2.0
    found.do_step(0.0, 0.0)
    assert found.tip_acceleration == pytest.approx(2.0 * (1.0 - found.participation[0] - found.participation[1]), abs=1e-14)
    assert (found.base_position, found.tip_deflection, found.tip_position) == (0.0, 0.0, 0.0)


def tip_error(fmus, step: float, **options) -> float:
    """Error of the tip's position in the middle of a 3-4-5 move of 0.4 s, both FMUs, against scipy's DOP853 [m]."""
    system = System()
    system.add("profile", fmus / "MotionProfile.fmu", profile="polynomial_345", distance=0.1, duration=0.4)
    system.add("beam", fmus / "FlexibleBeam.fmu", modes=1)
    system.connect("profile.acceleration", "beam.base_acceleration")
    found = system.simulate(0.2, step, record=["beam.tip_position"], **options)["beam.tip_position"][-1]
    reference = beam()
    w, gamma = reference.natural_frequency[0], reference.participation[0]

    def slopes(t, y):
        u = t / 0.4
        a = 0.1 * (60 * u - 180 * u**2 + 120 * u**3) / 0.16
        return [y[1], a, y[3], -gamma * a - w * w * y[2]]

    exact = solve_ivp(slopes, (0.0, 0.2), [0.0] * 4, method="DOP853", rtol=1e-12, atol=1e-14).y[:, -1]
    return abs(found - exact[0] - exact[2])


@pytest.mark.parametrize(("options", "order"), [({}, 1), ({"algorithm": "gauss_seidel", "interpolation": "linear"}, 2)])
def test_order_of_held_and_of_linear_inputs(fmus, options, order):
    """Through the FMUs: an input that is held over steps of h is late by h/2; a linear one errs by its curvature, O(h^2).

    For the base alone and h = 1 ms these are 2.3e-4 m, by the speed of 0.469 m/s, and a'(0) t h^2 / 12 = 1.56e-6 m.
    """
    errors = [tip_error(fmus, step, **options) for step in (0.008, 0.004, 0.002, 0.001)]
    orders = [math.log2(a / b) for a, b in pairwise(errors)]
    assert orders == pytest.approx([order] * 3, abs=0.1)
    assert errors[-1] < (5e-4 if order == 1 else 2e-6)


@pytest.mark.parametrize(
    ("values", "words"),
    [
        ({"length": 0.0}, "length = 0 m must be greater than 0 m"),
        ({"thickness": -0.001}, "thickness = -0.001 m must be greater than 0 m"),
        ({"width": 0.0}, "width = 0 m must be greater than 0 m"),
        ({"youngs_modulus": -1.0}, "youngs_modulus = -1 Pa must be greater than 0 Pa"),
        ({"beam_mass": 0.0}, "beam_mass = 0 kg must be greater than 0 kg"),
        ({"tip_mass": -0.1}, "tip_mass = -0.1 kg must be at least 0 kg"),
        ({"modes": 0}, "modes = 0 must be at least 1"),
        ({"modes": 6}, "modes = 6 must be at most 5"),
        ({"modal_damping": [0.0, 1.0]}, r"modal_damping\[2\] = 1 must be less than 1"),
        ({"modal_damping": [-0.01]}, r"modal_damping\[1\] = -0.01 must be at least 0"),
        ({"tip_mass": 1.0, "beam_mass": 1e-13}, r"tip_mass = 1 kg is more than 1e12 times beam_mass = 1e-13 kg"),
        ({"base_acceleration": math.nan}, "base_acceleration is nan; it must be a finite number"),
    ],
)
def test_values_outside_their_domain_are_named(values, words):
    with pytest.raises(ComponentError, match=words):
        beam(**values)
