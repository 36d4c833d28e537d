"""The S-curve for several modes: no vibration of any, limits, and the shortest one."""

from __future__ import annotations

import math
import random

import numpy as np
import pytest
from compiled_kernels import Kernels, record_of
from hypothesis import given, settings
from hypothesis import strategies as st
from profile_cases import pieces
from scipy.integrate import solve_ivp

from shaper_fmu.commands.motion_profile import MotionProfile
from shaper_fmu.design import fastest_move, profile, shaper, shortest_s_curve
from shaper_fmu.errors import ArgumentError, ComponentError

SECOND, THIRD = (14.0, 0.02), (31.0, 0.3)
THREE = {
    "second_natural_frequency": SECOND[0], "second_damping_ratio": SECOND[1],
    "third_natural_frequency": THIRD[0], "third_damping_ratio": THIRD[1],
}  # fmt: skip
mode = st.tuples(st.floats(2.0, 40.0), st.floats(0.0, 0.8))


def parameters(second, third):
    names = ("second_natural_frequency", "second_damping_ratio", "third_natural_frequency", "third_damping_ratio")
    return dict(zip(names, (*second, *third), strict=True))


@settings(max_examples=60, deadline=None)
@given(mode, mode, mode, st.floats(0.5, 5.0), st.just(0.0) | st.floats(0.05, 0.5))
def test_nothing_is_left_of_any_of_three_modes(first, second, third, periods, segment):
    slowest = 2 * math.pi / min(first[0], second[0], third[0])
    law = profile("s_curve_modes", 1.0, periods * slowest, *first, **parameters(second, third), segment_time=segment * periods)
    size = max(1.0, law.peak_velocity * law.duration, law.peak_acceleration * law.duration**2 * 1e-2)
    for w, zeta in (first, second, third):
        assert law.residual_vibration(w, zeta) < 1e-12 * size


def test_an_oscillator_of_each_mode_rests_in_an_independent_integration():
    """scipy's DOP853 on x'' + 2 zeta w x' + w^2 x = -a(t), relative to the moved base."""
    law = profile("s_curve_modes", 0.4, 1.9, 5.0, 0.1, max_velocity=0.55, **THREE)
    for w, zeta in ((5.0, 0.1), SECOND, THIRD):
        x, largest = [0.0, 0.0], 0.0
        for begin, end in pieces(law):
            run = relative_motion(law, w, zeta, (begin, end), x)
            x, largest = run[:, -1].tolist(), max(largest, np.abs(run[0]).max())
        assert math.hypot(x[0], x[1] / w) < 1e-8 * largest


def relative_motion(law, w, zeta, span, x):
    """Displacement and speed over a piece of the move."""
    last = np.nextafter(span[1], 0.0)

    def slopes(t, x):
        return [x[1], -2 * zeta * w * x[1] - w * w * x[0] - float(law.acceleration(min(t, last)))]

    return solve_ivp(slopes, span, x, method="DOP853", rtol=1e-11, atol=1e-13).y


@pytest.mark.parametrize("zeta", [0.0, 0.3])
def test_with_one_mode_it_is_the_s_curve(zeta):
    for duration, limits in ((1.0, {}), (2.8, {"max_velocity": 0.5})):
        one, paper = (profile(kind, 1.0, duration, 5.0, zeta, **limits) for kind in ("s_curve_modes", "s_curve"))
        t = np.linspace(0.0, duration, 97)[:-1]
        for name in ("position", "velocity", "acceleration"):
            values = getattr(paper, name)(t)
            assert getattr(one, name)(t) == pytest.approx(values, abs=1e-12 * max(1.0, np.abs(values).max()))
        assert (one.peak_velocity, one.peak_acceleration) == pytest.approx(
            (paper.peak_velocity, paper.peak_acceleration), rel=1e-10
        )
        assert one.cruise_velocity == pytest.approx(paper.cruise_velocity)


