"""Events of native FMUs, exact on both sides; derivatives of outputs; intermediate updates."""

from __future__ import annotations

import math

import pytest
from fmpy.fmi1 import FMICallException
from native_drivers import Driver
from native_host import native_fmu
from trial_runs import PARAMETERS, stimuli

from shaper_fmu.component import NO_EVENT, Component
from shaper_fmu.registry import components

every_component = pytest.mark.parametrize("name", components())
both_versions = pytest.mark.parametrize("fmi", [2, 3])


@both_versions
def test_output_derivatives_are_the_declared_ones(fmi):
    driver = Driver(native_fmu("MassSpringDamper", fmi)).initialize({})
    driver.set({"force": 10.0})
    driver.step(0.0, 0.3)
    reference = driver.variables["position"].valueReference
    ask = driver.slave.getOutputDerivatives if fmi == 3 else lambda vr, order: real_derivatives(driver, vr, order)
    assert ask([reference, reference], [1, 2]) == [driver.get("velocity"), driver.get("acceleration")]
    with pytest.raises(FMICallException):
        ask([reference], [3])
    assert driver.messages[-1] == "MassSpringDamper: the derivative of position of order 3 is not known"
    driver.close()


def real_derivatives(driver: Driver, references: list[int], orders: list[int]) -> list[float]:
    from ctypes import c_double, c_int, c_uint

    n = len(references)
    values = (c_double * n)()
    function = driver.slave.dll.fmi2GetRealOutputDerivatives
    status = function(driver.slave.component, (c_uint * n)(*references), n, (c_int * n)(*orders), values) if n else 0
    if status:
        raise FMICallException(function="fmi2GetRealOutputDerivatives", status=status)
    return list(values)


def announced(component: Component) -> float:
    return getattr(component, "next_event_time", NO_EVENT)


@every_component
def test_left_and_right_limits_at_events_are_those_of_plain_python(name):
    """FMI 3.0 event mode: values before and after each event, with early return, over steps that no event divides."""
    component = components()[name]
    plain = component()
    for variable, value in PARAMETERS[name].items():
        plain.set(variable, value)
    plain.initialize(0.0)
    outputs = [v.name for v in component.variables.values() if v.causality == "output"]
    driver = Driver(native_fmu(name, 3), eventModeUsed=True, earlyReturnAllowed=True).initialize(PARAMETERS[name])
    driver.leave_event_mode()
    events, t = 0, 0.0
    for i in range(40):
        end = 0.0931 * (i + 1)
        inputs = stimuli(name, i)
        driver.set(inputs)
        for variable, value in inputs.items():
            plain.set(variable, value)
        if inputs:
            plain.do_step(t, 0.0)
            assert [driver.get(output) for output in outputs] == [getattr(plain, output) for output in outputs]
        while t < end:
            due = announced(plain)
            waits, reached = driver.step(t, end - t)
            assert waits == (due <= end)
            assert reached == min(due, end)
            plain.do_step(t, reached - t, left_limits=waits)
            assert [driver.get(output) for output in outputs] == [getattr(plain, output) for output in outputs]
            if waits:
                events += 1
                following = driver.handle_event()
                plain.do_step(reached, 0.0)
                assert [driver.get(output) for output in outputs] == [getattr(plain, output) for output in outputs]
                assert (NO_EVENT if following is None else following) == announced(plain)
            t = reached
    assert (events > 0) == ("next_event_time" in component.variables)
    driver.close()


MOVES = [("MotionProfile", {"profile": kind, "start_time": 0.13, "duration": 0.9, "distance": -1.3}) for kind in range(1, 8)]
BOUNDED = [("MotionProfile", {"profile": kind, "duration": 1.5, "max_velocity": 1.2}) for kind in (2, 7)]
TRAINS = [("PulseTrain", {"design": design, "start_time": 0.13, "duration": 0.4}) for design in range(1, 7)]


