"""Stores on full disks and read-only media, damaged, taken away, of other versions; and what is left beside them."""

from __future__ import annotations

import csv
import os
import resource
import signal
import sqlite3
import subprocess
import sys
import tracemalloc
from pathlib import Path

import numpy as np
import pytest
from sweep_cases import CRANE

from shaper_fmu.errors import StudyError
from shaper_fmu.master.results import Results
from shaper_fmu.spreadsheets import plain_text, safe_text
from shaper_fmu.sweep.export import write_csv
from shaper_fmu.sweep.runs import Outcome
from shaper_fmu.sweep.store import Store
from shaper_fmu.sweep.study import Study, check_study, read_study


def study_in(folder: Path, points: int = 3, text: str = CRANE) -> Study:
    (folder / "study.toml").write_text(text.replace("points = 3", f"points = {points}"))
    return read_study(folder / "study.toml")


def filled(folder: Path, points: int = 3) -> Path:
    """A store whose runs are all done, the metrics of run i being i and i + 0.5."""
    study = study_in(folder, points)
    with Store(folder / "s.sqlite", study, {}) as store:
        tasks = list(store.planned())
        store.enter([Outcome(task.id, (float(task.id), task.id + 0.5), None, 0.0) for task in tasks])
    return folder / "s.sqlite"


def beside(folder: Path) -> list[str]:
    return sorted(path.name for path in folder.iterdir() if path.name != "study.toml")


def test_nothing_is_left_beside_a_store(tmp_path):
    store = filled(tmp_path)
    assert beside(tmp_path) == ["s.sqlite"]
    with Store(store) as opened:
        assert opened.counts() == {"done": 9}
        write_csv(opened, tmp_path / "r.csv")
    assert beside(tmp_path) == ["r.csv", "s.sqlite"]


KILLED = """
import os, signal, sys
from shaper_fmu.sweep.runs import Outcome
from shaper_fmu.sweep.store import Store
from shaper_fmu.sweep.study import read_study
store = Store(sys.argv[2], read_study(sys.argv[1]), {})
store.enter([Outcome(task.id, (1.0, 2.0), None, 0.0) for task in list(store.planned())[:4]])
os.kill(os.getpid(), signal.SIGKILL)
"""


@pytest.mark.skipif(sys.platform != "linux" or os.geteuid() != 0, reason="needs to mount")
@pytest.mark.parametrize("killed", [False, True], ids=["finished", "killed"])
def test_a_store_on_a_read_only_medium_is_read(tmp_path, killed):
    """One that is finished, and one whose sweep was killed: its rows are in the log beside it."""
    medium = tmp_path / "medium"
    medium.mkdir()
    if killed:
        study_in(medium)
        command = [sys.executable, "-c", KILLED, str(medium / "study.toml"), str(medium / "s.sqlite")]
        assert subprocess.run(command, check=False).returncode == -signal.SIGKILL
        assert "s.sqlite-wal" in beside(medium)
        (medium / "s.sqlite-shm").unlink()
    else:
        filled(medium)
    before = beside(medium)
    if subprocess.run(["mount", "--bind", medium, medium], capture_output=True, check=False).returncode:
        pytest.skip("mounts are not allowed here")
    try:
        subprocess.run(["mount", "-o", "remount,ro,bind", medium], check=True)
        with Store(medium / "s.sqlite") as opened:
            assert opened.counts() == ({"done": 4, "planned": 5} if killed else {"done": 9})
            assert write_csv(opened, tmp_path / "r.csv") == 9
        with pytest.raises(StudyError, match=r"s\.sqlite: cannot be written: Read-only file system"):
            Store(medium / "s.sqlite", read_study(medium / "study.toml"), {})
        assert beside(medium) == before
    finally:
        subprocess.run(["umount", medium], check=True)


@pytest.mark.skipif(sys.platform == "win32", reason="no limits of file sizes there")
def test_a_full_disk_is_told_and_what_was_entered_stays(tmp_path):
    """A limit of the files' size in the place of a small disk."""
    study = study_in(tmp_path, 2000)
    soft, hard = resource.getrlimit(resource.RLIMIT_FSIZE)
    entered = 0

    def enter_all(store: Store) -> None:
        nonlocal entered
        for task in store.planned():
            store.enter([Outcome(task.id, (1.0, 2.0), None, 0.0)])
            entered += 1

    with Store(tmp_path / "s.sqlite", study, {}) as store:
        resource.setrlimit(resource.RLIMIT_FSIZE, (200_000, hard))
        try:
            with pytest.raises(StudyError, match=r"s\.sqlite: .*what was entered before is kept"):
                enter_all(store)
        finally:
            resource.setrlimit(resource.RLIMIT_FSIZE, (soft, hard))
    assert entered > 10
    with Store(tmp_path / "s.sqlite", study, {}) as store:
        assert store.counts() == {"done": entered, "planned": study.count - entered}


