"""Engines of sweeps: equal to the bit, and FMUs that crash, hang or give NaN cost their own runs and no others."""

from __future__ import annotations

import contextlib
import os
import re
import signal
import socket
import subprocess
import sys
import time
from collections.abc import Iterator
from pathlib import Path

import pytest
from harmful_fmu import build_harmful
from sweep_cases import content, crane_study, harmful_study, runs_of, workers_alive

from shaper_fmu.errors import ModelError, StudyError
from shaper_fmu.sweep.engine import engine_for, job_of, run_study
from shaper_fmu.sweep.engines import Processes, Serial
from shaper_fmu.sweep.store import Store

HARMS = ["none"] * 40


@pytest.fixture(scope="module")
def harmful(tmp_path_factory) -> Path:
    return build_harmful(tmp_path_factory.mktemp("harmful"))


@pytest.fixture(scope="module")
def serial_content(fmus, tmp_path_factory) -> list[tuple]:
    folder = tmp_path_factory.mktemp("serial")
    run_study(crane_study(folder, fmus), folder / "s.sqlite", engine=Serial())
    return content(runs_of(folder / "s.sqlite"))


@pytest.mark.representatives(workers=[2])
@pytest.mark.parametrize("workers", [1, 2, 3])
def test_worker_processes_give_the_bits_of_a_serial_sweep(serial_content, fmus, tmp_path, workers):
    counts = run_study(crane_study(tmp_path, fmus), tmp_path / "s.sqlite", engine=Processes(workers))
    assert counts == {"done": 9}
    assert content(runs_of(tmp_path / "s.sqlite")) == serial_content


def swept(folder: Path, fmu: Path, harms: list[str], more: str = "", workers: int = 2) -> list:
    run_study(harmful_study(folder, fmu, harms, more), folder / "s.sqlite", engine=Processes(workers))
    return runs_of(folder / "s.sqlite")


def test_a_run_that_crashes_hangs_or_gives_nan_is_marked_and_the_others_are_as_ever(harmful, tmp_path):
    """A null pointer, an abort with a child process that goes on, exit(), an error, NaN, and an endless loop."""
    (tmp_path / "calm").mkdir()
    undisturbed = swept(tmp_path / "calm", harmful, HARMS)
    assert [run.metrics["peak"] for run in undisturbed] == pytest.approx([1.0 + i for i in range(40)], rel=1e-12)
    places = {3: "null", 7: "abort", 12: "hang", 18: "leave", 19: "leave_well", 25: "fail", 33: "not_a_number", 39: "null"}
    harms = [places.get(i, "none") for i in range(40)]
    runs = swept(tmp_path, harmful, harms, more="time_limit = 2.0")
    assert [run.id for run in runs if run.status == "failed"] == list(places)
    words = {
        "null": r"quarantined: it ended its worker 2 times: .*SIGSEGV", "abort": r"quarantined: .*SIGABRT",
        "hang": r"killed after the time limit of 2 s", "leave": r"quarantined: .*exit status 3",
        "leave_well": r"quarantined: .*exit status 0", "fail": r"x at t = 0\.5\d* s: fmi2DoStep failed",
        "not_a_number": r"metric peak is not a number: x\.sum became NaN",
    }  # fmt: skip
    for number, harm in places.items():
        assert re.search(words[harm], runs[number].reason or ""), (harm, runs[number].reason)
    calm = [i for i in range(40) if i not in places]
    assert [runs[i].metrics for i in calm] == [undisturbed[i].metrics for i in calm]


def test_a_run_whose_worker_was_killed_by_somebody_else_is_done_again(harmful, tmp_path, monkeypatch):
    monkeypatch.setenv("HARMFUL_MARK", str(tmp_path / "killed"))
    runs = swept(tmp_path, harmful, ["none"] * 10 + ["killed_once"] + ["none"] * 10)
    assert (tmp_path / "killed").exists()
    assert {run.status for run in runs} == {"done"}
    assert [run.attempts for run in runs] == [1] * 10 + [2] + [1] * 10
    assert runs[10].metrics["peak"] == pytest.approx(11.0, rel=1e-12)


def test_failed_runs_are_run_again_only_if_asked_for(harmful, tmp_path, monkeypatch):
    study = harmful_study(tmp_path, harmful, ["none", "fail", "none"])
    for retry, counts in ((False, {"done": 2, "failed": 1}), (False, {"done": 2, "failed": 1}), (True, {"done": 2, "failed": 1})):
        seen: list[tuple[int, ...]] = []
        assert run_study(study, tmp_path / "s.sqlite", lambda *told, seen=seen: seen.append(told), retry_failed=retry) == counts
        assert seen[-1] == (2, 1, 3)
    assert runs_of(tmp_path / "s.sqlite")[1].attempts == 1


def test_instances_that_remember_are_not_used_again(harmful, tmp_path):
    """With `forgetful` a reset leaves the sum: found out by doing the first run again, and every run gets fresh instances."""
    study = harmful_study(tmp_path, harmful, ["none"] * 6)
    study.compare["all"] = {"x.forgetful": 1}
    run_study(study, tmp_path / "s.sqlite", engine=Processes(1))
    assert [run.metrics["peak"] for run in runs_of(tmp_path / "s.sqlite")] == pytest.approx(
        [1.0, 2.0, 3.0, 4.0, 5.0, 6.0], rel=1e-12
    )
    with Store(tmp_path / "s.sqlite") as store:
        assert "every run had fresh instances" in store.remarks()["instances"]


