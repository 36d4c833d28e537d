"""Minimax and unity magnitude pulses: tables, bounds, equations."""

from __future__ import annotations

import cmath
import math

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from scipy.optimize import linprog

from shaper_fmu.design.pulses import (
    minimax_pulses,
    unity_magnitude_pulses,
)
from shaper_fmu.errors import ComponentError

# the plant of Taskin, Kilic and Kapucu 2019
W, ZETA = 22.9476, 0.0891
DAMPED = W * math.sqrt(1.0 - ZETA**2)
PERIOD = 2.0 * math.pi / DAMPED
LONG, SHORT = PERIOD / 2, 0.1222

dampings = st.floats(0.0, 0.5)


@pytest.mark.parametrize(
    ("duration", "tabled", "vibration"),
    [
        (LONG, (0.0, 0.0286189, 0.0689723, 0.1196141, 0.1374496), (24.89, 12.05, 0.0, 10.79, 19.90)),
        (SHORT, (0.0, 0.0306868, 0.0628138, 0.1028066, 0.1222), (27.33, 13.58, 0.0, 13.03, 25.15)),
    ],
)
def test_minimax_switch_times(duration, tabled, vibration):
    """Found independently by a scan with numpy and scipy's Brent and bounded minimization, for a band of 20 %."""
    command = minimax_pulses(duration, W, ZETA)
    assert command.switch_times == pytest.approx(tabled, abs=1e-6)
    found = [100 * command.residual_vibration(r * W, ZETA) for r in (0.8, 0.9, 1.0, 1.1, 1.2)]
    assert found == pytest.approx(vibration, abs=5.1e-3)
    assert command.certificate < 1e-12


def lowest_worst_vibration(duration: float, band: float, cells: int = 400, directions: int = 200) -> float:
    """Lower bound of max V over the band for all commands 0 <= u <= 1 with V(W) = 0, by linear programming.

    exp(p tau) S = 1 + p int_0^tau u exp(p (tau - t)) dt, with u constant in each cell; |.| from below by a polygon.
    """
    grid = np.linspace(0.0, duration, cells + 1)

    def response(ratio):
        pole = ratio * W * complex(-ZETA, math.sqrt(1 - ZETA**2))
        return -np.diff(np.exp(pole * (duration - grid)))

    turns = np.exp(2j * np.pi * np.arange(directions) / directions)
    rows, limits = [], []
    for ratio in (1 - band, 1 - band / 2, 1 + band):
        rows.append(np.hstack([np.real(turns[:, None] * response(ratio)), -np.ones((directions, 1))]))
        limits.append(-np.real(turns))
    nominal = np.append(response(1.0), 0.0)
    solution = linprog(
        np.eye(cells + 1)[-1],
        A_ub=np.vstack(rows),
        b_ub=np.concatenate(limits),
        A_eq=np.array([np.real(nominal), np.imag(nominal)]),
        b_eq=[-1.0, 0.0],
        bounds=[(0.0, 1.0)] * cells + [(0.0, None)],
    )
    assert solution.status == 0
    return 100 * solution.fun


@pytest.mark.parametrize(
    ("duration", "band", "tabled"), [(LONG, 0.1, 12.04), (LONG, 0.2, 24.88), (SHORT, 0.1, 13.58), (SHORT, 0.2, 27.32)]
)
def test_minimax_meets_the_bound_of_linear_programming(duration, band, tabled):
    bound = lowest_worst_vibration(duration, band)
    assert bound == pytest.approx(tabled, abs=0.01)
    command = minimax_pulses(duration, W, ZETA, band=band)
    worst = max(100 * command.residual_vibration(r * W, ZETA) for r in np.linspace(1 - band, 1 + band, 81))
    assert worst == pytest.approx(bound, abs=0.01)


