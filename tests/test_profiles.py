"""Motion profiles: their formulas, ends, jumps, derivatives, limits and residual vibration."""

from __future__ import annotations

import math
import random
import re
from itertools import pairwise

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from scipy.integrate import solve_ivp
from scipy.optimize import brentq

from shaper_fmu.commands.motion_profile import MotionProfile, ProfileKind
from shaper_fmu.component import NO_EVENT
from shaper_fmu.errors import ComponentError
from shaper_fmu.export.compile import jit, record_of
from shaper_fmu.profiles.design import Profile, profile
from shaper_fmu.profiles.s_curve import s_curve, s_curve_segment_time
from shaper_fmu.profiles.s_curve_limits import s_curve_peaks

W, ZETA, DISTANCE, DURATION, START = 22.9476, 0.0891, 0.4, 0.3, 0.1


def profile_at(times, **values):
    """Columns position, velocity, acceleration at these times, reached by one step each."""
    rows = []
    for t in times:
        component = MotionProfile(
            **{
                "distance": DISTANCE,
                "duration": DURATION,
                "start_time": START,
                "natural_frequency": W,
                "damping_ratio": ZETA,
                **values,
            }
        )
        component.initialize(0.0)
        component.do_step(0.0, t)
        rows.append((component.position, component.velocity, component.acceleration))
    return np.array(rows).T


def paper_cycloid_versine_ramp(s, distance, duration, w, zeta):
    """Taskin, Kilic and Kapucu 2019, part by part: ramp L1, cycloid L2, ramped versine L3."""
    rate = 2 * math.pi / duration
    r = rate / w
    cycloid, versine = distance * (1 - r**2), distance * 2 * zeta * r
    ramp = distance - cycloid - versine
    angle = rate * s
    return (ramp * angle + cycloid * (angle - np.sin(angle)) + versine * (angle + 1 - np.cos(angle))) / (2 * math.pi)


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


@pytest.mark.parametrize("kind", ["trapezoid", "cycloid", "polynomial_345", "cycloid_versine_ramp", "two_part"])
def test_velocity_and_acceleration_are_the_derivatives(kind):
    h = 1e-5
    s = START + np.array([0.031, 0.077, 0.139, 0.1618, 0.22, 0.287])
    before, at, after = (profile_at(s + offset, profile=kind) for offset in (-h, 0.0, h))
    assert at[1] == pytest.approx((after[0] - before[0]) / (2 * h), rel=1e-5, abs=1e-6)
    assert at[2] == pytest.approx((after[1] - before[1]) / (2 * h), rel=1e-5, abs=1e-4)


def events(component):
    """All event times that a component announces, stepping from each to the next, with a step of no length at each."""
    component.initialize(0.0)
    t, found = 0.0, []
    while component.next_event_time < NO_EVENT:
        found.append(component.next_event_time)
        component.do_step(t, component.next_event_time - t)
        t = found[-1]
        before = record_of(component)
        component.do_step(t, 0.0)
        assert record_of(component) == before
    return found


@pytest.mark.parametrize("kind", list(ProfileKind))
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


@pytest.mark.parametrize("kind", list(ProfileKind))
def test_an_event_within_rounding_of_a_communication_point_is_taken_from_the_right(kind):
    component = MotionProfile(profile=kind, duration=DURATION, start_time=START, natural_frequency=W, damping_ratio=ZETA)
    for event in events(component):
        rows = []
        for t in (event, event * (1 - 2e-15)):
            component.initialize(0.0)
            component.do_step(0.0, t)
            rows.append([component.position, component.velocity, component.acceleration, component.next_event_time])
        assert rows[1] == pytest.approx(rows[0], rel=1e-12, abs=1e-10)


# ---- the objects ----

FREQUENCY = 22.048710
"""First mode of the beam of Ozokutan, Karadag, Kapucu and Kutuk 2025 [rad/s]."""
PERIOD = 2 * math.pi / FREQUENCY
SMOOTH = [kind for kind in ProfileKind if kind != ProfileKind.step]

