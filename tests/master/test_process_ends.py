"""FMUs that end their process, or make two of it: no run that is not finished has exit code 0, and nothing is done twice."""

from __future__ import annotations

import os
import subprocess
import sys
from pathlib import Path

import pytest
from command_line import MAIN
from harmful_fmu import HARM, build_harmful
from sweep_cases import harmful_study

pytestmark = pytest.mark.skipif(sys.platform != "linux", reason="what hears of the end is Linux's")
FORKING = """
import multiprocessing, os, sys
from shaper_fmu.master.system import System
def sum_of(harm):
    system = System()
    system.add("x", sys.argv[1], harm=harm, command=2.0)
    return system.simulate(1.0, 0.1)["x.sum"][-1]
def told(t):
    global found
    if t > 0.25 and found is None:
        with multiprocessing.get_context("fork").Pool(1) as pool:
            found = pool.map(sum_of, [0])
found = None
system = System()
system.add("x", sys.argv[1], harm=int(sys.argv[2]), command=2.0)
print(system.simulate(1.0, 0.1, progress=told)["x.sum"][-1], found)
"""


@pytest.fixture(scope="module")
def files(tmp_path_factory) -> Path:
    """The harmful FMU, harmful.ssp with it, and a study of it."""
    folder = tmp_path_factory.mktemp("harmful")
    harmful_study(folder, build_harmful(folder), ["none", "leave_well", "none"])
    return folder


def run(files: Path, harm: str, folder: Path, *arguments: str) -> subprocess.CompletedProcess[str]:
    """`shaper-fmu run`, with what it unpacks and writes in an empty folder."""
    (folder / "temporary").mkdir()
    settings = ["--set", f"x.harm={HARM.index(harm)}", "--set", "x.command=2"]
    command = [*MAIN, "run", str(files / "harmful.ssp"), "--stop-time", "1", "--step", "0.1", *settings, *arguments]
    environment = {**os.environ, "TMPDIR": str(folder / "temporary")}
    # to files: the FMU's own processes may live on, and would keep pipes open
    with (folder / "out").open("w") as out, (folder / "said").open("w") as said:
        done = subprocess.run(command, cwd=folder, env=environment, stdout=out, stderr=said, check=False)
    return subprocess.CompletedProcess(command, done.returncode, (folder / "out").read_text(), (folder / "said").read_text())


@pytest.mark.parametrize(("harm", "status"), [("leave", 3), ("leave_well", 0)])
def test_exit_in_a_step_is_told_and_never_exit_code_0(files, tmp_path, harm, status):
    done = run(files, harm, tmp_path, "--output", "r.csv")
    assert (done.returncode, done.stdout) == (1, ""), done.stderr
    said = done.stderr.splitlines()
    assert said[-1] == f"error: x (harmful.fmu): fmi2DoStep has ended the process by exit({status}); the work is not finished"
    assert not (tmp_path / "r.csv").exists()
    assert list((tmp_path / "temporary").iterdir()) == []


def test_a_fault_ends_the_process_by_its_signal_after_a_line(files, tmp_path):
    done = run(files, "null", tmp_path)
    assert done.returncode == -11  # SIGSEGV
    assert done.stderr.splitlines()[-1] == "error: the process is ended by a fault in an FMU's code; FMUs: x (harmful.fmu)"


def test_a_sweep_in_one_process_is_told_of_the_end_and_goes_on_in_workers(files, tmp_path):
    command = [*MAIN, "sweep", str(files / "study.toml"), "--store", str(tmp_path / "s.sqlite"), "--workers"]
    done = subprocess.run([*command, "0"], capture_output=True, text=True, check=False)
    assert done.returncode == 1
    assert "error: x (harmful.fmu): fmi2DoStep has ended the process by exit(0); the work is not finished" in done.stderr
    done = subprocess.run([*command, "1"], capture_output=True, text=True, check=False)
    assert (done.returncode, "2 of 3 runs done" in done.stdout) == (1, True), done.stderr
    assert "quarantined: it ended its worker 2 times: its process ended with exit status 0" in done.stderr


@pytest.mark.parametrize("harm", ["fork", "fork_at_start"])
def test_a_copy_that_an_fmu_makes_of_the_process_writes_and_prints_nothing(files, tmp_path, harm):
    """The sum is 2 per second; each file's row and each word on standard output comes once."""
    done = run(files, harm, tmp_path, "--output", "r.csv")
    assert done.returncode == 0, done.stderr
    assert done.stdout.count("x.sum") == 1
    assert done.stdout.count("wrote r.csv") == 1
    time, total = map(float, (tmp_path / "r.csv").read_text().splitlines()[-1].split(","))
    assert (time, total) == (1.0, pytest.approx(2.0))
    assert done.stderr.count("simulated in") == 1


def test_a_process_that_the_caller_forks_during_a_run_has_runs_of_its_own(files):
    """multiprocessing from a progress function; and the same while the FMU makes copies."""
    for harm in ("none", "fork"):
        command = [sys.executable, "-c", FORKING, str(files / "harmful.fmu"), str(HARM.index(harm))]
        done = subprocess.run(command, capture_output=True, text=True, check=False)
        assert (done.returncode, len(done.stdout.splitlines())) == (0, 1), done.stderr
        value, _, found = done.stdout.strip().partition(" ")
        assert float(value) == pytest.approx(2.0)
        assert found.startswith("[")
