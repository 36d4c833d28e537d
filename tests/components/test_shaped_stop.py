"""The component ShapedStop: limits, rest, least time against linear programmes, stops by travel, measured swings, errors in words."""

from __future__ import annotations

import math
import random
import re
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from operated_drives import GRAVITY, Drive, Optimum, kernels, swing_after, swing_integrated

from shaper_fmu.commands.shaped_stop import TOO_FAST, ShapedStop
from shaper_fmu.component import NO_EVENT
from shaper_fmu.errors import ComponentError

LIMITS = {"max_speed": 1.0, "max_acceleration": 0.5, "stop_deceleration": 0.8}


def check_limits(drive: Drive, pull: float) -> None:
    """No speed and no acceleration that has left the drive is beyond its limit, not by the last digit."""
    assert max(map(abs, drive.speeds)) <= drive["max_speed"]
    assert max((abs(level) for _, level in drive.pieces), default=0.0) <= pull


def swing_left(drive: Drive) -> float:
    """Amplitude [rad] of the linear pendulum at the end, by the matrix exponential."""
    length = drive["rope_length"]
    w, zeta = math.sqrt(drive["gravity"] / length), drive["damping_ratio"]
    angle, rate = swing_after(drive.pieces, w, zeta, drive["initial_angle"], drive["initial_rate"], length)
    return math.hypot(angle, (rate + zeta * w * angle) / (w * math.sqrt(1.0 - zeta * zeta)))


states = {
    "speed": st.floats(-1.0, 1.0),
    "target": st.one_of(st.sampled_from([0.0, 1.0, -1.0]), st.floats(-1.0, 1.0)),
    "amplitude": st.one_of(st.just(0.0), st.floats(1e-6, 3.0)),
    "phase": st.floats(-math.pi, math.pi),
    "length": st.floats(0.5, 30.0),
    "pull": st.floats(0.1, 2.0),
    "zeta": st.one_of(st.just(0.0), st.floats(0.0, 0.4)),
    "top": st.floats(0.2, 4.0),
    "overshoot": st.sampled_from([0.0, 0.1, 10.0]),
    "how": st.sampled_from(["time", "braking", "travel", "target"]),
}


@pytest.mark.parametrize("count", [100, pytest.param(1000, marks=pytest.mark.thorough)])
def test_from_any_speed_and_swing_the_limits_are_kept_and_the_load_rests(count):
    """1,000 random states."""
    settings(max_examples=count, deadline=None)(given(**states)(limits_are_kept_and_the_load_rests))()


def limits_are_kept_and_the_load_rests(speed, target, amplitude, phase, length, pull, zeta, top, overshoot, how):
    """Speeds to both ends, swings up to 3 times what half a swing at the limits takes away, or 1 rad; the
    linear pendulum rests to 1e-10 rad."""
    w = math.sqrt(GRAVITY / length)
    amplitude = min(1.0, amplitude * min(top, pull / w) / (w * length))
    drive = Drive(max_speed=top, max_acceleration=pull, stop_deceleration=pull, overshoot=overshoot, damping_ratio=zeta,
                  rope_length=length, initial_speed=top * speed, initial_angle=amplitude * math.cos(phase),
                  initial_rate=w * amplitude * math.sin(phase), target_speed=top * target, stop=how != "target",
                  criterion="time" if how == "target" else how)  # fmt: skip
    end = drive["rest_time"]
    drive.step(end + 1.0)
    check_limits(drive, pull)
    assert drive["settled"]
    assert drive["speed"] == (top * target if how == "target" else 0.0)
    assert swing_left(drive) < 1e-10
    travelled = np.cumsum([time * level for time, level in drive.pieces])
    assert top * speed + travelled[-1] == pytest.approx(drive["speed"], abs=1e-11 * top)


@settings(max_examples=60, deadline=None)
@given(
    st.lists(st.tuples(st.integers(1, 80), st.integers(-4, 4), st.booleans()), min_size=1, max_size=12),
    st.sampled_from(["time", "braking", "travel"]),
)
def test_buttons_pressed_and_released_at_any_time(presses, criterion):
    """Commands beyond the limit, stops in the middle of swings, at communication points 0.1 s apart."""
    drive = Drive(rope_length=8.0, criterion=criterion, **LIMITS)
    for steps, speed, stop in presses:
        for _ in range(steps):
            drive.step(drive.time + 0.1, target_speed=0.3 * speed, stop=stop)
            assert abs(drive["acceleration"]) <= (0.8 if stop else 0.5)
    drive.step(drive["rest_time"] + 0.1)
    check_limits(drive, 0.8)
    steps, speed, stop = presses[-1]
    assert drive["speed"] == (0.0 if stop else max(-1.0, min(1.0, 0.3 * speed)))
    assert swing_left(drive) < 1e-10


