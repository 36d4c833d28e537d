"""The paper on the smooth S-curve, run again through the FMUs: numbers, verdicts and the SSP system."""

from __future__ import annotations

import cmath
import math
from pathlib import Path

import numpy as np
import pytest
from documented_verdicts import assert_documented
from reference_runs import assert_agrees_with_reference
from scipy.integrate import trapezoid

from shaper_fmu.page.blocks import Table
from shaper_fmu.page.figures import Figure, Panels
from shaper_fmu.reproduce.s_curve import paper as s_curve
from shaper_fmu.reproduce.s_curve.runs import SHAPER_PERIODS
from shaper_fmu.reproduce.s_curve.study import DURATIONS, GRID, RATIOS, Study, run_study
from shaper_fmu.ssp.archive import pack_ssp

FOLDER = Path(__file__).parents[2] / "ssp" / "s_curve_beam"
TN = 2.0 * math.pi / 22.04871045651039


@pytest.fixture(scope="module")
def updates() -> list[tuple[float, float]]:
    return []


@pytest.fixture(scope="module")
def study(updates) -> Study:
    return run_study(lambda done, total: updates.append((done, total)))


def test_the_polynomials_residual(study):
    """|integral of a exp(-j w t)| / (w D) of the 3-4-5 polynomial, by quadrature; the same to 0.001 points."""
    expected = {0.8: 62.085, 1.25: 27.487, 1.75: 2.266, 2.25: 4.097, 4.25: 0.538}
    x = np.linspace(0.0, 1.0, 20001)
    acceleration = 60 * x - 180 * x**2 + 120 * x**3
    for r in DURATIONS:
        spectrum = trapezoid(acceleration * np.exp(-2j * math.pi * r * x), x) / (2 * math.pi * r)
        found = 100 * study.polynomial[r].relative[0]
        assert found == pytest.approx(expected[r], abs=1e-3)
        assert found == pytest.approx(100 * abs(spectrum), abs=1e-3)


def test_the_s_curve_leaves_nothing_at_its_frequency_and_what_it_should_beside_it(study):
    """Off the design: the spectrum of eq. (14) by quadrature, as for the polynomial, to 0.01 points."""
    expected = {0.8: 6.79, 1.25: 3.40, 1.75: 0.54, 2.25: 0.61, 4.25: 0.04}
    for r in DURATIONS:
        assert 100 * study.nominal[r].relative[0] < 1e-6
        assert 100 * study.stiffer[r].relative[0] == pytest.approx(expected[r], abs=0.01)
        assert 100 * study.stiffer[r].relative[0] == pytest.approx(100 * spectrum_of_eq_14(r, 1.05), abs=0.01)
        for ratio, found in zip(RATIOS, study.detuned[r], strict=True):
            assert 100 * found == pytest.approx(100 * spectrum_of_eq_14(r, ratio), abs=0.01)


def spectrum_of_eq_14(r: float, ratio: float) -> float:
    """|integral of a exp(-j w t)| / (w D) of the S-curve without cruise, for w = ratio times the design frequency."""
    tau = r / 4.0  # all in periods and in units of D
    a = 1.0 / (2.0 * tau * tau)
    a2 = a * (1.0 - 1.0 / tau**2)
    u = np.linspace(0.0, tau, 4001)
    s = a * u / tau - a2 / (2.0 * math.pi) * np.sin(2.0 * math.pi * u / tau)
    w = 2.0 * math.pi * ratio
    parts = [(s, 0.0), (a - s, tau), (-s, 2.0 * tau), (-a + s, 3.0 * tau)]
    return float(abs(sum(trapezoid(part * np.exp(-1j * w * (u + start)), u) for part, start in parts))) / w


def test_speeds(study):
    """A tau = 2 D / T; beyond it the speed swings where the segments are shorter than 0.24 periods, as eq. (14) gives it."""
    expected = {0.8: 0.8773, 1.25: 0.5615, 1.75: 0.4010, 2.25: 0.3119, 4.25: 0.1651}
    for r in DURATIONS:
        assert study.cruise[r] == pytest.approx(expected[r], abs=5e-5)
        assert study.cruise[r] == pytest.approx(0.2 / (r * TN), rel=1e-12)
        tau = r * TN / 4.0
        x = np.linspace(0.0, 1.0, 20001)
        first = 0.5 * x * x - (1.0 - (TN / tau) ** 2) * (1.0 - np.cos(2.0 * math.pi * x)) / (4.0 * math.pi**2)
        peak = study.cruise[r] * max(np.max(np.abs(first)), np.max(np.abs(0.5 + x - first)))
        assert study.nominal[r].velocity == pytest.approx(peak, rel=1e-6)
    assert study.nominal[0.8].velocity == pytest.approx(1.1811, abs=1e-4)  # above the actuator's 1 m/s
    for distance, periods in study.shortest.items():
        near = np.interp(periods, GRID, [left.velocity * distance / 0.1 for left in study.scans["S-curve"]])
        assert near == pytest.approx(1.0, rel=0.03)  # between durations of the scan


