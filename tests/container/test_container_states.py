"""States of a container: saved, restored and serialized with all FMUs inside, bit by bit."""

from __future__ import annotations

from pathlib import Path

import pytest
from containers import container, shaped_oscillator
from faulty_fmus import chain, faulty_fmu
from fmpy.fmi1 import FMICallException
from native_drivers import Driver

VERSIONS = [(2, 2), (2, 3), (3, 2), (3, 3)]
OUTPUTS = ("plant.position", "plant.velocity", "plant.acceleration", "shaper.shaped")


@pytest.fixture(params=VERSIONS, ids=str)
def path(request, tmp_path) -> Path:
    inner, outer = request.param
    return container(shaped_oscillator(inner, "ei"), tmp_path / "c.fmu", outer, expose=("plant.damping",))


def saved(driver: Driver):
    return driver.slave.getFMUState() if driver.fmi == 3 else driver.slave.getFMUstate()


def restore(driver: Driver, state) -> None:
    (driver.slave.setFMUState if driver.fmi == 3 else driver.slave.setFMUstate)(state)


def free(driver: Driver, state) -> None:
    (driver.slave.freeFMUState if driver.fmi == 3 else driver.slave.freeFMUstate)(state)


def go_on(driver: Driver, begin: int, end: int) -> list[tuple[float, ...]]:
    """Steps with a command that jumps now and then."""
    rows = []
    for i in range(begin, end):
        driver.set({"shaper.command": float(i // 3 % 2)})
        driver.step(i * 0.07, 0.07)
        rows.append(tuple(driver.get(name) for name in OUTPUTS))
    return rows


def test_the_description_says_that_states_are_there(path):
    driver = Driver(path)
    simulation = driver.description.coSimulation
    assert simulation is not None
    assert simulation.canGetAndSetFMUstate  # fmpy's name for both versions
    assert simulation.canSerializeFMUstate
    driver.close()


def test_a_restored_state_goes_on_to_the_bit(path):
    driver = Driver(path).initialize({"plant.damping": 0.1})
    go_on(driver, 0, 10)
    driver.set({"shaper.command": 0.5})  # which is not used before the state is saved
    state = saved(driver)
    assert driver.get("shaper.command") == 0.5  # which brings it to the shaper, here as below
    expected = go_on(driver, 10, 20)
    for _ in range(3):
        restore(driver, state)
        assert driver.get("shaper.command") == 0.5
        assert go_on(driver, 10, 20) == expected
    free(driver, state)
    driver.close()


def test_a_state_of_each_phase(path):
    driver = Driver(path)
    state = saved(driver)
    driver.initialize()
    expected = go_on(driver, 0, 5)
    restore(driver, state)
    driver.initialize()
    assert go_on(driver, 0, 5) == expected
    free(driver, state)
    driver.close()


def test_serialized_bytes_become_the_state_in_another_instance(path):
    one, other = Driver(path).initialize(), Driver(path).initialize()
    go_on(one, 0, 10)
    state = saved(one)
    name = "FMUState" if one.fmi == 3 else "FMUstate"
    content = getattr(one.slave, f"serialize{name}")(state)
    assert content == getattr(one.slave, f"serialize{name}")(state)
    found = getattr(other.slave, f"de{'s' if one.fmi == 3 else 'S'}erialize{name}")(content)
    restore(other, found)
    assert go_on(other, 10, 20) == go_on(one, 10, 20)
    free(one, state)
    free(other, found)
    for wrong in (content[:-8], content + bytes(8), bytes(len(content)), content[:20]):
        with pytest.raises(FMICallException):
            getattr(other.slave, f"de{'s' if one.fmi == 3 else 'S'}erialize{name}")(wrong)
    assert "no state of this FMU" in "\n".join(other.messages)
    one.close()
    other.close()


def test_without_states_inside_there_are_none_outside(tmp_path):
    driver = Driver(container(chain(faulty_fmu(2)), tmp_path / "c.fmu"))
    simulation = driver.description.coSimulation
    assert simulation is not None
    assert not simulation.canGetAndSetFMUstate
    driver.close()


def test_the_time_goes_back_with_the_state(path):
    driver = Driver(path).initialize()
    state = saved(driver)
    driver.set({"shaper.command": 1.0})
    driver.step(0.0, 0.5)
    once = driver.get("plant.position")
    restore(driver, state)
    assert driver.get("plant.position") == 0.0
    driver.set({"shaper.command": 1.0})
    driver.step(0.0, 0.25)
    driver.step(0.25, 0.25)
    assert driver.get("plant.position") == pytest.approx(once, abs=1e-13)
    with pytest.raises(FMICallException):
        driver.step(0.25, 0.25)
    free(driver, state)
    driver.close()
