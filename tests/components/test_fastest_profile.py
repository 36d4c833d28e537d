"""The profile `fastest` of MotionProfile: segments as parameters, in plain Python, compiled, and as FMUs of both versions."""

from __future__ import annotations

import math
from itertools import pairwise

import numpy as np
import pytest
from compiled_kernels import Kernels, record_of
from native_host import native_fmu

from shaper_fmu.commands.motion_profile import MotionProfile
from shaper_fmu.component import NO_EVENT
from shaper_fmu.design.fastest import FastestMove, fastest_move
from shaper_fmu.design.profiles import profile
from shaper_fmu.errors import ArgumentError, ComponentError
from shaper_fmu.master.system import System

W, ZETA = 5.0, 0.03


@pytest.fixture(scope="module")
def by_acceleration() -> FastestMove:
    return fastest_move(1.0, max_velocity=1.0, max_acceleration=3.0, modes=[(W, ZETA)])


@pytest.fixture(scope="module")
def by_jerk() -> FastestMove:
    return fastest_move(-0.3, max_velocity=1.0, max_acceleration=3.0, max_jerk=60.0, modes=[(9.0, 0.05)])


@pytest.fixture(params=["by_acceleration", "by_jerk"])
def move(request) -> FastestMove:
    return request.getfixturevalue(request.param)


def formula(move: FastestMove, t: np.ndarray) -> np.ndarray:
    """Position, velocity and acceleration by integrating the segments' polynomials one after the other."""
    found = np.zeros((3, len(t)))
    p = v = 0.0
    for segment in move.segments:
        h = np.clip(t - segment.start, 0.0, segment.duration)
        inside = t >= segment.start
        a, j = segment.acceleration, segment.jerk
        found[0][inside] = (p + v * h + a * h**2 / 2.0 + j * h**3 / 6.0)[inside]
        found[1][inside] = (v + a * h + j * h**2 / 2.0)[inside]
        found[2][inside] = (a + j * h)[inside]
        h = segment.duration
        p, v = p + v * h + a * h**2 / 2.0 + j * h**3 / 6.0, v + a * h + j * h**2 / 2.0
    found[:, t >= move.duration] = [[move.distance], [0.0], [0.0]]
    return found


def test_the_component_is_the_formula(move):
    component = MotionProfile(**move.start_values(), start_time=0.1)
    component.initialize()
    times = np.linspace(0.0, 1.2 * move.duration, 400)
    rows: list[tuple[float, float, float]] = []
    for before, now in pairwise(times):
        component.do_step(before, now - before)
        rows.append((component.position, component.velocity, component.acceleration))
    expected = formula(move, times[1:] - 0.1)
    expected[:, times[1:] < 0.1] = 0.0
    found = np.array(rows).T
    assert found == pytest.approx(expected, abs=1e-12)


def test_the_python_object_and_the_profile_of_the_same_name_are_the_formula(move):
    t = np.linspace(0.0, 1.1 * move.duration, 301)
    expected = formula(move, t)
    assert np.array([move.position(t), move.velocity(t), move.acceleration(t)]) == pytest.approx(expected, abs=1e-12)
    values = {name: value for name, value in move.start_values().items() if name not in ("profile", "distance")}
    law = profile("fastest", move.distance, **values)
    assert law.duration == move.duration
    assert np.array([law.position(t), law.velocity(t), law.acceleration(t)]) == pytest.approx(expected, abs=1e-11)
    assert law.peak_velocity == pytest.approx(move.peak_velocity, rel=1e-12)
    assert law.peak_acceleration == pytest.approx(move.peak_acceleration, rel=1e-12)
    for w, zeta in ((W, ZETA), (9.0, 0.05), (7.0, 0.2)):  # by quadrature there, in closed form here
        assert law.residual_vibration(w, zeta) == pytest.approx(move.residual_vibration(w, zeta), abs=1e-12)


def test_events_are_the_switches_of_the_acceleration_and_kinks_those_of_the_jerk(move):
    component = MotionProfile(**move.start_values())
    component.initialize()
    inner = move.switch_times[1:-1]
    events, kinks, t = [], [], 0.0
    for until in [*inner, move.duration, move.duration + 1.0]:
        events.append(component.next_event_time)
        kinks.append(component.next_kink_time)
        component.do_step(t, until - t)
        t = until
    if move.order == 2:
        assert events == [*inner, move.duration, NO_EVENT]
        assert kinks == [*[move.duration] * (len(inner) + 1), NO_EVENT]
    else:
        assert events == [move.duration] * (len(inner) + 1) + [NO_EVENT]
        assert kinks[: len(inner)] == list(inner)


