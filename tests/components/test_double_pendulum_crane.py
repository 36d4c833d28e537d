"""The double-pendulum crane: against Newton's law with Lagrange multipliers, matrices, closed forms and the balance of energy."""

from __future__ import annotations

import math

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from scipy.integrate import simpson, solve_ivp
from scipy.linalg import eigh

from shaper_fmu import System, fmu_path
from shaper_fmu.errors import ComponentError
from shaper_fmu.plants.double_pendulum_crane import DoublePendulumCrane
from shaper_fmu.plants.overhead_crane import OverheadCrane

G = 9.81
BODIES = {"initial_rope_length": 4.0, "sling_length": 1.5, "hook_mass": 80.0, "load_mass": 120.0}


def crane(**values) -> DoublePendulumCrane:
    made = DoublePendulumCrane(**{**BODIES, **values})
    made.initialize()
    return made


def tensions(q, v, push, length, growth, bend, plant) -> np.ndarray:
    """Multipliers of |hook| = l1(t) and |load - hook| = l2: forces along rope and sling that keep the second derivatives.

    With unit vectors e1, e2 and accelerations hook'' = field - T1/mh e1 + T2/mh e2, load'' = field - T2/mp e2.
    """
    rope, sling = q[:2], q[2:] - q[:2]
    e1, e2 = rope / length, sling / plant.sling_length
    field = np.array([-push, -G])
    across = v[:2] - (v[:2] @ e1) * e1
    turning = v[2:] - v[:2]
    h, p = plant.hook_mass, plant.load_mass
    matrix = np.array([[-1.0 / h, e1 @ e2 / h], [e1 @ e2 / h, -1.0 / p - 1.0 / h]])
    wanted = [bend - across @ across / length - field @ e1, -(turning @ turning) / plant.sling_length]
    return np.linalg.solve(matrix, wanted)


def cartesian(plant, push, hoist, duration, state=None):
    """Hook and load beneath the trolley and their velocities by DOP853; push(t), hoist(t) -> (taken in, speed, acceleration)."""
    first = plant.initial_rope_length

    def slopes(t, y):
        q, v = y[:4], y[4:]
        taken, speed, acceleration = hoist(t)
        length = first - taken
        t1, t2 = tensions(q, v, push(t), length, -speed, -acceleration, plant)
        e1, e2 = q[:2] / length, (q[2:] - q[:2]) / plant.sling_length
        field = np.array([-push(t), -G])
        return np.concatenate([v, field - t1 / plant.hook_mass * e1 + t2 / plant.hook_mass * e2, field - t2 / plant.load_mass * e2])

    speed = hoist(0.0)[1]
    if state is None:
        state = [0.0, -first, 0.0, -first - plant.sling_length, 0.0, speed, 0.0, speed]
    found = solve_ivp(slopes, (0.0, duration), state, "DOP853", rtol=1e-12, atol=1e-12)
    assert found.success
    return found.y[:, -1]


def angles(y) -> list[float]:
    return [math.atan2(y[0], -y[1]), math.atan2(y[2] - y[0], y[1] - y[3])]


@pytest.mark.parametrize("step", [0.01, 0.25, 3.0])
@pytest.mark.parametrize("hoist", [0.0, 0.6, -0.5])
def test_it_agrees_with_newtons_law(hoist, step):
    """In Cartesian coordinates with both ropes' tensions. Tolerance: the plant's, 1e-10 a substep, and the constraints' drift."""
    plant = crane(trolley_acceleration=2.5, hoist_speed=hoist)
    for i in range(round(3.0 / step)):
        plant.do_step(i * step, step)
    y = cartesian(plant, lambda t: 2.5, lambda t: (hoist * t, hoist, 0.0), 3.0)
    assert min(abs(plant.hook_angle), abs(plant.load_angle)) > 0.1
    assert [plant.hook_angle, plant.load_angle] == pytest.approx(angles(y), abs=5e-9)
    assert [plant.hook_offset, plant.load_offset] == pytest.approx([y[0], y[2]], abs=2e-8)
    assert plant.load_position == pytest.approx(2.5 * 4.5 + y[2], abs=2e-8)
    length = 4.0 - 3.0 * hoist
    expected = tensions(y[:4], y[4:], 2.5, length, -hoist, 0.0, plant)
    assert [plant.rope_tension, plant.sling_tension] == pytest.approx(list(expected), rel=1e-7)


