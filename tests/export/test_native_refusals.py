"""What native FMUs refuse: in the words of plain Python, and without losing anything."""

from __future__ import annotations

import math

import pytest
from fmpy.fmi1 import FMICallException
from native_drivers import Driver
from native_host import native_fmu

from shaper_fmu.errors import ComponentError
from shaper_fmu.registry import components

every_component = pytest.mark.parametrize("name", components())
both_versions = pytest.mark.parametrize("fmi", [2, 3])


def wrong_parameters() -> list[tuple[str, str, float]]:
    """For each parameter with a domain or a finite range: a value outside of it."""
    found = []
    for name, component in components().items():
        for variable in component.variables.values():
            if variable.causality == "parameter" and variable.kind is float:
                found.append((name, variable.scalar_names[-1], math.nan))
                if variable.min is not None:
                    found.append((name, variable.scalar_names[0], variable.min - 1.5))
                if variable.max is not None:
                    found.append((name, variable.scalar_names[-1], variable.max + 1.5))
    return found


@both_versions
@pytest.mark.parametrize(("name", "variable", "value"), wrong_parameters())
def test_a_parameter_outside_its_domain_is_refused_in_the_words_of_plain_python(name, variable, value, fmi):
    plain = components()[name]()
    plain.set(variable, value)
    with pytest.raises(ComponentError) as refusal:
        plain.initialize(0.0)
    driver = Driver(native_fmu(name, fmi))
    assert driver.messages == []
    with pytest.raises(FMICallException):
        driver.initialize({variable: value})
    assert driver.messages == [str(refusal.value)]
    driver.slave.reset()
    driver.initialize({})
    driver.close()


KERNEL_FAULTS = [
    ("InputShaper", {"shaper": 13, "custom_impulses": 2, "custom_amplitude[1]": 0.9}),
    ("InputShaper", {"shaper": 7, "damping_ratio[1]": 0.9}),
    ("MotionProfile", {"max_velocity": 0.5}),
    ("MotionProfile", {"profile": 1, "max_velocity": 0.5}),
    ("PulseTrain", {"design": 3, "duration": 3.0}),
    ("PulseWidthModulator", {"minimum_pulse_width": 0.5}),
]


@both_versions
@pytest.mark.parametrize(("name", "values"), KERNEL_FAULTS)
def test_a_kernels_own_refusal_has_the_words_of_plain_python(name, values, fmi):
    plain = components()[name]()
    for variable, value in values.items():
        plain.set(variable, value)
    with pytest.raises(ComponentError) as refusal:
        plain.initialize(0.0)
    driver = Driver(native_fmu(name, fmi))
    with pytest.raises(FMICallException):
        driver.initialize(values)
    assert driver.messages == [str(refusal.value)]
    driver.close()


@both_versions
def test_what_cannot_be_set_or_stepped_is_refused_and_changes_nothing(fmi):
    driver = Driver(native_fmu("MassSpringDamper", fmi)).initialize({"mass": 2.0}, stop_time=1.0)
    driver.set({"force": 3.0})
    driver.step(0.0, 0.1)
    before = [driver.get(name) for name in driver.names("output")]
    refused = [
        (lambda: driver.set({"mass": 1.0}), "mass is fixed: it can be set only before and during initialization"),
        (lambda: driver.set({"position": 1.0}), "position is an output and cannot be set"),
        (lambda: driver.set({"natural_frequency": 1.0}), "natural_frequency is a calculatedParameter and cannot be set"),
        (lambda: driver.slave.setFloat64([99], [1.0]) if fmi == 3 else driver.slave.setReal([99], [1.0]), "value reference 99"),
        *([(lambda: driver.slave.getFloat64([0]), "value reference 0")] if fmi == 3 else []),
        (lambda: driver.slave.getInt32([1]) if fmi == 3 else driver.slave.getInteger([0]), "force is not of type Int"),
        (lambda: driver.step(0.1, -0.1), "a step of -0.1 s at t = 0.1 s is not possible"),
        (lambda: driver.step(0.1, math.nan), "is not possible; it must be finite and not negative"),
        (lambda: driver.step(0.3, 0.1), "a step cannot begin at t = 0.3 s: the last one ended at 0.1 s"),
        (lambda: driver.step(0.1, 1.0), "a step to t = 1.1 s ends after the stop time 1 s"),
        (lambda: driver.slave.exitInitializationMode(), "cannot be called between steps"),
    ]
    driver.messages  # noqa: B018 - forget what was said before
    for call, words in refused:
        with pytest.raises(FMICallException):
            call()
        said = driver.messages
        assert len(said) == 1
        assert words in said[0]
        assert [driver.get(name) for name in driver.names("output")] == before
    driver.set({"force": math.inf})
    with pytest.raises(FMICallException):
        driver.step(0.1, 0.1)
    assert driver.messages == ["MassSpringDamper: input force is inf; it must be a finite number at t = 0.1 s"]
    driver.set({"force": 3.0})
    driver.step(0.1, 0.1)
    driver.close()


@both_versions
def test_tunable_parameters_change_while_running_and_are_checked_at_once(fmi):
    driver = Driver(native_fmu("InputShaper", fmi)).initialize({"natural_frequency[1]": 5.0})
    driver.step(0.0, 0.1)
    before = driver.get("duration")
    driver.set({"natural_frequency[1]": 10.0})
    driver.step(0.1, 0.1)
    assert before == pytest.approx(math.pi / 5.0, abs=1e-15)  # half a period
    assert driver.get("duration") == pytest.approx(math.pi / 10.0, abs=1e-15)
    driver.messages  # noqa: B018
    with pytest.raises(FMICallException):
        driver.set({"natural_frequency[1]": -1.0})
    assert driver.messages == ["InputShaper: parameter natural_frequency[1] = -1 rad/s must be greater than 0 rad/s"]
    driver.close()


@both_versions
def test_log_categories_select_what_is_said(fmi):
    driver = Driver(native_fmu("InputShaper", fmi)).initialize({})
    driver.messages  # noqa: B018
    driver.slave.setDebugLogging(True, ["logEvents"])
    driver.set({"command": 1.0})
    driver.step(0.0, 0.1)
    assert driver.messages == []
    driver.step(0.1, 0.9)
    assert driver.messages == [f"InputShaper: event at t = {math.pi / 10.0:.15g} s"]
    driver.slave.setDebugLogging(False, ["logStatusError"])
    with pytest.raises(FMICallException):
        driver.step(1.0, -1.0)
    assert driver.messages == []
    driver.close()
