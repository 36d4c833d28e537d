"""The component FeedbackInverse: the design's own inverse at its samples, whatever the communication step, and a loop with it."""

from __future__ import annotations

import math

import numpy as np
import pytest
from scipy.linalg import expm

from shaper_fmu import System, fmu_path
from shaper_fmu.commands.feedback_inverse import FeedbackInverse
from shaper_fmu.design.feedback_inverse import inverse_shaper
from shaper_fmu.errors import ComponentError

W, ZETA, H = 5.0, 0.1, 0.01
RANDOM = np.random.default_rng(20161).normal(size=400)


def started(**values) -> FeedbackInverse:
    one = FeedbackInverse(natural_frequency=W, damping_ratio=ZETA, sample_period=H, **values)
    one.initialize()
    return one


def test_what_it_calculates_is_the_design():
    one, design = started(), inverse_shaper(W, ZETA, H)
    assert one.samples == len(design.amplitudes) - 1
    shares = (design.amplitudes[0], design.amplitudes[1], design.amplitudes[-1])
    assert (one.direct_share, one.sample_share, one.last_share) == shares
    assert one.duration == pytest.approx(one.samples * H)
    gains = 1.0 / np.abs(design.response(np.linspace(0.5, 15.0, 100_001)))
    assert one.peak_gain == pytest.approx(gains.max(), rel=1e-7)
    zero = sum(a * np.exp(-k * H * W * complex(-ZETA, math.sqrt(1.0 - ZETA * ZETA))) for k, a in enumerate(design.amplitudes))
    assert abs(zero) < 1e-13


@pytest.mark.parametrize("parts", [1, 4, 7])
@pytest.mark.parametrize("initial", [0.0, 2.5])
def test_a_sampled_signal_passes_as_through_the_design(parts, initial):
    """The communication step is the sample period, or a part of it; set twice at one time, the last value counts."""
    one, expected = started(initial_measurement=initial), inverse_shaper(W, ZETA, H).running(initial)
    for k, value in enumerate(RANDOM):
        for set_value in (99.0, float(value)):
            one.measurement = set_value
            one.do_step(k * H, 0.0)
        assert one.feedback == pytest.approx(expected(value), rel=1e-10, abs=1e-10)
        held = one.feedback
        for part in range(parts):
            one.do_step(k * H + part * H / parts, H / parts)
            if part < parts - 1:
                assert one.feedback == held
    assert one.next_event_time == pytest.approx((len(RANDOM) + 1) * H)


def test_several_samples_in_a_step_see_the_held_or_the_linear_measurement():
    for slope in (0.0, 3.0):
        one, expected = started(), inverse_shaper(W, ZETA, H).running()
        one.measurement = 1.0
        one.measurement_slope = slope
        one.do_step(0.0, 0.5)
        found = [expected(1.0 + slope * k * H) for k in range(51)]
        assert one.feedback == pytest.approx(found[-1], rel=1e-10)


def test_left_limits_are_those_before_the_sample():
    one, other = started(), started()
    for each in (one, other):
        each.measurement = 1.0
        each.do_step(0.0, 0.0)
    before = one.feedback
    one.do_step(0.0, H, left_limits=True)
    assert (one.feedback, one.next_event_time) == (before, H)
    one.do_step(H, 0.0)
    other.do_step(0.0, H)
    assert one.feedback == other.feedback != before


def test_it_begins_at_any_time():
    """Samples are at multiples of the period, before 0 as well."""
    one = FeedbackInverse(natural_frequency=W, damping_ratio=ZETA, sample_period=H)
    one.initialize(-0.025)
    one.measurement = 1.0
    one.do_step(-0.025, 0.0)
    assert one.feedback == 0.0
    assert one.next_event_time == pytest.approx(-0.02)
    one.do_step(-0.025, 0.005)
    assert one.feedback == pytest.approx(1.0 / one.direct_share)


