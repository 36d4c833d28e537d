"""Values of a container's variables: of every type, of arrays and parts of them, and when they may be set."""

from __future__ import annotations

import math

import pytest
from containers import FREQUENCY, container, shaped_oscillator
from faulty_fmus import faulty_fmu
from fmpy.fmi1 import FMICallException
from native_drivers import Driver

from shaper_fmu.master.system import System

VERSIONS = [(2, 2), (2, 3), (3, 2), (3, 3)]


@pytest.fixture(params=VERSIONS, ids=str)
def versions(request) -> tuple[int, int]:
    return request.param


def test_numbers_and_booleans_go_in_and_out(versions, tmp_path):
    """The test FMU counts its steps in `output` (1 + input each) and `count_out` (100 each), and turns the boolean round."""
    inner, outer = versions
    system = System()
    system.add("x", faulty_fmu(inner))
    driver = Driver(container(system, tmp_path / "c.fmu", outer)).initialize()
    driver.set({"x.input": 0.5, "x.count_in": 7, "x.flag_in": True})
    driver.step(0.0, 0.1)
    assert driver.get("x.output") == 1.5
    assert driver.get("x.count_out") % 100 == 0
    assert not driver.get("x.flag_out")
    assert [driver.get(f"x.{name}") for name in ("input", "count_in", "flag_in")] == [0.5, 7, True]
    driver.set({"x.flag_in": False})
    driver.step(0.1, 0.1)
    assert driver.get("x.flag_out")
    driver.close()


def test_a_small_integer_that_fmi2_shows_as_a_large_one(tmp_path):
    """UInt8 inside, Integer outside: 300 does not fit, and is told when the FMU would get it."""
    system = System()
    system.add("x", faulty_fmu(3))
    driver = Driver(container(system, tmp_path / "c.fmu", 2)).initialize()
    driver.set({"x.small": 255, "x.single": 0.1})
    driver.step(0.0, 0.1)
    driver.set({"x.small": 300})
    with pytest.raises(FMICallException):
        driver.step(0.1, 0.1)
    assert "the value for input small is 300, which does not fit into its type" in "\n".join(driver.messages)
    driver.close()


def test_enumerations_and_arrays_of_parameters(versions, tmp_path):
    """EI instead of ZVD, for a frequency of which one element of the array is set alone: V = 5 % is left (Singhose 1994)."""
    inner, outer = versions
    path = container(shaped_oscillator(inner), tmp_path / "c.fmu", outer, expose=("shaper.shaper", "shaper.natural_frequency*"))
    driver = Driver(path)
    declared = driver.variables["shaper.shaper"].declaredType
    assert declared is not None
    items = {item.name: int(str(item.value)) for item in declared.items}
    arrays = [name for name in driver.variables if name.startswith("shaper.natural_frequency")]
    assert len(arrays) == (1 if (inner, outer) == (3, 3) else 4)
    driver.set({"shaper.shaper": items["ei"], "shaper.natural_frequency[1]": 2.0 * FREQUENCY})
    driver.initialize({"shaper.command": 1.0})
    assert driver.get("shaper.shaper") == items["ei"]
    driver.step(0.0, 1.0)
    assert driver.get("shaper.shaped") == 1.0
    driver.close()
    driver = Driver(path)
    driver.set({"shaper.shaper": items["ei"], "shaper.natural_frequency[1]": FREQUENCY})
    driver.initialize({"shaper.command": 1.0})
    driver.step(0.0, 1.0)
    away = math.hypot(100.0 * driver.get("plant.position") - 1.0, 10.0 * driver.get("plant.velocity"))
    assert away == pytest.approx(0.05, abs=1e-12)
    driver.close()


def test_fixed_parameters_are_set_before_the_start_alone(versions, tmp_path):
    inner, outer = versions
    path = container(shaped_oscillator(inner), tmp_path / "c.fmu", outer, expose=("plant.stiffness", "plant.natural_frequency"))
    driver = Driver(path)
    driver.set({"plant.stiffness": 25.0})
    driver.initialize()
    assert driver.get("plant.stiffness") == 25.0
    assert driver.get("plant.natural_frequency") == 5.0  # sqrt(k / m), calculated inside
    if driver.variables["plant.stiffness"].variability == "fixed":
        with pytest.raises(FMICallException):
            driver.set({"plant.stiffness": 30.0})
        assert "cannot be set after initialization" in driver.messages[-1]
    with pytest.raises(FMICallException):
        driver.set({"plant.position": 1.0})
    assert "plant.position cannot be set" in driver.messages[-1]
    driver.close()


@pytest.mark.parametrize("outer", [2, 3])
def test_a_tunable_parameter_of_an_fmu_with_event_mode(outer, tmp_path):
    """FMI 3.0 lets it be set in event mode alone: the container goes through it before the next step. A command after the change
    is shaped for the new frequency: ZV's second impulse comes half a period after it."""
    path = container(shaped_oscillator(3, "zv"), tmp_path / "c.fmu", outer, expose=("shaper.natural_frequency",))
    driver = Driver(path).initialize()
    name = "shaper.natural_frequency[1]"
    assert driver.variables[name if outer == 2 else "shaper.natural_frequency"].variability == "tunable"
    driver.step(0.0, 0.1)
    driver.set({name: 2.0 * FREQUENCY, "shaper.command": 1.0})
    half = math.pi / (2.0 * FREQUENCY)
    driver.step(0.1, half - 1e-6)
    assert driver.get("shaper.shaped") == 0.5
    driver.step(0.1 + half - 1e-6, 2e-6)
    assert driver.get("shaper.shaped") == 1.0
    driver.close()


def test_wrong_references_types_and_counts(versions, tmp_path):
    inner, outer = versions
    driver = Driver(container(shaped_oscillator(inner), tmp_path / "c.fmu", outer)).initialize()
    getter = driver.slave.getFloat64 if outer == 3 else driver.slave.getReal
    other = driver.slave.getInt32 if outer == 3 else driver.slave.getInteger
    position = driver.variables["plant.position"].valueReference
    for call, words in ((lambda: getter([9999]), "no variable"), (lambda: other([position]), "of another type")):
        with pytest.raises(FMICallException):
            call()
        assert words in driver.messages[-1]
    driver.close()


def test_start_values_of_the_system_are_those_of_the_container(versions, tmp_path):
    """They are in the description, and count where the host sets nothing; a reset brings them back."""
    inner, outer = versions
    system = shaped_oscillator(inner)
    system.set("shaper.command", 0.25)
    path = container(system, tmp_path / "c.fmu", outer, expose=("plant.stiffness",))
    driver = Driver(path)
    assert float(str(driver.variables["shaper.command"].start)) == 0.25
    assert float(str(driver.variables["plant.stiffness"].start)) == 100.0
    for _ in range(2):
        driver.initialize()
        driver.step(0.0, 1.0)
        assert driver.get("plant.position") == pytest.approx(0.25 / 100.0, abs=1e-14)
        driver.slave.reset()
        driver.set({"shaper.command": 7.0})
        driver.slave.reset()
    driver.close()
