"""The profiles that the papers compare theirs with: what each leaves of its mode, and what it needs."""

from __future__ import annotations

import math

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from scipy.integrate import solve_ivp

from shaper_fmu.commands.motion_profile import MotionProfile
from shaper_fmu.design.profiles import profile
from shaper_fmu.errors import ComponentError
from shaper_fmu.kinds.profiles import PROFILES
from shaper_fmu.tune.choice.requirements import PROFILES as TRIED

APART = ["cycloid_cruise", "constant_acceleration", "trapezoidal_acceleration"]
ANY_DURATION = ["cycloid_ramp", "exponential"]


@settings(max_examples=60, deadline=None)
@given(st.sampled_from(APART + ANY_DURATION), st.floats(0.3, 8.0), st.floats(1.0, 40.0))
def test_nothing_is_left_of_an_undamped_mode(kind, periods, w):
    duration = 2 * math.pi / w * (periods if kind in ANY_DURATION else 1.01 + periods)
    law = profile(kind, 1.0, duration, w)
    assert law.residual_vibration(w) < 1e-12 * max(1.0, law.peak_velocity * law.duration)


@settings(max_examples=40, deadline=None)
@given(st.floats(0.3, 8.0), st.floats(1.0, 40.0), st.floats(0.0, 0.9))
def test_inverse_dynamics_leave_nothing_of_a_damped_mode_either(periods, w, zeta):
    law = profile("exponential", 1.0, periods * 2 * math.pi / w, w, zeta)
    assert law.residual_vibration(w, zeta) < 1e-12 * max(1.0, law.peak_velocity * law.duration)


def test_the_mode_follows_the_prescribed_output():
    """x'' + 2 zeta w x' + w^2 x = w^2 u, solved by scipy, is L (1 - exp(-40 (t/T)^3)) all the way."""
    w, zeta, distance, duration = 5.0, 0.1, 0.7, 1.9
    law = profile("exponential", distance, duration, w, zeta)
    slopes = lambda t, x: [x[1], w * w * (float(law.position(t)) - x[0]) - 2 * zeta * w * x[1]]  # noqa: E731
    times = np.linspace(0.0, duration, 60)
    found = solve_ivp(slopes, (0.0, duration), [0.0, 0.0], method="DOP853", t_eval=times, rtol=1e-11, atol=1e-12)
    assert found.y[0] == pytest.approx(distance * (1 - np.exp(-40 * (times / duration) ** 3)), abs=1e-9)


def test_a_ramp_leaves_what_its_sinc_says_and_nothing_at_whole_periods():
    """|integral_0^T exp(j w t)/T dt| = |sin(w T/2)|/(w T/2)."""
    for duration in (0.3, 1.1, 2.7):
        expected = abs(math.sin(2.5 * duration) / (2.5 * duration))
        assert profile("ramp", 2.0, duration).residual_vibration(5.0) == pytest.approx(expected, abs=1e-14)
    assert profile("ramp", 1.0, 3 * 2 * math.pi / 5.0).residual_vibration(5.0) < 1e-15


@pytest.mark.parametrize("zeta", [0.02, 0.3])
def test_the_versine_alone_will_do_for_one_duration(zeta):
    """Its cycloid's part, 1 - r^2, is 0 where the duration is the undamped period: then it is the whole profile."""
    period = 2 * math.pi / 7.0
    assert profile("versine_ramp", 1.0, period, 7.0, zeta).residual_vibration(7.0, zeta) < 1e-14
    assert profile("versine_ramp", 1.0, 0.8 * period, 7.0, zeta).residual_vibration(7.0, zeta) > 0.05
    whole = profile("cycloid_versine_ramp", 1.0, period, 7.0, zeta)
    t = np.linspace(0.0, period, 50)[:-1]
    assert profile("versine_ramp", 1.0, period, 7.0, zeta).position(t) == pytest.approx(whole.position(t), abs=1e-14)


def test_pulses_of_one_period_each_tolerate_the_frequency_better():
    """At T = 2 Tn each pulse leaves nothing by itself, and the second cancels it besides: V = (sin(x)/x)^2, x = pi w/w0."""
    law = profile("constant_acceleration", 1.0, 4 * math.pi / 5.0, 5.0)
    for ratio in (0.9, 1.05, 1.3):
        x = math.pi * ratio
        assert law.residual_vibration(5.0 * ratio) == pytest.approx((math.sin(x) / x) ** 2, abs=1e-14)
    assert (law.velocity(law.duration / 2), law.peak_velocity) == (pytest.approx(2 / law.duration), pytest.approx(2 / law.duration))


