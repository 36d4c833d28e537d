"""The plan of a tuning is what it takes, and a budget is kept: what it leaves out is told, and never called tuned."""

from __future__ import annotations

import io
import json
import time

import pytest
import typer
from command_line import typed
from counted_spring import counted_spring, steps_counted
from rich.console import Console

from shaper_fmu.cli.amounts import duration_of
from shaper_fmu.export.build import fmu_path
from shaper_fmu.master.simulation import Simulation
from shaper_fmu.progress import parts_progress
from shaper_fmu.tune.meter import Budget, BudgetError, Meter
from shaper_fmu.tune.plan import Cost, plan_for
from shaper_fmu.tune.tuning import Tuning, requirements_for
from shaper_fmu.tune.tuning_plant import tune_plant

VALUES = {"mass": 2.0, "stiffness": 50.0, "damping": 1.0}
SPREAD = {"mass": 0.1}
LEAST = sum(one.steps for one in plan_for(3, 1, Cost()).least.values())
USUAL = sum(one.steps for one in plan_for(3, 1, Cost()).usual.values())


def tuned(budget: Budget | None, said: list[str] | None = None) -> Tuning:
    requirements = requirements_for(SPREAD, kinds=("mzv", "zvd", "ei"))
    plant, say = fmu_path("MassSpringDamper", platforms=["this"]), (said if said is not None else []).append
    return tune_plant(
        plant, "force", ["position"], start_values=VALUES, spread=SPREAD, requirements=requirements, budget=budget, say=say
    )  # fmt: skip


def test_the_plan_is_what_it_takes():
    said: list[str] = []
    found = tuned(Budget(steps=USUAL + 500), said)
    assert found.verdict == "tuned"
    taken = sum(one.steps for one in found.efforts.values())
    assert LEAST <= taken == pytest.approx(USUAL, rel=0.1)
    assert f"plan for one mode and 3 points of the range: {USUAL:,} steps" in said[0]
    assert found.efforts["excite"].steps == pytest.approx(plan_for(3, 1, Cost()).usual["excite"].steps, rel=0.1)


def test_what_a_budget_leaves_out_is_never_tuned():
    """At every budget between the least and the usual one: it is kept, and the verdict tells what is not known."""
    for steps in range(LEAST, USUAL, 300):
        found = tuned(Budget(steps=steps))
        assert sum(one.steps for one in found.efforts.values()) <= steps
        if found.verdict == "tuned":
            assert found.verification is not None
            assert found.verification.holds
            assert len(found.verification.points) > 9
            assert found.responses or any(one.code == "left_out" for one in found.findings)
        else:
            assert found.verdict == "not_verified"
            assert f"the budget of {steps:,} steps is spent" in found.summary


def test_points_that_a_budget_leaves_out_are_named():
    """A plant of 3000 rad/s: its survey takes rounds beside which two points of the range do not fit any more."""
    values, requirements = {**VALUES, "stiffness": 18e6}, requirements_for(SPREAD, kinds=("mzv", "zvd", "ei"))
    plant = fmu_path("MassSpringDamper", platforms=["this"])
    found = tune_plant(
        plant, "force", ["position"], start_values=values, spread=SPREAD, requirements=requirements, budget=Budget(LEAST)
    )  # fmt: skip
    assert found.verdict == "not_verified"
    assert found.plant is not None
    left = [one.text for one in found.plant.uncovered if one.code == "left_out"]
    assert left
    assert all(text in found.summary for text in left)


def test_too_small_a_budget_is_refused_before_the_work(tmp_path, monkeypatch):
    spring, counted = counted_spring(tmp_path), steps_counted(tmp_path, monkeypatch)
    arguments = ("--input", "force", "--output", "position", "--vary", "mass=10%")
    done = typed("tune", spring, *arguments, "--steps", "1000", cwd=tmp_path)
    assert done.returncode == 2
    words = " ".join(done.stderr.replace("│", " ").split())
    assert f"a budget of 1,000 steps is too small: a verdict takes {LEAST:,} steps at least" in words
    assert counted() == 0
    monkeypatch.setenv("COUNTED_PAUSE", "0.005")
    done = typed("tune", spring, *arguments, "--budget", "3s", cwd=tmp_path)
    assert done.returncode == 1
    assert "a budget of 3 s is too small" in " ".join(done.stderr.split())
    assert counted() == 12