def test_less_than_five_percent_from_08_periods_on(study):
    residuals = [left.relative[0] for left in study.scans["S-curve"]]
    assert max(residuals) < 5e-5
    polynomial = np.array([left.relative[0] for left in study.scans["3-4-5 polynomial"]])
    assert np.max(polynomial[GRID > 1.7]) < 0.05 < np.min(polynomial[GRID < 1.6])


def test_claims_and_verdicts(study):
    found = [claim.verdict for claim in s_curve.claims(study)]
    assert found == [
        "reproduced", "not reproduced", "reproduced", "reproduced",
        "reproduced", "not reproduced", "reproduced", "not reproduced",
        "reproduced", "reproduced",
        "reproduced", "reproduced",
        "reproduced", "reproduced", "not decidable", "reproduced", "reproduced", "reproduced",
    ]  # fmt: skip
    assert_documented("s-curve", s_curve.claims(study))


def test_damping_and_modes(study):
    """A shaper designed for an undamped mode leaves (zeta pi / 2)^n of it, a polynomial's own share beside; others are small."""
    for zeta in (0.01, 0.02):
        for order, name in ((1, "3-4-5 polynomial, ZV"), (2, "3-4-5 polynomial, ZVD")):
            for r in (1.75, 2.25, 4.25):
                alone = mode_after_polynomial(study, r - SHAPER_PERIODS["zv" if order == 1 else "zvd"], zeta)
                shaped = study.modes[name, zeta, r].relative[0]
                assert shaped == pytest.approx(alone * shaper_share(order, zeta), rel=2e-3)
        told = study.modes["S-curve, told the damping", zeta, 0.8]
        assert told.relative[0] < 1e-5 < 1e-2 < study.modes["S-curve", zeta, 0.8].relative[0]
    assert all(left.modes[1:].sum() < 0.0032 for _, lefts in study.mode_scans.values() for left in lefts)


def mode_after_polynomial(study: Study, periods: float, zeta: float) -> float:
    """V of the 3-4-5 polynomial in a damped first mode, amplitude over that of an undamped step, by quadrature."""
    x = np.linspace(0.0, 1.0, 20001)
    acceleration = (60 * x - 180 * x**2 + 120 * x**3) / periods
    p = 2.0 * math.pi * complex(-zeta, math.sqrt(1.0 - zeta * zeta))
    left = abs(trapezoid(acceleration * np.exp(p * periods * (1.0 - x)), x))
    return float(left) / (2.0 * math.pi * math.sqrt(1.0 - zeta * zeta))


def shaper_share(order: int, zeta: float) -> float:
    """|(1 + exp(p Tn / 2)) / 2|^order: what ZV and ZVD for an undamped mode leave of a damped one, at the command's end."""
    p = math.pi * complex(-zeta, math.sqrt(1.0 - zeta * zeta))
    return abs((1.0 + cmath.exp(p)) / 2.0) ** order


def test_second_mode_of_the_s_curve(study):
    """The undamped second mode is driven with w2 / w1 = 9.45692: the spectrum of eq. (14) there, times Gamma_2 = 0.18672."""
    for r in DURATIONS[:4]:
        expected = 0.186721077 * spectrum_of_eq_14(r, 208.51106396 / 22.04871046)
        assert study.modes["S-curve", 0.0, r].modes[1] == pytest.approx(expected, rel=2e-3)


def test_the_report(study, updates, monkeypatch):
    monkeypatch.setattr(s_curve, "run_study", lambda update: study)
    found = s_curve.reproduce(lambda done, total: None)
    assert found.key == "s-curve"
    assert updates[0][0] == 0
    assert updates[-1][0] == updates[-1][1]
    figures = [block for block in found.blocks if isinstance(block, Figure | Panels)]
    assert len({figure.key for figure in figures}) == len(figures) == 6
    (third,) = (block for block in figures if isinstance(block, Panels))  # the paper's figure 3, (a) to (d), is one picture
    assert [panel.title[:3] for panel in third.figures] == ["(a)", "(b)", "(c)", "(d)"]
    tables = [block for block in found.blocks if isinstance(block, Table)]
    assert all(len(row) == len(table.head) for table in tables for row in table.rows)
    assert tables[0].rows[0][:4] == ["0.8", "62.085", "8.5e-07", "6.793"]


@pytest.fixture
def archive(fmus, tmp_path) -> Path:
    return pack_ssp(FOLDER, fmus, tmp_path / "s_curve_beam.ssp", ["this"])


def test_the_ssp_system_agrees_with_its_reference(archive):
    values = list(assert_agrees_with_reference(archive, (1.0, 0.001), 1e-12).values())
    assert values[1][-1] == pytest.approx(0.1, abs=1e-12)  # the base arrives
    assert np.ptp(values[2][360:]) / 2 < 2e-5  # and the tip rests, but for what steps of 1 ms cost


def test_sizes():
    assert (FOLDER / "reference.csv").stat().st_size <= 100_000
    assert (FOLDER / "picture.png").stat().st_size <= 60_000