def test_a_damaged_store_is_told(tmp_path):
    """Each page in turn overwritten; and rows that no sweep writes."""
    store = filled(tmp_path, 400)
    whole = store.read_bytes()
    told = []
    for place in range(0, len(whole), 4096):
        store.write_bytes(whole[:place] + bytes([0xA5]) * 4096 + whole[place + 4096 :])
        try:
            with Store(store) as opened:
                opened.runs()
        except StudyError as error:
            told.append(str(error).removeprefix(f"{store}: "))
    assert len(told) > 3
    assert all(words.startswith(("the store is damaged", "not a sweep's store")) for words in told)
    store.write_bytes(whole[: len(whole) // 2])
    with pytest.raises(StudyError, match="the store is damaged"), Store(store) as opened:
        opened.runs()


@pytest.mark.parametrize(
    ("change", "words"),
    [
        ("UPDATE run SET compared = 'nobody' WHERE id = 1", "run 1 has the case 'nobody'"),
        ("UPDATE run SET status = 'dune' WHERE id = 1", "status 'dune'"),
        ("UPDATE run SET peak_swing = NULL WHERE id = 1", "run 1 is done, and has .*None"),
        ("UPDATE study SET value = '{' WHERE key = 'study'", "its study cannot be read"),
        ("UPDATE study SET value = '2' WHERE key = 'format'", "another version of shaper-fmu .format '2', this version has 3"),
        ("UPDATE study SET value = '99' WHERE key = 'format'", "another version of shaper-fmu"),
        ("DELETE FROM study WHERE key = 'format'", "another version of shaper-fmu .no format"),
        ("DROP TABLE added", "a database, but not a sweep's store"),
        ("ALTER TABLE run RENAME COLUMN peak_swing TO other", "the store is damaged, or none: no such column: run.peak_swing"),
    ],
)
def test_stores_that_no_sweep_has_left_are_told(tmp_path, change, words):
    store = filled(tmp_path)
    database = sqlite3.connect(store)
    database.execute(change)
    database.commit()
    database.close()
    with pytest.raises(StudyError, match=words), Store(store) as opened:
        opened.runs()


def test_a_store_that_is_deleted_while_it_is_written_is_told(tmp_path):
    study = study_in(tmp_path)
    with Store(tmp_path / "s.sqlite", study, {}) as store:
        (tmp_path / "s.sqlite").unlink()
        with pytest.raises(StudyError, match="was deleted, moved or replaced while the sweep was writing"):
            store.enter([Outcome(0, (1.0, 2.0), None, 0.0)])


def test_folders_and_links_as_stores(tmp_path):
    study = study_in(tmp_path)
    (tmp_path / "folder").mkdir()
    for given in (study, None):
        with pytest.raises(StudyError, match="folder: a folder, not a store"):
            Store(tmp_path / "folder", given, {})
    (tmp_path / "link.sqlite").symlink_to(tmp_path / "s.sqlite")
    with Store(tmp_path / "s.sqlite", study, {}), pytest.raises(StudyError, match="another sweep is writing to this store"):
        Store(tmp_path / "link.sqlite", study, {})
    with pytest.raises(StudyError, match="cannot be written: No such file or directory"):
        Store(tmp_path / "nowhere" / "s.sqlite", study, {})


def test_a_run_that_is_told_twice_stays_as_it_was(tmp_path):
    with Store(filled(tmp_path), study_in(tmp_path), {}) as store:
        store.enter([Outcome(3, (7.0, 7.0), None, 0.0)])
        assert store.runs()[3].metrics == {"residual_swing": 3.0, "peak_swing": 3.5}


def test_names_that_differ_in_case_only_have_columns_of_their_own(tmp_path):
    text = CRANE.replace(
        "[metrics.peak_swing]", '[metrics.PEAK_swing]\nkind = "final"\noutput = "crane.swing_angle"\n[metrics.peak_swing]'
    )
    text = text.replace("[compare]", '[vary."crane.Initial_Rope_Length"]\nvalues = [1.0]\n[compare]\nzv = {}')
    with Store(tmp_path / "s.sqlite", study_in(tmp_path, text=text), {}) as store:
        store.enter([Outcome(5, (1.0, 2.0, 3.0), None, 0.0)])
        assert write_csv(store, tmp_path / "r.csv") == 12
    with Store(tmp_path / "s.sqlite") as store:
        run = store.runs()[5]
    assert run.metrics == {"residual_swing": 1.0, "PEAK_swing": 2.0, "peak_swing": 3.0}
    assert run.varied == {"crane.initial_rope_length": 9.6, "crane.Initial_Rope_Length": 1.0}
    with pytest.raises(StudyError, match="metric 'Status': this name is a column"):
        study_in(tmp_path, text=CRANE.replace("[metrics.peak_swing]", "[metrics.Status]"))


@pytest.mark.parametrize(
    ("old", "new", "words"),
    [
        ("points = 3", "points = 1000000000", "1000000000 values are too many"),
        ("points = 3", "points = 1000000000000000000000000", "values are too many"),
        ("points = 3", "points = 1000\n[vary.'crane.a']\nlow = 1\nhigh = 2\npoints = 1000000", "plan: 1000000000 points are too many"),
        ("[compare]", "[plan]\nkind = 'zip'\n[vary.'crane.a']\nlow = 1\nhigh = 2\npoints = 1000000000\n[compare]", "too many"),
        ("[compare]", "[plan]\nkind = 'sobol'\nsamples = 1000000000\n[compare]", "plan.samples: 1000000000 values of all samples"),
        ("[compare]", "[plan]\nkind = 'latin_hypercube'\nsamples = 9223372036854775807\n[compare]", "too many"),
        ("points = 3", "points = 10000\n[vary.'crane.a']\nlow = 1\nhigh = 2\npoints = 9000", "3 cases are 27\\d* runs, too many"),
        ("points = 3", "points = -3", "at least 2 points"),
        ("low = 6.4", "low = nan", "vary.crane.initial_rope_length.low = nan must be a finite number"),
        ("stop_time = 24.0", "stop_time = inf", "stop_time = inf must be a finite number"),
        ("reference =", "time_limit = inf\nreference =", "time_limit = inf must be a finite number"),
    ],
)  # fmt: skip
def test_numbers_that_no_sweep_can_do_are_refused_by_themselves(tmp_path, old, new, words):
    """In little memory: 10^9 numbers would take 8 GB."""
    tracemalloc.start()
    try:
        with pytest.raises(StudyError, match=words):
            check_study(study_in(tmp_path, text=CRANE.replace(old, new, 1)))
        assert tracemalloc.get_traced_memory()[1] < 4e6
    finally:
        tracemalloc.stop()


def test_no_text_of_a_table_is_a_formula(tmp_path):
    """As spreadsheets take texts (OWASP, CSV injection); the way back gives the same texts, and numbers are as ever."""
    cases = ["=cmd|' /C calc'!A0", "+1+1", "-2+3", "@SUM(A1)", "\t=1", "\r=1", "\n=1", " =1", "'=1", "'", "a=1", "\uff1d1", "ZV"]
    study = study_in(tmp_path, 2)
    study.compare, study.reference = {case: {} for case in cases}, None
    with Store(tmp_path / "s.sqlite", study, {}) as store:
        store.enter([Outcome(0, None, "=HYPERLINK(1)", 0.0), Outcome(2, (-1.5, float("inf")), None, 0.0)])
        write_csv(store, tmp_path / "r.csv")
    with open(tmp_path / "r.csv", newline="", encoding="utf-8") as stream:
        _, *rows = csv.reader(stream)
    assert not [row[1] for row in rows if row[1].lstrip(" ")[:1] in "=+-@\t\r\n\uff1d"]
    assert {plain_text(row[1]) for row in rows} == set(cases)
    assert rows[0][-3] == "'=HYPERLINK(1)"
    assert next(row[3:5] for row in rows if row[3]) == ["-1.5", "inf"]
    assert [safe_text(text) for text in ("-1", "-inf", "+2.5e3")] == ["-1", "-inf", "+2.5e3"]


def test_tables_of_runs_have_no_formulas_and_leave_no_drafts(tmp_path, monkeypatch):
    """A variable with such a name; a draft that a killed process left; a disk that is full at the end."""
    results = Results(np.array([0.0]), {"=cmd.x": np.array([-1.0])})
    (tmp_path / ".r.csv.draft").write_text("what a killed process has left")
    results.to_csv(tmp_path / "r.csv")
    assert (tmp_path / "r.csv").read_text() == "time,'=cmd.x\n0.0,-1.0\n"
    assert beside(tmp_path) == ["r.csv"]
    monkeypatch.setattr(os, "replace", lambda *_: (_ for _ in ()).throw(OSError(28, "No space left on device")))
    with pytest.raises(OSError, match="No space left"):
        results.to_csv(tmp_path / "r.csv")
    assert beside(tmp_path) == ["r.csv"]
