"""`shaper-fmu run X.fmu`, and `simulate_fmu`: one FMU alone, with its inputs driven.

Expected motion: the mass on a spring's step response in closed form, and the matrix exponential for a force that is held over each step
(`moved`, of the FMI 1.0 spring); the FMUs of model exchange have known solutions.
"""

from __future__ import annotations

import csv
import math
import shutil
from pathlib import Path

import numpy as np
import pytest
from command_line import typed
from equation_fmus import equations_fmu
from scipy.linalg import expm
from spring_fmus import moved, spring_fmu

from shaper_fmu import ArgumentError, System, fmu_path, simulate_fmu
from shaper_fmu.errors import ModelError, SimulationError
from shaper_fmu.ssp.export import write_system

MASS, STIFFNESS, DAMPING = 1.0, 100.0, 1.0  # MassSpringDamper's own values


def step_response(t: np.ndarray) -> np.ndarray:
    """Position after a unit force from t = 0 on: (1 - exp(-d t) (cos wd t + d / wd sin wd t)) / k."""
    d = DAMPING / (2.0 * MASS)
    wd = math.sqrt(STIFFNESS / MASS - d**2)
    t = np.maximum(t, 0.0)
    return (1.0 - np.exp(-d * t) * (np.cos(wd * t) + d / wd * np.sin(wd * t))) / STIFFNESS


def held_response(forces: np.ndarray, step: float) -> np.ndarray:
    """Positions for forces[k] held over step k, by the matrix exponential; shape (len(forces) + 1,)."""
    over = expm(step * np.array([[0, 1, 0], [-STIFFNESS / MASS, -DAMPING / MASS, 1 / MASS], [0, 0, 0]]))
    state, found = np.zeros(3), [0.0]
    for force in forces:
        state[2] = force
        state = over @ state
        found.append(state[0])
    return np.array(found)


@pytest.fixture(scope="module")
def desk(tmp_path_factory) -> Path:
    folder = tmp_path_factory.mktemp("desk")
    for fmi in (2, 3):
        shutil.copy(fmu_path("MassSpringDamper", fmi=fmi, platforms=["this"]), folder / f"plant{fmi}.fmu")
    shutil.copy(spring_fmu(), folder / "spring.fmu")
    (folder / "force.csv").write_text("time_ms,force,other\n0,0,5\n500,1,5\n500,2,5\n800,2,5\n")
    return folder


def table(path: Path) -> dict[str, np.ndarray]:
    with open(path, newline="") as stream:
        head, *rows = csv.reader(stream)
    return {name: np.array(column, float) for name, column in zip(head, zip(*rows, strict=True), strict=True)}


def run(desk: Path, tmp_path: Path, *arguments: str):
    done = typed("run", *arguments, "--output", tmp_path / "r.csv", cwd=desk)
    assert done.returncode == 0, done.stderr
    return table(tmp_path / "r.csv"), done.stderr


@pytest.mark.parametrize("interface", ["co_simulation", "model_exchange"])
@pytest.mark.parametrize("fmi", [2, 3])
def test_a_step(desk, tmp_path, fmi, interface):
    """Exact though the step falls between two communication points."""
    given = ["--input", "force=step:2@0.333", "--until", "2", "--step", "0.01", "--interface", interface]
    found, said = run(desk, tmp_path, f"plant{fmi}.fmu", *given, "--solver-tolerance", "1e-10")
    assert list(found) == ["time", "force", "position", "velocity", "acceleration"]
    assert found["time"][-1] == pytest.approx(2.0)
    expected = 2.0 * step_response(found["time"] - 0.333)
    assert found["position"] == pytest.approx(expected, abs=1e-12 if interface == "co_simulation" else 1e-8)
    assert "input force: step from 0 to 2 N at 0.333 s\n" in said


@pytest.mark.parametrize(("text", "rate"), [("sine:0.2@1.5Hz@0.1", 3.0 * math.pi), ("sine:0.2@9rad/s@0.1s", 9.0)])
def test_a_sine_on_top_of_the_start_value(desk, tmp_path, text, rate):
    given = ["--input", f"force={text}", "--set", "force=3", "--until", "1", "--step", "0.01"]
    found, said = run(desk, tmp_path, "plant2.fmu", *given)
    t = 0.01 * np.arange(100)
    forces = 3.0 + np.where(t > 0.1, 0.2 * np.sin(rate * (t - 0.1)), 0.0)
    assert found["position"] == pytest.approx(held_response(forces, 0.01), abs=1e-12)
    hertz = f"{rate / (2.0 * math.pi):.6g} Hz ({rate:.6g} rad/s)"
    assert f"sine of amplitude 0.2 N about 3, {hertz}, from 0.1 s on; held over each step of 0.01 s" in said


TABLES = {  # the force over time that a table means
    "force.csv": lambda t: np.where(t < 0.5 - 1e-9, 2.0 * t, 2.0),
    "force.csv@hold": lambda t: np.where(t < 0.5 - 1e-9, 0.0, 2.0),
    "force.csv:other": lambda t: np.full_like(t, 5.0),
    "7": lambda t: np.full_like(t, 7.0),
}


@pytest.mark.parametrize("text", TABLES)
def test_tables_and_constants(desk, tmp_path, text):
    """A time column in ms, a jump at a time that is there twice, the last value kept."""
    found, said = run(desk, tmp_path, "plant2.fmu", "--input", f"force={text}", "--until", "1", "--step", "0.01")
    forces = TABLES[text](0.01 * np.arange(100))
    assert found["position"] == pytest.approx(held_response(forces, 0.01), abs=1e-12)
    if text != "7":
        assert "held until the next row" in said if "@hold" in text else "straight between the rows" in said
        assert "the table ends at 0.8 s, and the run at 1 s" in said


