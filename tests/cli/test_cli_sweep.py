"""`shaper-fmu sweep` and `export` as a user types them: what is printed, what is kept, how they exit."""

from __future__ import annotations

import math
import os
import re
import signal
import subprocess
import sys
import time
from pathlib import Path

import pytest
from command_line import MAIN, in_a_process, typed

from shaper_fmu.ssp.archive import pack_ssp
from shaper_fmu.sweep.store import Store

SYSTEMS = Path(__file__).parents[2] / "ssp"

STUDY = """
name = "small"
system = "crane.ssp"
stop_time = 15.0
step = 0.05
reference = "unshaped"

[vary."crane.initial_rope_length"]
nominal = 8.0
low = 6.0
high = 10.0
points = 5

[compare]
unshaped = { "shaper.shaper" = "none" }
ZV = { "shaper.shaper" = "zv" }

[metrics.peak_swing]
kind = "peak"
output = "crane.swing_angle"
"""
# hoisting 0.45 m/s for 15 s takes 6.75 m of rope, which 6 m do not have
FAILING = STUDY.replace("ZV = { ", 'ZV = { "crane.hoist_speed" = 0.45, ')


@pytest.fixture(scope="module")
def archive(fmus, tmp_path_factory) -> bytes:
    folder = tmp_path_factory.mktemp("archive")
    return pack_ssp(SYSTEMS / "overhead_crane", fmus, folder / "crane.ssp").read_bytes()


@pytest.fixture
def workshop(archive, tmp_path) -> Path:
    (tmp_path / "crane.ssp").write_bytes(archive)
    (tmp_path / "study.toml").write_text(STUDY)
    return tmp_path


def content(store: Path) -> list[tuple]:
    with Store(store) as opened:
        return [(r.id, r.compared, tuple(r.varied.items()), r.status, tuple(r.metrics.items()), r.reason) for r in opened.runs()]


@pytest.mark.parametrize(
    "options", [["--workers", "2"], pytest.param(["--dask", "local", "--workers", "1"], marks=pytest.mark.thorough)]
)
def test_all_ways_to_run_give_the_same(workshop, options):
    if "--dask" in options:
        pytest.importorskip("distributed")
    here = typed("sweep", "study.toml", "--store", "0.sqlite", "--workers", "0", cwd=workshop)
    done = in_a_process("sweep", "study.toml", "--store", "1.sqlite", *options, cwd=workshop)
    for i, run in enumerate((here, done)):
        assert run.returncode == 0, run.stderr
        assert f"10 of 10 runs done, in {i}.sqlite" in run.stdout
    assert content(workshop / "1.sqlite") == content(workshop / "0.sqlite")
    assert done.stdout.replace("1.sqlite", "0.sqlite") == here.stdout
    for words in ("6 m", "8 m", "10 m", "unshaped", "ZV"):
        assert words in here.stdout


def test_failed_runs_are_grouped_told_and_tried_again_on_demand(workshop):
    (workshop / "study.toml").write_text(FAILING.replace("low = 6.0", "low = 5.0"))
    first = typed("sweep", "study.toml", "--store", "s.sqlite", "--workers", "0", cwd=workshop)
    assert first.returncode == 1
    assert "10 of 12 runs done" in first.stdout
    # 5 m and 6.25 m of rope fail at other times for the same reason: one line
    told = [line for line in first.stderr.splitlines() if "leaves no rope" in line]
    assert len(told) == 1
    assert told[0].startswith("2 runs failed, the first of them run 6 (ZV; crane.initial_rope_length = 5): ")
    assert "2 failed" in first.stderr
    again = typed("sweep", "study.toml", "--store", "s.sqlite", "--workers", "0", cwd=workshop)
    assert (again.returncode, again.stdout) == (1, first.stdout)
    assert "sweeping small: 12 of 12, 2 failed\n" in again.stderr  # nothing is run
    retried = typed("sweep", "study.toml", "--store", "s.sqlite", "--workers", "0", "--retry-failed", cwd=workshop)
    assert retried.returncode == 1
    assert "sweeping small: 10 of 12\n" in retried.stderr
    assert re.search(r"sweeping small: 12 of 12, 2 failed, \d", retried.stderr)


@pytest.mark.representatives(workers=["2"])
@pytest.mark.skipif(sys.platform == "win32", reason="Ctrl-C is another thing there")
@pytest.mark.parametrize("workers", ["0", "2"])
def test_ctrl_c_keeps_what_is_finished_and_the_same_command_goes_on(workshop, workers):
    (workshop / "study.toml").write_text(STUDY.replace("step = 0.05", "step = 0.001").replace("points = 5", "points = 151"))
    arguments = [*MAIN, "sweep", "study.toml", "--store", "s.sqlite", "--workers", workers]
    with subprocess.Popen(arguments, cwd=workshop, stdout=subprocess.PIPE, stderr=subprocess.PIPE, text=True) as running:
        while running.poll() is None and not finished(workshop / "s.sqlite"):
            time.sleep(0.02)
        running.send_signal(signal.SIGINT)
        _, said = running.communicate(timeout=900)
    assert running.returncode == 130, said
    found = re.search(r"interrupted: (\d+) of 302 runs are finished \(0 failed\) and kept in s\.sqlite", said)
    assert found, said
    assert "Traceback" not in said
    kept = content(workshop / "s.sqlite")
    assert sum(run[3] == "done" for run in kept) == int(found[1])
    assert 0 < int(found[1]) < 302
    rest = typed("sweep", "study.toml", "--store", "s.sqlite", "--workers", workers, cwd=workshop)
    assert rest.returncode == 0, rest.stderr
    assert f"sweeping small: {found[1]} of 302\n" in rest.stderr
    assert "302 of 302 runs done" in rest.stdout
    assert [run for run in content(workshop / "s.sqlite") if run in kept] == [run for run in kept if run[3] == "done"]


