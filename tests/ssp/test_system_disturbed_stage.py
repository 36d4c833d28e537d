"""The stage of ssp/disturbed_stage: its reference result, what its page says of its parameter sets, and its study."""

from __future__ import annotations

import csv
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

FOLDER = Path(__file__).parents[2] / "ssp" / "disturbed_stage"
PAGE = (FOLDER / "README.md").read_text(encoding="utf-8")
MOVE, GUST, STOP = 1.0, 11.0, 22.0
ROWS = re.findall(r"^\| (\(none\)|`\w+`) \|[^|]*\|((?: [\d.]+ \|){4})$", PAGE, re.MULTILINE)


@pytest.fixture(scope="module")
def archive(fmus, tmp_path_factory) -> Path:
    return pack_ssp(FOLDER, fmus, tmp_path_factory.mktemp("disturbed") / "disturbed_stage.ssp")


def run(archive: Path, *sets: str, step: float = 0.01) -> Results:
    loaded = load_ssp(archive)
    for which in sets:
        apply_parameter_set(loaded, which)
    return loaded.simulate(STOP, step)


def deflection(results: Results) -> np.ndarray:
    """The tip against the carriage [mm]."""
    return 1e3 * (results["stage.position[3]"] - results["stage.position[2]"])


def test_a_run_agrees_with_the_reference(archive):
    results = run(archive)
    with (FOLDER / "reference.csv").open(newline="", encoding="utf-8") as stream:
        header, *rows = csv.reader(stream)
    expected = np.array(rows, float).T
    assert expected.shape == (7, 441)
    for name, column in zip(header, expected, strict=True):
        found = (results.time if name == "time" else results[name])[::5]
        np.testing.assert_allclose(found, column, rtol=1e-10, atol=1e-10)  # 12 digits


def test_the_communication_step_may_be_a_part_of_the_sample_period(archive):
    coarse, fine = (run(archive, step=step) for step in (0.01, 0.002))
    np.testing.assert_allclose(deflection(fine)[::5], deflection(coarse), atol=1e-9)


def test_the_page_tells_every_parameter_set():
    assert {name.strip("`") for name, _ in ROWS} == {"(none)", *(path.stem for path in (FOLDER / "parameter_sets").iterdir())}


@pytest.mark.parametrize(("name", "printed"), ROWS)
def test_the_sets_do_what_the_page_says(archive, name, printed):
    """The rows of the page's table, to the digits that it prints."""
    results = run(archive, *([] if name == "(none)" else [name.strip("`")]))
    time, swing = results.time, np.abs(deflection(results))
    before, after = time <= GUST, time >= GUST
    found = [swing[before].max(), swing[before & (time > MOVE + 4.0)].max(), swing[after].max(), swing[time > GUST + 4.5].max()]
    assert [f"{value:.1f}" for value in found] == [text.strip() for text in printed.strip(" |").split("|")]


def test_the_study_sweeps(archive, tmp_path):
    """Outside of the loop the shaper does not help against the gust; the inverse does, most of all where it is designed."""
    study = read_study(FOLDER / "study.toml")
    study.folder = str(tmp_path)
    study.system = str(archive)
    study.vary["stage.stiffness[2]"].points = 3
    assert run_study(study, tmp_path / "s.sqlite") == {"done": 12}
    with Store(tmp_path / "s.sqlite") as store:
        found = {(one.compared, one.varied["stage.stiffness[2]"]): one.metrics["acceleration_of_the_tip"] for one in store.runs()}
    for stiffness in (0.1225, 0.25, 0.4225):
        assert found["shaper outside", stiffness] == pytest.approx(found["no shaper", stiffness], rel=0.01)
        assert found["inverse", stiffness] < found["no shaper", stiffness]
    assert found["inverse", 0.25] < 0.05 * found["no shaper", 0.25]
