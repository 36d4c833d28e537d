"""Model exchange, FMI 2.0 and 3.0: an independent solver (scipy) integrates, and arrives where co-simulation does."""

from __future__ import annotations

from ctypes import c_double
from typing import Any

import numpy as np
import pytest
from fmpy.fmi1 import FMICallException
from native_drivers import Driver
from native_host import native_fmu
from scipy.integrate import solve_ivp
from trial_runs import PARAMETERS, stimuli

from shaper_fmu.component import NO_EVENT, Component
from shaper_fmu.registry import components

EXCHANGED = [name for name, component in components().items() if component.continuous_states is not None]
both_versions = pytest.mark.parametrize("fmi", [2, 3])


class Integrated:
    """A model-exchange instance, driven as the standards tell: events at announced times, a solver between them."""

    def __init__(self, name: str, fmi: int, values: dict[str, Any] | None = None):
        self.driver = Driver(native_fmu(name, fmi), exchange=True).initialize(PARAMETERS[name] if values is None else values)
        self.slave, self.inputs = self.driver.slave, self.driver.labels("input")
        component = components()[name]
        self.count = sum(component.variables[state].size or 1 for state in component.continuous_states or ())
        self.due = self.driver.update()
        self.slave.enterContinuousTimeMode()
        self.t = 0.0

    def states(self) -> np.ndarray:
        x = (c_double * self.count)()
        self.slave.getContinuousStates(x, self.count)
        return np.array(x)

    def slopes(self, t: float, x: np.ndarray) -> np.ndarray:
        self.slave.setTime(t)
        self.slave.setContinuousStates((c_double * self.count)(*x), self.count)
        dx = (c_double * self.count)()
        ask = self.slave.getContinuousStateDerivatives if self.driver.fmi == 3 else self.slave.getDerivatives
        ask(dx, self.count)
        return np.array(dx)

    def event(self) -> None:
        self.slave.enterEventMode()
        self.due = self.driver.update()
        self.slave.enterContinuousTimeMode()

    def set(self, values: dict[str, float]) -> None:
        """Inputs jump: an event."""
        self.slave.enterEventMode()
        self.driver.set(values)
        self.due = self.driver.update()
        self.slave.enterContinuousTimeMode()

    def advance(self, end: float) -> list[float]:
        """Integrate to `end`; returns the times of the FMU's own events."""
        events = []
        while self.t < end:
            target = end if self.due is None else min(end, self.due)
            if self.count and target > self.t:
                found = solve_ivp(self.slopes, (self.t, target), self.states(), rtol=1e-11, atol=1e-13)
                self.slopes(target, found.y[:, -1])
            self.slave.setTime(target)
            assert self.slave.completedIntegratorStep() == (False, False)
            self.t = target
            if target == self.due:
                events.append(target)
                self.event()
        return events


def seen(driver: Driver, outputs: list[str]) -> list[float]:
    names = [n for n in driver.names("output") if n.split("[")[0] in outputs]
    return np.hstack([driver.get(name) for name in names]).astype(float).tolist()


def expected(plain: Component, outputs: list[str]) -> list[float]:
    return np.hstack([getattr(plain, name) for name in outputs]).astype(float).tolist()


