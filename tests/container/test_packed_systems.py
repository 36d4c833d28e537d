"""A system in a container moves as it does in the master's run, whatever steps the host takes."""

from __future__ import annotations

import math
from pathlib import Path

import numpy as np
import pytest
from containers import FREQUENCY, STIFFNESS, container, shaped_oscillator
from fmpy import simulate_fmu
from fmpy.validation import validate_fmu
from native_drivers import Driver

from shaper_fmu.container.build import pack
from shaper_fmu.container.interface import outer_variables
from shaper_fmu.errors import ModelError
from shaper_fmu.export.build import fmu_path
from shaper_fmu.master.system import System
from shaper_fmu.ssp import load_ssp
from shaper_fmu.ssp.archive import pack_ssp
from shaper_fmu.ssp.packing import connector_variables

ROOT = Path(__file__).parents[2]
EDGE = 0.3137  # [s], of no grid
VERSIONS = [(2, 2), (2, 3), (3, 2), (3, 3)]

SHAPERS = {  # amplitudes and delays in half periods; Singer and Seering 1990 (ZV, ZVD), Singhose 1994 (EI at V = 5 %)
    "zv": ([0.5, 0.5], 0.0),
    "zvd": ([0.25, 0.5, 0.25], 0.0),
    "ei": ([1.05 / 4, 0.95 / 2, 1.05 / 4], 0.05),
}


def response(t: float, amplitudes: list[float]) -> float:
    """Position of the undamped oscillator at rest after a step of the force of 1 N through a shaper (superposition)."""
    half = math.pi / FREQUENCY
    moved = [(a, t - i * half) for i, a in enumerate(amplitudes)]
    return sum(a / STIFFNESS * (1.0 - math.cos(FREQUENCY * since)) for a, since in moved if since > 0.0)


@pytest.mark.representatives(step=[0.007, 0.05])
@pytest.mark.parametrize("shaper", SHAPERS)
@pytest.mark.parametrize("step", [0.001, 0.007, 0.05])
@pytest.mark.parametrize("versions", VERSIONS, ids=str)
def test_edges_inside_are_exact_whatever_the_host_steps(versions, step, shaper, tmp_path):
    inner, outer = versions
    path = container(shaped_oscillator(inner, shaper), tmp_path / "c.fmu", outer)
    driver = Driver(path).initialize({"shaper.command": 1.0})
    amplitudes, residual = SHAPERS[shaper]
    for i in range(math.ceil(1.0 / step)):
        driver.step(i * step, step)
        t = (i + 1) * step
        assert driver.get("plant.position") == pytest.approx(response(t, amplitudes), abs=1e-10 / STIFFNESS)
    away = math.hypot(driver.get("plant.position") - 1.0 / STIFFNESS, driver.get("plant.velocity") / FREQUENCY)
    assert away * STIFFNESS == pytest.approx(residual, abs=1e-10)
    driver.close()


@pytest.mark.parametrize("fmi", [2, 3])
def test_an_inner_event_between_the_hosts_points(fmi, tmp_path):
    """A profile's step at a time of no grid: after it the position is that of the formula, for host steps of 50 ms."""
    system = System("late")
    system.add("profile", fmu_path("MotionProfile", 3, platforms=["this"]), profile="step", distance=1.0, start_time=EDGE)
    system.add("plant", fmu_path("MassSpringDamper", 2, platforms=["this"]), mass=1.0, stiffness=STIFFNESS, damping=0.0)
    system.connect_raw("profile.position", "plant.force")
    driver = Driver(container(system, tmp_path / "c.fmu", fmi)).initialize()
    for i in range(20):
        driver.step(i * 0.05, 0.05)
        expected = response((i + 1) * 0.05 - EDGE, [1.0])
        assert driver.get("plant.position") == pytest.approx(expected, abs=1e-12)
    driver.close()


