"""What a tuning costs: the steps that it tells are those that an FMU counts itself, and they are few."""

from __future__ import annotations

import json
import math
from pathlib import Path

import numpy as np
import pytest
from command_line import typed
from counted_spring import counted_spring, steps_counted

from shaper_fmu.export.build import fmu_path
from shaper_fmu.tune import Move
from shaper_fmu.tune.meter import PARTS, Effort, Meter, effort_words
from shaper_fmu.tune.plan import Cost, plan_for
from shaper_fmu.tune.tuning import requirements_for
from shaper_fmu.tune.tuning_plant import tune_plant
from shaper_fmu.tune.verification.peaks import peak_to_peak


@pytest.fixture(scope="module")
def spring(tmp_path_factory) -> Path:
    return counted_spring(tmp_path_factory.mktemp("counted"))


def test_every_step_is_told(spring, tmp_path, monkeypatch):
    """An FMU of pythonfmu's counts the calls of its do_step; a linear mode with three points of a range."""
    counted = steps_counted(tmp_path, monkeypatch)
    arguments = ("--input", "force", "--output", "position", "--vary", "mass=10%", "--no-report", "--output-folder", "out")
    done = typed("tune", spring, *arguments, cwd=tmp_path)
    assert done.returncode == 0, done.stderr
    effort = json.loads((tmp_path / "out" / "tuning.json").read_text())["effort"]
    assert effort["steps"] == counted()
    assert effort["steps"] == sum(part["steps"] for part in effort["parts"].values())
    assert set(effort["parts"]) <= set(PARTS)
    assert {name for name, part in effort["parts"].items() if part["steps"]} == {"settle", "look", "excite", "verify"}
    assert all(part["seconds"] >= part["stepping"] >= 0.0 for part in effort["parts"].values())
    assert f"the plant took {effort['steps']:,} steps" in " ".join(done.stderr.split())


@pytest.mark.parametrize("damping", [0.0, 0.62])
def test_a_mode_with_three_points_takes_few_steps(damping):
    """A mode of 3.1 rad/s, exact at any step, varied by 10 %: it took 202,563 steps when each part took what the worst plant needs."""
    values = {"mass": 1.0, "stiffness": 3.1**2, "damping": damping}
    plant = fmu_path("MassSpringDamper", platforms=["this"])
    requirements = requirements_for({"mass": 0.1}, kinds=("mzv", "zvd", "ei"))
    found = tune_plant(plant, "force", ["position"], start_values=values, spread={"mass": 0.1}, requirements=requirements)
    assert found.verdict == "tuned"
    assert sum(one.steps for one in found.efforts.values()) <= 6000
    assert found.plant is not None
    assert found.plant.nominal.modes[0].natural_frequency == pytest.approx(3.1, rel=1e-9)
    assert found.plant.nominal.modes[0].damping_ratio == pytest.approx(damping / 6.2, abs=1e-9)


def test_two_modes_with_three_points_take_few_steps():
    """Two pendulums in a row, each a mode, and a load that varies by 10 %."""
    plant = fmu_path("DoublePendulumCrane", platforms=["this"])
    requirements = requirements_for({"load_mass": 0.1}, kinds=("mzv", "zvd", "ei", "direct_zv"))
    outputs = ["hook_angle", "load_angle"]
    found = tune_plant(plant, "trolley_acceleration", outputs, spread={"load_mass": 0.1}, requirements=requirements)
    assert found.verdict == "tuned"
    assert found.plant is not None
    assert len(found.plant.nominal.modes) == 2
    assert sum(one.steps for one in found.efforts.values()) <= 15000


@pytest.mark.parametrize("samples", [20, 24, 48])
def test_peaks_between_samples(samples):
    """cos t, shifted against its samples by all shares of a step: the parabola errs by (2 pi / n)^4 / 42 at most."""
    step = 2.0 * math.pi / samples
    for shift in np.linspace(-0.5, 0.5, 41):
        t = step * (np.arange(2 * samples) + shift)
        assert peak_to_peak(t, np.cos(t)) == pytest.approx(2.0, abs=2.0 * step**4 / 42.0)
    assert peak_to_peak(np.array([0.0, 1.0, 1.0, 2.0]), np.array([0.0, 0.0, 1.0, 0.5])) == 1.0  # no parabola over a jump
    assert peak_to_peak(np.arange(3.0), np.array([3.0, 2.0, 1.0])) == 2.0


def test_the_parts_of_an_effort_add_up():
    meter = Meter()
    meter.add(5)  # no part of the work
    with meter.part("look"):
        meter.add(3, 0.25)
        with meter.part("excite"):
            meter.add(4)
        meter.add(2)
    efforts = meter.efforts
    assert (efforts["look"].steps, efforts["look"].runs, efforts["look"].stepping) == (5, 2, 0.25)
    assert (efforts["excite"].steps, efforts["excite"].runs) == (4, 1)
    assert meter.whole.steps == 9
    words = effort_words({"look": Effort(3000, 3, 240.0, 15.0), "choose": Effort(0, 0, 1.5)})
    assert words == "the plant took 3,000 steps, 5 ms each, 4 min 2 s in all: look 3,000 (4 min 0 s), choose (1.5 s)"
    assert effort_words({"choose": Effort(0, 0, 1.5)}) == ""


def test_a_report_tells_the_steps(spring):
    from shaper_fmu.page.blocks import Table
    from shaper_fmu.report.tune.report import tuning_blocks

    found = tune_plant(spring, "force", ["position"], requirements=requirements_for({}))
    (table,) = (one for one in tuning_blocks(found) if isinstance(one, Table) and "time" in one.title)
    assert [row[0] for row in table.rows] == [*found.efforts, "all"]
    assert table.rows[-1][1] == str(sum(one.steps for one in found.efforts.values()))


def test_a_move_takes_few_steps_and_the_plan_knows_them():
    """A crane's move took 69,294 steps of its verification, at the abrupt move's step throughout, and a plan of 2,604."""
    plant, spread = fmu_path("OverheadCrane", platforms=["this"]), {"initial_rope_length": 0.05}
    requirements = requirements_for(spread, move=Move(2.0, max_velocity=1.0, max_acceleration=0.5))
    found = tune_plant(plant, "trolley_acceleration", ["swing_angle"], spread=spread, requirements=requirements)
    assert found.verdict == "tuned"
    taken = found.efforts["verify"].steps
    assert taken <= 25_000
    told = plan_for(3, 1, Cost(), moves=True)
    assert told.least["verify"].steps <= taken <= 1.5 * told.usual["verify"].steps
