"""Events of a container in FMI 3.0: announced, returned at, and handled with the host; and inputs that jump or slope."""

from __future__ import annotations

import math
from itertools import pairwise

import numpy as np
import pytest
from containers import FREQUENCY, STIFFNESS, container, shaped_oscillator
from fmpy.fmi1 import FMICallException
from native_drivers import Driver

from shaper_fmu.archives import read_archive, write_archive
from shaper_fmu.export.build import fmu_path
from shaper_fmu.master.system import System

HALF = math.pi / FREQUENCY  # [s]: between ZVD's impulses


def packed(tmp_path, inner: int = 3, outer: int = 3, **options) -> Driver:
    path = container(shaped_oscillator(inner), tmp_path / "c.fmu", outer)
    return Driver(path, **options)


@pytest.mark.parametrize("inner", [2, 3])
def test_events_are_announced_and_returned_at(inner, tmp_path):
    """A command's step at 0.1 s: ZVD passes it on at once, and half a period and a period later."""
    driver = packed(tmp_path, inner, eventModeUsed=True, earlyReturnAllowed=True).initialize()
    driver.leave_event_mode()
    assert driver.step(0.0, 0.1) == (False, 0.1)
    driver.slave.enterEventMode()
    driver.set({"shaper.command": 1.0})
    following = driver.leave_event_mode()
    assert following == pytest.approx(0.1 + HALF, abs=1e-14)
    reached, met = 0.1, []
    while reached < 1.0:
        event, reached = driver.step(reached, 1.0 - reached)
        if event:
            before = driver.get("shaper.shaped")
            driver.slave.enterEventMode()
            following = driver.leave_event_mode()
            met.append((reached, before, driver.get("shaper.shaped")))
    assert [t for t, _, _ in met] == pytest.approx([0.1 + HALF, 0.1 + 2 * HALF], abs=1e-14)
    left = [0.25, 0.75] if inner == 3 else [0.75, 1.0]  # FMI 2.0 knows no values from the left
    assert [values for _, *values in met] == [pytest.approx([left[0], 0.75]), pytest.approx([left[1], 1.0])]
    assert following is None
    assert driver.get("plant.position") == pytest.approx(1.0 / STIFFNESS, abs=1e-14)
    driver.close()


def test_without_early_return_inner_events_are_handled_inside(tmp_path):
    driver = packed(tmp_path, eventModeUsed=True, earlyReturnAllowed=False).initialize({"shaper.command": 1.0})
    driver.leave_event_mode()
    assert driver.step(0.0, 1.0) == (False, 1.0)
    assert driver.get("plant.position") == pytest.approx(1.0 / STIFFNESS, abs=1e-14)
    driver.close()


def test_an_event_that_the_host_passes_over_is_handled_inside(tmp_path):
    """It steps on from where it was told to enter event mode."""
    driver = packed(tmp_path, eventModeUsed=True, earlyReturnAllowed=True).initialize({"shaper.command": 1.0})
    driver.leave_event_mode()
    reached = 0.0
    while reached < 1.0:
        _, reached = driver.step(reached, 1.0 - reached)
    assert driver.get("plant.position") == pytest.approx(1.0 / STIFFNESS, abs=1e-14)
    driver.close()


def test_event_mode_has_to_be_asked_for(tmp_path):
    driver = packed(tmp_path).initialize()
    with pytest.raises(Exception, match="EnterEventMode"):
        driver.slave.enterEventMode()
    assert "not asked for" in driver.messages[-1]
    driver.close()


@pytest.mark.parametrize("inner", [2, 3])
@pytest.mark.parametrize("outer", [2, 3])
def test_an_input_that_jumps_between_steps_is_an_event(inner, outer, tmp_path):
    """The command jumps at 0.2 s and back at 0.5 s, between two steps of the host: each jump is shaped for itself."""
    driver = packed(tmp_path, inner, outer).initialize()
    for i in range(20):
        t = i * 0.1
        driver.set({"shaper.command": 1.0 if 0.15 < t < 0.45 else 0.0})
        driver.step(t, 0.1)
        if i == 1:
            assert driver.get("shaper.shaped") == 0.0
    assert driver.get("plant.position") == pytest.approx(0.0, abs=1e-13)
    assert driver.get("plant.velocity") == pytest.approx(0.0, abs=1e-12)
    driver.close()