laws = st.builds(
    profile,
    st.sampled_from(SMOOTH),
    st.floats(0.01, 20.0) | st.floats(-20.0, -0.01),
    st.floats(0.3, 5.0),
    st.floats(5.0, 40.0),
    st.floats(0.0, 0.9),
)


def pieces(law):
    return list(pairwise(law.pieces))


def integral(values, begin, end, panels=6):
    """Gauss-Legendre over smooth `values`."""
    nodes, weights = np.polynomial.legendre.leggauss(30)
    edges = np.linspace(begin, end, panels + 1)
    return sum((b - a) / 2 * np.sum(weights * values((a + b) / 2 + (b - a) / 2 * nodes)) for a, b in pairwise(edges))


@settings(max_examples=80, deadline=None)
@given(laws)
def test_velocity_and_acceleration_are_derivatives_on_every_piece(law):
    """Their integrals over each smooth piece are the changes of position and velocity, just inside the piece's ends."""
    fastest = np.abs(law.velocity(np.linspace(0.0, law.duration, 400))).max()
    for begin, end in pieces(law):
        last = np.nextafter(end, 0.0)
        moved = law.position(last) - law.position(begin)
        assert integral(law.velocity, begin, last) == pytest.approx(moved, abs=2e-13 * fastest * law.duration)
        gained = law.velocity(last) - law.velocity(begin)
        hardest = np.abs(law.acceleration(np.linspace(begin, last, 100))).max()
        assert integral(law.acceleration, begin, last) == pytest.approx(gained, abs=2e-13 * (fastest + hardest * law.duration))


@settings(max_examples=80, deadline=None)
@given(laws, st.floats(-0.1, 1.1))
def test_all_is_continuous_away_from_the_declared_jumps(law, fraction):
    step = 1e-9 * law.duration
    samples = np.linspace(0.0, law.duration, 500)
    for t in [fraction * law.duration, *(end - step / 2 for end in law.pieces)]:
        if any(t - step <= jump <= t + 2 * step for jump in law.jumps):
            continue
        for values in (law.position, law.velocity, law.acceleration):
            assert abs(values(t + step) - values(t)) <= 1e-5 * np.abs(values(samples)).max() + 1e-12


@settings(max_examples=60, deadline=None)
@given(laws)
def test_what_is_declared_a_jump_is_one(law):
    for jump in law.jumps:
        before, after = np.nextafter(jump, -1.0), jump
        leap = [
            abs(v(after) - v(before)) / np.abs(v(np.linspace(0.0, law.duration, 300))).max()
            for v in (law.velocity, law.acceleration)
        ]
        assert max(leap) > 1e-5


@settings(max_examples=60, deadline=None)
@given(laws)
def test_the_distance_is_reached_exactly(law):
    assert law.position(law.duration) == law.distance
    assert law.position(np.nextafter(law.duration, 0.0)) == pytest.approx(
        law.distance, abs=1e-13 * (abs(law.distance) + law.peak_velocity * law.duration)
    )
    assert (law.position([-1.0, 0.0]) == 0.0).all()
    assert (law.velocity([-1.0, law.duration]) == 0.0).all()


@settings(max_examples=60, deadline=None)
@given(laws)
def test_peaks_are_those_of_a_dense_sampling(law):
    t = np.unique(np.concatenate([np.linspace(a, np.nextafter(b, 0.0), 1501) for a, b in pieces(law)]))
    assert np.abs(law.velocity(t)).max() == pytest.approx(law.peak_velocity, rel=2e-4)
    assert np.abs(law.velocity(t)).max() <= law.peak_velocity * (1 + 1e-12)
    if math.isfinite(law.peak_acceleration):
        assert np.abs(law.acceleration(t)).max() == pytest.approx(law.peak_acceleration, rel=2e-4)
        assert np.abs(law.acceleration(t)).max() <= law.peak_acceleration * (1 + 1e-12)
    else:
        assert law.kind in (ProfileKind.cycloid_versine_ramp, ProfileKind.two_part)


