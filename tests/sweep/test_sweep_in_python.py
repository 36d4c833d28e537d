"""A system built in Python, swept without a file: the formula's robustness, resuming, reports, what is refused."""

from __future__ import annotations

import hashlib
import math
import shutil
from typing import Any

import pytest
from sweep_cases import content, runs_of
from typer.testing import CliRunner

from shaper_fmu import Residual, Store, System, Vary, sweep_system
from shaper_fmu.cli.main import app
from shaper_fmu.errors import ArgumentError, ModelError, StudyError
from shaper_fmu.sweep.engine import load_stored_system

W = 2.0 * math.pi
RATIOS = (0.8, 1.0, 1.25)
SWEEP: dict[str, Any] = {
    "vary": {"plant.stiffness": [ratio * ratio * W * W for ratio in RATIOS]},
    "compare": {kind: {"shaper.shaper": kind} for kind in ("none", "zv")},
    "metrics": {"residual": Residual("plant.position", command="shaper.shaped")},
    "stop_time": 3.0,
    "step": 0.001,
}


def built(fmus, mass: float = 1.0) -> System:
    system = System("shaped")
    system.add("shaper", fmus / "InputShaper.fmu", natural_frequency=[W], command=1.0)
    system.add("plant", fmus / "MassSpringDamper.fmu", mass=mass, stiffness=W * W, damping=0.0)
    system.connect("shaper.shaped", "plant.force")
    return system


@pytest.fixture(scope="module")
def swept(fmus, tmp_path_factory):
    store = tmp_path_factory.mktemp("python") / "s.sqlite"
    assert sweep_system(built(fmus), store, **SWEEP) == {"done": 6}
    return store


def test_the_residuals_are_the_formulas(swept):
    """|cos(pi r / 2)| for ZV (Singer and Seering 1990), r the actual over the designed frequency; edges are within a step."""
    residual: dict[str, list[float]] = {"none": [], "zv": []}
    for run in runs_of(swept):
        residual[run.compared].append(run.metrics["residual"])
    shares = [zv / none for zv, none in zip(residual["zv"], residual["none"], strict=True)]
    assert shares == pytest.approx([abs(math.cos(0.5 * math.pi * ratio)) for ratio in RATIOS], abs=W * 1.25 * 0.001)


def test_it_is_resumed_by_the_same_call_with_a_system_built_anew(swept, fmus, tmp_path):
    """After a Ctrl-C, with workers, and once more with nothing left to do; the archive keeps its bytes."""
    store = tmp_path / "s.sqlite"
    seen: list[tuple[int, ...]] = []

    def interrupt(*told: int) -> None:
        seen.append(told)
        if len(seen) == 2:
            raise KeyboardInterrupt

    with pytest.raises(KeyboardInterrupt):
        sweep_system(built(fmus), store, **SWEEP, progress=interrupt)
    digest = hashlib.sha256((tmp_path / "s.sqlite.ssp").read_bytes()).hexdigest()
    assert sweep_system(built(fmus), store, **SWEEP, workers=1) == {"done": 6}
    assert content(runs_of(store)) == content(runs_of(swept))
    seen.clear()
    sweep_system(built(fmus), store, **SWEEP, progress=lambda *told: seen.append(told))
    assert seen == [(6, 0, 6)]
    assert hashlib.sha256((tmp_path / "s.sqlite.ssp").read_bytes()).hexdigest() == digest
    with Store(store) as opened:
        assert opened.provenance()["system"] == digest
        assert opened.study().name == "shaped"


def test_both_files_together_can_be_moved_reported_and_exported(swept, tmp_path):
    for name in ("s.sqlite", "s.sqlite.ssp"):
        shutil.copy(swept.parent / name, tmp_path / name)
    with Store(tmp_path / "s.sqlite") as store:
        assert list(load_stored_system(store).system.fmus) == ["shaper", "plant"]
    done = CliRunner().invoke(app, ["export", str(tmp_path / "s.sqlite"), "--output", str(tmp_path / "runs.csv")])
    assert done.exit_code == 0, done.output
    assert len((tmp_path / "runs.csv").read_text().splitlines()) == 7
    done = CliRunner().invoke(app, ["report", str(tmp_path / "s.sqlite"), "--output", str(tmp_path / "r.html")])
    assert done.exit_code == 0, done.output
    assert "residual" in (tmp_path / "r.html").read_text()


def test_another_system_is_refused_and_the_archive_stays(swept, fmus):
    before = (swept.parent / "s.sqlite.ssp").read_bytes()
    with pytest.raises(StudyError, match="holds runs of another system than this one; give another store"):
        sweep_system(built(fmus, mass=2.0), swept, **SWEEP)
    assert (swept.parent / "s.sqlite.ssp").read_bytes() == before
    with pytest.raises(StudyError, match="another study"):
        sweep_system(built(fmus), swept, **{**SWEEP, "step": 0.002})


def test_what_an_archive_cannot_hold_is_refused(fmus, tmp_path):
    driven = built(fmus)
    driven.drive("shaper.command", math.sin)
    with pytest.raises(ModelError, match=r"shaper\.command is driven from outside"):
        sweep_system(driven, tmp_path / "s.sqlite", **SWEEP)
    announcing = built(fmus)
    announcing.without_event_mode.add("shaper")
    with pytest.raises(StudyError, match=r"does not hold instances without event mode: .*shaper"):
        sweep_system(announcing, tmp_path / "s.sqlite", **SWEEP)
    assert not (tmp_path / "s.sqlite").exists()


def test_wrong_names_are_told_as_in_a_study(fmus, tmp_path):
    wrong = {**SWEEP, "vary": {"plant.stifness": Vary(values=[1.0])}}
    with pytest.raises(ModelError, match="Did you mean 'stiffness'"):
        sweep_system(built(fmus), tmp_path / "s.sqlite", **wrong)
    with pytest.raises(ArgumentError, match=r"no option 'refrence'. Did you mean 'reference'"):
        sweep_system(built(fmus), tmp_path / "s.sqlite", **SWEEP, refrence="none")
