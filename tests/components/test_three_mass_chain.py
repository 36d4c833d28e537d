"""The chain of three masses: exact propagation, its modes, its balances, and the FMU of it."""

from __future__ import annotations

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from scipy.integrate import solve_ivp
from scipy.linalg import expm

from shaper_fmu.errors import ComponentError
from shaper_fmu.export.build import fmu_path
from shaper_fmu.master.system import System
from shaper_fmu.matrix_exponential import phi_functions, power_of_two
from shaper_fmu.plants.three_mass_chain import ThreeMassChain
from shaper_fmu.quartic import quadratic_factors

SPRINGS = np.array([[-1.0, 1.0, 0.0], [0.0, -1.0, 1.0]])  # elongations of the springs = SPRINGS @ positions


def matrices(mass, stiffness, damping):
    """A (6 by 6) of x' = A x + B f, x = [positions, velocities], and B (6 by 3); M and K of Jung 2011, eqs (9) and (10)."""
    inverse = np.diag(1.0 / np.array(mass))
    k, c = (SPRINGS.T @ np.diag(values) @ SPRINGS for values in (stiffness, damping))
    return np.block([[np.zeros((3, 3)), np.eye(3)], [-inverse @ k, -inverse @ c]]), np.vstack([np.zeros((3, 3)), inverse])


def exact(plant: ThreeMassChain, h: float) -> np.ndarray:
    """The state after h by scipy's matrix exponential of the system with the forces and the ramp as states."""
    a, b = matrices(plant.mass, plant.stiffness, plant.damping)
    forces = np.array(plant.disturbance) + np.array([plant.force, 0.0, 0.0])
    whole = np.zeros((8, 8))
    whole[:6, :6], whole[:6, 6], whole[:6, 7], whole[7, 6] = a, b @ forces, b[:, 0] * plant.force_slope, 1.0
    return (expm(whole * h) @ [*plant.position, *plant.velocity, 1.0, 0.0])[:6]


def state(plant: ThreeMassChain) -> np.ndarray:
    return np.array([*plant.position, *plant.velocity])


def started(**values) -> ThreeMassChain:
    plant = ThreeMassChain(**values)
    plant.initialize()
    return plant


magnitudes = st.floats(-1.0, 1.0)
logarithms = st.floats(-1.0, 1.5)


@settings(max_examples=150, deadline=None)
@given(
    st.tuples(logarithms, logarithms, logarithms),
    st.tuples(logarithms, logarithms),
    st.tuples(logarithms, logarithms),
    st.sampled_from([0.0, 0.1, 10.0]),
    st.floats(-4.0, 0.5),
    st.lists(magnitudes, min_size=11, max_size=11),
)
def test_a_step_is_the_matrix_exponential(mass, stiffness, damping, damped, step, values):
    """Held disturbances and a force that is linear over the step, from any state, with any damping."""
    plant = started(
        mass=[10.0**x for x in mass], stiffness=[100.0 * 10.0**x for x in stiffness], damping=[damped * 10.0**x for x in damping]
    )
    plant.position, plant.velocity, plant.disturbance = values[:3], values[3:6], values[6:9]
    plant.force, plant.force_slope = values[9], values[10]
    h = 10.0**step
    expected, force = exact(plant, h), plant.force + plant.force_slope * h
    plant.do_step(0.0, h)
    assert state(plant) == pytest.approx(expected, rel=0.0, abs=2e-12 * (1.0 + np.abs(expected).max()))
    assert plant.force == force


@pytest.mark.parametrize(
    ("damping", "overdamped"),
    [([0.0, 0.0], 0), ([20.0, 6.0], 0), ([300.0, 0.0], 1), ([0.0, 90.0], 1), ([900.0, 300.0], 2), ([4000.0, 1.0], 1)],
)
def test_modes_are_the_eigenvalues(damping, overdamped):
    """Against numpy's eigenvalues of the free-free chain without its two rigid-body poles."""
    plant = started(damping=damping)
    relative = SPRINGS @ np.diag(1.0 / np.array(plant.mass)) @ SPRINGS.T
    k, c = relative @ np.diag(plant.stiffness), relative @ np.diag(damping)
    poles = np.linalg.eigvals(np.block([[np.zeros((2, 2)), np.eye(2)], [-k, -c]]))
    pairs = [(abs(p), -p.real / abs(p)) for p in poles if p.imag > 0.0]
    real = sorted(-p.real for p in poles if p.imag == 0.0)
    assert len(real) == 2 * overdamped
    for i in range(overdamped):
        slow, fast = real[i], real[-1 - i]
        pairs.append((np.sqrt(slow * fast), 0.5 * (slow + fast) / np.sqrt(slow * fast)))
    for (w, zeta), found_w, found_zeta in zip(sorted(pairs), plant.natural_frequency, plant.damping_ratio, strict=True):
        assert found_w == pytest.approx(w, rel=1e-12)
        assert found_zeta == pytest.approx(zeta, rel=1e-12, abs=1e-14)