def test_a_system_that_cannot_start_is_an_error_of_the_sweep(fmus, tmp_path):
    study = crane_study(tmp_path, fmus)
    study.compare["ZV"] = {"shaper.shapr": 1.0}
    with pytest.raises(ModelError, match="Did you mean 'shaper'"):
        run_study(study, tmp_path / "s.sqlite", engine=Processes(1))
    with pytest.raises(StudyError, match="workers = -1 must not be negative"):
        engine_for(-1)


def test_workers_do_not_outlive_the_sweep(harmful, tmp_path):
    """The sweep is interrupted while runs hang: their processes are gone, and what was done is kept."""
    study = harmful_study(tmp_path, harmful, ["none"] * 8 + ["hang"] * 2)

    def interrupt(done: int, failed: int, total: int) -> None:
        if done == 8:
            raise KeyboardInterrupt

    with pytest.raises(KeyboardInterrupt):
        run_study(study, tmp_path / "s.sqlite", interrupt, engine=Processes(2))
    deadline = time.monotonic() + 300.0
    while workers_alive(os.getpid()) and time.monotonic() < deadline:
        time.sleep(0.05)
    assert workers_alive(os.getpid()) == []
    with Store(tmp_path / "s.sqlite") as store:
        assert store.counts() == {"done": 8, "planned": 2}


@contextlib.contextmanager
def dask_cluster(folder: Path, workers: int) -> Iterator[tuple[str, list[subprocess.Popen]]]:
    """A scheduler and workers, each started by its own command line; the scheduler's address, and the workers."""
    with socket.socket() as probe:
        probe.bind(("127.0.0.1", 0))
        port = probe.getsockname()[1]
    address = f"tcp://127.0.0.1:{port}"
    options = {"stdout": subprocess.DEVNULL, "stderr": subprocess.DEVNULL, "cwd": folder, "start_new_session": True}
    dask = [sys.executable, "-m", "distributed.cli.dask_scheduler", "--host", "127.0.0.1", "--port", str(port), "--no-dashboard"]
    started = [subprocess.Popen(dask, **options)]
    command = [
        sys.executable,
        "-m",
        "distributed.cli.dask_worker",
        address,
        "--nthreads",
        "1",
        "--no-dashboard",
        "--local-directory",
    ]
    started += [subprocess.Popen([*command, str(folder / f"worker{i}")], **options) for i in range(workers)]
    try:
        yield address, started[1:]
    finally:
        for process in started:
            with contextlib.suppress(ProcessLookupError):
                os.killpg(process.pid, signal.SIGKILL)
            process.wait()


@pytest.mark.thorough
def test_a_dask_cluster_gives_the_bits_of_a_serial_sweep(serial_content, harmful, fmus, tmp_path):
    """Two workers; then one of them is killed on the way of a second sweep, with runs that do harm: nothing is lost or counted twice."""
    with dask_cluster(tmp_path, 2) as (address, workers):
        run_study(crane_study(tmp_path, fmus), tmp_path / "s.sqlite", engine=engine_for(dask=address))
        assert content(runs_of(tmp_path / "s.sqlite")) == serial_content
        harms = ["fail" if i == 11 else "null" if i == 5 else "none" for i in range(60)]
        (tmp_path / "harm").mkdir()
        study = harmful_study(tmp_path / "harm", harmful, harms, step=1e-6)
        seen: list[int] = []

        def kill_one(done: int, failed: int, total: int) -> None:
            seen.append(done)
            if done >= 4 and workers[0].poll() is None:
                os.killpg(workers[0].pid, signal.SIGKILL)

        assert run_study(study, tmp_path / "harm" / "s.sqlite", kill_one, engine=engine_for(dask=address)) == {
            "done": 58,
            "failed": 2,
        }
        assert workers[0].poll() is not None
        assert seen == sorted(seen)
    runs = runs_of(tmp_path / "harm" / "s.sqlite")
    assert [run.id for run in runs if run.status == "failed"] == [5, 11]
    assert [run.metrics["peak"] for run in runs if run.status == "done"] == pytest.approx(
        [1.0 + i for i in range(60) if i not in (5, 11)], rel=1e-9
    )


def test_a_scheduler_that_is_not_there_is_named(fmus, tmp_path):
    with pytest.raises(StudyError, match=r"--dask nonsense://here: no scheduler answers there"):
        run_study(crane_study(tmp_path, fmus), tmp_path / "s.sqlite", engine=engine_for(dask="nonsense://here"))


def test_a_job_says_what_it_is(fmus, tmp_path):
    """The digest by which a cluster's workers know a job is that of its content."""
    from shaper_fmu.ssp.archive import load_ssp

    study = crane_study(tmp_path, fmus)
    one, other = (job_of(study, load_ssp(study.system_path)) for _ in range(2))
    assert one.digest == other.digest
