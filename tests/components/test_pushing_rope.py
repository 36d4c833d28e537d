"""Ropes that would have to push: refused, where Newton's law has the tension at zero."""

from __future__ import annotations

import math
import re

import numpy as np
import pytest
from scipy.integrate import solve_ivp

from shaper_fmu.errors import ComponentError
from shaper_fmu.plants.overhead_crane import OverheadCrane

G = 9.81
WORDS = r"the rope would have to push: its tension is (-?[\d.e-]+) N and must be greater than 0 N"


def crane(**values) -> OverheadCrane:
    made = OverheadCrane(**values)
    made.initialize()
    return made


def slack_time(length: float, accelerations: tuple[float, float], turn: float) -> float:
    """When the tension passes zero, by Newton's law in Cartesian coordinates, the trolley's push turned round at `turn` [s]."""

    def tension(t, y):
        q, speed = y[:2], y[2:]
        field = np.array([accelerations[int(t >= turn)], G])
        return (speed @ speed - q @ field) / length

    def slopes(t, y):
        return [*y[2:], *(-tension(t, y) / length * y[:2] - np.array([accelerations[int(t >= turn)], G]))]

    def slack(t, y):
        return tension(t, y)

    slack.terminal = True  # pyright: ignore[reportFunctionMemberAccess]
    state = solve_ivp(lambda _, y: slopes(0.0, y), (0.0, turn), [0.0, -length, 0.0, 0.0], "DOP853", rtol=1e-12, atol=1e-12).y[:, -1]
    found = solve_ivp(slopes, (turn, 30.0), state, "DOP853", events=slack, rtol=1e-12, atol=1e-12)
    return float(found.t[-1])


def until_refused(plant: OverheadCrane, accelerations: tuple[float, float], turn: float, step: float) -> tuple[float, str]:
    """Start of the step that is refused, and the words."""
    now = 0.0
    while now < 30.0:
        plant.trolley_acceleration = accelerations[int(now >= turn - 1e-9)]
        try:
            plant.do_step(now, step)
        except ComponentError as error:
            return now, str(error)
        now += step
    return now, ""


@pytest.mark.parametrize("step", [1e-3, 0.01, 1.0])
def test_a_swing_beyond_the_horizontal_is_refused_when_newtons_law_says(step):
    """Pushed at 14 m/s2, then pulled: the load goes over 90 degrees. Refused within the step in which the tension passes zero."""
    accelerations, turn = (14.0, -14.0), 1.0
    expected = slack_time(4.0, accelerations, turn)
    plant = crane(initial_rope_length=4.0)
    now, words = until_refused(plant, accelerations, turn, step)
    assert now - 1e-9 <= expected <= now + step + 1e-9
    assert re.search(WORDS, words)
    assert plant.rope_tension <= 0.0
    assert f"{plant.rope_tension:.9g} N" in words


def test_a_tension_that_recovers_within_a_long_step_is_refused_too():
    """Thrown at 5.5 rad/s, beyond 90 degrees and not over the top: after 1.3 s a rod would hang almost straight again, and pull.

    It takes sqrt(2 g/l) = 4.43 rad/s to 90 degrees, and sqrt(5 g/l) = 7.004 to stay taut over the top.
    """
    plant = crane(initial_rope_length=1.0)
    plant.swing_rate = 5.5
    with pytest.raises(ComponentError, match=WORDS):
        plant.do_step(0.0, 1.3)
    thrown = crane(initial_rope_length=1.0)
    thrown.swing_rate = 7.1
    thrown.do_step(0.0, 2.0)
    assert thrown.swing_angle > 2.0 * math.pi
    assert thrown.rope_tension > 0.0


@pytest.mark.parametrize(("rate", "taut"), [(7.0036, True), (6.98, False)])
def test_the_limit_of_the_full_circle(rate, taut):
    """A rope stays taut over the top from sqrt(5 g / l) on: 7.00357 rad/s for 1 m. Looked for every substep."""
    plant = crane()
    plant.rope_length = 1.0
    plant.swing_rate = rate
    if taut:
        plant.do_step(0.0, 1.0)
        assert plant.swing_angle > math.pi
    else:
        with pytest.raises(ComponentError, match=WORDS):
            plant.do_step(0.0, 1.0)