def test_a_host_without_events_alone_loses_percents(tmp_path):
    """The same two FMUs, stepped by a plain host at 50 ms, leave what the container does not: the reason for it."""
    shaper, plant = (
        Driver(fmu_path("InputShaper", 2, platforms=["this"])),
        Driver(fmu_path("MassSpringDamper", 2, platforms=["this"])),
    )
    shaper.initialize({"shaper": 1, "natural_frequency[1]": FREQUENCY, "command": 1.0})
    plant.initialize({"mass": 1.0, "stiffness": STIFFNESS, "damping": 0.0})
    for i in range(20):
        plant.set({"force": shaper.get("shaped")})
        shaper.step(i * 0.05, 0.05)
        plant.step(i * 0.05, 0.05)
    away = math.hypot(plant.get("position") - 1.0 / STIFFNESS, plant.get("velocity") / FREQUENCY)
    assert away * STIFFNESS > 0.01
    shaper.close()
    plant.close()


@pytest.fixture(scope="module")
def archives(tmp_path_factory) -> Path:
    """The systems of ssp/ as archives, with FMUs for this machine."""
    from shaper_fmu.registry import components

    folder = tmp_path_factory.mktemp("archives")
    for name in components():
        (folder / f"{name}.fmu").write_bytes(fmu_path(name, 2, platforms=["this"]).read_bytes())
    for system in sorted(path for path in (ROOT / "ssp").iterdir() if path.is_dir()):
        pack_ssp(system, folder, folder / f"{system.name}.ssp")
    return folder


NAMES = sorted(path.name for path in (ROOT / "ssp").iterdir() if path.is_dir())


@pytest.mark.representatives(name=["partial_modes_three_mass", "two_part_pendulum", "nested_crane"])
@pytest.mark.parametrize("name", NAMES)
@pytest.mark.parametrize("fmi", [2, 3])
def test_the_systems_of_ssp_give_what_run_gives(name, fmi, archives, tmp_path):
    """By our own master, which uses the container's events, and by fmpy, which knows none."""
    loaded = load_ssp(archives / f"{name}.ssp")
    stop, step = min(loaded.structure.stop_time or 1.0, 2.0), loaded.structure.step_size or 0.01
    expected = loaded.simulate(stop, step)
    outer = connector_variables(loaded, fmi)
    path = pack(loaded.system, outer, tmp_path / f"{name}.fmu", fmi=fmi, step=step, platforms=("this",)).path
    assert validate_fmu(str(path)) == []
    system = System()
    system.add("c", path)
    for every in (1, 5):
        found = system.simulate(stop, every * step)
        for variable in (name for name in found.values if name.startswith("c.")):
            one, other = expected.values[variable.removeprefix("c.")][::every], found.values[variable]
            size = np.max(np.abs(one)) or 1.0
            assert np.max(np.abs(one - other[: len(one)])) <= 1e-12 * size, variable
    recorded = [v.name for v in outer if v.causality == "output" and not v.dimensions]
    plain = simulate_fmu(str(path), stop_time=stop, step_size=step, output_interval=step, output=recorded)
    for variable in recorded:
        one = expected.values[variable]
        assert np.max(np.abs(one - plain[variable])) <= 1e-12 * (np.max(np.abs(one)) or 1.0), variable


@pytest.mark.parametrize("fmi", [2, 3])
def test_hosts_whose_times_are_off_by_their_last_bits(fmi, archives, tmp_path):
    """Times that are added up, as ecos does, and steps that are differences of times, as libcosim's: the pendulum's valves make 1e-10 of
    the last bits where they are not brought back to the grid inside."""
    loaded = load_ssp(archives / "two_part_pendulum.ssp")
    step = loaded.structure.step_size or 0.001
    expected = loaded.simulate(2.0, step)["arm.swing_angle"]
    path = pack(loaded.system, connector_variables(loaded, fmi), tmp_path / "c.fmu", fmi=fmi, step=step, platforms=("this",)).path
    for differences in (False, True):
        driver, t, found = Driver(path).initialize(), 0.0, []
        for i in range(len(expected) - 1):
            end = (i + 1) * step
            driver.step(t, end - t if differences else step)
            t = end if differences else t + step
            found.append(driver.get("arm.swing_angle"))
        assert np.max(np.abs(np.array(found) - expected[1:])) <= 1e-12 * np.max(np.abs(expected))
        driver.close()