def test_the_default_chain_has_the_modes_of_the_paper():
    """Jung 2011, eq. (11): 3.85 rad/s, 0.096 and 9.42 rad/s, 0.24; M and K there give these digits (scipy.linalg.eig)."""
    plant = started()
    assert plant.natural_frequency == pytest.approx([3.8554510, 9.4234900], abs=5e-8)
    assert plant.damping_ratio == pytest.approx([0.0963863, 0.2355873], abs=5e-8)


@settings(max_examples=200, deadline=None)
@given(*[st.floats(0.0, 3.0)] * 2, *[st.floats(-2.0, 2.0)] * 2)
def test_quadratic_factors_multiply_to_the_quartic(zeta1, zeta2, w1, w2):
    """Also where poles are real or double: the product of the factors is the polynomial that was given."""
    p, q = [2.0 * zeta1 * 10.0**w1, 2.0 * zeta2 * 10.0**w2], [10.0 ** (2 * w1), 10.0 ** (2 * w2)]

    def product(p1, q1, p2, q2):
        return np.array([p1 + p2, q1 + q2 + p1 * p2, p1 * q2 + p2 * q1, q1 * q2])

    given_coefficients = product(p[0], q[0], p[1], q[1])
    p1, q1, p2, q2 = quadratic_factors(*given_coefficients)
    assert q1 <= q2
    found = product(p1, q1, p2, q2)
    scale = np.sqrt(np.sqrt(given_coefficients[3])) ** np.arange(1, 5) * (
        1.0 + given_coefficients[1] / np.sqrt(given_coefficients[3])
    )
    assert np.abs(found - given_coefficients) / scale == pytest.approx(np.zeros(4), abs=1e-7)  # sqrt(rounding) at double poles
    if max(zeta1, zeta2) < 0.99 and abs(w1 - w2) > 0.05:
        low = int(w1 > w2)
        assert [p1, q1, p2, q2] == pytest.approx([p[low], q[low], p[1 - low], q[1 - low]], rel=1e-9, abs=1e-12)


@pytest.mark.parametrize("norm", [1e-8, 0.3, 7.0, 300.0])
@pytest.mark.parametrize("n", [1, 3, 5])
def test_phi_functions_are_blocks_of_a_matrix_exponential(n, norm):
    """exp([[Z, I, 0], [0, 0, I], [0, 0, 0]]) holds phi0, phi1, phi2 of Z in its first row; Z is a stable matrix here."""
    random = np.random.default_rng(n)
    z = random.normal(size=(n, n))
    z = z - z.T - 0.1 * z @ z.T
    z *= norm / np.abs(z).sum(axis=1).max()
    whole = np.zeros((3 * n, 3 * n))
    whole[:n, :n], whole[:n, n : 2 * n], whole[n : 2 * n, 2 * n :] = z, np.eye(n), np.eye(n)
    found = [[0.0] * n * n for _ in range(4)]
    squarings = phi_functions(z.ravel().tolist(), n, *found)
    assert squarings == max(0, int(np.ceil(np.log2(2.0 * norm) - 1e-9)))
    expected = expm(whole)[:n]
    for k in range(3):
        assert np.array(found[k]).reshape(n, n) == pytest.approx(expected[:, k * n : (k + 1) * n], abs=3e-14 * max(1.0, norm))


def test_phi_functions_refuse_what_has_no_accurate_result():
    room = [[0.0] * 4 for _ in range(4)]
    for value in (1e12, float("inf"), float("nan")):
        assert phi_functions([value, 0.0, 0.0, 1.0], 2, *room) == -1
    assert [power_of_two(x) for x in (1.0, 3.0, 0.2, 0.0, float("inf"), float("nan"))] == [1.0, 4.0, 0.25, 1.0, 1.0, 1.0]


def test_the_response_to_changing_forces_is_that_of_an_integration():
    """scipy's DOP853, tolerances 1e-13, over pieces of held and linear forces on all masses."""
    plant, x, t = started(), np.zeros(6), 0.0
    a, b = matrices(plant.mass, plant.stiffness, plant.damping)
    for h, force, slope, disturbance in (
        (0.4, 3.0, 0.0, [0.0, 1.0, 0.0]),
        (1.3, 0.0, -4.0, [0.0, 0.0, 2.0]),
        (2.2, -6.0, 5.0, [1.0, -1.0, -0.5]),
    ):
        plant.force, plant.force_slope, plant.disturbance = force, slope, list(disturbance)

        def slopes(s, y, force=force, slope=slope, disturbance=disturbance):
            return a @ y + b @ (np.array(disturbance) + np.array([force + slope * s, 0.0, 0.0]))

        x = solve_ivp(slopes, (0.0, h), x, method="DOP853", rtol=1e-13, atol=1e-13).y[:, -1]
        for _ in range(10):
            plant.do_step(t, h / 10)
            t += h / 10
        assert state(plant) == pytest.approx(x, abs=1e-11)
        assert [*plant.velocity, *plant.acceleration] == pytest.approx(slopes(h, x), abs=1e-10)


