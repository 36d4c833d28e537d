"""Commands write where the user says, wherever FMUs have taken the process; they say so of files that exist."""

from __future__ import annotations

import os
import sys
import zipfile
from pathlib import Path

import fmpy
import pytest
from command_line import typed
from faulty_fmus import library
from test_process_state import DESCRIPTION

from shaper_fmu.master.system import System

pytestmark = pytest.mark.skipif(sys.platform != "linux", reason="the FMU is Linux's")

STRUCTURE = """<?xml version="1.0" encoding="UTF-8"?>
<ssd:SystemStructureDescription version="1.0" name="moving" xmlns:ssd="http://ssp-standard.org/SSP1/SystemStructureDescription">
  <ssd:System name="moving"><ssd:Elements><ssd:Component name="{}" source="resources/x.fmu"/></ssd:Elements></ssd:System>
</ssd:SystemStructureDescription>
"""
STUDY = """
name = "moving"
system = "x.ssp"
stop_time = 1.0
step = 0.1
[vary."{name}.input"]
low = 1.0
high = 2.0
points = 2
[metrics.last]
kind = "final"
output = "{name}.sum"
"""
CALLS = ("instantiate", "setup", "enter", "get", "exit", "step", "terminate", "free")


def archive(folder: Path, name: str, description: str = DESCRIPTION) -> Path:
    """A system of one FMU, whose instance is called so: that is what it does, and when."""
    made = library("disturbing2")
    with zipfile.ZipFile(folder / "x.fmu", "w") as archive:
        archive.writestr("modelDescription.xml", description)
        archive.write(made, f"binaries/{fmpy.platform}/{made.name}")
    with zipfile.ZipFile(folder / "x.ssp", "w") as archive:
        archive.writestr("SystemStructure.ssd", STRUCTURE.format(name))
        archive.write(folder / "x.fmu", "resources/x.fmu")
    return folder / "x.ssp"


def told(output: str) -> list[str]:
    return [line.removeprefix("wrote ") for line in output.splitlines() if line.startswith("wrote ")]


@pytest.mark.parametrize("call", CALLS)
def test_results_are_where_the_user_is(tmp_path, call):
    archive(tmp_path, f"directory_{call}")
    done = typed("run", "x.ssp", "--stop-time", "1", "--step", "0.1", "--output", "a/r.csv", "--report", "r.html", cwd=tmp_path)
    assert done.returncode == 0, done.stderr
    assert told(done.stdout) == ["a/r.csv", "r.html", "r_response_number.png"]
    assert all((tmp_path / name).is_file() for name in told(done.stdout))


@pytest.mark.parametrize("call", CALLS)
def test_tables_of_results_are_where_the_caller_is(tmp_path, monkeypatch, call):
    archive(tmp_path, f"directory_{call}")
    monkeypatch.chdir(tmp_path)
    system = System()
    system.add(f"directory_{call}", "x.fmu", input=1.0)
    system.simulate(1.0, 0.1).to_csv("r.csv")
    assert len((tmp_path / "r.csv").read_text().splitlines()) == 12


def test_the_store_of_a_sweep_is_where_the_user_is(tmp_path):
    archive(tmp_path, "directory_step")
    (tmp_path / "study.toml").write_text(STUDY.format(name="directory_step"))
    done = typed("sweep", "study.toml", "--store", "s/s.sqlite", "--workers", "0", cwd=tmp_path)
    assert done.returncode == 0, done.stderr
    assert "2 of 2 runs done, in s/s.sqlite" in done.stdout
    assert (tmp_path / "s/s.sqlite").is_file()
    done = typed("report", "s/s.sqlite", "--output", "r.html", cwd=tmp_path)
    assert done.returncode == 0, done.stderr
    assert "r.html" in told(done.stdout)
    assert all((tmp_path / name).is_file() for name in told(done.stdout))


def test_wrote_is_not_said_of_a_file_that_is_gone(tmp_path, monkeypatch):
    archive(tmp_path, "none")
    monkeypatch.setattr("shaper_fmu.master.results.Results.to_csv", lambda self, path: os.path.abspath(path))
    done = typed("run", "x.ssp", "--stop-time", "1", "--step", "0.1", "--output", "r.csv", cwd=tmp_path)
    assert (done.returncode, told(done.stdout)) == (1, [])
    assert "r.csv: was written, but is not there any more" in done.stderr


SWINGING = DESCRIPTION.replace(
    "</ModelVariables>",
    """<ScalarVariable name="position" valueReference="2" causality="output" variability="continuous"><Real/></ScalarVariable>
  </ModelVariables>""",
).replace("<Outputs>", '<Outputs><Unknown index="3" dependencies=""/>')


@pytest.mark.thorough
@pytest.mark.parametrize("call", ["instantiate", "step", "free"])
def test_what_tune_writes_is_where_the_user_is(tmp_path, call):
    archive(tmp_path, f"directory_{call}", SWINGING)
    names = ["--input", f"directory_{call}.input", "--output", f"directory_{call}.position"]
    done = typed("tune", "x.ssp", *names, "--output-folder", "tuned", cwd=tmp_path)
    assert done.returncode == 0, done.stdout + done.stderr
    assert {"tuned/report.html", "tuned/tuning.json"} <= set(told(done.stdout))
    assert all((tmp_path / name).is_file() for name in told(done.stdout))
