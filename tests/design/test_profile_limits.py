"""Motion profiles within limits of speed and acceleration."""

from __future__ import annotations

import math
import re

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from profile_cases import (
    BY_LIMITS,
    JUMPING,
    SMOOTH,
    events,
    pieces,
    root,
)

from shaper_fmu.commands.motion_profile import MotionProfile, ProfileKind
from shaper_fmu.design.profiles import Profile, profile
from shaper_fmu.errors import ComponentError
from shaper_fmu.profiles.s_curve import s_curve, s_curve_segment_time
from shaper_fmu.profiles.s_curve_limits import s_curve_peaks


def shortest_within(kind, speed, hardness, w, zeta) -> Profile:
    acceleration = {} if kind in JUMPING else {"max_acceleration": hardness}
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
    if kind not in BY_LIMITS:  # the others depend on the duration alone
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
@given(st.floats(0.2, 5.0), st.floats(0.2, 50.0), st.floats(2.0, 40.0), st.floats(0.0, 0.2))
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
    if kind not in JUMPING:
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
