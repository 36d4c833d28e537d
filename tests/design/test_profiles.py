"""Motion profiles: their formulas, ends, jumps and derivatives, plain and compiled."""

from __future__ import annotations

import math
import random
from itertools import pairwise

import numpy as np
import pytest
from compiled_kernels import Kernels, record_of
from profile_cases import (
    BY_LIMITS,
    DISTANCE,
    DURATION,
    FORMULAS,
    JUMPING,
    SMOOTH,
    START,
    ZETA,
    W,
    events,
    paper_cycloid_versine_ramp,
    profile_at,
)

from shaper_fmu.commands.motion_profile import MotionProfile, ProfileKind
from shaper_fmu.component import NO_EVENT
from shaper_fmu.design.profiles import profile
from shaper_fmu.kinds.profiles import PROFILES

PERIOD = 2 * math.pi / W


def test_cycloid_versine_ramp_is_the_papers_formula():
    s = np.linspace(0.0, DURATION, 41)[1:-1]
    position, _, _ = profile_at(START + s, profile="cycloid_versine_ramp")
    assert position == pytest.approx(paper_cycloid_versine_ramp(s, DISTANCE, DURATION, W, ZETA), abs=1e-14)


def test_two_part_is_two_halves_in_series():
    s = np.linspace(0.0, DURATION / 2, 21)[1:-1]
    half = paper_cycloid_versine_ramp(s, DISTANCE / 2, DURATION / 2, W, ZETA)
    first, _, _ = profile_at(START + s, profile="two_part")
    second, _, _ = profile_at(START + DURATION / 2 + s, profile="two_part")
    assert first == pytest.approx(half, abs=1e-14)
    assert second == pytest.approx(DISTANCE / 2 + half, abs=1e-14)