def test_linear_inputs_are_followed_exactly():
    plant = crane(trolley_acceleration=-1.0, hoist_speed=0.4)
    plant.trolley_acceleration_slope, plant.hoist_speed_slope = 1.5, -0.6
    for i in range(3):
        plant.do_step(float(i), 1.0)
    y = cartesian(plant, lambda t: -1.0 + 1.5 * t, lambda t: (0.4 * t - 0.3 * t * t, 0.4 - 0.6 * t, -0.6), 3.0)
    assert [plant.hook_angle, plant.load_angle] == pytest.approx(angles(y), abs=5e-9)
    expected = tensions(y[:4], y[4:], 3.5, 4.0 - 1.2 + 2.7, 1.4, 0.6, plant)
    assert [plant.rope_tension, plant.sling_tension] == pytest.approx(list(expected), rel=1e-7)


@pytest.mark.parametrize("jump", [0.8, -0.8])
def test_a_jump_of_the_hoists_speed_is_the_limit_of_short_ramps(jump):
    """With rope and sling out of line it turns both. Newton's law over ramps of 2 ms and 1 ms, extrapolated to none."""
    plant = crane()
    plant.hook_angle, plant.load_angle = 0.4, -0.5
    hook = 4.0 * np.array([math.sin(0.4), -math.cos(0.4)])
    load = hook + 1.5 * np.array([math.sin(-0.5), -math.cos(0.5)])
    plant.hoist_speed = jump
    plant.do_step(0.0, 0.0)
    rates = [plant.hook_rate, plant.load_rate]
    plant.do_step(0.0, 0.5)
    found = []
    for ramp in (2e-3, 1e-3):
        state = [*hook, *load, 0.0, 0.0, 0.0, 0.0]
        a = jump / ramp
        begun = cartesian(plant, lambda t: 0.0, lambda t, a=a: (0.5 * a * t * t, a * t, a), ramp, state)
        taken = 0.5 * jump * ramp
        y = cartesian(plant, lambda t: 0.0, lambda t, taken=taken: (taken + jump * t, jump, 0.0), 0.5 - 0.5 * ramp, begun)
        found.append(np.array(angles(y)))
    assert max(map(abs, rates)) > 0.05
    assert [plant.hook_angle, plant.load_angle] == pytest.approx(list(2.0 * found[1] - found[0]), abs=2e-6)


def original_formula(r: float, l1: float, l2: float) -> list[float]:
    """As Singhose, Kim and Kenison (2008) have it: sqrt(g/2) sqrt((1 + R)(1/L1 + 1/L2) -+ sqrt(...))."""
    total = (1 + r) * (1 / l1 + 1 / l2)
    spread = math.sqrt(total**2 - 4 * (1 + r) / (l1 * l2))
    return [math.sqrt(G / 2 * (total - spread)), math.sqrt(G / 2 * (total + spread))]


def matrices(r: float, l1: float, l2: float) -> tuple[np.ndarray, np.ndarray]:
    """Mass and stiffness for the small angles, per kg of hook."""
    mass = np.array([[(1 + r) * l1 * l1, r * l1 * l2], [r * l1 * l2, r * l2 * l2]])
    return mass, np.diag([(1 + r) * G * l1, r * G * l2])