@pytest.mark.parametrize("kind", list(ProfileKind))
def test_the_object_is_the_component(kind):
    law = profile(kind, DISTANCE, DURATION, W, ZETA)
    t = np.linspace(-0.02, DURATION + 0.02, 47)
    expected = profile_at(t + 0.02, profile=kind, start_time=0.02)
    for values, row in zip((law.position, law.velocity, law.acceleration), expected, strict=True):
        assert values(t) == pytest.approx(row, rel=1e-9, abs=1e-9)


def test_a_step_as_an_object():
    law = profile("step", 3.0)
    assert (law.duration, law.jumps, law.peak_velocity, law.peak_acceleration) == (0.0, (0.0,), math.inf, math.inf)
    assert law.position([-1e-9, 0.0, 1.0]).tolist() == [0.0, 3.0, 3.0]
    assert law.residual_vibration(5.0, 0.3) == law.relative_residual(5.0, 0.3) == 1.0


# ---- compiled ----


@pytest.mark.parametrize("kind", list(ProfileKind))
def test_each_kind_compiled_gives_the_same_bits(kind):
    start, step = jit(MotionProfile, "start"), jit(MotionProfile, "step")
    rng = random.Random(int(kind))
    jumping = kind in (ProfileKind.step, ProfileKind.cycloid_versine_ramp, ProfileKind.two_part)
    statuses = set()
    for i in range(24):
        limits = {} if kind == ProfileKind.step and i % 2 else {"max_velocity": rng.uniform(0.5, 4.0)}
        limits |= {} if jumping and i % 4 else {"max_acceleration": rng.uniform(2.0, 20.0)}
        component = MotionProfile(profile=kind, duration=rng.uniform(0.2, 3.0), damping_ratio=rng.choice([0.0, 0.1, 0.8]), **limits)
        record = record_of(component)
        statuses.add(component.start() or 0)
        assert start(record[0]) == (component.start() or 0)
        assert record_of(component).tobytes() == record.tobytes()
        for k in range(30 if component.ramp or jumping or kind < ProfileKind.s_curve else 0):
            component.step(0.11 * k, 0.11)
            step(record[0], 0.11 * k, 0.11)
            assert record_of(component).tobytes() == record.tobytes()
    assert len(statuses) > 1


# ---- the formulas ----


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


# ---- limits ----


def root(function, low, high) -> float:
    return float(brentq(function, low, high, xtol=1e-14))  # pyright: ignore[reportArgumentType]


def shortest_within(kind, speed, hardness, w, zeta) -> Profile:
    acceleration = {} if kind in (ProfileKind.cycloid_versine_ramp, ProfileKind.two_part) else {"max_acceleration": hardness}
    return profile(kind, 1.5, None, w, zeta, max_velocity=speed, **acceleration)


@settings(max_examples=80, deadline=None)
@given(st.sampled_from(SMOOTH), st.floats(0.2, 5.0), st.floats(0.2, 50.0), st.floats(2.0, 40.0), st.floats(0.0, 0.7))
def test_limits_are_kept_at_the_shortest_duration_and_broken_below(kind, speed, hardness, w, zeta):
    law = shortest_within(kind, speed, hardness, w, zeta)
    assert law.duration == law.shortest_duration
    t = np.unique(np.concatenate([np.linspace(a, np.nextafter(b, 0.0), 600) for a, b in pieces(law)]))
    assert np.abs(law.velocity(t)).max() <= speed * (1 + 1e-12)
    if math.isfinite(law.peak_acceleration):
        assert np.abs(law.acceleration(t)).max() <= hardness * (1 + 1e-12)
    with pytest.raises(ComponentError, match=r"the shortest possible duration is [0-9.e+-]+ s"):
        profile(kind, 1.5, law.duration * (1 - 1e-9), w, zeta, law.max_velocity, law.max_acceleration)
    if kind not in (ProfileKind.trapezoid, ProfileKind.s_curve):  # these depend on the duration alone
        for shorter in law.duration * np.array([1 - 1e-9, 0.99, 0.9, 0.7, 0.5, 0.2]):
            other = profile(kind, 1.5, shorter, w, zeta)
            assert other.peak_velocity > speed or hardness < other.peak_acceleration < math.inf


