"""Sweeps whose process is killed: what was done stays, and a second start ends with the content of an undisturbed sweep."""

from __future__ import annotations

import os
import random
import signal
import sqlite3
import subprocess
import sys
import time
from pathlib import Path

import pytest
from harmful_fmu import build_harmful
from sweep_cases import content, harmful_study, runs_of

from shaper_fmu.errors import StudyError
from shaper_fmu.sweep.engine import run_study
from shaper_fmu.sweep.engines import Serial
from shaper_fmu.sweep.store import Store

KILLS, RUNS = 10, 160
SWEEP = """
import sys
from shaper_fmu.sweep.engine import engine_for, run_study
from shaper_fmu.sweep.study import read_study
run_study(read_study(sys.argv[1]), sys.argv[2], engine=engine_for(int(sys.argv[3])))
"""


def start_sweep(study: Path, store: Path, workers: int) -> subprocess.Popen:
    return subprocess.Popen([sys.executable, "-c", SWEEP, str(study), str(store), str(workers)], start_new_session=True)


def done(store: Path) -> int:
    """Runs that are entered, as another process sees them."""
    try:
        with sqlite3.connect(f"file:{store}?mode=ro", uri=True) as database:
            return database.execute("SELECT count(*) FROM run WHERE status = 'done'").fetchone()[0]
    except sqlite3.OperationalError:  # not there yet
        return 0


@pytest.mark.parametrize("workers", [0, 2])
def test_a_sweep_killed_at_random_moments_loses_and_repeats_nothing(workers, tmp_path):
    """SIGKILL, each time it is started, after some more runs have been entered; then to the end."""
    fmu = build_harmful(tmp_path)
    harms = ["fail" if i % 50 == 17 else "none" for i in range(RUNS)]
    study = harmful_study(tmp_path, fmu, harms, step=1e-6)  # a run takes some 20 ms
    calm = tmp_path / "calm.sqlite"
    run_study(study, calm, engine=Serial())
    store, moments = tmp_path / "s.sqlite", random.Random(workers)
    kills = KILLS // 2
    for number in range(kills):
        before = done(store)
        wanted = before + moments.randrange(1, max(2, 2 * (RUNS - before) // (kills - number + 2)))
        sweep = start_sweep(tmp_path / "study.toml", store, workers)
        deadline = time.monotonic() + 600.0
        while done(store) < wanted and sweep.poll() is None and time.monotonic() < deadline:
            time.sleep(moments.uniform(0.0, 0.01))
        os.kill(sweep.pid, signal.SIGKILL)
        assert sweep.wait() == -signal.SIGKILL
        assert done(store) >= before
    assert start_sweep(tmp_path / "study.toml", store, workers).wait() == 0
    assert content(runs_of(store)) == content(runs_of(calm))
    assert all(run.attempts == 1 for run in runs_of(store))


def test_two_sweeps_on_one_store_are_refused_and_a_reader_is_not(tmp_path):
    fmu = build_harmful(tmp_path)
    study = harmful_study(tmp_path, fmu, ["none"] * 3)
    with Store(tmp_path / "s.sqlite", study, {}), pytest.raises(StudyError, match="another sweep is writing to this store"):
        run_study(study, tmp_path / "s.sqlite")
    with Store(tmp_path / "s.sqlite", study, {}), Store(tmp_path / "s.sqlite") as reader:
        assert reader.counts() == {"planned": 3}


def test_many_runs_take_flat_memory(tmp_path, capsys):
    """100,000 short runs by two workers: the parent's peak, of which Python and its libraries are most. A list of them would show."""
    fmu = build_harmful(tmp_path)
    harmful_study(tmp_path, fmu, ["none"])
    text = (tmp_path / "study.toml").read_text().split("[plan]")[0].replace("stop_time = 1.0", "stop_time = 0.02")
    vary = '[vary."x.command"]\nnominal = 1.0\nlow = 1.0\nhigh = 2.0\npoints = 100000\n'
    (tmp_path / "study.toml").write_text(f'{text}{vary}[metrics.peak]\nkind = "peak"\noutput = "x.sum"\n')
    # getrusage would tell the peak of this process, of which the other one is a fork
    peak = "print(next(line for line in open('/proc/self/status') if line.startswith('VmHWM')).split()[1])"
    command = [sys.executable, "-c", SWEEP + peak, str(tmp_path / "study.toml"), str(tmp_path / "s.sqlite"), "2"]
    kilobytes = int(subprocess.run(command, capture_output=True, text=True, check=True).stdout)
    with Store(tmp_path / "s.sqlite") as store:
        assert store.counts() == {"done": 100_000}
        last = next(iter(run for run in store.iterate() if run.id == 99_999))
    assert last.metrics["peak"] == pytest.approx(0.02 * 2.0, rel=1e-9)
    with capsys.disabled():
        print(f"\n100,000 runs: the parent's peak is {kilobytes / 1024:.0f} MB")
    assert kilobytes < 500 * 1024