@both_versions
@pytest.mark.parametrize("name", EXCHANGED)
def test_a_solver_arrives_where_co_simulation_does(name, fmi):
    """Tolerance: the solver's, 1e-8 of an output's largest value, at least of 1; components without continuous states have none,
    but for the means over a step."""
    component = components()[name]
    plain = component()
    for variable, value in PARAMETERS[name].items():
        plain.set(variable, value)
    plain.initialize(0.0)
    outputs = [v.name for v in component.variables.values() if v.causality == "output" and not v.name.endswith("_mean")]
    model, events = Integrated(name, fmi), []
    tolerance = 1e-8 if model.count else 0.0
    largest = np.ones(len(seen(model.driver, outputs)))
    for i in range(30):
        end = 0.0731 * (i + 1)
        values = stimuli(name, i)
        if values:
            model.set(values)
        for variable, value in values.items():
            plain.set(variable, value)
        plain.do_step(model.t, 0.0)
        largest = np.maximum(largest, np.abs(expected(plain, outputs)))
        assert np.all(np.abs(np.subtract(seen(model.driver, outputs), expected(plain, outputs))) <= tolerance * largest)
        t = model.t
        while t < end:
            target = min(end, getattr(plain, "next_event_time", NO_EVENT))
            plain.do_step(t, target - t)
            t = target
        events += model.advance(end)
        if end < getattr(plain, "next_event_time", NO_EVENT):
            largest = np.maximum(largest, np.abs(expected(plain, outputs)))
            assert np.all(np.abs(np.subtract(seen(model.driver, outputs), expected(plain, outputs))) <= tolerance * largest)
    assert bool(events) == ("next_event_time" in component.variables)
    model.driver.close()


@both_versions
@pytest.mark.parametrize("name", [n for n in EXCHANGED if components()[n].continuous_states])
def test_derivatives_are_those_of_the_states(name, fmi):
    """Central differences of co-simulation over 2e-5 and 4e-5 s, extrapolated: their error is the fifth derivative times 1.3e-20.

    Tolerance: 3e-6 of the largest derivative, at least of 1, since states are right to 1e-10 and fast ones have large derivatives.
    """
    model, component = Integrated(name, fmi), components()[name]
    values = stimuli(name, 3)
    model.set(values)
    model.advance(0.7)
    x, h = model.states(), 1e-5
    slopes = model.slopes(0.7, x)
    plain = component()
    for variable, value in {**PARAMETERS[name], **values}.items():
        plain.set(variable, value)
    plain.initialize(0.0)
    plain.do_step(0.0, 0.7 - 2 * h)
    found = [np.hstack([getattr(plain, state) for state in component.continuous_states or ()])]
    for i in range(4):
        plain.do_step(0.7 + (i - 2) * h, h)
        found.append(np.hstack([getattr(plain, state) for state in component.continuous_states or ()]))
    near, far = (found[3] - found[1]) / (2 * h), (found[4] - found[0]) / (4 * h)
    assert slopes == pytest.approx((4.0 * near - far) / 3.0, abs=3e-6 * max(1.0, *np.abs(slopes)))
    model.driver.close()


@both_versions
def test_a_sampled_input_that_changed_asks_for_an_event(fmi):
    model = Integrated("InputShaper", fmi)
    model.slave.setTime(0.25)
    model.driver.set({"command": 1.0})
    assert model.slave.completedIntegratorStep() == (True, False)
    model.t = 0.25
    model.event()
    assert model.slave.completedIntegratorStep() == (False, False)
    assert model.driver.get("shaped") > 0.0
    model.driver.close()


@both_versions
def test_the_time_does_not_go_back_behind_an_event_and_values_must_be_finite(fmi):
    model = Integrated("MassSpringDamper", fmi)
    model.advance(0.5)
    model.event()
    model.driver.messages  # noqa: B018
    with pytest.raises(FMICallException):
        model.slave.setTime(0.4)
    assert "the time 0.4 s is before the last event at 0.5 s" in model.driver.messages[0]
    with pytest.raises(FMICallException):
        model.slave.setContinuousStates((c_double * 2)(float("nan"), 0.0), 2)
    assert "the state position is nan" in model.driver.messages[0]
    with pytest.raises(FMICallException):
        model.slave.getContinuousStates((c_double * 3)(), 3)
    assert "there are 2 continuous states" in model.driver.messages[0]
    with pytest.raises(FMICallException):
        model.driver.set({"mass": 3.0})
    model.driver.close()


