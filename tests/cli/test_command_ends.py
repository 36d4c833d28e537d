"""Commands that a signal ends while an FMU calculates: exit code and words tell so, nothing is left, and nothing counts as failed."""

from __future__ import annotations

import contextlib
import os
import re
import signal
import subprocess
import sys
import time
from collections.abc import Callable, Iterator
from pathlib import Path

import pytest
from command_line import MAIN
from sweep_cases import workers_alive
from waiting_fmu import waiting_files

from shaper_fmu.sweep.store import Store

pytestmark = pytest.mark.skipif(sys.platform == "win32", reason="signals cannot be sent to another process there")
ENDS = {signal.SIGINT: (130, "interrupted"), signal.SIGTERM: (143, "ended by SIGTERM")}
RUN = ["run", "waiting.ssp", "--stop-time", "1", "--step", "0.1"]


@pytest.fixture(scope="module")
def files(tmp_path_factory) -> Path:
    return waiting_files(tmp_path_factory.mktemp("waiting"))


@pytest.fixture
def temporary(tmp_path) -> Path:
    """Where the command unpacks; empty again after it."""
    folder = tmp_path / "temporary"
    folder.mkdir()
    return folder


@contextlib.contextmanager
def waiting_command(files: Path, temporary: Path, *arguments: str | Path) -> Iterator[subprocess.Popen[str]]:
    """The command, once it is in the FMU's step."""
    mark = temporary.parent / "mark"
    environment = {**os.environ, "WAITING_MARK": str(mark), "TMPDIR": str(temporary)}
    options = {"cwd": files, "env": environment, "stdout": subprocess.PIPE, "stderr": subprocess.PIPE, "text": True}
    with subprocess.Popen([*MAIN, *map(str, arguments)], **options) as process:
        try:
            wait_for(lambda: mark.exists() or process.poll() is not None)
            assert process.poll() is None, process.communicate()
            yield process
        finally:
            process.kill()


def wait_for(state: Callable[[], object]) -> None:
    """Until it is so: however long a slow machine takes."""
    while not state():
        time.sleep(0.01)


@pytest.mark.representatives(swallows=["false"])
@pytest.mark.parametrize(
    ("number", "swallows"), [(signal.SIGINT, "false"), (signal.SIGINT, "true"), (signal.SIGTERM, "false"), (signal.SIGTERM, "true")]
)
def test_a_run_ends_in_the_midst_of_a_step(files, temporary, number, swallows):
    """An FMU by pythonfmu gets the exception, and makes an error of it, or nothing at all."""
    with waiting_command(files, temporary, *RUN, "--set", f"x.swallows={swallows}") as process:
        process.send_signal(number)
        out, said = process.communicate()
    code, words = ENDS[number]
    assert (process.returncode, out) == (code, ""), said
    assert said.splitlines()[-1] == f"{words} before the work was finished"
    assert "error" not in said.lower()
    assert "Traceback" not in said
    assert list(temporary.iterdir()) == []


@pytest.mark.representatives(number=[signal.SIGINT])
@pytest.mark.parametrize(
    ("number", "workers", "swallows"),
    [(signal.SIGINT, "0", False), (signal.SIGTERM, "0", True), (signal.SIGINT, "2", False), (signal.SIGTERM, "2", False)],
)
def test_a_sweep_ends_with_no_run_failed_and_goes_on_later(files, temporary, number, workers, swallows):
    arguments = ["sweep", f"{swallows}.toml", "--store", temporary.parent / "s.sqlite", "--workers", workers]
    with waiting_command(files, temporary, *arguments) as process:
        at_work = workers_alive(process.pid)
        assert len(at_work) == int(workers)
        process.send_signal(number)
        out, said = process.communicate()
    code, words = ENDS[number]
    assert (process.returncode, out) == (code, ""), said
    assert f"{words}: 0 of 5 runs are finished (0 failed) and kept in" in said
    assert "Traceback" not in said
    wait_for(lambda: not any(Path(f"/proc/{worker}").exists() for worker in at_work))
    assert list(temporary.iterdir()) == []
    with Store(temporary.parent / "s.sqlite") as store:
        assert store.counts() == {"planned": 5}
    assert sorted(path.name for path in temporary.parent.iterdir() if path.name.startswith("s.")) == ["s.sqlite"]
    done = subprocess.run([*MAIN, *map(str, arguments)], cwd=files, capture_output=True, text=True, check=False)
    assert (done.returncode, "5 of 5 runs done" in done.stdout) == (0, True), done.stderr


@pytest.mark.representatives(number=[signal.SIGTERM])
@pytest.mark.parametrize("number", ENDS, ids=lambda number: number.name)
def test_tune_ends_in_the_midst_of_an_experiment(files, temporary, number):
    arguments = ["tune", "waiting.ssp", "--input", "x.gain", "--output", "x.sum", "--output-folder", temporary.parent / "tuned"]
    with waiting_command(files, temporary, *arguments) as process:
        process.send_signal(number)
        out, said = process.communicate()
    code, words = ENDS[number]
    kept = "; no mode was identified; what was measured is kept, and --resume goes on"  # where the call of the FMU returns in time
    assert (process.returncode, out) == (code, ""), said
    assert re.fullmatch(rf"{words}(: \d+ steps are taken{kept}| before the work was finished)", said.splitlines()[-1])
    assert list(temporary.iterdir()) == []
    assert not (temporary.parent / "tuned").exists()
    assert not (temporary.parent / "tuned").exists()
