"""The crane's hoisting: against Newton's law in Cartesian coordinates, and by the balance of energy."""

from __future__ import annotations

import math

import numpy as np
import pytest
from scipy.integrate import simpson, solve_ivp

from shaper_fmu import System, fmu_path
from shaper_fmu.plants.overhead_crane import OverheadCrane

LENGTH, GRAVITY = 4.0, 9.81


def cartesian(acceleration, hoist, duration):
    """The load's position beneath the trolley (across, up) and its velocity, from the rope's tension, by DOP853.

    From |q| = l(t) follows q.q'' + |q'|^2 = l'^2, and with q'' = -T q/l - (a, g) the tension T = (|q'|^2 - l'^2 - q.(a, g))/l.
    """

    def slopes(t, y):
        q, speed = y[:2], y[2:]
        field = np.array([acceleration, GRAVITY])
        length = LENGTH - hoist * t
        tension = (speed @ speed - hoist**2 - q @ field) / length
        return np.concatenate([speed, -tension / length * q - field])

    start = [0.0, -LENGTH, 0.0, hoist]
    return solve_ivp(slopes, (0.0, duration), start, method="DOP853", rtol=1e-13, atol=1e-13).y[:, -1]


@pytest.mark.parametrize("hoist", [0.8, -0.5, 0.0])
def test_hoisting_agrees_with_newtons_law(hoist):
    """Tolerance: the plant's, 1e-10 a substep, and the drift of the constraint."""
    crane = OverheadCrane(initial_rope_length=LENGTH, trolley_acceleration=1.5, hoist_speed=hoist)
    crane.initialize()
    for i in range(30):
        crane.do_step(0.1 * i, 0.1)
    across, up, *_ = cartesian(1.5, hoist, 3.0)
    length = LENGTH - 3.0 * hoist
    assert math.hypot(across, up) == pytest.approx(length, rel=1e-10)
    assert crane.swing_angle == pytest.approx(math.atan2(across, -up), abs=2e-9)
    assert crane.load_position == pytest.approx(1.5 * 9.0 / 2 + across, abs=1e-8)


@pytest.mark.parametrize("hoist", [0.8, -0.5])
@pytest.mark.parametrize("zeta", [0.0, 0.05])
def test_the_work_of_trolley_and_hoist_is_the_loads_energy(hoist, zeta):
    """Per kg of load, by Lagrange's equations: the trolley pushes with the load's acceleration across, the hoist pulls with
    g cos + l rate^2 - a sin, and the damping takes 2 zeta w0 (l rate)^2.

    Outputs of the native FMU every millisecond, Simpson's rule.
    """
    system = System()
    system.add("crane", fmu_path("OverheadCrane", platforms=["this"]), initial_rope_length=LENGTH, damping_ratio=zeta)
    system.drive("crane.trolley_acceleration", 1.5)
    system.drive("crane.hoist_speed", hoist)
    names = ("swing_angle", "swing_rate", "swing_acceleration", "rope_length", "trolley_speed")
    results = system.simulate(3.0, 1e-3, record=[f"crane.{name}" for name in names])
    angle, rate, bend, length, speed = (results[f"crane.{name}"] for name in names)
    sine, cosine = np.sin(angle), np.cos(angle)
    across = speed - hoist * sine + length * rate * cosine
    up = hoist * cosine + length * rate * sine
    energy = 0.5 * (across**2 + up**2) - GRAVITY * length * cosine
    push = 1.5 + (length * bend - 2 * hoist * rate) * cosine - length * rate**2 * sine
    tension = GRAVITY * cosine + length * rate**2 - 1.5 * sine
    loss = 2 * zeta * math.sqrt(GRAVITY / LENGTH) * (length * rate) ** 2
    work = simpson(push * speed + tension * hoist - loss, x=results.time)
    assert np.max(np.abs(angle)) > 0.2
    assert work == pytest.approx(energy[-1] - energy[0], rel=1e-8)