@settings(max_examples=40, deadline=None)
@given(st.floats(0.2, 5.0), st.floats(0.2, 50.0))
def test_the_shortest_trapezoid_is_the_time_optimal_one(speed, hardness):
    """Bang-bang control of a double integrator with bounded speed: full acceleration, speed limit, full deceleration."""
    law = shortest_within(ProfileKind.trapezoid, speed, hardness, 10.0, 0.0)
    ramp = min(speed / hardness, math.sqrt(1.5 / hardness))
    expected = 2 * ramp + max(0.0, (1.5 - hardness * ramp**2) / speed)
    assert law.duration == pytest.approx(expected, rel=1e-12)
    assert law.peak_acceleration == pytest.approx(hardness, rel=1e-7)


@settings(max_examples=20, deadline=None)
@given(st.floats(0.2, 5.0), st.floats(0.2, 50.0), st.floats(2.0, 40.0), st.floats(0.0, 0.6))
def test_no_segment_time_makes_a_shorter_s_curve(speed, hardness, w, zeta):
    """Every choice of tau, also those that cruise below the limit, breaks a limit in a shorter time."""
    law = shortest_within(ProfileKind.s_curve, speed, hardness, w, zeta)
    for duration in law.duration * np.array([0.98, 0.8]):
        for tau in duration * np.array([0.02, 0.06, 0.1, 0.15, 0.2, 0.22, 0.24, 0.245, 0.25]):
            t = np.concatenate([begin + np.linspace(0.0, tau, 50) for begin in (0.0, tau, duration - 2 * tau, duration - tau)])
            rows = np.array([s_curve(s, duration, tau, w, zeta) for s in t.tolist()])
            assert 1.5 * np.abs(rows[:, 1]).max() > speed * 0.999 or 1.5 * np.abs(rows[:, 2]).max() > hardness * 0.999


@pytest.mark.parametrize("zeta", [0.0, 0.1, 0.5, 0.95])
@pytest.mark.parametrize("speed", [0.7, 4.0, 1e300])
def test_peaks_of_the_s_curve_fall_with_the_duration(zeta, speed):
    """So bisection finds the shortest duration; found by analysis for zeta = 0, scanned here."""
    durations = np.linspace(1.001 / speed if speed < 1e300 else 0.1, 20.0, 300).tolist()
    found = np.array([s_curve_peaks(d, s_curve_segment_time(d, speed), 3.0, zeta) for d in durations])
    assert (np.diff(found, axis=0) <= 1e-12 * found[1:]).all()


