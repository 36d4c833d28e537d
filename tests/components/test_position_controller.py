"""The position controller: its law, its limit, and how it comes back from saturation."""

from __future__ import annotations

import math
from typing import Any

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from scipy.integrate import solve_ivp
from scipy.signal import StateSpace, cont2discrete, step

from shaper_fmu.commands.position_controller import PositionController
from shaper_fmu.errors import ComponentError
from shaper_fmu.plants.mass_spring_damper import MassSpringDamper


def started(**values) -> PositionController:
    controller = PositionController(**values)
    controller.initialize(0.0)
    return controller


def test_the_first_output_is_the_direct_part():
    """Kp (r - x) - Kd v, before anything is integrated; also in a step of no length after a change of the inputs."""
    controller = started(proportional_gain=50.0, integral_gain=9.0, derivative_gain=4.0, reference=0.3, position=0.1, velocity=0.5)
    assert controller.force == pytest.approx(50.0 * 0.2 - 4.0 * 0.5, rel=1e-15)
    controller.reference = 1.0
    controller.do_step(0.0, 0.0)
    assert controller.force == pytest.approx(50.0 * 0.9 - 4.0 * 0.5, rel=1e-15)


def test_the_integral_over_held_inputs_is_exact():
    controller = started(proportional_gain=2.0, integral_gain=3.0, derivative_gain=0.5)
    t, integral = 0.0, 0.0
    for h, reference, position, velocity in (
        (0.1, 1.0, 0.2, 0.1),
        (0.7, -2.0, 0.4, -1.0),
        (0.0, 5.0, 0.0, 0.0),
        (2.5, 0.3, 0.1, 0.2),
    ):
        controller.reference, controller.position, controller.velocity = reference, position, velocity
        controller.do_step(t, h)
        t, integral = t + h, integral + 3.0 * (reference - position) * h
        assert controller.force == pytest.approx(2.0 * (reference - position) + integral - 0.5 * velocity, abs=1e-14)


def run_loop(controller, plant, h, steps, reference=1.0):
    """Sampled control: force from the plant's state at each point, held over the step. Positions at the points."""
    positions = []
    for k in range(steps):
        controller.set("reference", reference)
        controller.position, controller.velocity = plant.position, plant.velocity
        controller.do_step(k * h, 0.0)
        positions.append(plant.position)
        plant.force = controller.force
        plant.do_step(k * h, h)
        controller.do_step(k * h, h)
    return np.array(positions)


GAINS = {"proportional_gain": 40.0, "integral_gain": 30.0, "derivative_gain": 9.0}
PLANT = np.array([[0.0, 1.0], [-8.0 / 2.0, -1.0 / 2.0]]), np.array([[0.0], [1.0 / 2.0]])


def plant_at_rest():
    plant = MassSpringDamper(mass=2.0, stiffness=8.0, damping=1.0)
    plant.initialize(0.0)
    return plant


def test_a_sampled_loop_is_that_of_scipys_discrete_plant():
    """x[k+1] = A x[k] + B f[k] by scipy.signal.cont2discrete (zero-order hold), I[k+1] = I[k] + Ki e[k] h."""
    h, steps = 0.04, 300
    discrete: Any = cont2discrete((*PLANT, np.eye(2), np.zeros((2, 1))), h)
    a, b = discrete[:2]
    x, integral, expected = np.zeros(2), 0.0, []
    for _ in range(steps):
        expected.append(x[0])
        error = 1.0 - x[0]
        x = a @ x + b[:, 0] * (40.0 * error + integral - 9.0 * x[1])
        integral += 30.0 * error * h
    assert run_loop(started(**GAINS), plant_at_rest(), h, steps) == pytest.approx(np.array(expected), abs=1e-11)


def test_a_fast_loop_tends_to_the_continuous_closed_loop():
    """scipy.signal.step of the plant with the PID law; the difference halves with the step."""
    a, b = PLANT
    closed = np.zeros((3, 3))
    closed[:2, :2] = a - b @ np.array([[40.0, 9.0]])
    closed[:2, 2] = b[:, 0]
    closed[2, 0] = -30.0
    system = StateSpace(closed, np.array([[0.0], [20.0], [30.0]]), [[1.0, 0.0, 0.0]], [[0.0]])
    points = np.linspace(0.0, 4.0, 41)[:-1]
    exact = np.asarray(step(system, T=points)[1])
    errors = [np.abs(run_loop(started(**GAINS), plant_at_rest(), 0.1 / n, 40 * n)[::n] - exact).max() for n in (20, 40)]
    assert errors[0] < 0.02
    assert errors[0] / errors[1] == pytest.approx(2.0, rel=0.1)