def test_without_a_cruise_the_cut_cycloid_is_the_cycloid():
    law, whole = profile("cycloid_cruise", 1.0, 4 * math.pi / 5.0, 5.0), profile("cycloid", 1.0, 4 * math.pi / 5.0)
    t = np.linspace(0.0, law.duration, 70)[:-1]
    for name in ("position", "velocity", "acceleration"):
        assert getattr(law, name)(t) == pytest.approx(getattr(whole, name)(t), abs=1e-12)


@pytest.mark.parametrize(("kind", "peak"), zip(APART, (math.pi / 2, 1.0, 1.5), strict=True))
def test_the_acceleration_is_that_of_a_pulse_within_whole_periods(kind, peak):
    """T = 1.7 Tn: pulses of 0.7 Tn, V = 1/Tn, A = c V/(0.7 Tn), with c the pulse's peak over its mean."""
    period = 2 * math.pi / 5.0
    law = profile(kind, 1.0, 1.7 * period, 5.0)
    assert law.ramp == pytest.approx(0.7 * period)
    assert (law.peak_velocity, law.peak_acceleration) == (pytest.approx(1 / period), pytest.approx(peak / (0.7 * period**2)))


@pytest.mark.parametrize("kind", APART)
def test_a_duration_of_a_period_or_less_is_refused(kind):
    for duration in (0.3, 2 * math.pi / 5.0):
        with pytest.raises(ComponentError, match=r"leaves the mode at rest only if it takes longer than 1\.256"):
            profile(kind, 1.0, duration, 5.0)
    profile(kind, 1.0, 2 * math.pi / 5.0 * 1.001, 5.0)


@settings(max_examples=60, deadline=None)
@given(st.sampled_from(APART), st.floats(0.05, 3.0), st.floats(0.05, 20.0))
def test_all_durations_that_limits_permit_are_known(kind, speed, hardness):
    """By brute force: of every duration, each whole number of periods apart, Tn = 1 s."""
    peak = {"cycloid_cruise": math.pi / 2, "constant_acceleration": 1.0, "trapezoidal_acceleration": 1.5}[kind]
    limits = {"max_velocity": speed, "max_acceleration": hardness}
    for duration in np.random.default_rng(3).uniform(1.02, 12.0, 60):
        possible = [
            n for n in range(1, 12) if 1 / n <= speed and n >= duration / 2 and duration - n >= max(peak / (n * hardness), 0.01)
        ]
        try:
            law = profile(kind, 1.0, duration, 2 * math.pi, **limits)
        except ComponentError:
            assert not possible
        else:
            assert possible
            assert law.peak_velocity <= speed * (1 + 1e-9)
            assert law.peak_acceleration <= hardness * (1 + 1e-9)


def test_a_gap_of_the_exponential_is_found():
    """Somewhat above the natural period a longer move needs more speed, as of cycloid + ramped versine + ramp."""
    law = profile("exponential", 1.0, None, 2 * math.pi, max_velocity=5.0)
    durations = np.linspace(0.3, 3.0, 60)
    fits = np.array([profile("exponential", 1.0, d, 2 * math.pi).peak_velocity <= 5.0 for d in durations])
    assert durations[np.argmax(fits)] == pytest.approx(law.duration, abs=0.05)
    for duration, possible in zip(durations, fits, strict=True):
        if possible:
            profile("exponential", 1.0, duration, 2 * math.pi, max_velocity=5.0)
        else:
            with pytest.raises(ComponentError, match="possible"):
                profile("exponential", 1.0, duration, 2 * math.pi, max_velocity=5.0)


def test_the_velocity_jumps_at_the_start_of_the_exponential_alone():
    law = profile("exponential", 1.0, 1.0, 5.0)
    assert law.jumps == (0.0,)
    assert law.velocity(0.0) == pytest.approx(240.0 / 25.0)  # y'''/w^2 = 6 * 40/(w^2 T^3)


def test_tune_tries_those_of_the_papers_alone():
    assert {name for name, method in PROFILES.items() if not method.tuned} >= {*APART, *ANY_DURATION, "ramp", "versine_ramp"}
    assert not set(TRIED) & {*APART, *ANY_DURATION, "ramp", "versine_ramp", "s_curve_modes"}


def test_the_message_of_the_component_names_the_period():
    component = MotionProfile(profile="constant_acceleration", duration=0.5, natural_frequency=10.0)
    with pytest.raises(ComponentError, match=r"duration = 0.5 s is too short: .* longer than 0.628"):
        component.initialize()
