"""The crane of ssp/operator_crane: its reference result, limits, what its page says of its parameter sets, and its study."""

from __future__ import annotations

import csv
import math
import re
from pathlib import Path

import numpy as np
import pytest

from shaper_fmu.master.results import Results
from shaper_fmu.ssp.archive import load_ssp, pack_ssp
from shaper_fmu.ssp.parameter_sets import apply_parameter_set
from shaper_fmu.sweep.engine import run_study
from shaper_fmu.sweep.store import Store
from shaper_fmu.sweep.study import read_study

FOLDER = Path(__file__).parents[2] / "ssp" / "operator_crane"
PAGE = (FOLDER / "README.md").read_text(encoding="utf-8")
STOP = 17.5
ROWS = re.findall(r"^\| (\(none\)|`\w+`)[^|]*\|(.*deg.*)\|$", PAGE, re.MULTILINE)


@pytest.fixture(scope="module")
def archive(fmus, tmp_path_factory) -> Path:
    return pack_ssp(FOLDER, fmus, tmp_path_factory.mktemp("operated") / "operator_crane.ssp")


def run(archive: Path, *sets: str) -> Results:
    loaded = load_ssp(archive)
    for which in sets:
        apply_parameter_set(loaded, which)
    return loaded.simulate(40.0, 0.01)


def swing(results: Results, crane: str = "crane") -> float:
    """Half of the largest less the smallest angle from 30 s on [deg]."""
    return math.degrees(0.5 * np.ptp(results[f"{crane}.swing_angle"][results.time >= 30.0]))


def test_a_run_agrees_with_the_reference(archive):
    results = run(archive)
    with (FOLDER / "reference.csv").open(newline="", encoding="utf-8") as stream:
        header, *rows = csv.reader(stream)
    expected = np.array(rows, float).T
    assert expected.shape == (6, 801)
    for name, column in zip(header, expected, strict=True):
        found = (results.time if name == "time" else results[name])[::5]
        np.testing.assert_allclose(found, column, rtol=1e-10, atol=1e-10)  # 12 digits


def test_the_page_tells_every_parameter_set():
    assert {name.strip("`") for name, _ in ROWS} == {"(none)", *(path.stem for path in (FOLDER / "parameter_sets").iterdir())}


@pytest.mark.parametrize(("name", "printed"), ROWS)
def test_the_sets_do_what_the_page_says(archive, name, printed):
    """The rows of the page's table, to the digits that it prints; and the limits hold at every point."""
    results = run(archive, *([] if name == "(none)" else [name.strip("`")]))
    speed, place = results["drive.speed"], results["crane.trolley_position"]
    assert np.abs(speed).max() <= 1.0
    stopping = results.time > STOP + 1e-9
    assert np.abs(results["drive.acceleration"]).max() <= 0.5
    assert np.abs(results["drive.acceleration"][results.time < STOP - 1e-9]).max() <= 0.3
    at = np.searchsorted(results.time, STOP)
    moving = results.time[np.flatnonzero(np.abs(results["drive.acceleration_mean"]) > 1e-9)[-1]]
    found = [moving - STOP, np.max(place[stopping]) - place[at], place[-1] - place[at], swing(results)]
    for value, text in zip(found, printed.split("|"), strict=True):
        number = text.split()[0]
        assert f"{value:.{len(number.partition('.')[2])}f}" == number


def test_the_plain_drive_leaves_what_the_page_says(archive):
    assert f"The plain drive leaves {swing(run(archive), 'plain_crane'):.1f} deg." in PAGE


def test_the_study_sweeps(archive, tmp_path):
    """Without hoisting both leave a few hundredths of a degree; with it, measuring leaves less than swing_tolerance."""
    study = read_study(FOLDER / "study.toml")
    study.folder = str(tmp_path)
    study.system = str(archive)
    study.vary["crane.hoist_speed"].points = 3
    assert run_study(study, tmp_path / "s.sqlite") == {"done": 6}
    with Store(tmp_path / "s.sqlite") as store:
        found = {
            (one.compared, one.varied["crane.hoist_speed"]): math.degrees(one.metrics["residual_swing"]) for one in store.runs()
        }
    assert found["model", 0.0] < 0.03 > found["measured", 0.0]
    for speed in (-0.1, 0.1):
        assert found["measured", speed] < math.degrees(0.002) < 0.4 < found["model", speed]
