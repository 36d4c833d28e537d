"""A tuning whose plant is run in worker processes has the bits of one without, and outlives an FMU that ends its process."""

from __future__ import annotations

import json
import os
import signal
import subprocess
import sys
import time
from pathlib import Path

import numpy as np
import pytest
from command_line import typed
from counted_spring import counted_spring, steps_counted
from rough_fmus import EULER, rough_fmu

from shaper_fmu.errors import ArgumentError
from shaper_fmu.export.build import fmu_path
from shaper_fmu.tune.kept_runs import FILE
from shaper_fmu.tune.meter import Budget, without_seconds
from shaper_fmu.tune.tuning import Tuning, requirements_for
from shaper_fmu.tune.tuning_plant import tune_plant

MORE = pytest.mark.thorough
SPREAD = {"mass": 0.1, "stiffness": 0.05}
VALUES = {"mass": 2.0, "stiffness": 50.0, "damping": 1.0}
PROBED = 12
"""Steps that measure what a step costs; they are taken each time."""


def tuned(**options) -> Tuning:
    plant = fmu_path("MassSpringDamper", platforms=["this"])
    spread = options.pop("spread", SPREAD)
    requirements = requirements_for(spread, kinds=("mzv", "zvd"))
    return tune_plant(plant, "force", ["position"], start_values=VALUES, spread=spread, requirements=requirements, **options)


def assert_same(one: Tuning, other: Tuning) -> None:
    assert_same_but_effort(one, other)
    assert without_seconds(one.efforts) == without_seconds(other.efforts)


def assert_same_but_effort(one: Tuning, other: Tuning) -> None:
    assert one.verdict == other.verdict
    assert one.summary == other.summary
    assert one.findings == other.findings
    assert one.verification == other.verification
    assert one.plant is not None
    assert other.plant is not None
    assert len(one.plant.experiments) == len(other.plant.experiments)
    for here, there in zip(one.plant.experiments, other.plant.experiments, strict=True):
        np.testing.assert_array_equal(here.response, there.response)
        assert [mode.pole for mode in here.modes] == [mode.pole for mode in there.modes]
    for here, there in zip(one.responses, other.responses, strict=True):
        for name in here.outputs:
            np.testing.assert_array_equal(here.outputs[name], there.outputs[name])


def test_workers_give_the_same_bits_and_the_file_has_their_runs(tmp_path):
    alone = tuned()
    assert alone.verdict == "tuned"
    assert repr(alone.plant).startswith("<PlantModes: 5 experiments; 5 rad/s (4.6")
    assert len(repr(alone.plant)) < 100
    assert_same(alone, tuned(workers=2, keep=tmp_path / FILE))
    again = tuned(keep=tmp_path / FILE, resume=True)
    assert again.verification == alone.verification
    assert sum(one.steps for one in again.efforts.values()) == PROBED


@MORE
@pytest.mark.parametrize(
    ("values", "options"),
    [
        ({"w": 10.0, "z": 0.05, "euler": EULER, "q0": 1e-3}, {}),
        ({"w": 10.0, "z": 0.01, "pendulum": 1.0}, {"amplitude": 30.0}),
        ({"w": 10.0, "z": 0.01, "noise": 5e-5, "seed": 7.0}, {}),
    ],
    ids=["euler", "pendulum", "noise"],
)
def test_plants_as_they_are_have_the_same_bits(values, options):
    """Modes over the command are identified, noise is looked at, stable steps are found on the way.

    What a point shows of stable steps holds for the later ones: those that did not know are done again, and counted twice.
    """
    spread = {"mass": 0.05}

    def here(**more) -> Tuning:
        return tune_plant(rough_fmu(5.0), "u", ["y"], spread=spread, start_values=values, **options, **more)

    alone, shared = here(), here(workers=2)
    if "euler" not in values:
        assert_same(alone, shared)
    else:
        assert_same_but_effort(alone, shared)
        assert all(one.steps >= alone.efforts[part].steps for part, one in shared.efforts.items())


@pytest.mark.parametrize("share", [0.75, pytest.param(0.85, marks=MORE)])
def test_a_budget_of_steps_ends_at_the_same_place(share):
    steps = sum(one.steps for one in tuned(spread={"mass": 0.1}).efforts.values())
    budget = Budget(steps=round(share * steps))
    alone, shared = (tuned(spread={"mass": 0.1}, budget=budget, workers=count) for count in (1, 3))
    assert alone.verdict == "not_verified"
    assert f"the budget of {budget.steps:,} steps is spent" in alone.summary
    assert_same(alone, shared)


