"""Motion profiles: their formulas, ends, jumps and derivatives."""

from __future__ import annotations

import math

import numpy as np
import pytest

from shaper_fmu.commands.motion_profile import MotionProfile, Profile
from shaper_fmu.component import NO_EVENT

W, ZETA, DISTANCE, DURATION, START = 22.9476, 0.0891, 0.4, 0.3, 0.1


def profile_at(times, **values):
    """Columns position, velocity, acceleration at these times, reached by one step each."""
    rows = []
    for t in times:
        profile = MotionProfile(
            **{
                "distance": DISTANCE,
                "duration": DURATION,
                "start_time": START,
                "natural_frequency": W,
                "damping_ratio": ZETA,
                **values,
            }
        )
        profile.initialize(0.0)
        profile.do_step(0.0, t)
        rows.append((profile.position, profile.velocity, profile.acceleration))
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


@pytest.mark.parametrize("kind", ["cycloid", "cycloid_versine_ramp", "two_part"])
def test_velocity_and_acceleration_are_the_derivatives(kind):
    h = 1e-5
    s = START + np.array([0.031, 0.077, 0.139, 0.1618, 0.22, 0.287])
    before, at, after = (profile_at(s + offset, profile=kind) for offset in (-h, 0.0, h))
    assert at[1] == pytest.approx((after[0] - before[0]) / (2 * h), rel=1e-5, abs=1e-6)
    assert at[2] == pytest.approx((after[1] - before[1]) / (2 * h), rel=1e-5, abs=1e-4)


@pytest.mark.parametrize("kind", list(Profile))
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
        ("cycloid", [START, START + DURATION]),
        ("cycloid_versine_ramp", [START, START + DURATION]),
        ("two_part", [START, START + DURATION / 2, START + DURATION]),
    ],
)
def test_jumps_are_announced(kind, expected):
    profile = MotionProfile(profile=kind, distance=DISTANCE, duration=DURATION, start_time=START, natural_frequency=W)
    profile.initialize(0.0)
    t, found = 0.0, []
    while profile.next_event_time < NO_EVENT:
        found.append(profile.next_event_time)
        profile.do_step(t, profile.next_event_time - t)
        t = found[-1]
    assert found == pytest.approx(expected, rel=1e-15)
    assert profile.position == DISTANCE


def test_a_step_at_once_is_there_at_the_start():
    profile = MotionProfile(profile="step", distance=3.0)
    profile.initialize(0.0)
    assert (profile.position, profile.moving) == (3.0, False)