@pytest.mark.parametrize(("name", "values"), MOVES + BOUNDED + TRAINS)
def test_values_before_an_event_are_the_limits_from_the_left_and_after_it_from_the_right(name, values):
    """In FMI 3.0's event mode: those of plain Python 1e-7 s before and after; slopes of the outputs are below 1e3 per second."""
    driver = Driver(native_fmu(name, 3), eventModeUsed=True, earlyReturnAllowed=True).initialize(values)
    outputs = [n for n in driver.names("output") if not n.endswith(("_mean", "_time"))]

    def beside(t: float) -> list[float]:
        plain = components()[name](**values)
        plain.initialize(0.0)
        plain.do_step(0.0, t)
        return [getattr(plain, output) for output in outputs]

    due, t = driver.leave_event_mode(), 0.0
    while due is not None:
        assert driver.step(t, 2.0 - t) == (True, due)
        assert [driver.get(output) for output in outputs] == pytest.approx(beside(due - 1e-7), abs=1e-4)
        t, due = due, driver.handle_event()
        assert [driver.get(output) for output in outputs] == pytest.approx(beside(t + 1e-7), abs=1e-4)
    assert t >= 0.13
    driver.close()


def test_a_shaped_step_by_event_mode_leaves_nothing():
    """ZV on its own mode: residual below 1e-12 of the step, communication steps of 50 ms that no delay divides.

    The impulses' delays are 0 and pi/wd; Singer and Seering 1990: the residual vibration of the nominal mode is zero.
    """
    for frequency, damping in ((7.3, 0.0), (11.1, 0.03), (23.7, 0.11)):
        shaper = Driver(native_fmu("InputShaper", 3), eventModeUsed=True, earlyReturnAllowed=True)
        plant = Driver(native_fmu("MassSpringDamper", 3), eventModeUsed=True, earlyReturnAllowed=True)
        shaper.initialize({"shaper": 2, "natural_frequency[1]": frequency, "damping_ratio[1]": damping})
        plant.initialize({"mass": 1.0, "stiffness": frequency**2, "damping": 2.0 * damping * frequency})
        shaper.leave_event_mode()
        plant.leave_event_mode()
        t, stops = 0.0, 0
        shaper.set({"command": frequency**2})
        plant.set({"force": shaper.get("shaped")})
        for i in range(40):
            end = 0.05 * (i + 1)
            while t < end:
                waits, reached = shaper.step(t, end - t)
                plant.step(t, reached - t)
                if waits:
                    stops += 1
                    shaper.handle_event()
                    plant.set({"force": shaper.get("shaped")})
                t = reached
        assert stops == 1
        assert abs(shaper.get("duration") / 0.05 - round(shaper.get("duration") / 0.05)) > 0.1
        envelope = math.hypot(plant.get("position") - 1.0, plant.get("velocity") / frequency)
        assert envelope < 1e-12
        shaper.close()
        plant.close()


def test_intermediate_updates_show_events_and_can_end_the_step_early():
    seen: list[float] = []

    def update(environment, t, set_requested, get_allowed, finished, can_return, requested, wanted) -> None:
        assert (set_requested, get_allowed, finished, can_return) == (False, True, True, True)
        seen.append(t)
        if len(seen) == 2:
            requested[0], wanted[0] = True, t

    driver = Driver(native_fmu("InputShaper", 3), earlyReturnAllowed=True, intermediateUpdate=update)
    driver.initialize({"shaper": 3, "natural_frequency[1]": 10.0})  # zvd: jumps after half a period and a period
    driver.set({"command": 1.0})
    waits, reached = driver.step(0.0, 2.0)
    assert not waits
    assert seen == pytest.approx([math.pi / 10.0, math.pi / 5.0], rel=1e-15)
    assert reached == seen[1]
    assert driver.get("shaped") == 1.0
    driver.step(reached, 2.0 - reached)
    driver.close()
