"""A tuning that was interrupted goes on without measuring again, and ends with the bits of one that was not."""

from __future__ import annotations

import json
import os
import signal
import subprocess
import sys
import time
from pathlib import Path
from typing import Any

import pytest
from command_line import typed
from counted_spring import counted_spring, steps_counted

from shaper_fmu.errors import ArgumentError
from shaper_fmu.export.build import fmu_path
from shaper_fmu.tune.kept_runs import FILE, KeptRuns
from shaper_fmu.tune.meter import Budget
from shaper_fmu.tune.tuning import Tuning, requirements_for
from shaper_fmu.tune.tuning_plant import tune_plant

MORE = pytest.mark.thorough
ARGUMENTS = (
    "--input",
    "force",
    "--output",
    "position",
    "--vary",
    "mass=10%",
    "--no-report",
    "--output-folder",
    "out",
)
PROBED = 12
"""Steps that measure what a step costs; they are taken each time."""


@pytest.fixture(scope="module")
def spring(tmp_path_factory) -> Path:
    return counted_spring(tmp_path_factory.mktemp("counted"))


def command(spring: Path, *more: str) -> list[str]:
    return [sys.executable, "-c", "from shaper_fmu.cli.main import main; main()", "tune", str(spring), *ARGUMENTS, *more]


def told(folder: Path) -> dict[str, Any]:
    """All numbers, but for what the work took."""
    found = json.loads((folder / "out" / "tuning.json").read_text(encoding="utf-8"))
    return {name: value for name, value in found.items() if name != "effort"}


@pytest.mark.parametrize("number", [pytest.param(signal.SIGINT, marks=MORE), signal.SIGKILL])
@pytest.mark.skipif(os.name == "nt", reason="signals of POSIX")
def test_an_interrupted_tuning_goes_on(spring, tmp_path, monkeypatch, number):
    """Interrupted in the verification; its FMU counts its own steps."""
    counted = steps_counted(tmp_path, monkeypatch)
    whole, parted = tmp_path / "whole", tmp_path / "parted"
    whole.mkdir()
    parted.mkdir()
    monkeypatch.setattr("shaper_fmu.report.tune.outputs._write_shaper", lambda *_: [])  # it compiles for all platforms
    done = typed(*command(spring)[3:], cwd=whole)
    assert done.returncode == 0, done.stderr
    steps = counted()
    monkeypatch.setenv("COUNTED_PAUSE", "0.002")
    process = subprocess.Popen(command(spring), cwd=parted, stdout=subprocess.PIPE, stderr=subprocess.PIPE)
    while counted() - steps < 0.6 * steps and process.poll() is None:
        time.sleep(0.01)
    process.send_signal(number)
    words = process.communicate()[1].decode()
    assert process.returncode == (130 if number == signal.SIGINT else -signal.SIGKILL), words
    monkeypatch.delenv("COUNTED_PAUSE")
    before = counted() - steps
    assert 0.6 * steps <= before < steps
    done = typed(*command(spring, "--resume")[3:], cwd=parted)
    assert done.returncode == 0, done.stderr
    assert "runs of the plant are known" in " ".join(done.stderr.split())
    assert told(parted) == told(whole)
    again = counted() - steps - before
    broken = 200  # of the run that was interrupted: about 5 periods of 24 steps
    assert steps <= before + again <= steps + PROBED + broken


def tuned(folder: Path, spread: float = 0.1, version: str | None = None, **options: Any) -> Tuning:
    plant, values = fmu_path("MassSpringDamper", platforms=["this"]), {"mass": 2.0, "stiffness": 50.0, "damping": 1.0}
    requirements = requirements_for({"mass": spread}, kinds=("mzv", "zvd"))
    return tune_plant(
        plant, options.pop("input", "force"), ["position"], start_values=values, spread={"mass": spread},
        requirements=requirements, keep=folder / FILE, **options,
    )  # fmt: skip


def test_a_budget_that_was_spent_goes_on(tmp_path):
    whole = tuned(tmp_path / "whole")
    assert whole.verification is not None
    steps = sum(one.steps for one in whole.efforts.values())
    first = tuned(tmp_path / "parted", budget=Budget(steps=steps - 1000))
    assert first.verdict == "not_verified"
    taken = sum(one.steps for one in first.efforts.values())
    said: list[str] = []
    second = tuned(tmp_path / "parted", resume=True, say=said.append)
    assert second.verdict == "tuned"
    assert second.verification == whole.verification
    assert second.summary == whole.summary
    assert sum(one.steps for one in second.efforts.values()) == steps - taken + PROBED
    third = tuned(tmp_path / "parted", resume=True)
    assert sum(one.steps for one in third.efforts.values()) == PROBED
    assert any("take no steps" in one for one in said)


def test_what_differs_is_named(tmp_path, monkeypatch):
    tuned(tmp_path)
    with pytest.raises(ArgumentError, match=r"the range: then mass \+-10 %, now mass \+-20 %"):
        tuned(tmp_path, spread=0.2, resume=True)
    with pytest.raises(ArgumentError, match=r"the start values: .*stiffness = 60"):
        tuned(tmp_path, start={"stiffness": 60.0}, resume=True)
    monkeypatch.setattr("shaper_fmu.tune.plant.__version__", "9.9.9")
    with pytest.raises(ArgumentError, match=r"the version of shaper-fmu: then .*, now 9\.9\.9"):
        tuned(tmp_path, resume=True)
    with pytest.raises(ArgumentError, match="no such file to resume from"):
        tuned(tmp_path / "elsewhere", resume=True)
    (tmp_path / "other").mkdir()
    (tmp_path / "other" / FILE).write_text("no database, but long enough to be taken for one" * 100)
    with pytest.raises(ArgumentError, match="cannot be used"):
        tuned(tmp_path / "other", resume=True)
    facts = {"the file of plant": "a.fmu (1)", "the input": "force"}
    kept = KeptRuns(tmp_path / "more.sqlite", facts)
    kept.keep("key")
    kept.close()
    with pytest.raises(
        ArgumentError, match=r"the file of plant: then a\.fmu \(1\), now a\.fmu \(2\); the input: then force, now speed"
    ):
        KeptRuns(tmp_path / "more.sqlite", {"the file of plant": "a.fmu (2)", "the input": "speed"}, resume=True)