def test_compiled_it_gives_the_same_bits(move):
    compiled = Kernels(MotionProfile)
    component = MotionProfile(**move.start_values(), start_time=0.05)
    record = record_of(component)
    assert compiled.start(record) == (component.start() or 0) == 0
    for k in range(120):
        component.step(0.02 * k, 0.02)
        compiled.step(record, 0.02 * k, 0.02)
        assert record_of(component).tobytes() == record.tobytes()


@pytest.mark.parametrize("fmi", [2, 3])
@pytest.mark.parametrize("step", [0.001, 0.007, 0.05])
def test_through_fmus_nothing_vibrates_at_any_step(by_acceleration, fmi, step):
    """An oscillator driven by the acceleration: its envelope after the move over that of a step of the distance is V."""
    system = System()
    system.add("move", native_fmu("MotionProfile", fmi), **by_acceleration.start_values())
    system.add("plant", native_fmu("MassSpringDamper", fmi), stiffness=W * W, damping=2.0 * ZETA * W)
    system.connect_raw("move.acceleration", "plant.force", 1.0)  # of a plant of 1 kg
    results = system.simulate(2.5, step)
    t = results.time
    motion = np.array([results[f"move.{name}"] for name in ("position", "velocity", "acceleration")])
    assert motion == pytest.approx(formula(by_acceleration, t), abs=1e-12)
    x, v = results["plant.position"], results["plant.velocity"]
    wd = W * math.sqrt(1.0 - ZETA**2)
    envelope = np.hypot(x, (v + ZETA * W * x) / wd) * wd / (W * by_acceleration.distance)
    assert envelope[t < 1.0].max() > 0.1  # it does swing
    assert envelope[t > by_acceleration.duration].max() < 1e-9


@pytest.mark.parametrize("fmi", [2, 3])
@pytest.mark.parametrize("step", [0.001, 0.007, 0.05])
def test_through_fmus_a_move_with_limited_jerk_is_the_formula(by_jerk, fmi, step):
    system = System()
    system.add("move", native_fmu("MotionProfile", fmi), **by_jerk.start_values())
    results = system.simulate(1.5, step)
    motion = np.array([results[f"move.{name}"] for name in ("position", "velocity", "acceleration")])
    assert motion == pytest.approx(formula(by_jerk, results.time), abs=1e-12)


def refusal(move: FastestMove, **values) -> str:
    with pytest.raises(ComponentError) as caught:
        MotionProfile(**{**move.start_values(), **values}).initialize()
    return str(caught.value)


def test_what_is_no_move_is_refused_with_the_reason(by_acceleration):
    with pytest.raises(ComponentError, match="design fastest"):
        MotionProfile(profile="fastest").initialize()
    assert "distance = 2 m" in refusal(by_acceleration, distance=2.0)
    assert "distance = 0 m" in refusal(by_acceleration, distance=0.0)
    assert "max_velocity = 0.9" in refusal(by_acceleration, max_velocity=0.9)
    assert "max_acceleration = 2.9" in refusal(by_acceleration, max_acceleration=2.9)
    assert "must rise" in refusal(by_acceleration, segment_end=[0.3, 0.2])
    assert "do not end at rest" in refusal(by_acceleration, segment_acceleration=[3.1])
    MotionProfile(**by_acceleration.start_values(), max_velocity=1.0, max_acceleration=3.0).initialize()


def test_numbers_with_nine_digits_are_taken_and_arrive_exactly(by_acceleration):
    values = by_acceleration.start_values()
    rounded = {name: [float(f"{x:.9g}") for x in values[name]] for name in ("segment_end", "segment_acceleration")}
    component = MotionProfile(**{**values, **rounded})
    component.initialize()
    component.do_step(0.0, 2.0)
    assert (component.position, component.velocity, component.moving) == (1.0, 0.0, False)


def test_the_profile_takes_the_time_that_it_needs():
    with pytest.raises(ArgumentError, match="leave the duration out"):
        profile("fastest", 1.0, 2.0, max_acceleration=3.0)
    with pytest.raises(ArgumentError, match="max_jerk"):
        profile("cycloid", 1.0, 2.0, max_jerk=3.0)