def test_fmus_of_other_tools(desk, tmp_path):
    """An FMU of FMI 1.0, and one of model exchange alone: x' = u - x from 0."""
    found, said = run(
        desk, tmp_path, "spring.fmu", "--input", "force=step:2", "--until", "1", "--step", "0.01", "--set", "damping=2"
    )
    assert found["position"] == pytest.approx(moved(np.full(100, 2.0), 0.01, damping=2.0), abs=1e-12)
    for version in (2, 3):
        results = simulate_fmu(equations_fmu(version), 1.0, 0.1, inputs={"u": 1.0}, solver_tolerance=1e-10)
        assert results["y"] == pytest.approx(1.0 - np.exp(-results.time), abs=1e-8)
    assert "held over each step" not in said


def test_times_that_nobody_tells(desk, tmp_path):
    """The FMU's own stop time and step; a thousandth of the run where there is no step, and an error where there is no end."""
    found, _ = run(desk, tmp_path, "plant2.fmu", "--input", "force=1")
    assert found["time"][-1] > 1.0
    results = simulate_fmu(spring_fmu(), 3.0)
    assert len(results.time) == 1501  # 0.002 s is the next below 0.003 s of 1, 2 and 5
    assert "declares no step: 0.002 s was taken" in results.notes[0]
    with pytest.raises(ArgumentError, match="give a stop time"):
        simulate_fmu(spring_fmu())
    done = typed("run", "spring.fmu", cwd=desk)
    assert (done.returncode, "--until" in done.stderr) == (2, True)


def test_inputs_of_a_system(desk, tmp_path, fmus):
    system = System("alone")
    system.add("plant", fmus / "MassSpringDamper.fmu")
    write_system(system, tmp_path / "alone.ssp", stop_time=1.0, step=0.01)
    found, said = run(tmp_path, tmp_path, "alone.ssp", "--input", "plant.force=step:1@0.25")
    assert found["plant.position"] == pytest.approx(step_response(found["time"] - 0.25), abs=1e-12)
    assert "input plant.force: step from 0 to 1 N at 0.25 s" in said


def test_in_python(desk):
    results = simulate_fmu(desk / "plant3.fmu", 1.0, 0.01, inputs={"force": [(0, 0), (0.25, 1)]}, start_values={"mass": 1.0})
    assert list(results) == ["force", "position", "velocity", "acceleration"]
    assert (results.units["position"], results["force"][-1]) == ("m", 1.0)
    assert results["position"] == pytest.approx(step_response(results.time - 0.25), abs=1e-12)
    ramp = simulate_fmu(desk / "plant2.fmu", 1.0, 0.01, inputs={"force": ([0, 1], [0, 1])}, linear=True, record=["position"])
    assert list(ramp) == ["position"]
    assert ramp["position"] == pytest.approx(held_response(0.01 * np.arange(100), 0.01), abs=1e-12)
    with pytest.raises(ModelError, match="Did you mean 'force'"):
        simulate_fmu(desk / "plant2.fmu", 1.0, 0.01, inputs={"forc": 1.0})
    with pytest.raises(ArgumentError, match=r'such as \{"force": 1.0\}'):
        simulate_fmu(desk / "plant2.fmu", 1.0, 0.01, inputs="force")  # pyright: ignore[reportArgumentType]
    with pytest.raises(SimulationError) as failed:
        simulate_fmu(desk / "plant2.fmu", 1.0, 0.01, inputs={"force": lambda t: 1.0 / (t < 0.5)})
    assert "position" in failed.value.results


MISTAKES = {
    "--input forc=1": "no input 'forc'. Did you mean 'force'?",
    "--input position=1": "(it is of causality output)",
    "--input force": "'force' is not of the form F=step:1@0.5",
    "--input force=stp:1": "Did you mean 'step'? Write F=step:1@0.5",
    "--input force=step:1@late": "a step is written step:HEIGHT@TIME",
    "--input force=sine:1@2": "with the frequency's unit, such as sine:0.2@1.5Hz",
    "--input force=sine:1@0Hz": "must be a finite number above 0, not 0",
    "--input force=nowhere.csv": "nowhere.csv: No such file",
    "--input force=force.csv:forse": "has no column 'forse'. Did you mean 'force'?",
    "--input mass=1": "mass",
    "--set mas=2": "Did you mean 'mass'?",
    "--until 1 --step 2": "a step of 2 s does not fit into a run of 1 s",
    "--variant other": "this is for systems",
    "--parameter-set other": "this is for systems",
    "--algorithm jacobi": "this is for systems",
    "--input force=1 --input force=2": "force is given twice",
}


@pytest.mark.parametrize("line", MISTAKES)
def test_mistakes(desk, line):
    done = typed(
        "run",
        "plant2.fmu",
        *line.split(),
        "--until" if "--until" not in line else "--grid",
        *(["1"] if "--until" not in line else []),
        cwd=desk,
    )
    said = " ".join(done.stderr.split())
    assert done.returncode == 2, said
    assert MISTAKES[line] in said, said


def test_a_report_of_another_run_is_kept(desk, tmp_path):
    (tmp_path / "r.html").write_text("<title>Run of crane</title>")
    done = typed("run", desk / "plant2.fmu", "--until", "1", "--report", "r.html", cwd=tmp_path)
    assert (done.returncode, "--force" in done.stderr) == (2, True)
    done = typed("run", desk / "plant2.fmu", "--until", "1", "--input", "force=step", "--report", "r.html", "--force", cwd=tmp_path)
    assert done.returncode == 0, done.stderr
    assert "<title>Run of plant2</title>" in (tmp_path / "r.html").read_text()
