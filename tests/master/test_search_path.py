"""Files of a user's that have names of Python's own modules, or of packages, disturb no process that is started."""

from __future__ import annotations

import os
import subprocess
import sys
import sysconfig
from pathlib import Path

import pytest
from conftest import GAIN
from sweep_cases import content, crane_study, runs_of

from shaper_fmu.master.system import System
from shaper_fmu.search_path import search_path, with_search_path
from shaper_fmu.sweep.engine import run_study
from shaper_fmu.sweep.engines import Processes, Serial

NAMES = ("random", "types", "enum", "numpy", "msgspec", "tempfile", "json")
PLACES = ["first", "", "PYTHONPATH"]
"""Where the folder with these files stands: before all others, as the working folder, or in the environment, too."""


@pytest.fixture(params=PLACES)
def workshop(request, tmp_path, monkeypatch) -> Path:
    """A working folder with such files, which is looked into first."""
    for name in NAMES:
        (tmp_path / f"{name}.py").write_text(f"raise SystemExit('{name}.py of the working folder')\n")
    monkeypatch.chdir(tmp_path)
    monkeypatch.setattr(sys, "path", ["" if request.param == "" else str(tmp_path), *sys.path])
    if request.param == "PYTHONPATH":
        monkeypatch.setenv("PYTHONPATH", str(tmp_path))
    return tmp_path


def test_isolated_runs(workshop, fmus):
    system = System()
    system.add("plant", fmus / "MassSpringDamper.fmu", force=1.0)
    here, there = (system.simulate(0.5, 0.1, isolate=isolate) for isolate in (False, True))
    assert there["plant.position"].tobytes() == here["plant.position"].tobytes()


def test_sweeps(workshop, fmus):
    run_study(crane_study(workshop, fmus), workshop / "here.sqlite", engine=Serial())
    run_study(crane_study(workshop, fmus), workshop / "there.sqlite", engine=Processes(2))
    assert content(runs_of(workshop / "there.sqlite")) == content(runs_of(workshop / "here.sqlite"))


@pytest.mark.representatives(workshop=[""])  # the command finds the folder as the one it works in
def test_builds(workshop):
    """By the command, in the folder; test_wrong_declarations.py has the function."""
    (workshop / "gain.py").write_text(GAIN.format(factor=workshop.stat().st_ino))  # compiled now: it is in no cache
    command = [Path(sysconfig.get_path("scripts")) / "shaper-fmu", "build", "gain.py", "--output", "fmus", "--platform", "this"]
    environment = {name: value for name, value in os.environ.items() if name != "PYTHONPATH"}  # Python itself would not start
    done = subprocess.run(command, capture_output=True, text=True, check=False, cwd=workshop, env=environment)
    assert done.returncode == 0, done.stderr
    assert (workshop / "fmus" / "Gain.fmu").is_file()


def test_modules_of_the_working_folder_are_found(tmp_path, monkeypatch):
    """Last of all, and the environment of what such a process starts in turn is as it was."""
    (tmp_path / "of_the_user.py").write_text("import os; print(__file__, os.environ.get('PYTHONPATH'))\n")
    monkeypatch.chdir(tmp_path)
    monkeypatch.setattr(sys, "path", ["", *sys.path])
    monkeypatch.setenv("PYTHONPATH", "/of{the}user")
    command, environment = with_search_path("import of_the_user")
    told = subprocess.run(command, capture_output=True, text=True, check=True, env=environment, cwd="/").stdout
    assert told == f"{tmp_path / 'of_the_user.py'} /of{{the}}user\n"
    assert search_path()[0].startswith(sysconfig.get_path("stdlib")) or search_path()[0].endswith(".zip")
    assert sorted(search_path()) == sorted([str(tmp_path), *sys.path[1:]])
