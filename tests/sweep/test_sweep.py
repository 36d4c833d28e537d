"""Sweeps: the plan, the store, resuming, failures; the crane's robustness against the linear formula."""

from __future__ import annotations

import math
import sqlite3

import numpy as np
import pytest
from sweep_cases import CRANE, content, crane_study, runs_of

from shaper_fmu.analysis.response import command_end, residual_amplitude
from shaper_fmu.archives import read_archive, write_archive
from shaper_fmu.errors import ModelError, StudyError
from shaper_fmu.sweep.engine import load_stored_system, run_study
from shaper_fmu.sweep.runs import Run
from shaper_fmu.sweep.store import Store
from shaper_fmu.sweep.study import Study


@pytest.fixture(scope="module")
def swept(fmus, tmp_path_factory) -> tuple[Study, list[Run]]:
    folder = tmp_path_factory.mktemp("swept")
    study = crane_study(folder, fmus)
    assert run_study(study, folder / "s.sqlite") == {"done": 9}
    return study, runs_of(folder / "s.sqlite")


def linear_residual_ratio(order: int, ratio: float) -> float:
    """Residual of an undamped oscillator by a ZV (1) or ZVD (2) shaped command over the unshaped one: |cos(pi r / 2)|^order.

    Singer and Seering 1990; r is the ratio of the actual to the design frequency, and any command has the factor.
    """
    return abs(math.cos(math.pi * ratio / 2)) ** order


def test_small_swings_have_the_formulas_robustness(swept):
    """A move of 10 mm swings linearly; `shaped_mean` splits an edge over a step, an error of (w h)^2 / 16 < 4e-5."""
    found = {(r.compared, r.varied["crane.initial_rope_length"]): r.metrics["residual_swing"] for r in swept[1]}
    for length in (6.4, 8.0, 9.6):
        for case, order in (("ZV", 1), ("ZVD", 2)):
            expected = linear_residual_ratio(order, math.sqrt(8.0 / length))
            assert found[case, length] / found["unshaped", length] == pytest.approx(expected, abs=2e-4)


def test_the_plan_is_the_grid_of_all_cases(swept):
    study, runs = swept
    assert [r.id for r in runs] == list(range(9))
    assert [(r.compared, r.varied["crane.initial_rope_length"]) for r in runs] == [
        (case, length) for case in ("unshaped", "ZV", "ZVD") for length in (6.4, 8.0, 9.6)
    ]
    assert study.vary["crane.initial_rope_length"].grid() == [6.4, 8.0, 9.6]
    assert all(r.metrics["peak_swing"] >= r.metrics["residual_swing"] > 0.0 for r in runs)


def test_an_interrupted_sweep_resumes_to_the_same_content(swept, fmus, tmp_path):
    study = crane_study(tmp_path, fmus)
    seen: list[tuple[int, int, int]] = []

    def interrupt(done: int, failed: int, total: int) -> None:
        seen.append((done, failed, total))
        if len(seen) in (2, 4):
            raise KeyboardInterrupt

    for _ in range(2):
        with pytest.raises(KeyboardInterrupt):
            run_study(study, tmp_path / "s.sqlite", interrupt)
    with Store(tmp_path / "s.sqlite") as store:
        kept = store.counts()
    assert kept == {"done": 2, "planned": 7}  # each start enters its first run alone
    assert run_study(study, tmp_path / "s.sqlite", interrupt) == {"done": 9}
    assert content(runs_of(tmp_path / "s.sqlite")) == content(swept[1])
    assert [done for done, _, _ in seen] == sorted(done for done, _, _ in seen)
    again: list[tuple[int, int, int]] = []
    run_study(study, tmp_path / "s.sqlite", lambda *told: again.append(told))
    assert again == [(9, 0, 9)]  # nothing is run twice


