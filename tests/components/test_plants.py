"""Plants against closed forms and independent integration."""

from __future__ import annotations

import math

import numpy as np
import pytest
from scipy.integrate import solve_ivp
from scipy.linalg import expm

from shaper_fmu.errors import ComponentError
from shaper_fmu.plants.mass_spring_damper import MassSpringDamper, oscillator_transition
from shaper_fmu.plants.overhead_crane import OverheadCrane


@pytest.mark.parametrize("zeta", [0.0, 0.1, 0.9, 0.999999, 1.0, 1.000001, 1.2, 5.0, 1000.0])
@pytest.mark.parametrize("h", [1e-6, 1e-3, 0.02, 0.3, 4.0])
def test_transition_is_the_matrix_exponential(zeta, h):
    w = 7.3
    transition = [0.0] * 4
    oscillator_transition(transition, w, zeta, h)
    exact = expm(np.array([[0.0, 1.0], [-w * w, -2 * zeta * w]]) * h)
    assert transition == pytest.approx(exact.ravel().tolist(), rel=2e-10, abs=1e-13)


@pytest.mark.parametrize("step", [0.001, 0.007, 0.05, 0.35])
def test_step_response_is_exact_at_any_communication_step(step):
    """x = F/k (1 - exp(-zeta w t) (cos wd t + zeta w/wd sin wd t)), of an underdamped oscillator at rest."""
    plant = MassSpringDamper(mass=2.0, stiffness=50.0, damping=1.0, force=3.0)
    plant.initialize()
    w, zeta = math.sqrt(25.0), 1.0 / (2 * math.sqrt(100.0))
    wd = w * math.sqrt(1 - zeta**2)
    assert (plant.natural_frequency, plant.damping_ratio) == (w, zeta)
    for i in range(round(7.0 / step)):
        plant.do_step(i * step, step)
    t = round(7.0 / step) * step
    envelope = math.exp(-zeta * w * t)
    expected = 0.06 * (1 - envelope * (math.cos(wd * t) + zeta * w / wd * math.sin(wd * t)))
    assert plant.position == pytest.approx(expected, abs=1e-13)
    assert plant.velocity == pytest.approx(0.06 * w * w / wd * envelope * math.sin(wd * t), abs=1e-13)
    assert plant.acceleration == pytest.approx((3.0 - plant.velocity - 50.0 * plant.position) / 2.0, abs=1e-12)


def test_a_step_beyond_all_numbers_is_an_error_in_words():
    plant = MassSpringDamper()
    plant.initialize()
    with pytest.raises(ComponentError, match="MassSpringDamper: "):
        plant.do_step(0.0, 1e308)


def crane_reference(acceleration, hoist, duration, length=4.0, zeta=0.03, g=9.81):
    """The crane's equations of motion by scipy's DOP853 at tolerances of 1e-13."""
    w = math.sqrt(g / length)

    def slopes(t, y):
        angle, rate = y
        rope = length - hoist * t
        return [rate, -(g * math.sin(angle) + acceleration * math.cos(angle) - 2 * hoist * rate) / rope - 2 * zeta * w * rate]

    return solve_ivp(slopes, (0.0, duration), [0.0, 0.0], method="DOP853", rtol=1e-13, atol=1e-13).y[:, -1]


@pytest.mark.parametrize("step", [0.01, 0.25, 3.0])
@pytest.mark.parametrize("hoist", [0.0, 0.4, -0.3])
def test_crane_agrees_with_an_independent_integration(step, hoist):
    crane = OverheadCrane(initial_rope_length=4.0, damping_ratio=0.03, trolley_acceleration=2.0, hoist_speed=hoist)
    crane.initialize()
    for i in range(round(3.0 / step)):
        crane.do_step(i * step, step)
    angle, rate = crane_reference(2.0, hoist, 3.0)
    assert [crane.swing_angle, crane.swing_rate] == pytest.approx([angle, rate], abs=2e-9)
    assert crane.trolley_position == pytest.approx(9.0, abs=1e-12)
    assert crane.rope_length == pytest.approx(4.0 - 3.0 * hoist, abs=1e-12)
    assert crane.load_position == pytest.approx(9.0 + crane.rope_length * math.sin(angle), abs=1e-8)


def test_an_undamped_crane_keeps_its_energy():
    """After a push: l^2 rate^2 / 2 + g l (1 - cos angle) is constant while the trolley coasts."""
    crane = OverheadCrane(initial_rope_length=4.0, trolley_acceleration=4.0)
    crane.initialize()
    crane.do_step(0.0, 1.0)
    crane.trolley_acceleration = 0.0
    energies, angles = [], []
    for i in range(200):
        crane.do_step(1.0 + 0.1 * i, 0.1)
        angles.append(crane.swing_angle)
        energies.append(8.0 * crane.swing_rate**2 + 9.81 * 4.0 * (1 - math.cos(crane.swing_angle)))
    assert max(angles) > 0.4  # a large swing, so a nonlinear one
    assert np.ptp(energies) < 1e-7 * max(energies)


def test_small_swings_have_the_pendulums_frequency():
    crane = OverheadCrane(initial_rope_length=9.81, trolley_acceleration=1e-4)
    crane.initialize()
    assert crane.natural_frequency == 1.0
    crane.do_step(0.0, math.pi)  # half a period: twice the static deflection
    assert crane.swing_angle == pytest.approx(-2e-4 / 9.81, abs=1e-9)


def test_a_crane_without_rope_is_an_error():
    crane = OverheadCrane(initial_rope_length=1.0, hoist_speed=2.0)
    crane.initialize()
    with pytest.raises(ComponentError, match="hoisting at 2 m/s leaves no rope"):
        crane.do_step(0.0, 0.5)