def finished(path: Path) -> bool:
    """Whether some runs are done; the store is there only after its plan is."""
    if not path.is_file() or not path.stat().st_size:
        return False
    try:
        with Store(path) as store:
            return store.counts().get("done", 0) > 0
    except Exception:
        return False


@pytest.mark.skipif(sys.platform == "win32", reason="no pseudo-terminals there")
def test_a_terminal_shows_a_bar_with_rate_and_time_left(workshop):
    import pty

    (workshop / "study.toml").write_text(STUDY.replace("step = 0.05", "step = 0.002").replace("points = 5", "points = 201"))
    screen, terminal = pty.openpty()
    arguments = [*MAIN, "sweep", "study.toml", "--store", "s.sqlite", "--workers", "0"]
    environment = {**os.environ, "TERM": "xterm", "COLUMNS": "120"}
    shown = b""
    with subprocess.Popen(arguments, cwd=workshop, stdout=subprocess.DEVNULL, stderr=terminal, env=environment) as running:
        os.close(terminal)
        try:
            while chunk := os.read(screen, 4096):
                shown += chunk
        except OSError:  # Linux's way to say that the terminal is closed
            pass
        os.close(screen)
    assert running.returncode == 0
    assert re.search(rb"sweeping small .*\d+/402 .*\d/s, \d+:\d\d left", re.sub(rb"\x1b\[[0-9;?]*[A-Za-z]", b"", shown))


def test_a_sampled_plan_tells_how_the_metrics_are_distributed(workshop):
    plan = '\n[plan]\nkind = "latin_hypercube"\nsamples = 8\n'
    (workshop / "study.toml").write_text(STUDY.replace("points = 5\n", plan).replace('reference = "unshaped"\n', ""))
    done = typed("sweep", "study.toml", "--store", "s.sqlite", "--workers", "0", cwd=workshop)
    assert done.returncode == 0, done.stderr
    assert "16 of 16 runs done" in done.stdout
    with Store(workshop / "s.sqlite") as store:
        largest = max(run.metrics["peak_swing"] for run in store.runs() if run.compared == "ZV")
    row = next(line for line in done.stdout.splitlines() if "ZV" in line)
    assert f"{math.degrees(largest):.4g} deg" in row


def test_export_writes_by_the_ending(workshop):
    assert typed("sweep", "study.toml", "--store", "s.sqlite", "--workers", "0", cwd=workshop).returncode == 0
    done = typed("export", "s.sqlite", "--output", "runs.csv", cwd=workshop)
    assert (done.returncode, done.stdout) == (0, "wrote runs.csv: 10 runs\n")
    head, *rows = (workshop / "runs.csv").read_text().splitlines()
    assert head == "run,case,crane.initial_rope_length,peak_swing,status,reason,seconds,attempts"
    assert len(rows) == 10
    pytest.importorskip("pyarrow")
    done = typed("export", "s.sqlite", "--output", "runs.parquet", cwd=workshop)
    assert (done.returncode, done.stdout) == (0, "wrote runs.parquet: 10 runs\n")
    assert (workshop / "runs.parquet").read_bytes().startswith(b"PAR1")


@pytest.mark.parametrize(
    ("arguments", "code", "words"),
    [
        (["export", "s.sqlite", "--output", "runs.xlsx"], 2, "'runs.xlsx' must end with .csv, .parquet or .ssv"),
        (["export", "study.toml"], 2, "Missing option"),
        (["export", "none.sqlite", "--output", "runs.csv"], 2, "none.sqlite: No such file"),
        (["sweep", "study.toml", "--workers", "-1"], 2, "--workers"),
        (["sweep", "study.toml", "--workers", "2", "--dask", "tcp://host:8786"], 2, "a cluster has its own workers"),
        (["sweep", "none.toml"], 2, "none.toml: No such file"),
    ],
)
def test_errors_are_one_line_with_an_exit_code(workshop, arguments, code, words):
    done = typed(*arguments, cwd=workshop)
    assert (done.returncode, "Traceback" in done.stderr) == (code, False)
    assert words in done.stderr


def test_the_example_of_the_help_runs(workshop):
    lines = typed("sweep", "--help", cwd=workshop).stdout.splitlines()
    begin = next(i for i, line in enumerate(lines) if 'name = "rope"' in line)
    end = next(i for i in range(begin, len(lines)) if not lines[i].strip())
    text = "\n".join(line.strip() for line in lines[begin:end])
    (workshop / "study.toml").write_text(text.replace("points = 21", "points = 3"))
    written = [line.split()[1:] for line in lines if line.strip().startswith("shaper-fmu")]
    assert [words[0] for words in written] == ["sweep", "report", "export"]
    for words in (written[0], written[2]):  # reports are tested with the other commands
        done = typed(*words, cwd=workshop)
        assert done.returncode == 0, done.stderr
    assert (workshop / "rope.csv").read_text().count("\n") == 1 + 2 * 3