def test_a_run_that_fails_is_a_row_and_the_others_complete(swept, fmus, tmp_path):
    text = CRANE.replace('ZV = { "shaper.shaper" = "zv"', 'ZV = { "crane.hoist_speed" = 0.35, "shaper.shaper" = "zv"')
    assert run_study(crane_study(tmp_path, fmus, text), tmp_path / "s.sqlite") == {"done": 7, "failed": 2}
    runs = runs_of(tmp_path / "s.sqlite")
    failed = [r for r in runs if r.status == "failed"]
    # hoisting 0.35 m/s for 24 s takes 8.4 m: too much for 6.4 and 8 m of rope, not for 9.6 m
    assert [(r.compared, r.varied["crane.initial_rope_length"]) for r in failed] == [("ZV", 6.4), ("ZV", 8.0)]
    assert all("crane at t = " in (r.reason or "") and "leaves no rope" in (r.reason or "") for r in failed)
    expected = [c for c in content(swept[1]) if c[1] != "ZV"]
    assert [c for c in content(runs) if c[1] != "ZV"] == expected


def test_a_store_is_not_mixed_with_another_study_or_other_fmus(fmus, tmp_path):
    study = crane_study(tmp_path, fmus)
    with Store(tmp_path / "s.sqlite", study, {"fmus": {"crane": "1"}}) as store:
        assert store.study() == study
        assert store.provenance() == {"fmus": {"crane": "1"}}
    other = crane_study(tmp_path, fmus, CRANE.replace("step = 0.02", "step = 0.01"))
    with pytest.raises(StudyError, match="holds runs of another study"):
        Store(tmp_path / "s.sqlite", other, {"fmus": {"crane": "1"}})
    with pytest.raises(StudyError, match="holds runs of other FMUs"):
        Store(tmp_path / "s.sqlite", study, {"fmus": {"crane": "2"}})


def test_what_is_no_store_is_refused(tmp_path):
    (tmp_path / "text.sqlite").write_text("no database, " * 100)
    with pytest.raises(StudyError, match="not a sweep's store"):
        Store(tmp_path / "text.sqlite")
    with pytest.raises(StudyError, match="no such store"):
        Store(tmp_path / "none.sqlite")
    sqlite3.connect(tmp_path / "empty.sqlite").close()
    with pytest.raises(StudyError, match="holds no study"):
        Store(tmp_path / "empty.sqlite")


@pytest.mark.parametrize(
    ("old", "new", "words"),
    [
        ("stop_time = 24.0", "", "missing required field `stop_time`"),
        ("points = 3", "pionts = 3", r"study.toml, line 12: .*unknown field `pionts`.*Did you mean 'points'"),
        ("[compare]", "[plan]\nkind = 'gird'\n[compare]", "plan.kind = 'gird' is not one of grid, zip.*Did you mean 'grid'"),
        ("[compare]", "[plan]\nkind = 'sobol'\n[compare]", "sobol needs samples"),
        ("points = 3", "points = 3\nspacing = 'log'\n", None),
        ("low = 6.4", "low = -6.4\nspacing = 'log'", r"vary.crane.initial_rope_length: log spacing needs 0 < low < high"),
        ("reference =", "time_limit = -1.0\nreference =", "time_limit = -1.0 must be positive"),
        ("reference =", "solver_tolerance = 2.0\nreference =", r"solver_tolerance = 2\.0 must lie between 0 and 1"),
        ("reference =", "solver_tolerance = -1e-6\nreference =", "must lie between 0 and 1"),
        ("reference =", "solver = 'euler'\nreference =", "solver = 'euler'"),
        ("[metrics.peak_swing]", "[metrics.'peak-swing']", "a metric's name has letters"),
        ("[metrics.peak_swing]", "[metrics.seconds]", "metric 'seconds': this name is a column of the store's own"),
        ("[compare]", "[refine]\nmetric = 'peek_swing'\nlevel = 0.05\nwidth = 1.0\n[compare]", "Did you mean 'peak_swing'"),
        ("points = 3", "points = 1", "at least 2 points"),
        ("step = 0.02", 'step = "small"', "Expected `float`, got `str`"),
        ('kind = "peak"', 'kind = "pique"', "Invalid value 'pique'"),
        ('reference = "unshaped"', 'reference = "unshapd"', r"'unshapd' is not one of \[compare\]. Did you mean 'unshaped'\?"),
        ("name =", "name", "study.toml: "),
    ],
)
def test_wrong_studies_are_refused(fmus, tmp_path, old, new, words):
    if words is None:
        assert crane_study(tmp_path, fmus, CRANE.replace(old, new, 1)).count == 12
        return
    with pytest.raises(StudyError, match=words):
        crane_study(tmp_path, fmus, CRANE.replace(old, new, 1))