def test_a_spent_budget_refuses_a_run():
    meter = Meter(Budget(steps=10))
    with meter.part("look"):
        meter.add(8)
        meter.allow(2)
        with pytest.raises(BudgetError, match="the budget of 10 steps is spent: 8 are taken, and the next run takes 3 more"):
            meter.allow(3)
    late = Meter(Budget(seconds=1e-9))
    time.sleep(0.001)
    with pytest.raises(BudgetError, match="is spent"):
        late.allow(0)


@pytest.mark.parametrize(("text", "seconds"), [("90", 90.0), ("90s", 90.0), ("2min", 120.0), ("1.5 h", 5400.0), (".5", 0.5)])
def test_times_are_read(text, seconds):
    assert duration_of(text) == seconds


@pytest.mark.parametrize("text", ["", "min", "2 days", "-1", "0", "inf", "nan"])
def test_what_is_no_time_is_refused(text):
    with pytest.raises(typer.BadParameter, match="write 90s, 2min or 1h"):
        duration_of(text)


def interrupted_at(monkeypatch: pytest.MonkeyPatch, run: int) -> None:
    """Ctrl-C within this run of the plant."""
    runs, simulated = [0], Simulation.run

    def counting(self: Simulation, *arguments, **options):
        runs[0] += 1
        if runs[0] == run:
            raise KeyboardInterrupt
        return simulated(self, *arguments, **options)

    monkeypatch.setattr(Simulation, "run", counting)


@pytest.mark.parametrize(("run", "verdict"), [(3, None), (12, "not_verified"), (25, "not_verified")])
def test_ctrl_c_keeps_what_is_known(run, verdict, tmp_path, monkeypatch):
    """In the survey, at a point of the range, and in the verification."""
    interrupted_at(monkeypatch, run)
    plant = fmu_path("MassSpringDamper", platforms=["this"])
    arguments = ("--input", "force", "--output", "position", "--vary", "mass=10%", "--kind", "mzv", "--no-report")
    monkeypatch.setattr("shaper_fmu.report.tune.outputs._write_shaper", lambda *_: [])  # it compiles for all platforms
    done = typed("tune", plant, *arguments, "--output-folder", "out", cwd=tmp_path)
    assert done.returncode == 130
    words = " ".join(done.stderr.split())
    if verdict is None:
        assert "interrupted:" in words
        assert "no mode was identified; what was measured is kept, and --resume goes on" in words
        assert [one.name for one in (tmp_path / "out").iterdir()] == ["experiment.sqlite"]
    else:
        numbers = json.loads((tmp_path / "out" / "tuning.json").read_text())
        assert numbers["verdict"] == verdict
        assert numbers["modes"]
        assert "interrupted:" in numbers["words"]
        assert f"what was known is kept in out, and its verdict is {verdict.replace('_', ' ')}" in words


def test_each_part_is_heard_with_its_own_steps():
    """On a terminal that is a bar for each part: what is done of it, the whole, and the time left."""
    heard: dict[str, tuple[int, int]] = {}
    plant, requirements = fmu_path("MassSpringDamper", platforms=["this"]), requirements_for(SPREAD, kinds=("mzv", "zvd", "ei"))

    def hear(part: str, done: int, expected: int) -> None:
        assert done >= heard.get(part, (0, 0))[0]
        heard[part] = done, expected

    found = tune_plant(plant, "force", ["position"], start_values=VALUES, spread=SPREAD, requirements=requirements, hear=hear)
    assert {part: done for part, (done, _) in heard.items()} == {
        part: one.steps for part, one in found.efforts.items() if one.steps
    }  # fmt: skip
    assert all(done == pytest.approx(expected, rel=0.25) for done, expected in heard.values())
    console = Console(force_terminal=True, file=io.StringIO(), width=120)
    with parts_progress(console) as update:
        for part, (done, expected) in heard.items():
            update(part, 0.5 * done, expected)
            update(part, done, expected)
    shown = console.file.getvalue()  # pyright: ignore[reportAttributeAccessIssue]
    assert all(f"{part} " in shown for part in heard)
