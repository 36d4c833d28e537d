"""The crane of ssp/double_pendulum_range: its reference result, its designs, what its pages say, and its study."""

from __future__ import annotations

import csv
import math
import re
from itertools import product
from pathlib import Path

import numpy as np
import pytest

from shaper_fmu import Residual, guarantee, relative_residual, shaper
from shaper_fmu.design import ImpulseSequence, direct_two_mode, specified_insensitivity
from shaper_fmu.design.specified_bands import Band
from shaper_fmu.ssp.archive import load_ssp, pack_ssp
from shaper_fmu.ssp.parameter_sets import apply_parameter_set
from shaper_fmu.sweep.engine import run_study
from shaper_fmu.sweep.store import Store
from shaper_fmu.sweep.study import read_study

ROOT = Path(__file__).parents[2]
FOLDER = ROOT / "ssp" / "double_pendulum_range"
SWINGS = {name: Residual(f"crane.{name}_offset", "shaper.shaped_mean") for name in ("load", "hook")}
DESIGNS = ("unshaped", "zv_mode_1", "zv", "direct_zv", "zvd", "ei", "si")
VARIANTS = ("", "_light_short", "_heavy_long")
SLING, HOOK = 2.0, 200.0


def modes(load: float, rope: float) -> list[float]:
    """By the formula of Singhose, Kim and Kenison (2008) [rad/s]."""
    r = load / HOOK
    total = (1 + r) * (1 / rope + 1 / SLING)
    spread = math.sqrt(total**2 - 4 * (1 + r) / (rope * SLING))
    return [math.sqrt(9.81 / 2 * (total - spread)), math.sqrt(9.81 / 2 * (total + spread))]


CORNERS = np.array([modes(load, rope) for load, rope in product((50.0, 500.0), (3.5, 6.5))])
BANDS = [(float(low), float(high)) for low, high in zip(CORNERS.min(axis=0), CORNERS.max(axis=0), strict=True)]


@pytest.fixture(scope="module")
def archive(fmus, tmp_path_factory) -> Path:
    return pack_ssp(FOLDER, fmus, tmp_path_factory.mktemp("double") / "double_pendulum_range.ssp", ["this"])


def swings(archive: Path, which: str = "", **values: float) -> dict[str, float]:
    """Residual swings of load and hook [cm] with a parameter set and start values of the profile."""
    loaded = load_ssp(archive)
    if which:
        apply_parameter_set(loaded, which)
    for name, value in values.items():
        loaded.system.set(f"profile.{name}", value)
    found = loaded.system.simulate(35.0, 0.01, metrics=SWINGS).metrics
    return {name: 100.0 * found[name] for name in SWINGS}


def custom(which: str) -> ImpulseSequence:
    """The impulses of a parameter set."""
    text = (FOLDER / "parameter_sets" / f"{which}.ssv").read_text()
    parts = [re.findall(rf'custom_{part}\[\d+\]"><ssv:Real value="([^"]+)"', text) for part in ("amplitude", "delay")]
    assert f'"shaper.custom_impulses"><ssv:Integer value="{len(parts[0])}"' in text
    return ImpulseSequence(tuple(map(float, parts[0])), tuple(map(float, parts[1])), 0.0)


def test_a_run_agrees_with_the_reference(archive):
    results = load_ssp(archive).system.simulate(35.0, 0.01)
    with (FOLDER / "reference.csv").open(newline="", encoding="utf-8") as stream:
        header, *rows = csv.reader(stream)
    expected = np.array(rows, float).T
    assert expected.shape == (6, 701)
    for name, column in zip(header, expected, strict=True):
        found = (results.time if name == "time" else results[name])[::5]
        np.testing.assert_allclose(found, column, rtol=1e-11, atol=1e-11)  # 12 digits


def test_the_nominal_set_is_zv(archive):
    assert swings(archive) == swings(archive, "zv")


def test_the_shapers_are_those_of_the_designs():
    """Both modes' frequencies by the formula; direct ZV to the solver's rounding, SI with V <= 5 %, proven over both bands."""
    text = (FOLDER / "resources" / "shaper.ssv").read_text()
    assert [float(x) for x in re.findall(r'\]"><ssv:Real value="([^"]+)"', text)] == pytest.approx(modes(200.0, 5.0), rel=1e-11)
    direct, wanted = custom("direct_zv"), direct_two_mode(modes(200.0, 5.0))
    assert direct.duration == pytest.approx(wanted.duration, rel=1e-6)
    assert max(relative_residual(direct, w, 0.0) for w in modes(200.0, 5.0)) < 1e-9
    found = custom("si")
    shortest = specified_insensitivity(*BANDS[0], 0.05, 0.0, [Band(*BANDS[1], 0.05)])
    assert found.duration == pytest.approx(shortest.duration, rel=1e-5)
    assert all(guarantee(found, band, (0.0, 0.0)).bound < 0.05 * (1 + 1e-6) for band in BANDS)