@pytest.mark.parametrize(
    ("old", "new", "words"),
    [
        ('output = "crane.swing_angle"', 'output = "crane.swing_angel"', "Did you mean 'swing_angle'?"),
        ('"crane.initial_rope_length"', '"crane.inital_rope_length"', "Did you mean 'initial_rope_length'?"),
        ('"shaper.shaper" = "zv"', '"shaper.shaper" = "zw"', "'zw' is not a value of shaper"),
    ],
)
def test_names_that_the_system_does_not_have_are_refused_before_the_first_run(fmus, tmp_path, old, new, words):
    study = crane_study(tmp_path, fmus, CRANE.replace(old, new, 1))
    with pytest.raises(ModelError, match=words.replace("?", r"\?")):
        run_study(study, tmp_path / "s.sqlite")
    assert not (tmp_path / "s.sqlite").exists()


def test_residual_amplitude_of_a_known_response():
    time = np.linspace(0.0, 10.0, 10001)
    response = np.where(time < 4.0, 5.0, 1.0 + 0.3 * np.sin(7.0 * time))
    command = np.where(time < 4.0, 0.0, 2.0)
    assert command_end(time, command) == pytest.approx(4.0, abs=1e-12)
    assert residual_amplitude(time, response, 4.0) == pytest.approx(0.3, rel=(7.0 * 0.001) ** 2 / 8)
    assert command_end(time, np.ones(10001)) == 0.0


def test_a_changed_system_is_not_mixed_with_the_old_runs(fmus, tmp_path):
    study = crane_study(tmp_path, fmus, CRANE.replace("points = 3", "points = 2"))
    run_study(study, tmp_path / "s.sqlite")
    packed = tmp_path / "crane.ssp"
    files = read_archive(packed.read_bytes(), "crane.ssp")
    changed = files["resources/profile.ssv"].replace(b'value="8"', b'value="7"')
    write_archive(packed, {**files, "resources/profile.ssv": changed})
    with pytest.raises(StudyError, match="holds runs of other FMUs"):
        run_study(study, tmp_path / "s.sqlite")
    with Store(tmp_path / "s.sqlite") as store, pytest.raises(StudyError, match=r"its runs are of another crane\.ssp"):
        load_stored_system(store)


def test_a_command_that_has_not_ended_is_no_success(fmus, tmp_path):
    run_study(crane_study(tmp_path, fmus, CRANE.replace("stop_time = 24.0", "stop_time = 3.0")), tmp_path / "s.sqlite")
    runs = runs_of(tmp_path / "s.sqlite")
    assert {r.status for r in runs} == {"failed"}
    assert all("has not come to its end by t = 3 s" in (r.reason or "") for r in runs)


def test_a_foreign_database_is_left_alone(tmp_path):
    path = tmp_path / "mine.sqlite"
    with sqlite3.connect(path) as database:
        database.execute("CREATE TABLE mine (x)")
    database.close()
    before = path.read_bytes()
    with pytest.raises(StudyError, match="a database, but not a sweep's store"):
        Store(path)
    assert path.read_bytes() == before