def test_the_rest_is_that_of_an_integrator_too():
    """The linear pendulum by DOP853 at 1e-12: 0.3 rad, taken away while the drive stops."""
    drive = Drive(rope_length=6.0, initial_speed=0.9, initial_angle=0.3, initial_rate=-0.2, stop=True, **LIMITS)
    drive.step(drive["rest_time"])
    found = swing_integrated(drive.pieces, 6.0, 0.3, -0.2, linear=True)
    assert found == pytest.approx((0.0, 0.0), abs=1e-10)


def random_case(seed: int) -> dict[str, Any]:
    """Speeds within 0.9 of the limit, to any target; swings up to what two half swings at the limit take away."""
    rng = random.Random(seed)
    length, pull, top = rng.uniform(1.0, 20.0), rng.uniform(0.2, 1.0), rng.uniform(0.3, 3.0)
    amplitude = rng.choice([0.0, rng.uniform(0.0, 2.0)]) * pull / GRAVITY
    phase = rng.uniform(-math.pi, math.pi)
    return {
        "rope_length": length,
        "max_acceleration": pull,
        "max_speed": top,
        "overshoot": 2.0 * top,
        "damping_ratio": rng.choice([0.0, 0.0, 0.05, 0.2]),
        "initial_speed": rng.uniform(-0.9, 0.9) * top,
        "target_speed": rng.choice([0.0, rng.uniform(-0.9, 0.9) * top]),
        "initial_angle": amplitude * math.cos(phase),
        "initial_rate": amplitude * math.sin(phase) * math.sqrt(GRAVITY / length),
    }


def excess(case: dict[str, Any]) -> float:
    """By which share the plan is longer than the shortest that linear programmes find."""
    length, top = case["rope_length"], case["max_speed"]
    low, high = min(case["initial_speed"], case["target_speed"]), max(case["initial_speed"], case["target_speed"])
    over = case["overshoot"]
    optimum = Optimum(math.sqrt(GRAVITY / length), case["damping_ratio"], case["max_acceleration"], max(-top, low - over),
                      min(top, high + over))  # fmt: skip
    shortest = optimum.time(
        case["initial_speed"], case["target_speed"], length * case["initial_angle"], length * case["initial_rate"]
    )
    found = Drive(**case)["rest_time"]
    assert found >= shortest * (1.0 - 2e-3), "no plan is faster than the fastest"
    return found / shortest - 1.0


@pytest.mark.parametrize("count", [12, pytest.param(100, marks=pytest.mark.thorough)])
def test_least_time_is_that_of_linear_programmes(count):
    """Of 120 cells, to 0.1 %: speeds that do not begin or end at the limit."""
    found = np.array([excess(random_case(seed)) for seed in range(count)])
    print(f"median {np.median(found):.4f}, 90 % below {np.quantile(found, 0.9):.4f}, worst {found.max():.4f}")
    assert found.max() < 1e-3


@pytest.mark.parametrize("count", [12, pytest.param(100, marks=pytest.mark.thorough)])
def test_with_speeds_held_at_the_limit_a_plan_is_seldom_longer(count):
    """From one end of the speed's range to rest or to the other end, with and without overshoot."""
    found = []
    for seed in range(count):
        case, sign = random_case(seed), 1.0 if seed % 2 else -1.0
        ends = {"initial_speed": sign * case["max_speed"], "target_speed": -sign * (seed % 3) / 2 * case["max_speed"]}
        found.append(excess({**case, **ends, "overshoot": 0.0 if seed % 5 else 9.0}))
    print(f"median {np.median(found):.4f}, 90 % below {np.quantile(found, 0.9):.4f}, worst {max(found):.4f}")
    assert np.median(found) < 1e-3
    assert max(found) < 0.25


@pytest.mark.parametrize(("speed", "hull"), [(0.1, 2.20), (0.5, 2.60), (1.0, 3.10), (2.0, 3.93), (4.0, 5.12)])
def test_a_load_that_hangs_still_needs_less_than_a_ramp_through_zv(speed, hull):
    """Stops in units of w = 1 rad/s and a = 1 m/s2, speeds between 0 and the first; the ramp through ZV takes speed + pi."""
    optimum = Optimum(1.0, 0.0, 1.0, 0.0, speed)
    shortest = optimum.time(speed, 0.0, 0.0, 0.0)
    assert shortest == pytest.approx(hull, abs=0.01)
    found = Drive(gravity=5.0, max_speed=10.0, stop_deceleration=1.0, initial_speed=speed, stop=True, criterion="time")["rest_time"]
    assert shortest * (1.0 - 2e-3) <= found <= shortest * 1.02
    assert found < 0.78 * (speed + math.pi)