@pytest.mark.parametrize("versions", VERSIONS, ids=str)
def test_a_container_in_a_container(versions, tmp_path):
    inner, outer = versions
    within = container(shaped_oscillator(3), tmp_path / "within.fmu", inner)
    system = System()
    system.add("profile", fmu_path("MotionProfile", 2, platforms=["this"]), profile="step", distance=1.0, start_time=EDGE)
    system.add("shaped", within)
    system.connect_raw("profile.position", "shaped.shaper.command")
    driver = Driver(container(system, tmp_path / "around.fmu", outer)).initialize()
    for i in range(30):
        driver.step(i * 0.05, 0.05)
    assert driver.get("shaped.plant.position") == pytest.approx(1.0 / STIFFNESS, abs=1e-12)
    assert driver.get("shaped.plant.velocity") == pytest.approx(0.0, abs=1e-11)
    driver.close()


def test_the_same_system_gives_the_same_bytes(tmp_path):
    one, other = (container(shaped_oscillator(), tmp_path / str(i) / "c.fmu") for i in range(2))
    assert one.read_bytes() == other.read_bytes()


def test_what_cannot_be_packed_leaves_the_file_as_it_was(tmp_path):
    path = tmp_path / "c.fmu"
    path.write_bytes(b"before")
    system = shaped_oscillator()
    system.drive("shaper.command", lambda t: t)
    with pytest.raises(ModelError, match="function of Python"):
        container(system, path)
    assert path.read_bytes() == b"before"


@pytest.mark.parametrize("algorithm", ["jacobi", "gauss_seidel", "parallel"])
def test_each_algorithm_gives_what_it_gives_in_a_run(algorithm, tmp_path):
    """A profile before a shaper before a plant, whose inputs move smoothly: the algorithms differ by percents."""
    system = shaped_oscillator()
    system.add(
        "profile",
        fmu_path("MotionProfile", 2, platforms=["this"]),
        profile="trapezoid",
        distance=1.0,
        max_velocity=2.0,
        max_acceleration=8.0,
    )
    system.connect_raw("profile.position", "shaper.command")
    expected = system.simulate(1.5, 0.01, algorithm=algorithm).values["plant.position"]
    driver = Driver(container(system, tmp_path / "c.fmu", algorithm=algorithm)).initialize()
    found = [driver.get("plant.position")]
    for i in range(150):
        driver.step(i * 0.01, 0.01)
        found.append(driver.get("plant.position"))
    assert np.max(np.abs(found - expected)) <= 1e-12 * np.max(np.abs(expected))
    driver.close()


def test_an_fmu_that_needs_a_tool(tmp_path):
    """A component by pythonfmu, which needs Python where it runs: in a container it does, too, and that is told."""
    system = System()
    system.add("shaper", fmu_path("InputShaper", 2, backend="python"), shaper="zvd", natural_frequency=[FREQUENCY])
    system.add("plant", fmu_path("MassSpringDamper", 2, platforms=["this"]), mass=1.0, stiffness=STIFFNESS, damping=0.0)
    system.connect("shaper.shaped", "plant.force")
    packed = pack(system, outer_variables(system, 2), tmp_path / "c.fmu", platforms=("this",))
    assert any("needs a tool where the container runs" in note for note in packed.notes)
    driver = Driver(packed.path).initialize({"shaper.command": 1.0})
    simulation = driver.description.coSimulation
    assert simulation is not None
    assert simulation.needsExecutionTool
    for i in range(20):
        driver.step(i * 0.05, 0.05)
    assert driver.get("plant.position") == pytest.approx(1.0 / STIFFNESS, abs=1e-12)
    driver.close()
