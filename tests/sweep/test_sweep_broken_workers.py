"""FMUs that break the process they run in: copies of it, its channel, its start. They cost their own runs and no others."""

from __future__ import annotations

import os
import signal
import sys
from pathlib import Path

import msgspec
import pytest
from harmful_fmu import build_harmful
from sweep_cases import harmful_study, runs_of

from shaper_fmu.errors import SimulationError
from shaper_fmu.master.isolated_process import Child, send
from shaper_fmu.sweep.engine import engine_for, run_study
from shaper_fmu.sweep.runs import Outcome
from shaper_fmu.sweep.worker import Answer

RUNS = 12


@pytest.fixture(scope="module")
def harmful(tmp_path_factory) -> Path:
    return build_harmful(tmp_path_factory.mktemp("harmful"))


def swept(folder: Path, fmu: Path, harms: dict[int, str], **engine) -> list:
    study = harmful_study(folder, fmu, [harms.get(i, "none") for i in range(RUNS)])
    run_study(study, folder / "s.sqlite", engine=engine_for(**engine))
    return runs_of(folder / "s.sqlite")


def check(runs: list, failed: dict[int, str]) -> None:
    """All runs have ended, these failed for such reasons, and the others have their peaks: the command times 1 s."""
    assert [run.id for run in runs] == list(range(RUNS))
    assert {run.id for run in runs if run.status == "failed"} == set(failed)
    for number, words in failed.items():
        assert words in (runs[number].reason or ""), runs[number].reason
    done = [run for run in runs if run.id not in failed]
    assert [run.metrics["peak"] for run in done] == pytest.approx([1.0 + run.id for run in done], rel=1e-12)


@pytest.mark.representatives(engine=[{"workers": 0}, {"workers": 2}])
@pytest.mark.parametrize("engine", [{"workers": 0}, {"workers": 1}, {"workers": 2}, {"dask": "local", "workers": 1}], ids=str)
def test_a_process_that_an_fmu_forks_and_lets_return_does_nothing(harmful, tmp_path, engine):
    """In a step and at the start of a run, among the first runs (which are done twice) and later ones."""
    if "dask" in engine:
        pytest.importorskip("distributed")
    check(swept(tmp_path, harmful, {0: "fork", 4: "fork", 5: "fork", 9: "fork_at_start"}, **engine), {})


def test_an_fmu_that_goes_on_as_a_copy_of_its_process_is_quarantined(harmful, tmp_path):
    check(swept(tmp_path, harmful, {6: "fork_and_leave"}, workers=2), {6: "quarantined: it ended its worker 2 times"})


def framed(content: bytes) -> bytes:
    """As a worker sends it."""
    ours, theirs = os.pipe()
    send(theirs, content)
    found = os.read(ours, len(content) + 100)
    os.close(ours)
    os.close(theirs)
    return found


FRAMES = {  # what an FMU may write into the channel of its worker
    "noise": b"no frame at all, " * 20,
    "zeros": bytes(64),
    "length": b"\x93fm" + b"\xff" * 5 + b"x",
    "text": framed(b"no answer"),
    "twice": framed(msgspec.msgpack.encode(Answer([Outcome(0, (1.0,), None, 0.0)]))),
    "unknown": framed(msgspec.msgpack.encode(Answer([Outcome(10**9, (1.0,), None, 0.0)]))),
    "many metrics": framed(msgspec.msgpack.encode(Answer([Outcome(7, (1.0, 2.0), None, 0.0)]))),
    "no reason": framed(msgspec.msgpack.encode(Answer([Outcome(7, None, None, 0.0)]))),
}


@pytest.mark.representatives(kind=["noise", "length", "no reason"])
@pytest.mark.parametrize("kind", FRAMES)
def test_answers_that_nobody_asked_for_are_ignored_and_the_worker_is_replaced(harmful, tmp_path, monkeypatch, kind):
    monkeypatch.setenv("HARMFUL_FRAME", str(tmp_path / "frame"))
    (tmp_path / "frame").write_bytes(FRAMES[kind])
    check(swept(tmp_path, harmful, {7: "write_anywhere"}, workers=1), {7: "quarantined: it ended its worker 2 times"})


@pytest.mark.representatives(harm=["close_all"])
@pytest.mark.parametrize("harm", ["close_all", "reopen_all"])
def test_an_fmu_that_closes_the_files_of_its_process_is_quarantined(harmful, tmp_path, harm):
    check(swept(tmp_path, harmful, {7: harm}, workers=1), {7: "quarantined: it ended its worker 2 times"})


@pytest.mark.representatives(workers=[2])
@pytest.mark.parametrize("workers", [1, 2])
def test_workers_that_are_killed_while_they_start_are_replaced(harmful, tmp_path, monkeypatch, workers):
    """The first three, as by somebody who is short of memory; each before it has sent anything."""
    killed, started = [], Child.__init__

    def start(self, *arguments, **options):
        started(self, *arguments, **options)
        if len(killed) < 3:
            killed.append(self.process.pid)
            os.kill(self.process.pid, signal.SIGKILL)

    monkeypatch.setattr(Child, "__init__", start)
    runs = swept(tmp_path, harmful, {}, workers=workers)
    check(runs, {})
    assert {run.attempts for run in runs} == {1}
    assert len(killed) == 3


def test_workers_that_never_start_are_told_after_some_tries(harmful, tmp_path, monkeypatch):
    monkeypatch.setattr(sys, "executable", "/bin/false")
    with pytest.raises(SimulationError, match=r"5 workers in a row ended before their first run, the last one: .*exit status 1"):
        swept(tmp_path, harmful, {}, workers=2)


def test_crashes_in_a_row_are_rows_once_a_run_is_done(harmful, tmp_path, monkeypatch):
    """More of them than a sweep bears in which nothing else happens (20 in earnest)."""
    monkeypatch.setattr("shaper_fmu.sweep.pool._MOST_BARREN", 2)
    study = harmful_study(tmp_path, harmful, ["none"] * 4 + ["null"] * 3)
    assert run_study(study, tmp_path / "s.sqlite", engine=engine_for(1)) == {"done": 4, "failed": 3}