@pytest.mark.parametrize("inner", [2, 3])
@pytest.mark.parametrize("outer", [2, 3])
def test_direct_feedthrough_is_seen_before_the_step(inner, outer, tmp_path):
    """The acceleration follows the force at once: a = F / m; the shaper passes a fourth of a step on at once."""
    driver = packed(tmp_path, inner, outer).initialize()
    driver.step(0.0, 0.1)
    driver.set({"shaper.command": 1.0})
    assert driver.get("shaper.shaped") in (0.0, 0.25)  # FMI 3.0 shows it after event mode alone
    driver.step(0.1, 0.1)
    assert driver.get("shaper.shaped") == 0.25
    driver.close()


def linear_plant(tmp_path, fmi: int, step: float | None = None) -> Driver:
    system = System()
    system.add("plant", fmu_path("MassSpringDamper", fmi, platforms=["this"]), mass=1.0, stiffness=STIFFNESS, damping=0.0)
    return Driver(container(system, tmp_path / "c.fmu", 2, step=step))


@pytest.mark.parametrize(("inner", "step"), [(2, None), (2, 0.01)])
def test_inputs_that_are_linear_over_a_step_are_so_inside(inner, step, tmp_path):
    """A ramp of the force of 3 N/s: x = (3 t - 3 sin(w t) / w) / k, exact for a plant inside that takes the derivative."""
    driver = linear_plant(tmp_path, inner, step).initialize()
    simulation = driver.description.coSimulation
    assert simulation is not None
    assert simulation.canInterpolateInputs
    reference = driver.variables["plant.force"].valueReference
    for i in range(20):
        t = i * 0.05
        driver.set({"plant.force": 3.0 * t})
        driver.slave.setRealInputDerivatives([reference], [1], [3.0])
        driver.step(t, 0.05)
        end = t + 0.05
        expected = (3.0 * end - 3.0 * math.sin(FREQUENCY * end) / FREQUENCY) / STIFFNESS
        assert driver.get("plant.position") == pytest.approx(expected, abs=1e-13)
    driver.set({"plant.force": 0.0})
    driver.slave.setRealInputDerivatives([reference], [1], [0.0])
    driver.step(1.0, 0.05)
    assert driver.get("plant.force") == 0.0
    driver.close()


def test_a_plant_inside_that_takes_no_derivative_gets_a_staircase(tmp_path):
    """Of the inner step; half of it shifts a ramp, to first order."""
    driver = linear_plant(tmp_path, 3, 0.001)
    simulation = driver.description.coSimulation
    assert simulation is not None
    assert not simulation.canInterpolateInputs
    driver.close()


def test_steps_of_every_length(tmp_path):
    """Of 2**-20 to 0.3 s, in an order that repeats nothing: the residual is that of the formula."""
    rng = np.random.default_rng(5)
    driver = packed(tmp_path, 2, 2).initialize({"shaper.command": 1.0})
    times = np.unique(np.concatenate([[0.0], rng.uniform(0.0, 2.0, 40), 0.5 + 2.0**-20 * np.arange(5), [2.0]]))
    for t, end in pairwise(times):
        driver.step(float(t), float(end - t))
    assert driver.get("plant.position") == pytest.approx(1.0 / STIFFNESS, abs=1e-13)
    assert driver.get("plant.velocity") == pytest.approx(0.0, abs=1e-12)
    driver.close()


def test_an_fmu_of_one_step_length_gets_no_other(tmp_path):
    """Steps inside of 2 ms: a host's steps of 6 ms are three of them; 7 ms would give the FMU a step of 1 ms, and are refused."""
    rigid = tmp_path / "rigid.fmu"
    files = read_archive(fmu_path("MassSpringDamper", 2, platforms=["this"]).read_bytes(), "plant")
    free, fixed = (b'canHandleVariableCommunicationStepSize="%s"' % text for text in (b"true", b"false"))
    assert free in files["modelDescription.xml"]
    write_archive(rigid, {**files, "modelDescription.xml": files["modelDescription.xml"].replace(free, fixed)})
    system = System()
    system.add("plant", rigid)
    driver = Driver(container(system, tmp_path / "c.fmu", 2, step=0.002)).initialize({"plant.force": 1.0})
    driver.step(0.0, 0.006)
    with pytest.raises(FMICallException):
        driver.step(0.006, 0.007)
    assert "a step of 0.007 s is no multiple of the steps inside, of 0.002 s" in driver.messages[-1]
    driver.step(0.006, 0.006)
    driver.close()
