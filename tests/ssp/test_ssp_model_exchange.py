"""FMUs of model exchange in SSP archives, on the command line, in sweeps and in `tune`: chosen, run, and the same numbers everywhere."""

from __future__ import annotations

import re
import zipfile
from pathlib import Path

import numpy as np
import pytest
from command_line import typed
from equation_fmus import MODELS, equations_fmu
from linear_fmus import linear_fmu, matrices
from sweep_cases import content, runs_of

from shaper_fmu import Peak, System, sweep_system
from shaper_fmu.ssp.archive import load_ssp
from shaper_fmu.tune import Requirements, tune_plant

STOP, STEP = 1.0, 0.02


def shaped(fmus: Path, interface: str | None) -> System:
    """A shaper before the mass on a spring."""
    system = System("shaped")
    system.add("shaper", fmus / "InputShaper.fmu", shaper="zv", natural_frequency=[10.0], command=1.0)
    system.add("plant", fmus / "MassSpringDamper.fmu", interface=interface)
    system.connect("shaper.shaped", "plant.force")
    return system


def rewritten(archive: Path, target: Path, old: str, new: str) -> Path:
    """The archive with another text in its description."""
    with zipfile.ZipFile(archive) as source, zipfile.ZipFile(target, "w") as changed:
        for name in source.namelist():
            found = source.read(name)
            if name == "SystemStructure.ssd":
                assert old in found.decode()
                found = found.decode().replace(old, new).encode()
            changed.writestr(name, found)
    return target


def test_an_archive_chooses_the_interface(fmus, tmp_path):
    """Written, read and run again it gives the same bits; without a choice the FMU is used by co-simulation."""
    system = shaped(fmus, "model_exchange")
    archive = system.to_ssp(tmp_path / "me.ssp", stop_time=STOP, step=STEP)
    loaded = load_ssp(archive)
    assert {name: fmu.interface for name, fmu in loaded.system.fmus.items()} == {
        "shaper": "co_simulation",
        "plant": "model_exchange",
    }
    direct, again = (one.simulate(STOP, STEP) for one in (system, loaded.system))
    assert np.array_equal(direct["plant.position"], again["plant.position"])
    free = load_ssp(rewritten(archive, tmp_path / "any.ssp", ' implementation="ModelExchange"', ""))
    assert free.system.fmus["plant"].interface == "co_simulation"
    alone = System()
    alone.add("x", equations_fmu(2), model=float(MODELS["decay"]))
    alone.to_ssp(tmp_path / "alone.ssp", stop_time=STOP, step=STEP)
    for implementation in ("any", "ModelExchange"):
        text = f'implementation="{implementation}"'
        read = load_ssp(
            rewritten(tmp_path / "alone.ssp", tmp_path / f"{implementation}.ssp", 'implementation="ModelExchange"', text)
        )
        assert read.system.fmus["x"].interface == "model_exchange"


def test_the_command_runs_it_with_the_solver_asked_for(fmus, tmp_path):
    """What is printed is what Python computes with the same options; a solver that does not exist is a wrong usage."""
    system = shaped(fmus, "model_exchange")
    archive = system.to_ssp(tmp_path / "me.ssp", stop_time=STOP, step=STEP)
    done = typed("run", archive, "--solver", "bdf", "--solver-tolerance", "1e-4", "--output", "out.csv", cwd=tmp_path)
    assert done.returncode == 0, done.stderr
    results = system.simulate(STOP, STEP, solver="bdf", solver_tolerance=1e-4)
    header, *_, last = (tmp_path / "out.csv").read_text().splitlines()
    column = next(i for i, name in enumerate(header.split(",")) if "plant.position" in name)
    assert float(last.split(",")[column]) == results["plant.position"][-1]
    assert results["plant.position"][-1] != system.simulate(STOP, STEP)["plant.position"][-1]
    assert typed("check", archive, cwd=tmp_path).returncode == 0
    wrong = typed("run", archive, "--solver", "euler", cwd=tmp_path)
    assert wrong.returncode == 2
    assert "euler" in wrong.stderr


def test_sweeps_give_the_same_with_and_without_workers(fmus, tmp_path):
    """And the peaks are those of single runs."""
    system = shaped(fmus, "model_exchange")
    options = {
        "vary": {"plant.stiffness": [80.0, 100.0, 120.0]}, "metrics": {"peak": Peak("plant.position")},
        "stop_time": STOP, "step": STEP, "solver": "adams", "solver_tolerance": 1e-8,
    }  # fmt: skip
    assert sweep_system(system, tmp_path / "a.sqlite", **options) == {"done": 3}
    assert sweep_system(system, tmp_path / "b.sqlite", **options, workers=2) == {"done": 3}
    assert content(runs_of(tmp_path / "a.sqlite")) == content(runs_of(tmp_path / "b.sqlite"))
    for run in runs_of(tmp_path / "a.sqlite"):
        values = {"plant.stiffness": run.varied["plant.stiffness"]}
        single = system.simulate(STOP, STEP, start_values=values, solver="adams", solver_tolerance=1e-8, everywhere=True)
        assert run.metrics["peak"] == np.abs(single["plant.position"]).max()


@pytest.mark.parametrize("version", [2, 3])
def test_a_plant_of_model_exchange_alone_is_tuned(version, tmp_path):
    """Its mode is that of its matrix: 3 rad/s, damping ratio 0.05."""
    plain = linear_fmu(version, "ModelExchange")
    plant = tmp_path / "alone.fmu"
    with zipfile.ZipFile(plain) as source, zipfile.ZipFile(plant, "w") as changed:
        for name in source.namelist():
            found = source.read(name)
            if name == "modelDescription.xml":
                found = re.sub(rb"<CoSimulation[^>]*/>", b"", found)
            changed.writestr(name, found)
    values = {"b2": 0.0}
    tuning = tune_plant(plant, "u", ["y"], requirements=Requirements(tolerance=0.05), start_values=values)
    assert tuning.verdict == "tuned"
    assert tuning.plant is not None
    (mode,) = tuning.plant.ranges
    poles = np.linalg.eigvals(matrices(**values)[0])
    assert np.abs(poles - 3.0 * complex(-0.05, np.sqrt(1.0 - 0.05**2))).min() < 1e-9
    assert mode.natural_frequency.nominal == pytest.approx(3.0, rel=1e-4)
    assert mode.damping_ratio.nominal == pytest.approx(0.05, rel=1e-3)
