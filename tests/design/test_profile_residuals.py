"""What motion profiles leave: the tables and claims of the papers."""

from __future__ import annotations

import math

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from profile_cases import (
    FREQUENCY,
    PERIOD,
    SMOOTH,
    ZETA,
    W,
    paper_cycloid_versine_ramp,
    pieces,
    root,
)
from scipy.integrate import solve_ivp

from shaper_fmu.design.profiles import profile


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
