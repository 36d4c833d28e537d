"""The files of a tuning: what the archive feeds to the plant, its instances, and the shaper's FMU without a compiler."""

from __future__ import annotations

import json
import shutil
from pathlib import Path

import numpy as np
import pytest
from command_line import typed
from spring_with_unit import spring_with_unit

from shaper_fmu import System, fmu_path, requirements_for, tune_plant
from shaper_fmu.master.fmu import load_fmu
from shaper_fmu.master.motion import motion_order
from shaper_fmu.report import write_tuning
from shaper_fmu.ssp.archive import load_ssp
from shaper_fmu.ssp.check import check_ssp
from shaper_fmu.ssp.parameter_sets import apply_parameter_set
from shaper_fmu.ssp.template import write_template


def ran(path: Path, names: list[str], *, unshaped: bool = False):
    loaded = load_ssp(path)
    if unshaped:
        apply_parameter_set(loaded, "unshaped")
    stop, step = loaded.structure.stop_time, loaded.structure.step_size
    assert stop is not None
    assert step is not None
    return loaded.system, loaded.simulate(stop, step, record=names)


@pytest.mark.parametrize(
    ("input_", "output", "unit", "fed"),
    [
        ("force", "position", "N", "position"),
        ("force", "position", "m/s", "velocity"),
        ("trolley_acceleration", "swing_angle", "m/s2", "acceleration"),
    ],
)
def test_the_archive_feeds_what_the_inputs_unit_says(tmp_path, input_, output, unit, fed):
    """A velocity's input gets a move's velocity, which ends at 0, with the command's size as its peak; `new system` does the same."""
    crane = input_ == "trolley_acceleration"
    plant = fmu_path("OverheadCrane", platforms=["this"]) if crane else spring_with_unit(tmp_path, unit)
    assert load_fmu(plant).unit_of(input_) == unit
    found = tune_plant(plant, input_, [output], requirements=requirements_for({}, kinds=("zvd", "mzv")))
    assert found.verdict == "tuned", found.summary
    write_tuning(found, tmp_path / "tuned", report=False)
    path = tmp_path / "tuned" / "shaped_plant.ssp"
    assert check_ssp(path) == []
    system, results = ran(path, [f"plant.{input_}", f"plant.{output}"], unshaped=True)
    assert set(system.fmus) == {"profile", "shaper", "plant"}
    assert system.connections["shaper", "command"] == ("profile", fed)
    command = results[f"plant.{input_}"]
    assert np.abs(command).max() == pytest.approx(abs(found.command.amplitude), rel=1e-3)
    assert command[-1] == pytest.approx(found.command.amplitude if fed == "position" else 0.0, abs=1e-9)
    _, shaped = ran(path, [f"plant.{output}"])
    last = len(results.time) // 3
    swing = [np.ptp(one[f"plant.{output}"][-last:]) for one in (results, shaped)]
    assert swing[1] < 0.05 * swing[0]
    write_template(plant, input_, output, tmp_path / "new.ssp")
    assert load_ssp(tmp_path / "new.ssp").system.connections["shaper", "command"] == ("profile", fed)


@pytest.mark.parametrize(
    ("unit", "order"), [("N", 0), ("m", 0), ("m/s", 1), ("m/s2", 2), ("rad/s", 1), ("m.s-2", 2), ("N.s/m", 0), ("1/s", 0)]
)
def test_the_order_of_a_motion_is_that_of_its_unit(unit, order, monkeypatch):
    fmu = load_fmu(fmu_path("MassSpringDamper", platforms=["this"]))
    monkeypatch.setattr(fmu.variables["force"], "unit", unit)
    assert motion_order(fmu, "force") == order


def test_a_system_that_has_a_shaper_can_be_tuned(tmp_path):
    """The names of the instances that are added give way."""
    plant = fmu_path("MassSpringDamper", platforms=["this"])
    system = System("loop")
    system.add("shaper", plant)
    found = tune_plant(system, "shaper.force", ["shaper.position"], requirements=requirements_for({}, kinds=("zvd",)))
    assert found.verdict == "tuned", found.summary
    write_tuning(found, tmp_path, report=False)
    loaded = load_ssp(tmp_path / "shaped_plant.ssp").system
    assert set(loaded.fmus) == {"shaper", "shaper_2", "profile"}
    assert loaded.connections["shaper", "force"] == ("shaper_2", "shaped_mean")


def test_without_a_compiler_the_plain_shaper_is_told(tmp_path, monkeypatch):
    monkeypatch.setattr("shaper_fmu.report.tune.outputs.has_toolchain", lambda: False)
    plant = fmu_path("MassSpringDamper", platforms=["this"])
    done = typed("tune", plant, "--input", "force", "--output", "position", "--kind", "zvd", "--no-report", cwd=tmp_path)
    assert done.returncode == 0, done.stderr
    line = next(line for line in done.stdout.splitlines() if "InputShaper" in line and line.startswith("wrote"))
    assert line.endswith("InputShaper.fmu (plain: it needs the values in shaper.ssv)")
    assert "note: there is no compiler" in done.stderr
    assert "InputShaper.fmu is the plain one" in " ".join(done.stderr.split())


def test_a_good_tuning_is_not_replaced_by_one_that_is_not_nor_by_that_of_another_plant(tmp_path):
    spring_with_unit(tmp_path, "N")
    fmu_path("MassSpringDamper", platforms=["this"])
    call = ("tune", tmp_path / "Spring.fmu", "--input", "force", "--output", "position", "--no-report", "--output-folder", "out")
    assert typed(*call, "--kind", "zvd", cwd=tmp_path).returncode == 0
    first = (tmp_path / "out" / "tuning.json").read_bytes()
    failed = typed(*call, "--kind", "zv", "--margin", "30%", cwd=tmp_path)
    assert failed.returncode == 1
    assert "note: out keeps its tuning" in failed.stderr
    assert (tmp_path / "out" / "tuning.json").read_bytes() == first
    assert not json.loads((tmp_path / "out_2" / "tuning.json").read_text())["good"]
    again = typed(*call, "--kind", "zvd", "--nominal", "0.9%", cwd=tmp_path)
    assert again.returncode == 0
    assert "keeps" not in again.stderr
    assert (tmp_path / "out" / "tuning.json").read_bytes() != first
    other = shutil.copy(tmp_path / "Spring.fmu", tmp_path / "Other.fmu")
    assert typed("tune", other, *call[2:], "--kind", "zvd", cwd=tmp_path).returncode == 0
    assert json.loads((tmp_path / "out" / "tuning.json").read_text())["source"] == "Spring.fmu"
    assert json.loads((tmp_path / "out_3" / "tuning.json").read_text())["source"] == "Other.fmu"
