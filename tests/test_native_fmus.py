"""Native FMUs of every component, FMI 2.0 and 3.0: the same bits as plain Python, the same words, exact states and events."""

from __future__ import annotations

import math
import random

import pytest
from fmpy.fmi1 import FMICallException
from native_drivers import Driver
from native_host import native_fmu
from test_fmu_identity import PARAMETERS, STEP, STEPS, plain_run, stimulus

from shaper_fmu.component import NO_EVENT, Component
from shaper_fmu.errors import ComponentError
from shaper_fmu.export.build import build_fmu, fmu_path
from shaper_fmu.registry import components, find_component

every_component = pytest.mark.parametrize("name", components())
both_versions = pytest.mark.parametrize("fmi", [2, 3])


def native_run(name: str, fmi: int, **options: bool) -> list[list[str]]:
    """Outputs after each step, as exact hexadecimal texts."""
    driver = Driver(native_fmu(name, fmi), **options).initialize(PARAMETERS[name])
    rows = []
    for i in range(STEPS):
        driver.set({variable: stimulus(i, place) for place, variable in enumerate(driver.names("input"))})
        driver.step(i * STEP, STEP)
        rows.append([float(driver.get(output)).hex() for output in driver.names("output")])
    driver.close()
    return rows


@every_component
@both_versions
def test_native_equals_plain_python_bit_for_bit(name, fmi):
    """On Linux both call the same mathematics library, so there is no tolerance."""
    assert native_run(name, fmi) == plain_run(components()[name])


@every_component
@both_versions
def test_all_values_after_initialization_equal_those_of_plain_python(name, fmi):
    plain = components()[name]()
    for variable, value in PARAMETERS[name].items():
        plain.set(variable, value)
    plain.initialize(0.7)
    driver = Driver(native_fmu(name, fmi)).initialize(PARAMETERS[name], start_time=0.7)
    for variable in plain.variables.values():
        if variable.causality == "state":
            continue
        expected = getattr(plain, variable.name)
        if variable.size is None or fmi == 3:
            assert driver.get(variable.name) == expected
        else:
            assert [driver.get(label) for label in variable.scalar_names] == expected
    driver.close()


@every_component
@both_versions
def test_a_restored_state_replays_to_the_bit(name, fmi):
    """Also after serialization, in another instance, after other steps, and with inputs set before the state was taken."""
    driver, other = (Driver(native_fmu(name, fmi)).initialize(PARAMETERS[name]) for _ in range(2))
    rng = random.Random(name)

    def run(who: Driver, first: int, count: int) -> list[float]:
        seen = []
        for i in range(first, first + count):
            who.set({variable: stimulus(i, place) for place, variable in enumerate(who.names("input"))})
            who.step(i * STEP, STEP)
            seen += [float(who.get(output)) for output in who.names("output")]
        return seen

    run(driver, 0, 40)
    driver.set({variable: rng.uniform(-0.1, 0.1) for variable in driver.names("input")})
    get, put, free, pack, unpack = [
        getattr(driver.slave, f)
        for f in (
            ("getFMUState", "setFMUState", "freeFMUState", "serializeFMUState", "deserializeFMUState")
            if fmi == 3
            else ("getFMUstate", "setFMUstate", "freeFMUstate", "serializeFMUstate", "deSerializeFMUstate")
        )
    ]
    state = get()
    serialized = pack(state)
    expected = run(driver, 40, 40)
    put(state)
    assert run(driver, 40, 40) == expected
    run(other, 0, 7)
    elsewhere = unpack(serialized)
    getattr(other.slave, put.__name__)(elsewhere)
    assert run(other, 40, 40) == expected
    free(state)
    free(elsewhere)
    driver.slave.reset()
    driver.initialize(PARAMETERS[name])
    run(driver, 0, 40)
    driver.close()
    other.close()


@every_component
@both_versions
def test_reset_equals_a_fresh_instance(name, fmi):
    driver = Driver(native_fmu(name, fmi)).initialize({})
    for i in range(5):
        driver.step(0.1 * i, 0.1)
    driver.slave.reset()
    driver.initialize(PARAMETERS[name])
    rows = []
    for i in range(STEPS):
        driver.set({variable: stimulus(i, place) for place, variable in enumerate(driver.names("input"))})
        driver.step(i * STEP, STEP)
        rows.append([float(driver.get(output)).hex() for output in driver.names("output")])
    assert rows == plain_run(components()[name])
    driver.close()


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
        (lambda: driver.slave.getInt32([0]) if fmi == 3 else driver.slave.getInteger([0]), "force is not of type Int"),
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
        inputs = {variable: stimulus(i, place) for place, variable in enumerate(driver.names("input"))}
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


@both_versions
def test_builds_are_the_same_to_the_byte_with_all_platforms(fmi, tmp_path, monkeypatch):
    """In another cache: kernels and libraries are compiled anew."""
    path = fmu_path("MassSpringDamper", fmi)
    monkeypatch.setenv("SHAPER_FMU_CACHE", str(tmp_path / "cache"))
    again = build_fmu(find_component("MassSpringDamper"), tmp_path, fmi=fmi)
    assert again.read_bytes() == path.read_bytes()
    assert path.stat().st_size < 1_000_000