def test_segments_far_longer_than_the_periods_rise_as_a_power_of_the_versine():
    """Then N(q) is all but constant, and s' = (2 sin(pi x)^2)^n over its mean: for two modes 2/3 (1 - cos 2 pi x)^2."""
    law = profile("s_curve_modes", 1.0, 400.0, 300.0, second_natural_frequency=700.0)
    tau, top = 100.0, 1.0 / (200.0 * 100.0)
    x = np.linspace(0.05, 0.95, 19)
    h = 1e-4
    slope = (law.acceleration((x + h) * tau) - law.acceleration((x - h) * tau)) / (2 * h) / top
    assert slope == pytest.approx(2 / 3 * (1 - np.cos(2 * math.pi * x)) ** 2, abs=1e-4)


def test_a_mode_given_twice_is_left_at_rest_although_its_frequency_is_wrong():
    """A double zero: V of an error e is proportional to e^2, of a single one to e."""
    once = profile("s_curve_modes", 1.0, 3.0, 5.0)
    twice = profile("s_curve_modes", 1.0, 3.0, 5.0, second_natural_frequency=5.0)
    for law, order in ((once, 1), (twice, 2)):
        small, large = (law.residual_vibration(5.0 * (1 + error)) for error in (1e-3, 2e-3))
        assert large / small == pytest.approx(2.0**order, rel=0.02)
    assert twice.residual_vibration(5.5) < 0.3 * once.residual_vibration(5.5)


# duration, mode, second mode, third natural frequency, segment time: swings far beyond cruise speed and acceleration, and a little
SWINGS = [
    (0.9, (5.0, 0.7), (7.0, 0.5), 0.0, 0.0),
    (0.6, (5.0, 0.0), (7.0, 0.0), 0.0, 0.0),
    (1.5, (5.0, 0.9), (9.0, 0.0), 0.0, 0.2),
    (0.8, (9.0, 0.1), (14.0, 0.0), 30.0, 0.0),
    (1.6, (5.0, 0.5), (9.0, 0.0), 0.0, 0.0),
    (0.86, (24.4, 0.48), (6.73, 0.0), 0.0, 0.0),  # swings back more than ahead, and so beyond V when it brakes
]


@pytest.mark.parametrize(("duration", "first", "second", "third", "segment"), SWINGS)
def test_peaks_of_strong_swings_are_those_of_a_dense_sampling(duration, first, second, third, segment):
    law = profile(
        "s_curve_modes",
        1.0,
        duration,
        *first,
        **parameters(second, (third, 0.0)),
        segment_time=segment,
    )
    t = np.unique(np.concatenate([np.linspace(a, np.nextafter(b, 0.0), 4001) for a, b in pieces(law)]))
    assert np.abs(law.velocity(t)).max() == pytest.approx(law.peak_velocity, rel=1e-5)
    assert np.abs(law.acceleration(t)).max() == pytest.approx(law.peak_acceleration, rel=1e-5)
    assert np.abs(law.velocity(t)).max() <= law.peak_velocity * (1 + 1e-12)


def test_the_acceleration_stays_between_the_segments():
    """Segments of 0.5 s within a speeding-up of 5.5 s: V = 1/(T - ta), A = V/(ta - tau)."""
    law = profile("s_curve_modes", 10.0, 15.5, 20.0, 0.05, max_velocity=1.0, segment_time=0.5, **THREE)
    assert law.ramp == pytest.approx(5.5)
    assert law.pieces == pytest.approx([0.0, 0.5, 5.0, 5.5, 10.0, 10.5, 15.0, 15.5])
    assert law.acceleration([0.5, 2.0, 4.99, 7.0, 12.0]) == pytest.approx([0.2, 0.2, 0.2, 0.0, -0.2], rel=1e-3, abs=1e-12)
    assert law.velocity([5.5, 8.0]) == pytest.approx([1.0, 1.0])
    assert law.residual_vibration(20.0, 0.05) < 1e-13