@settings(max_examples=25, deadline=None)
@given(st.floats(0.0, 0.9), st.floats(0.01, 0.99))
def test_minimax_exists_between_um_zv_and_the_damped_period(zeta, place):
    shortest = unity_magnitude_pulses("zv", 3.0, zeta).travel_time
    longest = 2 * math.pi / (3.0 * math.sqrt(1 - zeta**2))
    command = minimax_pulses(shortest + place * (longest - shortest), 3.0, zeta)
    assert command.residual_vibration(3.0, zeta) < 1e-11
    assert np.all(np.diff(command.switch_times) >= 0.0)


@pytest.mark.parametrize("share", [0.2, 0.33, 1.01, 3.0])
def test_minimax_of_an_impossible_duration_is_refused(share):
    with pytest.raises(ComponentError, match=r"possible are about 0\.091\d* s to 0\.274\d* s"):
        minimax_pulses(share * PERIOD, W, ZETA)


@pytest.mark.parametrize(
    ("kind", "shares", "vibration"),
    [
        ("zv", (0.0, 0.192615, 0.333889), (31.29, 16.09, 0.0, 16.78, 34.04)),
        ("zvd", (0.0, 0.116218, 0.358806, 0.668100, 0.734342), (9.13, 2.38, 0.0, 2.48, 9.99)),
    ],
)
def test_unity_magnitude_on_the_papers_plant(kind, shares, vibration):
    command = unity_magnitude_pulses(kind, W, ZETA)
    assert np.divide(command.switch_times, PERIOD) == pytest.approx(shares, abs=5.1e-7)
    found = [100 * command.residual_vibration(r * W, ZETA) for r in (0.8, 0.9, 1.0, 1.1, 1.2)]
    assert found == pytest.approx(vibration, abs=5.1e-3)


# Solutions of the equations of Singhose, Singer and Seering, over the undamped period
UM_ZV = {
    0: (1 / 6, 1 / 3),
    0.05: (0.1814057, 0.3339256),
    0.1: (0.1967999, 0.3357174),
    0.2: (0.2299023, 0.3431184),
    0.3: (0.2669397, 0.3563500),
}
UM_ZVD = {0: (0.08951255, 0.36623382, 0.6429551, 0.73246765), 0.1: (0.12030677, 0.35983063, 0.67456449, 0.73853028)}


@pytest.mark.parametrize(("kind", "table"), [("zv", UM_ZV), ("zvd", UM_ZVD)])
def test_unity_magnitude_tables(kind, table):
    for zeta, tabled in table.items():
        command = unity_magnitude_pulses(kind, 2 * math.pi, zeta)
        assert command.switch_times[1:] == pytest.approx(tabled, abs=1.2e-7 if kind == "zv" else 1.2e-8)
        assert command.travel_time == command.switch_times[-1]


@settings(max_examples=200, deadline=None)
@given(st.sampled_from(["zv", "zvd"]), st.floats(0.0, 0.95), st.floats(0.01, 1000.0))
def test_unity_magnitude_solves_its_equations(kind, zeta, w):
    """Sums over 1, -1, 1 (, -1, 1): of exp(s t) and, for zvd, t exp(s t), s = zeta w + j wd; over the last term."""
    command = unity_magnitude_pulses(kind, w, zeta)
    pole = complex(zeta, math.sqrt(1 - zeta**2))
    times = [w * t for t in command.switch_times]
    terms = [(-1) ** i * cmath.exp(pole * t - zeta * times[-1]) for i, t in enumerate(times)]
    assert abs(sum(terms)) < 1e-11
    if kind == "zvd":
        assert abs(sum(t * term for t, term in zip(times, terms, strict=True))) < 1e-11 * times[-1]
    assert command.certificate < 1e-11
    assert np.all(np.diff(times) > 0.0)


def test_unity_magnitude_near_critical_damping_is_refused():
    with pytest.raises(ComponentError, match=r"no unity magnitude switch times were found for damping_ratio = 0\.99"):
        unity_magnitude_pulses("zvd", W, 0.99)
