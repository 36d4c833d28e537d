"""The crane of ssp/overhead_crane: its reference result, what its page says of its parameter sets, and its study."""

from __future__ import annotations

import csv
import math
from pathlib import Path

import numpy as np
import pytest

from shaper_fmu import Residual, relative_residual, shaper
from shaper_fmu.ssp.archive import load_ssp, pack_ssp
from shaper_fmu.ssp.parameter_sets import apply_parameter_set
from shaper_fmu.sweep.engine import run_study
from shaper_fmu.sweep.store import Store
from shaper_fmu.sweep.study import read_study

FOLDER = Path(__file__).parents[2] / "ssp" / "overhead_crane"
SWING = Residual("crane.swing_angle", "shaper.shaped_mean")
VARIANTS = ("", "_short_rope", "_long_rope", "_hoisting")


@pytest.fixture(scope="module")
def archive(fmus, tmp_path_factory) -> Path:
    return pack_ssp(FOLDER, fmus, tmp_path_factory.mktemp("crane") / "overhead_crane.ssp")


def swing(archive: Path, *sets: str, **values: float) -> float:
    """Residual swing [deg] with these parameter sets and start values of the profile."""
    loaded = load_ssp(archive)
    for which in sets:
        apply_parameter_set(loaded, which)
    for name, value in values.items():
        loaded.system.set(f"profile.{name}", value)
    return math.degrees(loaded.system.simulate(25.0, 0.01, metrics={"swing": SWING}).metrics["swing"])


def test_a_run_agrees_with_the_reference(archive):
    results = load_ssp(archive).system.simulate(25.0, 0.01)
    with (FOLDER / "reference.csv").open(newline="", encoding="utf-8") as stream:
        header, *rows = csv.reader(stream)
    expected = np.array(rows, float).T
    assert expected.shape == (5, 501)
    for name, column in zip(header, expected, strict=True):
        found = (results.time if name == "time" else results[name])[::5]
        np.testing.assert_allclose(found, column, rtol=1e-11, atol=1e-11)  # 12 digits


def test_the_nominal_set_is_zv(archive):
    assert swing(archive) == swing(archive, "zv")


@pytest.mark.parametrize("variant", VARIANTS)
def test_the_sets_leave_what_the_page_says(archive, variant):
    """The rows of the page's table, to the digits that it prints."""
    row = (FOLDER / "README.md").read_text().splitlines()
    (line,) = [text for text in row if text.startswith(f"| `...{variant}`" if variant else "| `unshaped`, ")]
    printed = [text.strip().removesuffix(" deg") for text in line.split("|")[3:6]]
    for kind, text in zip(("unshaped", "zv", "zvd"), printed, strict=True):
        digits = len(text.partition(".")[2])
        assert f"{swing(archive, kind + variant):.{digits}f}" == text


@pytest.mark.parametrize("kind", ["zv", "zvd"])
@pytest.mark.parametrize("rope", ["_short_rope", "_long_rope"])
def test_small_swings_on_a_wrong_rope_have_the_formulas_residual(archive, kind, rope):
    """Singer and Seering 1990: the impulses' residual at the actual frequency, as a share of the unshaped move's.

    A move of 10 mm swings linearly; the mean over a step splits an edge, an error of (w h)^2 / 16 < 4e-5 at most.
    """
    length = {"_short_rope": 5.6, "_long_rope": 10.4}[rope]
    designed, actual = math.sqrt(9.81 / 8.0), math.sqrt(9.81 / length)
    share = swing(archive, kind + rope, distance=0.01) / swing(archive, "unshaped" + rope, distance=0.01)
    sequence = shaper(kind, designed, 0.0)
    assert share == pytest.approx(relative_residual(sequence, actual, 0.0), abs=4e-5)


def test_the_study_sweeps(archive, tmp_path):
    """Its table at the nominal length is that of the parameter sets; ZVD leaves less than ZV wherever the rope is wrong."""
    study = read_study(FOLDER / "study.toml")
    study.folder = str(tmp_path)
    study.system = str(archive)
    study.vary["crane.initial_rope_length"].points = 3
    assert run_study(study, tmp_path / "s.sqlite") == {"done": 9}
    with Store(tmp_path / "s.sqlite") as store:
        found = {
            (run.compared, run.varied["crane.initial_rope_length"]): math.degrees(run.metrics["residual_swing"])
            for run in store.runs()
        }
    for case, kind in (("unshaped", "unshaped"), ("ZV", "zv"), ("ZVD", "zvd")):
        for length, variant in ((5.6, "_short_rope"), (8.0, ""), (10.4, "_long_rope")):
            assert found[case, length] == pytest.approx(swing(archive, kind + variant), rel=1e-12)
    assert all(found["ZVD", length] < 0.35 * found["ZV", length] for length in (5.6, 10.4))
