"""What goes wrong inside a container is told with instance, time and the FMU's words, by the status that FMI has for it."""

from __future__ import annotations

import math

import pytest
from containers import container
from faulty_fmus import FAULTS, chain, faulty_fmu
from fmpy.fmi1 import FMICallException
from native_drivers import Driver, logged

from shaper_fmu.master.system import System

DISCARD, ERROR, FATAL = 2, 3, 4
VERSIONS = [(2, 2), (2, 3), (3, 2), (3, 3)]


@pytest.fixture(params=VERSIONS, ids=lambda pair: f"inside{pair[0]}-outside{pair[1]}")
def versions(request) -> tuple[int, int]:
    return request.param


@pytest.fixture
def driver(versions, tmp_path) -> Driver:
    """first -> x -> last in a container, with x's fault, its status and its time as parameters."""
    inner, outer = versions
    path = container(chain(faulty_fmu(inner)), tmp_path / "chain.fmu", outer, expose=("x.fault", "x.status", "x.fault_time"))
    found = Driver(path)
    return found


def fails(driver: Driver, fault: str, status: int, time: float, call) -> tuple[int, str]:
    """Have x fail, and make the call: its status, and what was logged."""
    driver.set({"x.fault": FAULTS[fault], "x.status": status, "x.fault_time": time})
    with pytest.raises(FMICallException) as raised:
        call()
    return raised.value.status, "\n".join(driver.messages)


def steps(driver: Driver, count: int = 5) -> None:
    driver.initialize()
    for i in range(count):
        driver.step(i * 0.1, 0.1)


@pytest.mark.parametrize("status", [ERROR, DISCARD])
def test_a_failed_step_is_told_with_time_and_words(driver, status):
    found, said = fails(driver, "step", status, 0.2, lambda: steps(driver))
    assert found == status
    assert "x at t = 0.2 s" in said
    assert "goes wrong as told" in said
    assert driver.get("first.output") >= 2.0  # values can still be looked at


@pytest.mark.parametrize("fault", ["enter_initialization", "exit_initialization"])
def test_failures_in_initialization(driver, fault):
    found, said = fails(driver, fault, ERROR, 0.0, driver.initialize)
    assert found == ERROR
    assert "x at initialization" in said
    assert "goes wrong as told" in said


@pytest.mark.parametrize("fault", ["set_real", "set_boolean", "get_real", "get_integer"])
def test_failures_of_values(driver, fault):
    found, said = fails(driver, fault, ERROR, 0.2, lambda: steps(driver))
    assert found == ERROR
    assert "x at t = 0.2 s" in said or "x at t = 0.3 s" in said
    assert "goes wrong as told" in said


def test_after_an_error_only_a_reset_leads_on(driver):
    fails(driver, "step", ERROR, 0.2, lambda: steps(driver))
    with pytest.raises(FMICallException):
        driver.step(0.2, 0.1)
    assert "after an error" in driver.messages[0]
    driver.slave.reset()
    driver.set({"x.fault": 0})
    steps(driver, 2)
    assert driver.get("first.output") == 2.0  # it counts its steps
    driver.close()


def test_after_a_refused_step_no_other_one_is_taken(driver):
    fails(driver, "step", DISCARD, 0.2, lambda: steps(driver))
    with pytest.raises(FMICallException) as raised:
        driver.step(0.2, 0.05)
    assert raised.value.status == ERROR
    assert "set back to a saved state" in driver.messages[-1]
    driver.close()


def test_a_fatal_error_ends_all_calls(driver):
    found, said = fails(driver, "step", FATAL, 0.2, lambda: steps(driver))
    assert found == FATAL
    assert "cannot be used any more" in said
    with pytest.raises(FMICallException):
        driver.get("first.output")
    driver.close()  # which must not call the FMUs


@pytest.mark.parametrize("text", ["percent", "silent"])
def test_words_without_arguments_and_no_words_at_all(driver, text):
    found, said = fails(driver, text, ERROR, 0.2, lambda: steps(driver))
    assert found == ERROR
    assert ("a load of 100" in said) if text == "percent" else ("gave no message" in said)


@pytest.mark.parametrize("value", ["not_a_number", "infinite"])
def test_a_value_that_is_none_reaches_no_other_fmu(driver, value):
    found, said = fails(driver, value, ERROR, 0.2, lambda: steps(driver))
    assert found == ERROR
    assert "the value for input input is" in said
    assert "last at t = 0.2 s" in said
    assert not math.isfinite(driver.get("x.output"))


def test_the_request_to_end_is_passed_on(tmp_path):
    """FMI 3.0: by terminateSimulation; FMI 2.0: by Discard and fmi2Terminated."""
    system = chain(faulty_fmu(3))
    for outer in (2, 3):
        driver = Driver(container(system, tmp_path / f"c{outer}.fmu", outer, expose=("x.fault", "x.fault_time")))
        driver.set({"x.fault": FAULTS["terminate_in_step"], "x.fault_time": 0.2})
        steps(driver, 2)
        if outer == 3:
            event, terminate, early, reached = driver.slave.doStep(0.2, 0.1)
            assert (event, terminate, early, reached) == (False, True, True, 0.2)
        else:
            with pytest.raises(FMICallException) as raised:
                driver.step(0.2, 0.1)
            assert raised.value.status == DISCARD
            assert driver.slave.getBooleanStatus(3)  # fmi2Terminated
        assert "asked to end the simulation" in "\n".join(driver.messages)
        driver.close()


def test_an_fmu_that_cannot_be_made(versions, tmp_path):
    inner, outer = versions
    system = System()
    system.add("null", faulty_fmu(inner))
    path = container(system, tmp_path / "c.fmu", outer)
    with pytest.raises(Exception, match=r"(?i)instantiate"):
        Driver(path)
    assert "null cannot be instantiated" in logged()


def test_an_fmu_that_cannot_be_set_up(tmp_path):
    system = System()
    system.add("setup", faulty_fmu(2))
    driver = Driver(container(system, tmp_path / "c.fmu", 2))
    with pytest.raises(FMICallException) as raised:
        driver.initialize()
    assert raised.value.status == ERROR
    assert "setup at initialization: fmi2SetupExperiment failed" in logged()


def test_messages_with_an_environment_that_is_none(tmp_path):
    """Overture's FMUs give their component to the logger in place of the host's environment; the instance's name tells who it is."""
    system = System()
    system.add("other", faulty_fmu(2))
    system.add("stranger", faulty_fmu(2), {"fault": FAULTS["step"], "status": 1, "fault_time": 0.0})
    driver = Driver(container(system, tmp_path / "c.fmu")).initialize()
    driver.step(0.0, 0.1)
    assert "stranger: a step goes wrong as told" in driver.messages
    driver.close()


def test_messages_after_a_container_inside_has_worked(tmp_path):
    """Its calls end within those of the container around it, which still knows who speaks."""
    within = System()
    within.add("x", faulty_fmu(2))
    system = System()
    system.add("within", container(within, tmp_path / "within.fmu"))
    system.add("stranger", faulty_fmu(2), {"fault": FAULTS["step"], "status": 1, "fault_time": 0.0})
    driver = Driver(container(system, tmp_path / "c.fmu")).initialize()
    driver.step(0.0, 0.1)
    assert "stranger: a step goes wrong as told" in driver.messages
    driver.close()
