"""Measures of residual vibration."""

from __future__ import annotations

import math

import numpy as np
import pytest
from scipy.integrate import solve_ivp

from shaper_fmu.analysis.vibration import damping_curve, insensitivity, relative_residual, sensitivity_curve, tolerated_band
from shaper_fmu.design.shapers import shaper

W, ZETA = 22.9476, 0.0891


def test_v_and_rel_are_what_a_simulation_leaves():
    """A ZV for a wrong frequency on an oscillator by scipy: envelope at the last impulse over the step's at 0 and at the same time."""
    sequence = shaper("zv", 1.2 * W, ZETA)
    wd = W * math.sqrt(1 - ZETA**2)

    def envelope(steps: list[tuple[float, float]]) -> float:
        state, level, now = np.zeros(2), 0.0, 0.0
        for time, size in [*steps, (sequence.duration, 0.0)]:
            if time > now:

                def slopes(t, y, level=level):
                    return [y[1], W * W * (level - y[0]) - 2 * ZETA * W * y[1]]

                state = solve_ivp(slopes, (now, time), state, method="DOP853", rtol=1e-12, atol=1e-13).y[:, -1]
            now, level = time, level + size
        return math.hypot(state[0] - level, (state[1] + ZETA * W * (state[0] - level)) / wd)

    shaped = envelope(list(zip(sequence.delays, sequence.amplitudes, strict=True)))
    at_zero = 1.0 / math.sqrt(1 - ZETA**2)
    assert sequence.residual_vibration(W, ZETA) == pytest.approx(shaped / at_zero, rel=1e-9)
    assert relative_residual(sequence, W, ZETA) == pytest.approx(shaped / envelope([(0.0, 1.0)]), rel=1e-9)


@pytest.mark.parametrize(("kind", "n"), [("zv", 1), ("zvd", 2), ("zvdd", 3)])
def test_the_band_is_the_closed_form(kind, n):
    """V = |cos(pi r / 2)|^n: edges at 1 +- (2/pi) asin(V^(1/n))."""
    band = tolerated_band(shaper(kind, W), W, tolerance=0.05)
    half = 2 / math.pi * math.asin(0.05 ** (1 / n))
    assert band == pytest.approx((1 - half, 1 + half), abs=1e-13)


def test_ei_touches_the_tolerance_and_goes_on():
    """I = 2 - (2/pi) acos((3V - 1)/(1 + V))."""
    expected = 2 - 2 / math.pi * math.acos((3 * 0.05 - 1) / 1.05)
    assert insensitivity(shaper("ei", W), W) == pytest.approx(expected, abs=1e-12)


def test_no_shaper_has_no_band():
    assert tolerated_band(shaper("none", W), W) is None
    assert insensitivity(shaper("none", W), W) == 0.0


def test_curves_are_the_formula():
    sequence = shaper("zvd", W)
    ratios = np.linspace(0.2, 1.8, 9)
    assert sensitivity_curve(sequence, W, 0.0, ratios) == pytest.approx(np.cos(np.pi * ratios / 2) ** 2, abs=1e-13)
    curve = damping_curve(shaper("zv", W, ZETA), W, [0.0, ZETA, 0.2])
    assert curve[1] < 1e-13 < min(curve[0], curve[2])


@pytest.mark.parametrize("modes", [[1000.0, 1.0], [300.0, 1.0]])
def test_ripples_of_long_sequences_are_not_missed(modes):
    """Convolved with a slow mode, V of the fast one ripples; a dense scan from 1 outwards finds the same first crossings."""
    sequence = shaper("zv", modes)
    band = tolerated_band(sequence, modes[0])
    assert band is not None
    for sign, edge in ((-1, band[0]), (1, band[1])):
        inside = np.linspace(1.0, edge - sign * 1e-9, 4001)
        assert sensitivity_curve(sequence, modes[0], 0.0, inside).max() <= 0.05 * (1 + 1e-6)
        assert sequence.residual_vibration((edge + sign * 1e-6) * modes[0]) > 0.05


def test_a_residual_beyond_all_numbers_is_infinite():
    assert relative_residual(shaper("zv", 1.0, 0.9), 1e3, 0.9) == math.inf