def test_peak_speed_of_cycloid_versine_ramp_is_not_monotone_and_the_shortest_duration_is_found():
    """Undamped and with Tn = 1 s, peak speed x (1 + |1 - x^2|) for x = 1/T: x^3 from x = 1 on, x (2 - x^2) below it.

    The crest of the latter, at x = sqrt(2/3), is 1.0887; so 1.05 m/s allows T = 1.05^(-1/3) s, and durations up to and
    from the two roots of x (2 - x^2) = 1.05 below 1, but not those between.
    """
    law = profile("cycloid_versine_ramp", 1.0, None, 2 * math.pi, max_velocity=1.05)
    assert law.duration == pytest.approx(1.05 ** (-1 / 3), rel=1e-14)
    speed = lambda x: x * (2 - x * x)  # noqa: E731
    gap_end, gap_start = (1 / root(lambda x: speed(x) - 1.05, *ends) for ends in ((0.3, 0.816), (0.817, 0.999)))
    for duration, possible in (
        (gap_start - 1e-9, True),
        (gap_start + 1e-9, False),
        (1.2, False),
        (gap_end - 1e-9, False),
        (gap_end + 1e-9, True),
    ):
        if possible:
            assert profile("cycloid_versine_ramp", 1.0, duration, 2 * math.pi, max_velocity=1.05).peak_velocity <= 1.05
        else:
            with pytest.raises(
                ComponentError, match=r"possible duration is 0.9838\d+ s, .* longer ones are possible from 1.4547\d+ s on"
            ):
                profile("cycloid_versine_ramp", 1.0, duration, 2 * math.pi, max_velocity=1.05)
    slow = profile("cycloid_versine_ramp", 1.0, None, 2 * math.pi, max_velocity=0.9)
    assert slow.duration == pytest.approx(1 / root(lambda x: speed(x) - 0.9, 0.3, 0.8), rel=1e-13)


@settings(max_examples=60, deadline=None)
@given(st.sampled_from(SMOOTH), st.floats(0.01, 100.0), st.floats(0.01, 100.0), st.floats(0.01, 30.0))
def test_the_duration_that_the_message_names_is_possible(kind, distance, speed, hardness):
    limits = {"max_velocity": speed}
    if kind not in (ProfileKind.cycloid_versine_ramp, ProfileKind.two_part):
        limits["max_acceleration"] = hardness
    with pytest.raises(ComponentError) as caught:
        profile(kind, distance, 1e-7, **limits)
    named = float(re.search(r"shortest possible duration is (\S+) s", str(caught.value))[1])  # pyright: ignore
    law = profile(kind, distance, named, **limits)
    assert law.shortest_duration <= named <= law.shortest_duration * (1 + 1.1e-8)
    assert law.shortest_duration == profile(kind, distance, None, **limits).duration


def test_the_message_of_the_component_names_a_round_duration():
    component = MotionProfile(profile="cycloid", distance=-1.0, duration=0.1, max_velocity=1.0)
    with pytest.raises(ComponentError, match=r"duration = 0.1 s is too short to move -1 m .* shortest possible duration is 2 s"):
        component.initialize()
    component.duration = 2.0
    component.initialize()
    assert component.shortest_duration == 2.0


@pytest.mark.parametrize(
    ("arguments", "message"),
    [
        ({"kind": "step", "duration": 1.0, "max_velocity": 1.0}, "a step keeps to no limit"),
        (
            {"kind": "two_part", "duration": 9.0, "max_acceleration": 5.0},
            "where the velocity jumps .* no acceleration limit is kept",
        ),
        ({"kind": "cycloid_versine_ramp", "max_acceleration": 5.0}, "no duration is long enough"),
        ({"kind": "cycloid"}, "without max_velocity and max_acceleration there is no shortest duration"),
        ({"kind": "cycloid", "distance": 0.0, "max_velocity": 1.0}, "a move over no distance"),
        ({"kind": "cicloid", "duration": 2.0}, "Did you mean 'cycloid'"),
        ({"kind": "cycloid", "duration": -2.0}, "duration = -2 s must be greater than 0 s"),
        ({"kind": "cycloid", "duration": math.inf}, "duration is inf"),
        ({"kind": "s_curve", "duration": 1.0, "max_velocity": 0.0}, "max_velocity = 0 m/s must be greater than 0"),
    ],
)
def test_impossible_input_is_refused(arguments, message):
    with pytest.raises(ComponentError, match=message):
        profile(**{"distance": 1.0, **arguments})