@settings(max_examples=80, deadline=None)
@given(
    st.lists(st.tuples(st.floats(0.0, 2.0), st.floats(-3.0, 3.0), st.floats(-3.0, 3.0), st.integers(1, 7)), min_size=1, max_size=8),
    st.floats(0.1, 20.0),
)
def test_the_force_keeps_its_limit_and_dividing_a_step_changes_nothing(moves, limit):
    gains = {"proportional_gain": 2.0, "integral_gain": 5.0, "derivative_gain": 1.0, "force_limit": limit}
    whole, divided = started(**gains), started(**gains)
    t = 0.0
    for h, reference, velocity, parts in moves:
        for controller in (whole, divided):
            controller.reference, controller.velocity = reference, velocity
        whole.do_step(t, h)
        for i in range(parts):
            divided.do_step(t + i * h / parts, h / parts)
        t += h
        assert abs(whole.force) <= limit
        assert divided.force == pytest.approx(whole.force, abs=1e-12)


def test_saturated_law_against_scipy():
    """I' = Ki e, but 0 while the force is at a limit and e drives it further: integrated by scipy with small steps."""
    kp, ki, kd, limit = 3.0, 4.0, 0.5, 2.0
    error, velocity = (lambda t: math.sin(1.3 * t) + 0.2), (lambda t: math.cos(2.1 * t))

    def slope(t, integral):
        wanted = kp * error(t) - kd * velocity(t) + integral[0]
        return [0.0 if abs(wanted) >= limit and wanted * error(t) > 0.0 else ki * error(t)]

    h, end = 1e-3, 9.0
    exact = solve_ivp(slope, (0.0, end), [0.0], max_step=2e-3, t_eval=np.arange(1.0, end)).y[0]
    controller = started(proportional_gain=kp, integral_gain=ki, derivative_gain=kd, force_limit=limit)
    found = []
    for k in range(round(end / h)):
        controller.reference, controller.velocity = error((k + 0.5) * h), velocity((k + 0.5) * h)
        controller.do_step(k * h, h)
        if (k + 1) * h >= len(found) + 1 - 1e-9 and len(found) < len(exact):
            found.append(controller.integral_force)
    assert found == pytest.approx(exact, abs=5e-3)


def test_it_recovers_from_saturation_at_once():
    """An error of 1 m held for 100 s: the integral stops at limit - Kp e = 4 N, in closed form; an unlimited one winds up to 100 N.
    With the error at -0.5 m the force is 4 - 0.5 N at once, and falls at 0.5 N/s."""
    controller = started(proportional_gain=1.0, integral_gain=1.0, derivative_gain=0.0, force_limit=5.0, reference=1.0)
    controller.do_step(0.0, 3.0)
    assert controller.force == pytest.approx(4.0)
    controller.do_step(3.0, 97.0)
    assert controller.force == 5.0
    controller.reference = -0.5
    controller.do_step(100.0, 0.0)
    assert controller.force == pytest.approx(3.5)
    controller.do_step(100.0, 2.0)
    assert controller.force == pytest.approx(2.5)


def test_integration_rests_while_the_direct_part_alone_saturates():
    controller = started(proportional_gain=10.0, integral_gain=1.0, derivative_gain=0.0, force_limit=5.0, reference=1.0)
    controller.do_step(0.0, 50.0)
    assert (controller.force, controller.integral_force) == (5.0, 0.0)
    controller.reference = 0.2
    controller.do_step(50.0, 1.0)
    assert controller.force == pytest.approx(10.0 * 0.2 + 0.2)


def test_no_windup_means_less_overshoot():
    """The same loop with the same saturation, once with a naive integral that goes on (computed here)."""
    h, steps, limit = 0.01, 3000, 9.0
    plant, integral, naive = plant_at_rest(), 0.0, []
    for k in range(steps):
        naive.append(plant.position)
        error = 1.0 - plant.position
        plant.force = max(-limit, min(limit, 40.0 * error + integral - 9.0 * plant.velocity))
        integral += 30.0 * error * h
        plant.do_step(k * h, h)
    ours = run_loop(started(**GAINS, force_limit=limit), plant_at_rest(), h, steps)
    assert ours.max() - 1.0 < 0.5 * (max(naive) - 1.0)
    assert ours[-1] == pytest.approx(1.0, abs=1e-3)


@pytest.mark.parametrize(
    ("name", "value", "message"),
    [
        ("proportional_gain", -1.0, "proportional_gain = -1 N/m must be at least 0"),
        ("integral_gain", -1.0, "integral_gain = -1 N/m/s must be at least 0"),
        ("force_limit", 0.0, "force_limit = 0 N must be greater than 0"),
        ("reference", math.nan, "reference is nan"),
    ],
)
def test_values_outside_the_domain_are_named(name, value, message):
    with pytest.raises(ComponentError, match=message):
        started(**{name: value})
