"""The crane of ssp/hoisting_crane: its reference result, what its page says of its parameter sets, and its study."""

from __future__ import annotations

import csv
import math
import re
from pathlib import Path

import numpy as np
import pytest

from shaper_fmu.master.results import Results
from shaper_fmu.ssp.archive import load_ssp, pack_ssp
from shaper_fmu.ssp.check import check_ssp
from shaper_fmu.ssp.parameter_sets import apply_parameter_set
from shaper_fmu.sweep.engine import run_study
from shaper_fmu.sweep.store import Store
from shaper_fmu.sweep.study import read_study

FOLDER = Path(__file__).parents[2] / "ssp" / "hoisting_crane"
PAGE = (FOLDER / "README.md").read_text(encoding="utf-8")
ROWS = re.findall(r"^\| (\(none\)|`\w+`)[^|]*\|(.*deg.*)\|$", PAGE, re.MULTILINE)
CRANES = ("crane", "zv_crane", "plain_crane")


@pytest.fixture(scope="module")
def archive(fmus, tmp_path_factory) -> Path:
    return pack_ssp(FOLDER, fmus, tmp_path_factory.mktemp("hoisting") / "hoisting_crane.ssp")


def run(archive: Path, *sets: str) -> Results:
    loaded = load_ssp(archive)
    for which in sets:
        apply_parameter_set(loaded, which)
    return loaded.simulate(45.0, 0.01)


def test_it_is_right_and_a_run_agrees_with_the_reference(archive):
    assert check_ssp(archive) == []
    results = run(archive)
    with (FOLDER / "reference.csv").open(newline="", encoding="utf-8") as stream:
        header, *rows = csv.reader(stream)
    expected = np.array(rows, float).T
    assert expected.shape == (7, 901)
    for name, column in zip(header, expected, strict=True):
        found = (results.time if name == "time" else results[name])[::5]
        np.testing.assert_allclose(found, column, rtol=1e-9, atol=1e-9)  # 12 digits
    assert f"The trolley gets {results['crane.trolley_position'][-1]:.2f} m far" in PAGE


def test_the_page_tells_every_parameter_set():
    assert {name.strip("`") for name, _ in ROWS} == {"(none)", *(path.stem for path in (FOLDER / "parameter_sets").iterdir())}


@pytest.mark.parametrize(("name", "printed"), ROWS)
def test_the_sets_leave_what_the_page_says(archive, name, printed):
    """The rows of the page's table, to the digits that it prints."""
    results = run(archive, *([] if name == "(none)" else [name.strip("`")]))
    for crane, text in zip(CRANES, printed.split("|"), strict=True):
        swing = math.degrees(0.5 * np.ptp(results[f"{crane}.swing_angle"][results.time >= 32.0]))
        number = text.split()[0]
        assert f"{swing:.{len(number.partition('.')[2])}f}" == number


def test_the_study_sweeps(archive, tmp_path):
    """At any speed of the hoist the load rests to 0.05 deg, where a shaper for the rope at the start leaves up to a degree."""
    study = read_study(FOLDER / "study.toml")
    study.folder = str(tmp_path)
    study.system = str(archive)
    study.vary["hoist.press_speed[1]"].points = 3
    assert run_study(study, tmp_path / "s.sqlite") == {"done": 8}
    with Store(tmp_path / "s.sqlite") as store:
        runs = [{name: math.degrees(value) for name, value in one.metrics.items()} for one in store.runs()]
    assert all(one["residual_swing"] < 0.05 for one in runs)
    assert max(one["residual_swing_of_the_fixed_shaper"] for one in runs) > 0.5