def test_a_speed_limit_alone_lets_the_trapezoid_become_a_ramp():
    """Unlimited acceleration: the shortest move is one at max_velocity throughout, L/v."""
    law = profile("trapezoid", 1.5, None, max_velocity=2.0)
    assert (law.duration, law.ramp, law.jumps) == (0.75, 0.0, (0.0, 0.75))
    assert (law.peak_velocity, law.peak_acceleration) == (2.0, math.inf)
    component = MotionProfile(profile="trapezoid", distance=1.5, duration=0.75, max_velocity=2.0)
    assert events(component) == [0.75]
    component.initialize()
    assert (component.velocity, component.acceleration) == (2.0, 0.0)
    component.do_step(0.0, 0.3)
    assert (component.position, component.velocity, component.acceleration) == (pytest.approx(0.6), 2.0, 0.0)


def test_limits_do_not_matter_to_a_move_over_no_distance():
    law = profile("cycloid", 0.0, 1e-3, max_velocity=1e-3, max_acceleration=1e-3)
    assert (law.shortest_duration, law.peak_velocity, law.peak_acceleration) == (0.0, 0.0, 0.0)


# ---- residual vibration ----


def residual_by_integration(law, w, zeta=0.0):
    """Envelope of x after the move of x'' + 2 zeta w x' + w^2 x = -y'', over that of a step at the same instant.

    scipy's DOP853, piece by piece. For zeta = 0 it is the amplitude of the relative displacement per distance.
    """
    x, last = [0.0, 0.0], 0.0
    for begin, end in pieces(law):
        inside = np.nextafter(end, 0.0)
        x[1] -= float(law.velocity(begin) - law.velocity(np.nextafter(begin, -1.0)))
        slopes = lambda t, x, inside=inside: [x[1], -2 * zeta * w * x[1] - w * w * x[0] - float(law.acceleration(min(t, inside)))]  # noqa: E731
        x = solve_ivp(slopes, (begin, end), x, method="DOP853", rtol=1e-10, atol=1e-11).y[:, -1]
        last = float(law.velocity(inside))
    x[1] += last
    wd = w * math.sqrt(1 - zeta**2)
    envelope = math.hypot(x[0], (x[1] + zeta * w * x[0]) / wd) * math.exp(zeta * w * law.duration)
    return envelope * math.sqrt(1 - zeta**2) / abs(law.distance)


@pytest.mark.parametrize("kind", SMOOTH)
def test_the_residual_is_that_of_an_integrated_oscillator(kind):
    law = profile(kind, -0.7, 0.9, 9.0, 0.05)
    for w, zeta in ((9.0, 0.0), (7.0, 0.2), (14.0, 0.05)):
        assert law.relative_residual(w, zeta) == pytest.approx(residual_by_integration(law, w, zeta), abs=1e-8)
        assert law.residual_vibration(w, zeta) == pytest.approx(
            law.relative_residual(w, zeta) * math.exp(-zeta * w * 0.9), rel=1e-12
        )


def test_the_residual_of_the_polynomial_is_exact():
    """|integral_0^T y' exp(j w t) dt| of 30 u^2 (1 - u)^2 in closed form: 60 |(12 - z^2) sin z/2 - 6 z cos z/2| 2/z^5, z = w T."""
    for z in (2.0, 5.0, 30.0, 200.0):
        exact = 120 / z**5 * abs((12 - z * z) * math.sin(z / 2) - 6 * z * math.cos(z / 2))
        assert profile("polynomial_345", 3.0, 2.0).residual_vibration(z / 2) == pytest.approx(exact, abs=1e-13)


# Ozokutan et al. 2025, the five durations of its figure 3: residual of 3-4-5 polynomial and of the S-curve with a beam 5 %
# stiffer [% of the distance], and V = A tau for 0.1 m [m/s]; first mode, undamped
DURATIONS = [
    (0.8, 62.085, 6.79, 0.8773),
    (1.25, 27.487, 3.40, 0.5615),
    (1.75, 2.266, 0.54, 0.4010),
    (2.25, 4.097, 0.61, 0.3119),
    (4.25, 0.538, 0.04, 0.1651),
]