@pytest.mark.parametrize(("slope", "falls"), [(-9.8, False), (-9.82, True)])
def test_lowering_faster_than_free_fall_is_refused(slope, falls):
    """The hoist's speed as a linear input: the rope gets longer with the acceleration -slope."""
    plant = crane()
    plant.hoist_speed_slope = slope
    if falls:
        with pytest.raises(ComponentError, match=WORDS):
            plant.do_step(0.0, 0.1)
    else:
        plant.do_step(0.0, 0.1)
        assert plant.rope_tension == pytest.approx(G + slope, rel=1e-9)
        assert plant.rope_length == pytest.approx(5.0 - 0.5 * slope * 0.01, rel=1e-14)


def test_the_tension_is_newtons():
    """m (|v|^2 - l'^2 - q.(a, g))/l + m (-l''), from the outputs, while hoisting with a linear speed."""
    plant = crane(load_mass=7.0, initial_rope_length=4.0, trolley_acceleration=2.0, hoist_speed=-0.3)
    plant.hoist_speed_slope = 0.5
    for i in range(20):
        plant.do_step(0.1 * i, 0.1)
        length, angle, rate = plant.rope_length, plant.swing_angle, plant.swing_rate
        q = length * np.array([math.sin(angle), -math.cos(angle)])
        speed = length * rate * np.array([math.cos(angle), math.sin(angle)]) - plant.hoist_speed * q / length
        tension = (speed @ speed - plant.hoist_speed**2 - q @ np.array([2.0, G])) / length + 0.5
        assert plant.rope_tension == pytest.approx(7.0 * tension, rel=1e-12)
    assert plant.hoist_speed == pytest.approx(-0.3 + 0.5 * 2.0, rel=1e-12)


def test_linear_inputs_are_followed_exactly():
    """Against the same in Cartesian coordinates by DOP853: the trolley's push and the hoist's speed grow evenly."""
    plant = crane(initial_rope_length=4.0, trolley_acceleration=-1.0, hoist_speed=0.4)
    plant.trolley_acceleration_slope, plant.hoist_speed_slope = 1.5, -0.6
    for i in range(3):
        plant.do_step(float(i), 1.0)

    def slopes(t, y):
        q, speed = y[:2], y[2:]
        length, growth = 4.0 - 0.4 * t + 0.3 * t * t, -0.4 + 0.6 * t
        field = np.array([-1.0 + 1.5 * t, G])
        tension = (speed @ speed - growth**2 - length * 0.6 - q @ field) / length
        return [*speed, *(-tension / length * q - field)]

    across, up, *_ = solve_ivp(slopes, (0.0, 3.0), [0.0, -4.0, 0.0, 0.4], "DOP853", rtol=1e-12, atol=1e-12).y[:, -1]
    assert plant.swing_angle == pytest.approx(math.atan2(across, -up), abs=2e-9)
    assert plant.rope_length == pytest.approx(math.hypot(across, up), rel=1e-9)
    assert plant.trolley_position == pytest.approx(-4.5 + 1.5 * 27.0 / 6.0, rel=1e-12)


def test_a_rope_that_is_gone_within_a_step_is_refused():
    """Hoisted at 3 m/s, slowing down by 2 m/s2, and lowered again: 2.25 m are taken in, then less."""
    for length, gone in ((2.2, True), (2.3, False)):
        plant = crane(initial_rope_length=length, hoist_speed=3.0)
        plant.hoist_speed_slope = -2.0
        if gone:
            with pytest.raises(ComponentError, match="leaves no rope"):
                plant.do_step(0.0, 3.0)
        else:
            plant.do_step(0.0, 3.0)
            assert plant.rope_length == pytest.approx(length, rel=1e-12)
