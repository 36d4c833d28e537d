"""Stores that are moved together with their systems, and refinements that would never end."""

from __future__ import annotations

import shutil
from pathlib import Path

import pytest
from harmful_fmu import build_harmful
from sweep_cases import harmful_study

from shaper_fmu.errors import StudyError
from shaper_fmu.sweep import engine
from shaper_fmu.sweep.engine import load_stored_system, run_study
from shaper_fmu.sweep.store import Store
from shaper_fmu.sweep.study import read_study

REFINED = """
name = "harm"
system = "harmful.ssp"
stop_time = 1.0
step = 0.1
[vary."x.command"]
low = 1.0
high = 3.0
points = 3
[metrics.peak]
kind = "peak"
output = "x.sum"
[refine]
metric = "peak"
level = 1.5
width = 1e-300
"""


@pytest.fixture
def swept(tmp_path) -> Path:
    """A folder with a study, its system, and its store in results/."""
    folder = tmp_path / "there"
    folder.mkdir()
    study = harmful_study(folder, build_harmful(folder), ["none"])
    (folder / "results").mkdir()
    run_study(study, folder / "results" / "s.sqlite")
    return folder


@pytest.mark.parametrize("store", ["s.sqlite", "results/s.sqlite"])
def test_a_system_is_found_with_a_store_that_was_moved(swept, tmp_path, store):
    """Beside it, or as they lay; not one of the same name with another content, though it lies where the runs were done."""
    moved = tmp_path / "moved"
    (moved / store).parent.mkdir(parents=True)
    shutil.move(swept / "results" / "s.sqlite", moved / store)
    shutil.move(swept / "harmful.ssp", moved / "harmful.ssp")
    for content in (None, b"another one"):
        if content is not None:
            (swept / "harmful.ssp").write_bytes(content)
        with Store(moved / store) as opened:
            assert list(load_stored_system(opened).system.fmus) == ["x"]


def test_a_system_that_is_nowhere_or_another_one_is_told(swept):
    (swept / "harmful.ssp").rename(swept / "other.ssp")
    with Store(swept / "results" / "s.sqlite") as opened:
        with pytest.raises(StudyError, match=r"there is no system harmful\.ssp in .*there, nor beside the store"):
            load_stored_system(opened)
        (swept / "results" / "harmful.ssp").write_bytes(b"another one")
        with pytest.raises(StudyError, match=r"its runs are of another harmful\.ssp"):
            load_stored_system(opened)


def test_a_refinement_adds_no_more_runs_than_it_may(tmp_path, monkeypatch):
    """The peak is the command, so one interval has the crossing, and gets three points a round; 10 000 in earnest."""
    harmful_study(tmp_path, build_harmful(tmp_path), ["none"])
    (tmp_path / "study.toml").write_text(REFINED)
    monkeypatch.setattr(engine, "_MOST_ADDED", 5)
    monkeypatch.setattr(engine, "_TIMES_ADDED", 0)
    for _ in range(2):  # nor when it is started again
        assert run_study(read_study(tmp_path / "study.toml"), tmp_path / "s.sqlite") == {"done": 4 + 5}
    with Store(tmp_path / "s.sqlite") as store:
        assert store.remarks()["refine"].startswith("the refinement ended after 5 added runs")