@pytest.mark.parametrize("speed", [1.0, -0.7, 0.2])
@pytest.mark.parametrize("angle", [0.0, 0.01])
def test_a_stop_by_braking_never_accelerates_and_is_the_fastest_that_does_not(speed, angle):
    """Linear programmes with accelerations of one sign; undamped, a swing of 0.01 rad is less than the speed takes away."""
    drive = Drive(criterion="braking", rope_length=7.0, initial_speed=speed, initial_angle=angle, stop=True, **LIMITS)
    drive.step(drive["rest_time"])
    assert all(level * speed <= 0.0 for _, level in drive.pieces)
    assert swing_left(drive) < 1e-12
    lowest = Optimum(math.sqrt(GRAVITY / 7.0), 0.0, (-0.8, 0.0) if speed > 0.0 else (0.0, 0.8), -1.0, 1.0)
    assert drive["rest_time"] == pytest.approx(lowest.time(speed, 0.0, 7.0 * angle, 0.0), rel=2e-3)


def test_a_swing_that_braking_cannot_take_away_is_taken_away_all_the_same():
    """0.2 rad on 7 m swing at 1.66 m/s; the 0.2 m/s there are to brake are too little."""
    drive = Drive(criterion="braking", rope_length=7.0, initial_speed=0.2, initial_angle=0.2, stop=True, **LIMITS)
    drive.step(drive["rest_time"])
    assert any(level > 0.0 for _, level in drive.pieces)
    assert swing_left(drive) < 1e-12


@pytest.mark.parametrize("speed", [1.0, -0.7, 0.2])
@pytest.mark.parametrize("angle", [0.0, 0.1, -0.25])
def test_a_stop_by_travel_goes_no_farther_than_braking_does(speed, angle):
    """v^2/2a, which nothing that brakes from v can be below; then back, and the load rests."""
    drive = Drive(criterion="travel", rope_length=7.0, initial_speed=speed, initial_angle=angle, stop=True, **LIMITS)
    drive.step(drive["rest_time"])
    place, now, farthest = 0.0, speed, 0.0
    for time, level in drive.pieces:
        place += time * (now + 0.5 * level * time)
        now += time * level
        farthest = max(farthest, place * math.copysign(1.0, speed))
    assert farthest == pytest.approx(speed * speed / 1.6, rel=1e-12)
    assert swing_left(drive) < 1e-12
    assert now == pytest.approx(0.0, abs=1e-12)


@pytest.mark.parametrize("step", [0.001, 0.007, 0.05, 0.35])
def test_the_plan_does_not_depend_on_the_communication_step(step):
    drive = Drive(rope_length=8.0, initial_angle=0.1, target_speed=0.8, **LIMITS)
    for i in range(round(14.0 / step)):
        drive.step((i + 1) * step)
    one = Drive(rope_length=8.0, initial_angle=0.1, target_speed=0.8, **LIMITS)
    one.step(14.0)
    jumps = [[k for i, k in enumerate(x.pieces) if i == 0 or k[1] != x.pieces[i - 1][1]] for x in (drive, one)]
    assert [level for _, level in jumps[0]] == [level for _, level in jumps[1]]
    assert swing_left(drive) < 1e-12


def test_the_mean_is_the_change_of_the_speed_and_events_are_announced():
    """On a grid of 50 ms that no event cuts: the means add up to the speed, the model's swing is that of the pieces."""
    stop = ShapedStop(target_speed=0.8, rope_length=8.0, **LIMITS)
    stop.initialize()
    total, events, k = 0.0, [], 0
    while not stop.settled:
        due = stop.next_event_time
        stop.do_step(0.05 * k, 0.05)
        k += 1
        total += 0.05 * stop.acceleration_mean
        assert stop.speed == pytest.approx(total, abs=1e-13)
        if stop.next_event_time != due:
            events.append(due)
    assert events == sorted(events)
    assert stop.next_event_time == NO_EVENT
    assert events[-1] == stop.rest_time