@pytest.mark.parametrize("which", DESIGNS)
def test_the_sets_leave_what_the_page_says(archive, which):
    """A row of the page's table, to the digits that it prints."""
    (line,) = [text for text in (FOLDER / "README.md").read_text().splitlines() if text.startswith(f"| `{which}`")]
    for variant, cell in zip(VARIANTS, line.split("|")[3:6], strict=True):
        found = swings(archive, which + variant)
        assert cell.strip() == f"{found['load']:.1f} / {found['hook']:.1f}"


@pytest.mark.parametrize("which", ["zv_mode_1", "zv", "direct_zv", "zvd", "ei", "si"])
@pytest.mark.parametrize("variant", VARIANTS[1:])
def test_small_swings_keep_within_the_formulas_residual(archive, which, variant):
    """Singer and Seering 1990: a mode keeps V of what it has unshaped, so hook and load keep what both modes do at most.

    Modal amplitudes of the unshaped move of 6 mm by least squares on its rest, sines and cosines of both frequencies.
    """
    loaded = load_ssp(archive)
    apply_parameter_set(loaded, "unshaped" + variant)
    loaded.system.set("profile.distance", 0.006)
    loaded.system.set("profile.max_velocity", 0.0005)
    results = loaded.system.simulate(35.0, 0.01)
    rest = results.time > 12.6
    w = modes(*{"_light_short": (50.0, 3.5), "_heavy_long": (500.0, 6.5)}[variant])
    t = results.time[rest]
    basis = np.column_stack([function(x * t) for x in w for function in (np.cos, np.sin)])
    sequence = custom(which) if which in ("direct_zv", "si") else None
    shaped = swings(archive, which + variant, distance=0.006, max_velocity=0.0005)
    for name in SWINGS:
        (c1, s1, c2, s2), *_ = np.linalg.lstsq(basis, 100.0 * results[f"crane.{name}_offset"][rest])
        kept = [residual_of(which, sequence, x) for x in w]
        bound = kept[0] * math.hypot(c1, s1) + kept[1] * math.hypot(c2, s2)
        assert 0.5 * bound < shaped[name] < 1.01 * bound + 1e-5


def residual_of(which: str, sequence: ImpulseSequence | None, w: float) -> float:
    nominal = modes(200.0, 5.0)
    if sequence is None:
        sequence = shaper("zv", nominal[:1]) if which == "zv_mode_1" else shaper(which, nominal)
    return relative_residual(sequence, w, 0.0)


@pytest.mark.thorough
def test_the_plants_page_has_the_whole_study(archive, tmp_path):
    """Its table, to the digits that it prints; worst and median over 90 points. SI keeps less than 5 cm of a metre everywhere."""
    study = read_study(FOLDER / "study.toml")
    study.folder, study.system = str(tmp_path), str(archive)
    assert run_study(study, tmp_path / "s.sqlite") == {"done": 7 * 90}
    with Store(tmp_path / "s.sqlite") as store:
        runs = store.runs()
    page = (ROOT / "docs" / "plants" / "double_pendulum_crane.md").read_text().splitlines()
    for name in study.compare:
        (line,) = [text for text in page if text.startswith(f"| {name} |")]
        for cell, swing in zip(line.split("|")[4:6], ("load_swing", "hook_swing"), strict=True):
            found = [100.0 * run.metrics[swing] for run in runs if run.compared == name]
            assert cell.strip() == f"{max(found):.1f}, {np.median(found):.1f}"
    corner = next(run for run in runs if (run.compared, *run.varied.values()) == ("SI, direct", 50.0, 3.5))
    assert 100.0 * corner.metrics["load_swing"] == pytest.approx(swings(archive, "si_light_short")["load"], rel=1e-9)


def test_the_page_tells_the_proven_bounds():
    """Duration and V over both bands, as `guarantee` has them."""
    nominal = modes(200.0, 5.0)
    sequences = {
        "ZV, mode 1": shaper("zv", nominal[:1]),
        **{f"{kind.upper()}, convolved": shaper(kind, nominal) for kind in ("zv", "zvd", "ei")},
        "ZV, direct": custom("direct_zv"),
        "SI, direct": custom("si"),
    }
    page = (ROOT / "docs" / "plants" / "double_pendulum_crane.md").read_text()
    for name, sequence in sequences.items():
        low, high = (100.0 * guarantee(sequence, band, (0.0, 0.0)).bound for band in BANDS)
        assert f"| {name} | {sequence.duration:.2f} | {low:.1f}, {high:.1f} |" in page