@given(st.floats(-2.0, 2.0), st.floats(-1.0, 1.5), st.floats(-1.0, 1.5))
def test_frequencies_are_those_of_the_formula_and_of_the_matrices(ratio, upper, lower):
    r, l1, l2 = 10**ratio, 10**upper, 10**lower
    plant = crane(initial_rope_length=l1, sling_length=l2, hook_mass=3.0, load_mass=3.0 * r)
    mass, stiffness = matrices(r, l1, l2)
    roots = np.sqrt(eigh(stiffness, mass, eigvals_only=True))
    assert plant.natural_frequency == pytest.approx(original_formula(r, l1, l2), rel=1e-9)
    assert plant.natural_frequency == pytest.approx(list(roots), rel=1e-9)
    assert plant.mode_frequency == plant.natural_frequency


def test_frequencies_follow_the_rope():
    plant = crane(hoist_speed=0.5)
    plant.do_step(0.0, 4.0)
    assert plant.rope_length == pytest.approx(2.0, rel=1e-15)
    assert plant.mode_frequency == pytest.approx(original_formula(1.5, 2.0, 1.5), rel=1e-12)
    assert plant.natural_frequency == pytest.approx(original_formula(1.5, 4.0, 1.5), rel=1e-12)


@pytest.mark.parametrize("mode", [0, 1])
@pytest.mark.parametrize("zeta", [0.0, 0.03, 0.2])
def test_small_swings_of_each_mode_have_frequency_and_damping(mode, zeta):
    """Begun in a mode's shape, q = q0 exp(-zeta w t) (cos wd t + zeta w/wd sin wd t), and the other mode stays at rest."""
    plant = crane(damping_ratio=zeta)
    mass, stiffness = matrices(1.5, 4.0, 1.5)
    values, shapes = eigh(stiffness, mass)
    w, shape = math.sqrt(values[mode]), 1e-4 * shapes[:, mode] / np.abs(shapes[:, mode]).max()
    plant.hook_angle, plant.load_angle = shape.tolist()
    wd = w * math.sqrt(1 - zeta**2)
    for i in range(20):
        plant.do_step(0.2 * i, 0.2)
        t = 0.2 * (i + 1)
        wave = math.exp(-zeta * w * t) * (math.cos(wd * t) + zeta * w / wd * math.sin(wd * t))
        assert [plant.hook_angle, plant.load_angle] == pytest.approx((wave * shape).tolist(), abs=2e-9)


def test_without_a_load_the_hook_is_an_overhead_crane():
    """A load of a millionth of the hook: the hook's angle is the single pendulum's, damping and hoisting included."""
    double = crane(load_mass=80e-6, damping_ratio=0.05, trolley_acceleration=2.0, hoist_speed=0.3)
    single = OverheadCrane(initial_rope_length=4.0, damping_ratio=0.05, trolley_acceleration=2.0, hoist_speed=0.3, load_mass=80.0)
    single.initialize()
    for i in range(30):
        double.do_step(0.1 * i, 0.1)
        single.do_step(0.1 * i, 0.1)
    assert abs(single.swing_angle) > 0.1
    assert double.hook_angle == pytest.approx(single.swing_angle, abs=1e-5)
    assert double.rope_tension == pytest.approx(single.rope_tension, rel=1e-5)


def test_hoisting_alone_leaves_it_at_rest():
    plant = crane(hoist_speed=0.5)
    plant.do_step(0.0, 2.0)
    assert (plant.hook_angle, plant.load_angle, plant.load_offset) == (0.0, 0.0, 0.0)
    assert plant.rope_tension == pytest.approx(200.0 * G, rel=1e-14)
    assert plant.sling_tension == pytest.approx(120.0 * G, rel=1e-14)