def test_momentum_is_the_forces_impulse():
    """No friction to the ground: M v_cm = integral of the forces, M x_cm their double integral, whatever the inner motion."""
    plant = started(damping=[0.0, 0.0], disturbance=[0.3, -0.2, 0.5], force=2.0)
    plant.force_slope = -0.25
    for i in range(2000):
        plant.do_step(0.01 * i, 0.01)
    t, mass = 20.0, np.array(plant.mass)
    momentum = (0.6 + 2.0) * t - 0.25 * t * t / 2.0
    assert mass @ plant.velocity == pytest.approx(momentum, rel=1e-12)
    assert mass @ plant.position == pytest.approx((0.6 + 2.0) * t * t / 2.0 - 0.25 * t**3 / 6.0, rel=1e-12)


def energy(plant: ThreeMassChain) -> float:
    stretch = SPRINGS @ plant.position
    return 0.5 * float(np.array(plant.mass) @ np.square(plant.velocity) + np.array(plant.stiffness) @ np.square(stretch))


def test_an_undamped_chain_keeps_its_energy():
    plant = started(damping=[0.0, 0.0], force=7.0)
    plant.do_step(0.0, 1.1)
    plant.force = 0.0
    first = energy(plant)
    assert first > 1.0
    for i in range(10_000):
        plant.do_step(1.1 + 0.05 * i, 0.05)
    assert energy(plant) == pytest.approx(first, rel=1e-11)


def test_work_is_energy_and_heat():
    """Work of the force = energy + heat in the dampers; Simpson's rule over exact points (error below 1e-9)."""
    plant = started(force=5.0)
    h, powers, losses = 0.002, [0.0], [0.0]
    for i in range(1000):
        plant.do_step(h * i, h)
        powers.append(5.0 * plant.velocity[0])
        losses.append(float(np.array(plant.damping) @ np.square(SPRINGS @ plant.velocity)))
    weights = np.array([1.0, *[4.0, 2.0] * 499, 4.0, 1.0]) * h / 3.0
    assert energy(plant) + weights @ losses == pytest.approx(weights @ powers, rel=1e-9)


@pytest.mark.parametrize("damping", [[20.0, 6.0], [0.0, 0.0]])
def test_the_communication_step_does_not_matter(damping):
    found = []
    for step in (0.001, 0.007, 0.05):
        plant = started(damping=damping, force=4.0, disturbance=[0.0, 0.0, -3.5])
        for i in range(round(3.5 / step)):
            plant.do_step(i * step, step)
        found.append(state(plant))
    assert found[1] == pytest.approx(found[0], abs=1e-12)
    assert found[2] == pytest.approx(found[0], abs=1e-12)
    assert found[2] == pytest.approx(exact(started(damping=damping, force=4.0, disturbance=[0.0, 0.0, -3.5]), 3.5), abs=1e-12)


@pytest.mark.parametrize(
    ("name", "value", "message"),
    [
        ("mass[2]", 0.0, r"mass\[2\] = 0 kg must be greater than 0"),
        ("stiffness[1]", -5.0, r"stiffness\[1\] = -5 N/m must be greater than 0"),
        ("damping[2]", -1.0, r"damping\[2\] = -1 N.s/m must be at least 0"),
        ("disturbance[3]", float("nan"), r"disturbance\[3\] is nan"),
        ("mass[4]", 1.0, r"takes elements 1 to 3"),
    ],
)
def test_values_outside_the_domain_are_named(name, value, message):
    with pytest.raises(ComponentError, match=message):
        started(**{name: value})


def test_a_step_that_leaves_no_accuracy_is_refused():
    plant = started(force=1.0)
    with pytest.raises(ComponentError, match="more than 1e11 times as long as the chain's fastest time constant"):
        plant.do_step(0.0, 1e12)


def test_the_fmu_gives_the_exact_response():
    """A step of 3 N on mass 1 and one of -1 N on mass 3, 0.2 s later, by the native FMU."""
    system = System()
    system.add(
        "chain", fmu_path("ThreeMassChain", platforms=["this"]), {"damping[1]": 25.0, "disturbance[1]": 0.0, "disturbance[2]": 0.0}
    )
    system.drive("chain.force", ([0.0, 0.1], [0.0, 3.0]))
    system.drive("chain.disturbance[3]", ([0.0, 0.3], [0.0, -1.0]))
    results = system.simulate(2.1, 0.05)
    plant = started(damping=[25.0, 6.0], force=3.0)
    plant.position[:], plant.velocity[:] = np.split(exact(plant, 0.2), 2)
    plant.disturbance[2] = -1.0
    expected = exact(plant, 1.8)
    for i in range(3):
        assert results[f"chain.position[{i + 1}]"][-1] == pytest.approx(expected[i], abs=1e-13)
        assert results[f"chain.velocity[{i + 1}]"][-1] == pytest.approx(expected[3 + i], abs=1e-13)