def test_at_rest_it_passes_what_it_gets():
    one = started(initial_measurement=0.3)
    one.measurement = 0.3
    one.do_step(0.0, 50.0)
    assert one.feedback == pytest.approx(0.3, rel=1e-12)


def test_without_the_inverse_it_samples():
    one = started(inverse=False)
    one.measurement = 1.0
    one.measurement_slope = 1.0
    one.do_step(0.0, 0.035)
    assert one.feedback == pytest.approx(1.03)


@pytest.mark.parametrize(
    ("values", "words"),
    [
        ({"sample_period": 1.0}, r"sample_period = 1 s: the shaper takes 1\.\d+ s; it must be 4 to 4096 samples"),
        ({"sample_period": 1e-5}, "it must be 4 to 4096 samples"),
        ({"natural_frequency": 1e-6}, "it must be 4 to 4096 samples"),
        ({"damping_ratio": 0.001, "sample_period": 0.1}, r"no stable inverse: the share at once is 0\.0\d+, that of each sample"),
        ({"damping_ratio": 0.0}, "damping_ratio"),
    ],
)
def test_what_has_no_stable_inverse_is_refused(values, words):
    with pytest.raises(ComponentError, match=words):
        FeedbackInverse(**{"natural_frequency": W, "damping_ratio": ZETA, "sample_period": H, **values}).initialize()


@pytest.mark.parametrize(
    ("t", "h", "words"), [(0.0, 1e5, "more than 1000000 samples in one"), (1e14, 0.1, "the time is too large")]
)
def test_endless_samples_are_refused(t, h, words):
    with pytest.raises(ComponentError, match=words):
        started().do_step(t, h)


def expected_position(push: float, until: float) -> np.ndarray:
    """x'' = force + gust of a mass of 1 kg behind a sampled PD controller (2.25, 2.4) with the inverse, by the matrix exponential."""
    grown = expm(np.array([[0.0, 1.0, 0.0], [0.0, 0.0, 1.0], [0.0, 0.0, 0.0]]) * H)[:2]
    inverse, state, found = inverse_shaper(W, ZETA, H).running(), np.zeros(2), []
    for k in range(round(until / H) + 1):
        found.append(state[0])
        force = -inverse(2.25 * state[0] + 2.4 * state[1]) + (push if 30 <= k < 80 else 0.0)
        state = grown @ np.append(state, force)
    return np.array(found)


@pytest.mark.parametrize("fmi", [2, 3])
@pytest.mark.parametrize("step", [H, H / 4])
def test_a_loop_with_it_is_the_sampled_loop(fmi, step):
    """Position and velocity pass an inverse each, which is linear: the same as one for what the controller makes of both."""
    system = System()
    for name in ("position_inverse", "velocity_inverse"):
        system.add(name, fmu_path("FeedbackInverse", fmi=fmi, platforms=["this"]))
    system.add(
        "controller", fmu_path("PositionController", fmi=fmi, platforms=["this"]), proportional_gain=2.25, derivative_gain=2.4
    )
    masses = {"mass": [1.0, 1e-9, 1e-9], "stiffness": [1e-4, 1e-4], "damping": [0.0, 0.0]}  # two of which weigh nothing
    system.add("stage", fmu_path("ThreeMassChain", fmi=fmi, platforms=["this"]), **masses)
    panel = {"presses": 2, "press_time": [0.3, 0.8, *range(1, 15)], "press_speed": [1.0] + [0.0] * 15}
    system.add("gust", fmu_path("OperatorPanel", fmi=fmi, platforms=["this"]), **panel)
    system.connect_raw("gust.speed", "stage.disturbance[1]")
    for name in ("position", "velocity"):
        system.connect(f"stage.{name}[1]", f"{name}_inverse.measurement")
        system.connect(f"{name}_inverse.feedback", f"controller.{name}")
    system.connect("controller.force", "stage.force")
    results = system.simulate(10.0, step, record=["stage.position[1]"])
    found = results["stage.position[1]"][:: round(H / step)]
    np.testing.assert_allclose(found, expected_position(1.0, 10.0), atol=3e-9)