@pytest.mark.parametrize(("periods", "polynomial", "stiffer", "speed"), DURATIONS)
def test_residuals_of_polynomial_and_s_curve(periods, polynomial, stiffer, speed):
    smooth = profile("s_curve", 0.1, periods * PERIOD, FREQUENCY)
    other = profile("polynomial_345", 0.1, periods * PERIOD)
    assert 100 * other.relative_residual(FREQUENCY) == pytest.approx(polynomial, abs=6e-4)
    assert 100 * smooth.relative_residual(FREQUENCY) < 1e-10
    assert 100 * smooth.relative_residual(1.05 * FREQUENCY) == pytest.approx(stiffer, abs=6e-3)
    assert smooth.cruise_velocity == pytest.approx(speed, abs=6e-5)
    assert 100 * residual_by_integration(smooth, FREQUENCY) < 1e-6
    assert 100 * residual_by_integration(smooth, 1.05 * FREQUENCY) == pytest.approx(stiffer, abs=6e-3)


def test_the_papers_actuator_limit_changes_nothing_where_the_s_curve_does_not_reach_it():
    """Vmax = 1 m/s, D = 0.1 m: T3 < 0 for all five durations, eqs. (23), (24)."""
    for periods, *_ in DURATIONS[1:]:
        free = profile("s_curve", 0.1, periods * PERIOD, FREQUENCY)
        assert profile("s_curve", 0.1, periods * PERIOD, FREQUENCY, max_velocity=1.0).ramp == free.ramp == free.duration / 4


def test_claims_about_the_s_curve():
    """Ozokutan et al. 2025: residual under 5 % from 0.8 Tn on (nominal), 3-4-5 only from about 3 Tn on."""
    durations = np.arange(0.8, 6.0, 0.05)
    assert max(profile("s_curve", 0.1, q * PERIOD, FREQUENCY).relative_residual(FREQUENCY) for q in durations) < 1e-12
    polynomial = [profile("polynomial_345", 0.1, q * PERIOD).relative_residual(FREQUENCY) for q in durations]
    late = durations[np.flatnonzero(np.array(polynomial) > 0.05)[-1]]
    assert 1.5 < late < 3.0
    assert max(r for q, r in zip(durations, polynomial, strict=True) if q >= 3.0) < 0.05


def test_short_s_curves_swing_beyond_the_papers_speed():
    """The paper's speeds are A tau, those at the segments' ends: 0.877 m/s for 0.05 m in 0.4 Tn. Within segments shorter than
    about 0.24 Tn the integral of eq. (11) gets larger, and so does the true peak."""
    short = profile("s_curve", 0.05, 0.4 * PERIOD, FREQUENCY)
    assert short.cruise_velocity == pytest.approx(0.877, abs=5e-4)
    x = np.linspace(0.0, 1.0, 100001)
    for law in (short, profile("s_curve", 0.1, 0.8 * PERIOD, FREQUENCY), profile("s_curve", 0.1, 1.0 * PERIOD, FREQUENCY)):
        a2 = 1 - (PERIOD / law.ramp) ** 2
        within = x**2 / 2 - a2 / (4 * math.pi**2) * (1 - np.cos(2 * math.pi * x))
        assert law.peak_velocity / law.cruise_velocity == pytest.approx(max(1.0, within.max()), rel=1e-8)
    assert short.peak_velocity > 4.5
    assert short.peak_acceleration > 10 * profile("s_curve", 0.05, 0.8 * PERIOD, FREQUENCY).peak_acceleration