@pytest.fixture(scope="module")
def spring(tmp_path_factory) -> Path:
    return counted_spring(tmp_path_factory.mktemp("counted"))


@pytest.mark.skipif(os.name == "nt", reason="signals of POSIX")
@pytest.mark.parametrize(
    ("deadly", "where"),
    [("1.05", "at mass = 1.1: an FMU fails"), pytest.param("1.098", "at mass = 1.1: an FMU fails", marks=MORE)],
)
def test_an_fmu_that_ends_its_worker_is_told(spring, tmp_path, monkeypatch, deadly, where):
    """Above a mass of 1.05 kg its step ends the process: in this process the tuning would be gone."""
    monkeypatch.setenv("COUNTED_DEADLY", deadly)
    found = tune_plant(spring, "force", ["position"], spread={"mass": 0.1}, workers=2, keep=tmp_path / FILE)
    assert not found.good
    assert found.plant is not None
    (finding,) = found.plant.uncovered
    assert where in finding.text
    assert "SIGSEGV" in finding.text
    assert found.verification is not None
    assert found.verification.failed
    assert all(values["mass"] > float(deadly) and "SIGSEGV" in why for values, why in found.verification.failed)
    assert "SIGSEGV" in found.summary


@MORE
def test_a_run_that_fails_is_told_as_without_workers(spring, monkeypatch):
    monkeypatch.setenv("COUNTED_LIMIT", "1.05")
    alone, shared = (tune_plant(spring, "force", ["position"], spread={"mass": 0.1}, workers=count) for count in (1, 2))
    assert alone.verdict == "not_held"
    assert_same(alone, shared)


@MORE
@pytest.mark.skipif(os.name == "nt", reason="signals of POSIX")
@pytest.mark.parametrize("share", [0.3, 0.6])
def test_an_interrupted_tuning_with_workers_goes_on(spring, tmp_path, monkeypatch, share):
    """In the identification, or the verification. Its FMU counts its own steps, in all processes."""
    counted = steps_counted(tmp_path, monkeypatch)
    arguments = ["tune", spring, "--input", "force", "--output", "position", "--vary", "mass=10%", "--no-report"]
    arguments += ["--output-folder", "out"]
    monkeypatch.setattr("shaper_fmu.report.tune.outputs._write_shaper", lambda *_: [])  # it compiles for all platforms
    whole, parted = tmp_path / "whole", tmp_path / "parted"
    whole.mkdir()
    parted.mkdir()
    assert typed(*arguments, cwd=whole).returncode == 0
    steps = counted()
    monkeypatch.setenv("COUNTED_PAUSE", "0.002")
    code = "from shaper_fmu.cli.main import main; main()"
    words = [sys.executable, "-c", code, *map(str, arguments), "--workers", "2"]
    process = subprocess.Popen(words, cwd=parted, stdout=subprocess.PIPE, stderr=subprocess.PIPE)
    while counted() - steps < share * steps and process.poll() is None:
        time.sleep(0.01)
    process.send_signal(signal.SIGINT)
    told = process.communicate()[1].decode()
    assert process.returncode == 130, told
    assert "not verified" in " ".join(told.split())
    monkeypatch.delenv("COUNTED_PAUSE")
    before = counted() - steps
    done = typed(*arguments, "--resume", "--workers", "2", cwd=parted)
    assert done.returncode == 0, done.stderr
    assert "runs of the plant are known" in " ".join(done.stderr.split())
    assert counted() - steps - before < steps - 0.5 * before
    numbers = [json.loads((folder / "out" / "tuning.json").read_text(encoding="utf-8")) for folder in (whole, parted)]
    for one in numbers:
        del one["effort"]
    assert numbers[0] == numbers[1]


def test_wrong_numbers_of_workers(tmp_path):
    with pytest.raises(ArgumentError, match="workers = 0: a number of processes, at least 1, is needed"):
        tuned(workers=0)
    table = tmp_path / "ringing.csv"
    table.write_text("time,x\n0,1\n1,2\n")
    done = typed("tune", table, "--workers", "2", cwd=tmp_path)
    assert done.returncode == 2
    assert "no plant to run in processes" in " ".join(done.stderr.split())
