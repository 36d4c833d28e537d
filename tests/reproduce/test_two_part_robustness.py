"""The two-part command beside other methods, and with a wrong damping: FMU runs against formulas."""

from __future__ import annotations

import cmath
import math

import numpy as np
import pytest
from scipy.integrate import quad

from shaper_fmu.reproduce.two_part.compared import LONGER, LONGER_THAN_A_PERIOD, METHODS, compare
from shaper_fmu.reproduce.two_part.runs import oscillator, vibration

W, ZETA, T = 5.5045, 0.08, 0.9703
POLE = W * complex(-ZETA, math.sqrt(1 - ZETA**2))


@pytest.fixture(scope="module")
def compared():
    return compare(0.05)


def left(slope, duration: float) -> float:
    """V = |integral of y' exp(p (T - t)) dt| by quadrature."""
    parts = [
        quad(lambda t, f=f: f(cmath.exp(POLE * (duration - t))) * slope(t), 0, duration, limit=200)[0] for f in (np.real, np.imag)
    ]
    return abs(complex(*parts))


def exponential_slope(estimate: float, duration: float):
    """u' = y' + 2 zeta y''/w + y'''/w^2 for y = 1 - exp(-X), X = 40 (t/T)^3."""
    w, c = estimate * W, 40 / duration**3

    def slope(t: float) -> float:
        p, p1, p2, e = 3 * c * t * t, 6 * c * t, 6 * c, math.exp(-c * t**3)
        return e * (p + 2 * ZETA / w * (p1 - p * p) + (p**3 - 3 * p * p1 + p2) / w**2)

    return slope


def pulses_slope(estimate: float, duration: float):
    """Speed of two pulses of constant acceleration one period of the estimate apart."""
    apart = 2 * math.pi / (estimate * W)
    pulse = duration - apart
    return lambda t: min(t, pulse, max(0.0, duration - t)) / (pulse * apart)


def test_the_bands_of_the_exponential_and_of_constant_acceleration(compared):
    for duration in (T, LONGER):
        for estimate in compared["exponential output (Sahinkaya 2001)"][duration].band:
            assert left(exponential_slope(estimate, duration), duration) == pytest.approx(0.05, abs=3e-5)
    one = compared["constant acceleration (Mimmi and Pennacchi)"][LONGER]
    assert one.nominal == pytest.approx(left(pulses_slope(1.0, LONGER), LONGER), rel=3e-4)
    for estimate in one.band:
        assert left(pulses_slope(estimate, LONGER), LONGER) == pytest.approx(0.05, abs=3e-5)


def test_in_the_papers_time_the_two_part_command_tolerates_most_and_in_1_5_periods_it_does_not(compared):
    widths = {name: found[T].width for name, found in compared.items() if T in found}
    assert max(widths, key=lambda name: widths[name]) == "two-part"
    assert (widths["two-part"], widths["single"]) == (pytest.approx(0.2805, abs=1e-4), pytest.approx(0.1013, abs=1e-4))
    assert widths["exponential output (Sahinkaya 2001)"] == pytest.approx(0.0785, abs=1e-4)
    assert {METHODS[name] for name, found in compared.items() if T not in found} == set(LONGER_THAN_A_PERIOD)
    assert compared["single"][LONGER].width > 3 * compared["two-part"][LONGER].width


def test_a_ramp_and_the_polynomial_leave_more_than_5_percent(compared):
    """Speeds 1/T of a ramp, and 30 u^2 (1 - u)^2/T of the polynomial."""
    for duration in (T, LONGER):
        ramp, polynomial = (compared[name][duration] for name in ("ramp (Kapucu et al. 2008)", "3-4-5 polynomial"))
        assert ramp.nominal == pytest.approx(left(lambda t, d=duration: 1 / d, duration), rel=3e-4)
        slope = lambda t, d=duration: 30 * (t / d) ** 2 * (1 - t / d) ** 2 / d  # noqa: E731
        assert polynomial.nominal == pytest.approx(left(slope, duration), rel=3e-4)
        assert ramp.band is polynomial.band is None


@pytest.mark.parametrize(("command", "parts"), [("single", 1), ("two-part", 2)])
def test_a_wrong_damping_leaves_what_the_formula_says(command, parts):
    """docs/wrong_estimates.md's formula; the command comes half a step late, by the damping 1e-4 of V and up to 4e-4."""
    with oscillator() as bench:
        for zeta, believed in ((0.0, 0.08), (0.16, 0.08), (0.3, 0.08), (0.08, 0.0), (0.08, 0.16), (0.08, 0.3), (0.02, 0.3)):
            q = W * T * complex(-zeta, math.sqrt(1 - zeta * zeta))
            expected = 2 * abs(believed - zeta) / (W * T) * math.exp(-zeta * W * T)
            expected *= abs(1 - cmath.exp(-q)) / abs(1 + (q / (2 * math.pi * parts)) ** 2)
            assert vibration(bench, command, 1.0, zeta, believed) == pytest.approx(expected, rel=5e-4)