# Taskin, Kilic and Kapucu 2019: shape of the reference for L = 1, as (height of the maximum, its place, the minimum after it)
@pytest.mark.parametrize(
    ("duration", "top", "place", "bottom"), [(0.1374496, 0.8281, 0.323, 0.3228), (0.1222, 0.9921, 0.306, 0.1665)]
)
def test_short_profiles_are_not_monotone_as_the_paper_shows(duration, top, place, bottom):
    s = np.linspace(0.0, duration, 4001)[1:-1]
    position, _, _ = profile_at(s, profile="cycloid_versine_ramp", distance=1.0, duration=duration, start_time=0.0)
    peak = int(np.argmax(position[: len(position) // 2]))
    assert position[peak] == pytest.approx(top, abs=5e-5)
    assert s[peak] / duration == pytest.approx(place, abs=5e-4)
    assert position[peak:].min() == pytest.approx(bottom, abs=5e-5)


@pytest.mark.parametrize("kind", [kind.name for kind in SMOOTH])
def test_velocity_and_acceleration_are_the_derivatives(kind):
    h = 1e-5
    s = START + np.array([0.031, 0.077, 0.1395, 0.1618, 0.22, 0.287])
    before, at, after = (profile_at(s + offset, profile=kind) for offset in (-h, 0.0, h))
    assert at[1] == pytest.approx((after[0] - before[0]) / (2 * h), rel=1e-5, abs=1e-6)
    assert at[2] == pytest.approx((after[1] - before[1]) / (2 * h), rel=1e-5, abs=1e-4)


@pytest.mark.parametrize("kind", FORMULAS)
def test_before_and_after_the_move_everything_rests(kind):
    before = profile_at([0.0, START - 1e-6], profile=kind)
    after = profile_at([START + DURATION, START + DURATION + 1.0], profile=kind)
    assert (before == 0.0).all()
    assert (after[0] == DISTANCE).all()
    assert (after[1:] == 0.0).all()


@pytest.mark.parametrize(
    ("kind", "expected"),
    [
        ("step", [START]),
        ("trapezoid", [START, START + DURATION / 3, START + DURATION * 2 / 3, START + DURATION]),
        ("polynomial_345", [START, START + DURATION]),
        ("s_curve", [START, START + DURATION]),
        ("cycloid", [START, START + DURATION]),
        ("cycloid_versine_ramp", [START, START + DURATION]),
        ("two_part", [START, START + DURATION]),
        ("cycloid_cruise", [START, START + DURATION]),
        ("constant_acceleration", [START, START + DURATION - PERIOD, START + PERIOD, START + DURATION]),
        ("exponential", [START, START + DURATION]),
    ],
)
def test_jumps_are_announced(kind, expected):
    component = MotionProfile(profile=kind, distance=DISTANCE, duration=DURATION, start_time=START, natural_frequency=W)
    found = events(component)
    assert found == pytest.approx(expected, rel=1e-15)
    assert component.position == DISTANCE


def test_a_step_at_once_is_there_at_the_start():
    component = MotionProfile(profile="step", distance=3.0)
    component.initialize(0.0)
    assert (component.position, component.moving) == (3.0, False)


def test_a_bang_bang_move_announces_its_one_switch():
    """max_acceleration = 4 L/T^2 is the least acceleration that moves L in T: full ahead, full astern."""
    component = MotionProfile(profile="trapezoid", distance=-2.0, duration=4.0, start_time=1.0, max_acceleration=0.5)
    assert events(component) == [1.0, 3.0, 5.0]


@pytest.mark.parametrize("kind", FORMULAS)
def test_an_event_within_rounding_of_a_communication_point_is_taken_from_the_right(kind):
    component = MotionProfile(profile=kind, duration=DURATION, start_time=START, natural_frequency=W, damping_ratio=ZETA)
    for event in events(component):
        rows = []
        for t in (event, event * (1 - 2e-15)):
            component.initialize(0.0)
            component.do_step(0.0, t)
            rows.append([component.position, component.velocity, component.acceleration, component.next_event_time])
        assert rows[1] == pytest.approx(rows[0], rel=1e-12, abs=1e-10)


@pytest.mark.parametrize("kind", FORMULAS)
def test_each_kind_compiled_gives_the_same_bits(kind):
    compiled = Kernels(MotionProfile)
    rng = random.Random(int(kind))
    jumping = kind == ProfileKind.step or kind in JUMPING
    statuses = set()
    for i in range(24):
        limits = {} if kind == ProfileKind.step and i % 2 else {"max_velocity": rng.uniform(0.5, 4.0)}
        limits |= {} if jumping and i % 4 else {"max_acceleration": rng.uniform(2.0, 20.0)}
        component = MotionProfile(profile=kind, duration=rng.uniform(0.2, 3.0), damping_ratio=rng.choice([0.0, 0.1, 0.8]), **limits)
        record = record_of(component)
        statuses.add(component.start() or 0)
        assert compiled.start(record) == (component.start() or 0)
        assert record_of(component).tobytes() == record.tobytes()
        for k in range(30 if component.ramp or kind not in BY_LIMITS else 0):
            component.step(0.11 * k, 0.11)
            compiled.step(record, 0.11 * k, 0.11)
            assert record_of(component).tobytes() == record.tobytes()
    assert len(statuses) > 1


def test_polynomial_345_is_the_cam_designers():
    """y = L (10 u^3 - 15 u^4 + 6 u^5): zero velocity and acceleration at the ends, peaks 15/8 L/T and 10/sqrt(3) L/T^2."""
    polynomial = np.polynomial.Polynomial([0, 0, 0, 10, -15, 6])
    law = profile("polynomial_345", 2.0, 4.0)
    t = np.linspace(0.0, 4.0, 33)[:-1]
    assert law.position(t) == pytest.approx(2.0 * polynomial(t / 4.0), abs=1e-14)
    assert law.velocity(t) == pytest.approx(2.0 * polynomial.deriv()(t / 4.0) / 4.0, abs=1e-14)
    assert law.acceleration(t) == pytest.approx(2.0 * polynomial.deriv(2)(t / 4.0) / 16.0, abs=1e-14)
    assert law.peak_velocity == pytest.approx(2.0 * 15 / 8 / 4.0)
    assert law.peak_acceleration == pytest.approx(2.0 * 10 / math.sqrt(3) / 16.0)


# distance 1.2 m in 1 s at up to 2 m/s cruises; in 2 s it does not reach 2 m/s
@pytest.mark.parametrize(("distance", "duration", "speed"), [(1.2, 1.0, 2.0), (1.2, 0.9, 2.0), (1.2, 2.0, 2.0)])
def test_s_curve_is_the_papers(distance, duration, speed):
    """Ozokutan et al. 2025, eqs. (15)-(24): velocities and positions at the segments' ends; w = 60 rad/s."""
    period = 2 * math.pi / 60.0
    tau, cruise = (duration * speed - distance) / (2 * speed), duration - 2 * (duration * speed - distance) / speed
    a = speed / tau
    if cruise < 0:
        tau, cruise, a = duration / 4, 0.0, distance / (2 * (duration / 4) ** 2)
    a2 = a * (1 - period**2 / tau**2)
    law = profile("s_curve", distance, duration, 60.0, max_velocity=speed)
    ends = np.array([tau, 2 * tau, 2 * tau + cruise, 3 * tau + cruise])
    velocities = [a * tau / 2, a * tau, a * tau, a * tau / 2]
    first = a * tau**2 / 6 - a2 * tau**2 / (4 * math.pi**2)
    fourth = 5 * a * tau**2 / 6 + a * tau * (cruise + tau) + a2 * tau**2 / (4 * math.pi**2)
    assert law.velocity(ends) == pytest.approx(velocities, rel=1e-12)
    assert law.position(ends) == pytest.approx([first, a * tau**2, a * tau * (cruise + tau), fourth], rel=1e-12)
    assert a * tau * (cruise + 2 * tau) == pytest.approx(distance)
    u = np.linspace(0.0, tau, 23)[1:-1]
    segment = a * u / tau - a2 / (2 * math.pi) * np.sin(2 * math.pi * u / tau)  # eq. (11)
    for begin, expected in zip([0.0, *ends], [segment, a - segment, None, -segment, segment - a], strict=True):
        if expected is not None:
            assert law.acceleration(begin + u) == pytest.approx(expected, abs=1e-11 * a)
    assert law.cruise_velocity == pytest.approx(a * tau)


def test_trapezoid_takes_thirds_unless_a_limit_forbids_it():
    """1 m in 3 s: thirds need 0.5 m/s and 0.5 m/s2; 0.4 m/s asks for ramps of T - L/V = 0.5 s; 4/9 m/s2 for bang-bang."""
    for limits, ramp, speed in (
        ({}, 1.0, 0.5),
        ({"max_velocity": 0.4}, 0.5, 0.4),
        ({"max_velocity": 0.6, "max_acceleration": 0.6}, 1.0, 0.5),
        ({"max_acceleration": 4 / 9 * (1 + 1e-14)}, 1.5, 2 / 3),
    ):
        law = profile("trapezoid", 1.0, 3.0, **limits)
        assert law.ramp == pytest.approx(ramp, rel=1e-6)
        assert law.peak_velocity == pytest.approx(speed, rel=1e-6)
        assert law.velocity(1.5) == pytest.approx(speed, rel=1e-6)


@pytest.mark.parametrize("kind", [kind.name for kind in FORMULAS])
def test_what_is_declared_as_constant_between_jumps_is_and_nothing_else(kind):
    """By the component itself, at points well within the pieces between its announced events."""
    component = MotionProfile(profile=kind, distance=DISTANCE, duration=DURATION, start_time=START, natural_frequency=W)
    component.initialize()
    ends = [0.0]
    while component.next_event_time < NO_EVENT:
        ends.append(component.next_event_time)
        component.do_step(ends[-2], ends[-1] - ends[-2])
    varies = np.zeros(3, bool)
    for begin, end in pairwise([*ends, ends[-1] + DURATION]):
        values = profile_at(begin + (end - begin) * np.array([0.03, 0.1, 0.3, 0.6, 0.9, 0.97]), profile=kind)
        varies |= np.ptp(values, axis=1) > 1e-9
    names = np.array(["position", "velocity", "acceleration"])
    assert set(names[~varies]) == set(PROFILES[kind].constant)