@pytest.mark.parametrize("hoist", [0.5, -0.4])
@pytest.mark.parametrize("zeta", [0.0, 0.05])
def test_the_work_of_trolley_and_hoist_is_the_energy_of_hook_and_load(hoist, zeta):
    """In the trolley's frame: inertia forces -m a and the rope's tension work, the damping takes what its forces say.

    The damping's forces: d1 (per kg of both) across the rope on the centre of mass, d2 (per kg of load) across the sling, from
    C = 2 zeta (K + w1 w2 M)/(w1 + w2). Outputs of the native FMU every millisecond, Simpson's rule.
    """
    system = System()
    system.add("crane", fmu_path("DoublePendulumCrane", platforms=["this"]), damping_ratio=zeta, **BODIES)
    system.drive("crane.trolley_acceleration", 1.5)
    system.drive("crane.hoist_speed", hoist)
    names = ("hook_angle", "load_angle", "hook_rate", "load_rate", "rope_length", "rope_tension")
    results = system.simulate(3.0, 1e-3, record=[f"crane.{name}" for name in names])
    first, second, rate1, rate2, length, tension = (results[f"crane.{name}"] for name in names)
    growth = -hoist
    hook = np.array(
        [growth * np.sin(first) + length * rate1 * np.cos(first), -growth * np.cos(first) + length * rate1 * np.sin(first)]
    )
    load = hook + 1.5 * rate2 * np.array([np.cos(second), np.sin(second)])
    height1 = -length * np.cos(first)
    height2 = height1 - 1.5 * np.cos(second)
    energy = 0.5 * (80 * (hook**2).sum(axis=0) + 120 * (load**2).sum(axis=0)) + G * (80 * height1 + 120 * height2)
    low, high = original_formula(1.5, 4.0, 1.5)
    friction = 2 * zeta / (low + high)
    drag = friction * low * high
    x1, x2, cosine = length * rate1, 1.5 * rate2, np.cos(first - second)
    loss = 200 * (drag * (x1 + 0.6 * x2 * cosine) + friction * G / 4.0 * x1) * x1
    loss += 120 * (drag * (x2 + x1 * cosine) + friction * G / 1.5 * x2) * x2
    # the damping's forces act on the hook while the rope takes it up, too: only across the sling, through the load's part in d2
    upper = 120 * (drag * (x2 + x1 * cosine) + friction * G / 1.5 * x2) * growth * np.sin(first - second)
    power = -1.5 * (80 * hook[0] + 120 * load[0]) + tension * hoist - loss - upper
    work = simpson(power, x=results.time)
    assert np.max(np.abs(second)) > 0.2
    assert work == pytest.approx(energy[-1] - energy[0], rel=1e-7)
    if zeta:
        assert simpson(loss, x=results.time) > 1e-3 * np.ptp(energy)


def test_neither_rope_pushes():
    """The sling, where it is thrown upwards; the rope, where it is lowered faster than the free fall; both named with their values."""
    plant = crane()
    plant.load_angle = 2.0
    with pytest.raises(
        ComponentError, match=r"the sling would have to push: its tension is -\d+\.\d+ N and must be greater than 0 N"
    ):
        plant.do_step(0.0, 0.1)
    plant = crane()
    plant.hook_angle = plant.load_angle = 2.0
    with pytest.raises(ComponentError, match=r"the rope would have to push: its tension is -\d+\.\d+ N and must be greater"):
        plant.do_step(0.0, 0.1)
    for slope, words in ((-9.82, "the rope would have to push"), (-9.8, "")):
        plant = crane()
        plant.hoist_speed_slope = slope
        if words:
            with pytest.raises(ComponentError, match=words):
                plant.do_step(0.0, 0.1)
        else:
            plant.do_step(0.0, 0.1)
            assert plant.sling_tension == pytest.approx(120.0 * 0.01, rel=1e-9)
    with pytest.raises(ComponentError, match="leaves no rope"):
        crane(hoist_speed=1.0).do_step(0.0, 4.0)


def test_a_sling_that_goes_slack_within_a_long_step_is_refused():
    """The load is thrown round the hook, which is heavy: taut over the top from sqrt(5 g / l2) on, slack below."""
    heavy = {"hook_mass": 1e9, "load_mass": 1.0, "sling_length": 1.5}
    for rate, taut in ((1.003, True), (0.99, False)):
        plant = crane(**heavy)
        plant.sling_cross_speed = rate * math.sqrt(5.0 * G * 1.5)
        if taut:
            plant.do_step(0.0, 1.2)
            assert plant.load_angle > math.pi
        else:
            with pytest.raises(ComponentError, match="the sling would have to push"):
                plant.do_step(0.0, 1.2)