def test_the_models_swing_is_that_of_the_pendulum():
    drive = Drive(rope_length=8.0, damping_ratio=0.05, initial_angle=0.1, target_speed=0.8, **LIMITS)
    w = math.sqrt(GRAVITY / 8.0)
    for _ in range(20):
        drive.step(drive.time + 0.17)
        expected = swing_after(drive.pieces, w, 0.05, 0.1, 0.0, 8.0)
        assert [drive["model_angle"], drive["model_rate"]] == pytest.approx(expected.tolist(), abs=1e-13)


def test_inputs_that_come_after_the_initialization_count_from_the_begin():
    late = ShapedStop(initial_angle=0.1)
    late.initialize()
    late.rope_length = 9.0
    late.do_step(0.0, 0.0)
    early = ShapedStop(initial_angle=0.1, rope_length=9.0)
    early.initialize()
    assert late.rest_time == early.rest_time > 1.0


def test_a_measured_swing_that_is_left_is_taken_away():
    """The load swings by 0.05 rad, which nobody told; below swing_tolerance nothing moves."""
    drive = Drive(swing_source="measured", swing_tolerance=0.01, **LIMITS)
    drive.step(1.0, swing_angle=0.009)
    assert drive["settled"]
    assert drive.pieces[-1] == (1.0, 0.0)
    drive.step(1.5, swing_angle=0.05)
    w = math.sqrt(GRAVITY / 5.0)
    angle, rate = swing_after(drive.pieces[1:], w, 0.0, 0.05, 0.0, 5.0)
    assert not drive["settled"]
    drive.step(drive["rest_time"], swing_angle=angle, swing_rate=rate)
    found = swing_after(drive.pieces[1:], w, 0.0, 0.05, 0.0, 5.0)
    assert found == pytest.approx([0.0, 0.0], abs=1e-12)


def test_left_limits_leave_the_switch_to_the_step_that_follows():
    stop = ShapedStop(target_speed=0.8, rope_length=8.0, **LIMITS)
    stop.initialize()
    due, before = stop.next_event_time, stop.acceleration
    stop.do_step(0.0, due, left_limits=True)
    assert stop.acceleration == before
    stop.do_step(due, 0.0)
    assert stop.acceleration == pytest.approx(-before)


def test_what_cannot_be_done_is_told():
    with pytest.raises(ComponentError, match=r"initial_speed = 2 m/s is beyond max_speed = 1 m/s"):
        ShapedStop(initial_speed=2.0).initialize()
    assert kernels().start(Drive().record) != TOO_FAST
    words = r"takes a swing of 1 rad and 0 rad/s away within 16 swings on a rope of 5 m;.*stop_deceleration = 0\.12 m/s2"
    with pytest.raises(ComponentError, match=words):  # g 1 rad/(4 a) = 20.4 swings are needed, where 64 half swings would do
        ShapedStop(initial_angle=1.0, stop_deceleration=0.12, stop=True).initialize()
    Drive(initial_angle=1.0, stop_deceleration=0.16, stop=True)  # 15.3 swings


def test_a_long_ramp_begins_with_one():
    """100 s of ramp, 22 swings of 4.5 s: rest after little more than the ramp alone."""
    drive = Drive(max_speed=10.0, max_acceleration=0.1, target_speed=10.0)
    assert 100.0 <= drive["rest_time"] < 102.5
    drive.step(drive["rest_time"])
    check_limits(drive, 0.1)
    assert swing_left(drive) < 1e-11


@pytest.mark.parametrize("criterion", ["time", "braking", "travel"])
def test_the_page_tells_times_and_travels_of_stops(criterion):
    """The rows of the table in docs/stops.md, to the digits that it prints."""
    page = (Path(__file__).parents[2] / "docs" / "stops.md").read_text(encoding="utf-8")
    (row,) = re.findall(rf"^\|[^|]*`{criterion}`[^|]*\|(.* s, .* m .*)\|$", page, re.MULTILINE)
    found = []
    for speed, angle in [(1.0, 0.0), (0.3, 0.0), (1.0, 3.0), (1.0, -3.0)]:
        drive = Drive(criterion=criterion, rope_length=8.0, initial_speed=speed, initial_angle=math.radians(angle), stop=True)
        drive.step(drive["rest_time"])
        place, now, farthest = 0.0, speed, 0.0
        for time, level in drive.pieces:
            place += time * (now + 0.5 * level * time)
            now += time * level
            farthest = max(farthest, place)
        found.append((drive["rest_time"], farthest))
    printed = [tuple(float(text.split()[0]) for text in cell.split(",")) for cell in row.split("|")]
    assert np.array(found) == pytest.approx(np.array(printed), abs=0.0051)
