"""FMI 1.0 in all that takes a plant: archives, isolated runs, sweeps, `tune`, `check`."""

from __future__ import annotations

import shutil
import zipfile
from pathlib import Path

import numpy as np
import pytest
from spring_fmus import CAPABILITIES, DAMPING, FAULTS, MASS, STIFFNESS, model, moved, slave, spring_fmu
from sweep_cases import runs_of
from typer.testing import CliRunner

from shaper_fmu import System, check_ssp, load_ssp, sweep_system
from shaper_fmu.cli.main import app
from shaper_fmu.errors import SimulationError
from shaper_fmu.metrics import Final
from shaper_fmu.ssp.export import write_system
from shaper_fmu.sweep import Store
from shaper_fmu.tune import experiment

STEP = 0.1


def chained(second: Path) -> System:
    """Two masses on springs; the position of the first pulls the second, by a negated alias."""
    system = System()
    system.add("a", spring_fmu(), force=3.0)
    system.add("b", second, excitation=-2.0)
    system.connect_raw("a.position", "b.pull", gain=4.0)
    return system


@pytest.mark.parametrize("second", [spring_fmu, model])
def test_archives_and_isolated_runs_give_the_same_bits(second, tmp_path):
    system = chained(second())
    right = system.simulate(1.0, STEP)
    expected = moved(-4.0 * moved(np.full(10, 3.0), STEP)[:-1], STEP, damping=2.0)
    assert right["b.position"] == pytest.approx(expected, abs=1e-14 if second is spring_fmu else 2e-5)
    path = write_system(system, tmp_path / "chained.ssp", stop_time=1.0, step=STEP)
    assert check_ssp(path) == []
    loaded = load_ssp(path)
    for results in (loaded.system.simulate(1.0, STEP), system.simulate(1.0, STEP, isolate=True)):
        for name in ("a.position", "b.position", "b.drop", "b.resting", "b.count_out"):
            assert np.array_equal(results[name], right[name]), name
    done = CliRunner().invoke(app, ["check", str(path), str(spring_fmu()), str(model())])
    assert done.exit_code == 0, done.output


@pytest.mark.parametrize(("fault", "fresh"), [("none", False), ("reset", True)])
def test_a_sweep_of_slaves_that_can_be_reset_or_not(fault, fresh, tmp_path):
    system = System()
    system.add("x", spring_fmu(), fault=FAULTS[fault], force=3.0)
    _check_sweep(system, tmp_path, fresh, 1e-14)


def test_a_sweep_of_models(tmp_path):
    system = System()
    system.add("x", model(), force=3.0)
    _check_sweep(system, tmp_path, True, 1e-5)


def _check_sweep(system: System, folder: Path, fresh: bool, tolerance: float) -> None:
    dampings, store = [0.5, 1.0, 2.0, 4.0], folder / "s.sqlite"
    metrics = {"end": Final("x.position")}
    counts = sweep_system(system, store, vary={"x.damping": dampings}, metrics=metrics, stop_time=1.0, step=STEP, workers=1)
    assert counts == {"done": 4}
    ends = [run.metrics["end"] for run in runs_of(store)]
    assert ends == pytest.approx([moved(np.full(10, 3.0), STEP, damping=one)[-1] for one in dampings], abs=tolerance)
    with Store(store) as opened:
        assert ("instances" in opened.remarks()) == fresh


@pytest.mark.parametrize("fmu", [spring_fmu, model])
def test_its_mode_is_identified(fmu):
    """That of m x'' + d x' + k x = f, of the slave and of the model."""
    (mode,) = experiment(fmu(), "force", ["position"]).modes
    assert mode.natural_frequency == pytest.approx((STIFFNESS / MASS) ** 0.5, rel=1e-6)
    assert mode.damping_ratio == pytest.approx(0.5 * DAMPING / (STIFFNESS * MASS) ** 0.5, rel=1e-4)


def test_a_slave_that_is_once_in_a_process():
    fmu = spring_fmu(slave(f'{CAPABILITIES} canBeInstantiatedOnlyOncePerProcess="true"'))
    system = System()
    system.add("x", fmu, force=3.0)
    first, second = (system.simulate(1.0, STEP)["x.position"] for _ in range(2))
    assert np.array_equal(first, second)


def test_check_tells_faults(tmp_path):
    """Of a coupled tool, of a library that is not there, and of dependencies that are none."""
    tool = (
        "<Implementation><CoSimulation_Tool><Capabilities/><Model entryPoint='a' manualStart='false' type='b'/></CoSimulation_Tool>"
    )
    for changed, words in (
        (spring_fmu(f"{tool}</Implementation>"), "couples a tool (CoSimulation_Tool)"),
        (spring_fmu(changes=(('modelIdentifier="spring"', 'modelIdentifier="other"'),)), "has no library for this machine"),
    ):
        system = System()
        system.add("x", spring_fmu())
        path = write_system(system, tmp_path / "x.ssp", stop_time=1.0, step=STEP)
        _replace(path, "spring", changed)
        assert words in " ".join(check_ssp(path))


def _replace(path: Path, part: str, fmu: Path) -> None:
    """Put another FMU in the place of that of an archive."""
    with zipfile.ZipFile(path) as archive:
        files = {name: archive.read(name) for name in archive.namelist()}
    draft = path.with_suffix(".new")
    with zipfile.ZipFile(draft, "w") as archive:
        for name, content in files.items():
            archive.writestr(name, fmu.read_bytes() if part in name and name.endswith(".fmu") else content)
    shutil.move(draft, path)


def test_a_failure_in_an_isolated_run_is_told_in_words():
    system = System()
    system.add("x", spring_fmu(), fault=FAULTS["step"], fault_time=0.55, force=1.0)
    with pytest.raises(SimulationError, match=r"x at t = 0\.5 s: fmiDoStep failed: 100% of the load: broken at 0\.5 s"):
        system.simulate(1.0, STEP, isolate=True)