def test_compiled_it_gives_the_same_bits_with_three_modes():
    compiled, rng = Kernels(MotionProfile), random.Random(5)
    for _ in range(6):
        component = MotionProfile(
            profile="s_curve_modes", duration=rng.uniform(0.8, 6.0), damping_ratio=rng.choice([0.0, 0.1]), **THREE,
            segment_time=rng.choice([0.0, 0.2]), max_velocity=rng.uniform(0.5, 4.0), max_acceleration=rng.uniform(2.0, 20.0),
        )  # fmt: skip
        record = record_of(component)
        assert compiled.start(record) == (component.start() or 0)
        assert record_of(component).tobytes() == record.tobytes()
        for k in range(30 if component.ramp else 0):
            component.step(0.11 * k, 0.11)
            compiled.step(record, 0.11 * k, 0.11)
            assert record_of(component).tobytes() == record.tobytes()


# distance, speed, acceleration, modes; what s_curve for the first mode with ZV for the second takes [s]
TASKS = [
    (1.0, 1.0, 3.0, ((5.0, 0.0), (14.0, 0.0)), 2.1229),
    (1.0, 1.0, 3.0, ((20.0, 0.0), (45.0, 0.0)), 1.7365),
    (10.0, 1.0, 0.2, ((5.0, 0.0), (14.0, 0.0)), 20.2244),
    (-1.0, 1.0, 3.0, ((5.0, 0.05), (14.0, 0.1), (31.0, 0.03)), None),
]


@pytest.mark.parametrize(("distance", "speed", "hardness", "modes", "with_shaper"), TASKS)
def test_the_shortest_keeps_the_limits_and_no_segment_time_makes_a_shorter_one(distance, speed, hardness, modes, with_shaper):
    limits = {"max_velocity": speed, "max_acceleration": hardness}
    law = shortest_s_curve(distance, **limits, modes=modes)
    t = np.unique(np.concatenate([np.linspace(a, np.nextafter(b, 0.0), 500) for a, b in pieces(law)]))
    assert np.abs(law.velocity(t)).max() <= speed * (1 + 1e-12)
    assert np.abs(law.acceleration(t)).max() <= hardness * (1 + 1e-12)
    assert max(law.residual_vibration(w, zeta) for w, zeta in modes) < 1e-14
    further = parameters(modes[1], modes[2] if len(modes) > 2 else (0.0, 0.0))
    for tau in np.geomspace(0.1, 3.0, 7):
        other = profile("s_curve_modes", distance, None, *modes[0], **limits, **further, segment_time=tau)
        assert other.duration >= law.duration * (1 - 1e-6)
    if with_shaper is not None:
        paper = profile("s_curve", distance, None, *modes[0], **limits)
        assert paper.duration + shaper("zv", *modes[1]).duration == pytest.approx(with_shaper, abs=1e-4)
        assert law.duration < with_shaper
        assert law.duration > fastest_move(distance, **limits, modes=list(modes)).lower_bound


@pytest.mark.parametrize(
    ("arguments", "message"),
    [
        ({"modes": []}, "0 modes"),
        ({"modes": [1.0, 2.0, 3.0, 4.0]}, "4 modes; an S-curve takes 1 to 3"),
        ({"modes": [(5.0, 1.0)]}, "damping ratio"),
        ({"modes": [5.0], "max_velocity": 1e300}, "needs max_velocity and max_acceleration"),
        ({"modes": [5.0], "distance": 0.0}, "distance = 0.0"),
    ],
)
def test_impossible_arguments_are_refused(arguments, message):
    with pytest.raises(ArgumentError, match=message):
        shortest_s_curve(**{"distance": 1.0, "max_velocity": 1.0, "max_acceleration": 1.0, **arguments})


def test_a_damping_ratio_of_1_is_refused():
    with pytest.raises(ComponentError, match="second_damping_ratio"):
        profile("s_curve_modes", 1.0, 1.0, second_natural_frequency=9.0, second_damping_ratio=1.0)