@settings(max_examples=60, deadline=None)
@given(
    st.sampled_from(["cycloid_versine_ramp", "two_part", "s_curve"]),
    st.floats(0.3, 6.0),
    st.floats(2.0, 40.0),
    st.floats(0.0, 0.9),
    st.floats(0.0, 1.0),
)
def test_no_residual_on_the_design_mode_for_any_duration(kind, periods, w, zeta, cruise):
    """Taskin, Kilic and Kapucu 2019; Kilic and Kapucu 2011; Ozokutan et al. 2025, the latter here with damping too."""
    law = profile(kind, 1.0, periods * 2 * math.pi / w, w, zeta)
    assert law.residual_vibration(w, zeta) < 1e-13 * max(1.0, law.peak_velocity * law.duration)
    if kind == "s_curve" and cruise > 0.3:
        limited = profile(kind, 1.0, None, w, zeta, max_velocity=cruise * w)
        assert limited.residual_vibration(w, zeta) < 1e-13 * max(1.0, limited.peak_velocity * limited.duration)


@pytest.mark.parametrize(
    ("duration", "ramp", "cycloid", "versine"), [(0.1374496, 3.6133, -2.9682, 0.3550), (0.1222, 4.6212, -4.0205, 0.3993)]
)
def test_parts_and_residual_of_the_pulse_papers_reference(duration, ramp, cycloid, versine):
    """Taskin, Kilic and Kapucu 2019, for L = 1 and their plant: amplitudes of ramp, cycloid and ramped versine."""
    rate = 2 * math.pi / duration
    law = profile("cycloid_versine_ramp", 1.0, duration, W, ZETA)
    s = np.linspace(0.0, duration, 41)[:-1]
    parts = ramp * rate * s + cycloid * (rate * s - np.sin(rate * s)) + versine * (rate * s + 1 - np.cos(rate * s))
    assert law.position(s) == pytest.approx(parts / (2 * math.pi), abs=1e-4)
    assert law.relative_residual(W, ZETA) < 1e-14


# Kilic and Kapucu 2011: pendulum w = 5.5045 rad/s, zeta = 0.08, 0.09 m in 0.9703 s
# kind, band with V < 5 %, its width, V at 0.8, 0.9, 1.1, 1.2 times the design frequency [%], peak speed [m/s]
ROBUSTNESS = [
    ("cycloid_versine_ramp", (0.95135, 1.05238), 0.10103, (22.33, 10.610, 9.169, 16.66), 0.132),
    ("two_part", (0.90523, 1.23321), 0.32798, (13.82, 5.360, 2.282, 3.763), 0.515),
]


@pytest.mark.parametrize(("kind", "band", "width", "values", "speed"), ROBUSTNESS)
def test_robustness_of_single_and_two_part_command(kind, band, width, values, speed):
    law = profile(kind, 0.09, 0.9703, 5.5045, 0.08)
    residual = lambda ratio: law.residual_vibration(ratio * 5.5045, 0.08)  # noqa: E731
    assert residual(1.0) < 1e-14
    ends = [root(lambda ratio: residual(ratio) - 0.05, *bracket) for bracket in ((0.85, 1.0), (1.0, 1.3))]
    assert ends == pytest.approx(band, abs=6e-6)
    assert ends[1] - ends[0] == pytest.approx(width, abs=1.1e-5)
    assert [100 * residual(ratio) for ratio in (0.8, 0.9, 1.1, 1.2)] == pytest.approx(values, abs=6e-3)
    assert law.peak_velocity == pytest.approx(speed, abs=5e-4)


def test_the_two_part_command_overshoots_on_the_way():
    """Kilic and Kapucu 2011, from the paper's formula for the second half: about 3.26 % of L, where its speed is zero."""
    law = profile("two_part", 0.09, 0.9703, 5.5045, 0.08)
    half = paper_cycloid_versine_ramp(np.linspace(0.0, 0.9703 / 2, 200001), 0.5, 0.9703 / 2, 5.5045, 0.08)
    highest = law.position(np.linspace(0.0, 0.9703, 20001)).max() / 0.09
    assert highest == pytest.approx(0.5 + half.max(), abs=1e-7)
    assert highest == pytest.approx(1.0326, abs=2e-4)