@both_versions
def test_a_state_of_co_simulation_is_refused_by_model_exchange(fmi):
    stepping = Driver(native_fmu("MassSpringDamper", fmi)).initialize({})
    model = Integrated("MassSpringDamper", fmi)
    names = ("getFMUState", "setFMUState", "freeFMUState") if fmi == 3 else ("getFMUstate", "setFMUstate", "freeFMUstate")
    state = getattr(stepping.slave, names[0])()
    model.driver.messages  # noqa: B018
    with pytest.raises(FMICallException):
        getattr(model.slave, names[1])(state)
    assert "another kind of simulation" in model.driver.messages[0]
    getattr(stepping.slave, names[2])(state)
    stepping.close()
    model.driver.close()


@pytest.mark.parametrize("fmi", [2, 3])
def test_fmpys_own_solver_runs_the_crane(fmi):
    """CVode in fmpy against co-simulation, both through fmpy.simulate_fmu, with a trolley that brakes."""
    import fmpy

    jumps = [(0.0, 0.4), (1.0, 0.4), (1.0, -0.4), (2.0, -0.4), (2.0, 0.0), (8.0, 0.0)]  # two rows at one time: an event
    signal = np.array(jumps, dtype=[("time", float), ("trolley_acceleration", float)])
    runs = [
        fmpy.simulate_fmu(
            str(native_fmu("OverheadCrane", fmi)), fmi_type=kind, stop_time=8.0, output_interval=0.01, input=signal,
            relative_tolerance=1e-10, output=["swing_angle", "load_position"],
        )
        for kind in ("CoSimulation", "ModelExchange")
    ]  # fmt: skip
    swing = [np.interp(np.arange(0.5, 7.5, 0.5), run["time"], run["swing_angle"]) for run in runs]
    assert np.max(np.abs(swing[0])) > 0.01
    assert swing[0] == pytest.approx(swing[1], abs=1e-6)


@both_versions
@pytest.mark.parametrize("clock", [-1, 0, 1], ids=["early", "exact", "late"])
@pytest.mark.parametrize(
    ("name", "values"),
    [("MotionProfile", {"profile": kind, "start_time": 0.3, "duration": 0.7}) for kind in (1, 2, 5)]
    + [("PulseTrain", {"design": design, "start_time": 0.3}) for design in (1, 3, 6)]
    + [("InputShaper", {"shaper": 3}), ("PulseWidthModulator", {"carrier_frequency": 3.0})],
)
def test_after_an_event_values_stay_those_from_the_right(name, values, clock, fmi):
    """Also of an importer whose clock is off by rounding when it meets the event; and until the event those from the left."""
    model = Integrated(name, fmi, values)
    plain = components()[name](**values)
    plain.initialize(0.0)
    for label in model.inputs:
        model.set({label: 0.4})
        plain.set(label, 0.4)
    plain.do_step(0.0, 0.0)
    outputs = [v.name for v in plain.variables.values() if v.causality == "output" and not v.name.endswith("_mean")]
    events, t = 0, 0.0
    while model.due is not None and events < 12:
        due = model.due
        plain.do_step(t, due - t, left_limits=True)
        model.slave.setTime(due)
        assert seen(model.driver, outputs) == expected(plain, outputs)
        met = due * (1.0 + clock * 2.0**-52)
        model.slave.setTime(met)
        model.event()
        plain.do_step(due, 0.0)
        for later in (met, due, due * (1.0 + 2.0**-51), due * (1.0 + 2.0**-47)):
            if later >= met:
                model.slave.setTime(later)
                assert seen(model.driver, outputs) == pytest.approx(expected(plain, outputs), abs=1e-9)
        events, t = events + 1, due
    assert events >= 1
    model.driver.close()


@both_versions
def test_sampled_inputs_act_at_events_alone(fmi):
    """Between the events a set command is read back as it was set, and shaped from the next event on."""
    model = Integrated("InputShaper", fmi)
    model.slave.setTime(0.25)
    model.driver.set({"command": 1.0})
    assert (model.driver.get("command"), model.driver.get("shaped")) == (1.0, 0.0)
    model.t = 0.25
    model.event()
    assert model.driver.get("shaped") > 0.0
    model.slave.setTime(0.25)
    assert (model.driver.get("command"), model.driver.get("shaped") > 0.0) == (1.0, True)
    model.driver.close()
