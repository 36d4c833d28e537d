"""Model exchange under a plain solver: classical Runge-Kutta of order 4, whose steps end on the announced events.

Each output drives an oscillator, x'' = w^2 (y - x), which the solver integrates beside the FMU's own states. What x must be is
the convolution integral of the plain Python component's output, by Gauss-Legendre quadrature between the events. Where one
value beside an event is wrong, the error falls with the first power of the step; otherwise with the fourth.
"""

from __future__ import annotations

import itertools
import math
from ctypes import c_double
from typing import Any

import numpy as np
import pytest
from native_drivers import Driver
from native_host import native_fmu
from trial_runs import PARAMETERS, stimuli

from shaper_fmu.commands.pulse_train import Design
from shaper_fmu.component import NO_EVENT, Component
from shaper_fmu.integration import Integrated
from shaper_fmu.kinds.profiles import PROFILES, ProfileKind
from shaper_fmu.registry import components

END = 1.5
INPUT_TIMES = (0.0, 0.31, 0.9)
FREQUENCY = 3.0
MOVE = {"duration": 1.1, "start_time": 0.13, "distance": -0.7, "natural_frequency": 5.5, "damping_ratio": 0.08}
LIMITED = {**MOVE, "max_velocity": 0.8}


def moved(kind: ProfileKind) -> dict[str, float]:
    """A mode whose period is shorter than the move, where it must be."""
    return {"natural_frequency": 7.0} if PROFILES[kind.name].least else {}


PULSES = {"duration": 0.5, "start_time": 0.13, "natural_frequency": 8.0, "damping_ratio": 0.05, "frequency_ratio": 5.0}
LONGEST = 0.02
"""Longest step of the solver [s], of components that are not faster."""
FASTEST = 0.5
"""And its product with the plant's fastest eigenvalue, so that the error falls with the fourth power."""
CASES: list[tuple[str, dict[str, Any]]] = [
    *[("MotionProfile", {**MOVE, **moved(kind), "profile": int(kind)}) for kind in ProfileKind if kind != ProfileKind.fastest],
    ("MotionProfile", {**LIMITED, "profile": int(ProfileKind.trapezoid)}),
    ("MotionProfile", {**LIMITED, "profile": int(ProfileKind.s_curve), "distance": -0.4}),
    ("MotionProfile", {**MOVE, "profile": int(ProfileKind.trapezoid), "start_time": 0.0}),
    *[("PulseTrain", {**PULSES, "design": int(design)}) for design in Design],
    *[(name, PARAMETERS[name]) for name in components() if name not in ("MotionProfile", "PulseTrain")],
]
IDS = [f"{name}-{values.get('profile', values.get('design', ''))}-{i}" for i, (name, values) in enumerate(CASES)]
every_case = pytest.mark.parametrize(("name", "values"), CASES, ids=IDS)
both_versions = pytest.mark.parametrize("fmi", [2, 3])


def outputs_of(component: type[Component]) -> list[str]:
    """The names of the real outputs that a plant may be driven by: not means, not the announced event, not the carrier, whose
    kinks are not told."""
    real = [v for v in component.variables.values() if v.causality == "output" and v.kind is float]
    return [label for v in real if not v.name.endswith(("_mean", "_time")) and v.name != "carrier" for label in v.scalar_names]


def value(component: Component, label: str) -> float:
    name, _, index = label.partition("[")
    found = getattr(component, name)
    return found[int(index[:-1]) - 1] if index else found


class Exchanged:
    """A model-exchange instance as a right-hand side, and its events."""

    def __init__(self, name: str, fmi: int, values: dict[str, Any]):
        component = components()[name]
        self.driver = Driver(native_fmu(name, fmi), exchange=True).initialize(values)
        self.slave, self.inputs = self.driver.slave, self.driver.labels("input")
        self.outputs = outputs_of(component)
        self.readable = [
            n for n in self.driver.names("output") if any(label.split("[")[0] == n or label == n for label in self.outputs)
        ]
        self.count = sum(component.variables[state].size or 1 for state in component.continuous_states or ())
        self.due = self.driver.update()
        self.slave.enterContinuousTimeMode()

    def states(self) -> np.ndarray:
        x = (c_double * self.count)()
        if self.count:
            self.slave.getContinuousStates(x, self.count)
        return np.array(x)

    def event(self, values: dict[str, float]) -> None:
        self.slave.enterEventMode()
        self.driver.set(values)
        self.due = self.driver.update()
        self.slave.enterContinuousTimeMode()

    def slopes(self, t: float, x: np.ndarray) -> np.ndarray:
        """Of the FMU's states, then of an oscillator's position and speed per output."""
        n = self.count
        self.slave.setTime(t)
        dx = (c_double * n)()
        if n:
            self.slave.setContinuousStates((c_double * n)(*x[:n]), n)
            (self.slave.getContinuousStateDerivatives if self.driver.fmi == 3 else self.slave.getDerivatives)(dx, n)
        y = np.hstack([self.driver.get(name) for name in self.readable])
        position, speed = np.split(x[n:], 2)
        return np.hstack([dx, speed, FREQUENCY**2 * (y - position)])


def fastest_eigenvalue(name: str, fmi: int, values: dict[str, Any]) -> float:
    """Magnitude of a component's fastest eigenvalue [1/s], by central differences of its derivatives at the start."""
    model = Exchanged(name, fmi, values)
    x, n = model.states(), model.count
    moves = 1e-6 * np.diag(np.maximum(1.0, np.abs(x)))
    rest = np.zeros(2 * len(model.outputs))
    slopes = [[model.slopes(0.0, np.hstack([x + way * move, rest]))[:n] for way in (1.0, -1.0)] for move in moves]
    model.driver.close()
    matrix = np.array([(ahead - behind) / (2.0 * np.max(move)) for (ahead, behind), move in zip(slopes, moves, strict=True)])
    return float(np.max(np.abs(np.linalg.eigvals(matrix)))) if n else 0.0


def integrated(name: str, fmi: int, values: dict[str, Any], longest: float) -> np.ndarray:
    """States of the FMU and of the oscillators at END, by steps of at most `longest` [s] that end on events."""
    model = Exchanged(name, fmi, values)
    x = np.hstack([model.states(), np.zeros(2 * len(model.outputs))])
    t = 0.0
    for i, begin in enumerate(INPUT_TIMES):
        if model.inputs:
            model.event(stimuli(name, 3 * i))
        end = (*INPUT_TIMES, END)[i + 1]
        assert t == begin
        while t < end:
            target = min(end, model.due if model.due is not None else NO_EVENT)
            steps = math.ceil((target - t) / longest)
            times = np.linspace(t, target, steps + 1)
            for a, b in itertools.pairwise(times):
                h = b - a
                k1 = model.slopes(a, x)
                k2 = model.slopes(a + 0.5 * h, x + 0.5 * h * k1)
                k3 = model.slopes(a + 0.5 * h, x + 0.5 * h * k2)
                k4 = model.slopes(b, x + h * k3)
                x = x + h / 6.0 * (k1 + 2.0 * k2 + 2.0 * k3 + k4)
                model.slopes(b, x)
                assert model.slave.completedIntegratorStep() == (False, False)
            t = target
            if target == model.due:
                model.event({})
    found = np.hstack([model.states(), x[model.count :]])
    model.driver.close()
    return found


def exact(name: str, values: dict[str, Any], longest: float) -> np.ndarray:
    """The same from the plain Python component: states by its own steps, oscillators by Gauss-Legendre quadrature."""
    component = components()[name]
    plain = component()
    for label, given in values.items():
        plain.set(label, given)
    plain.initialize(0.0)
    outputs = outputs_of(component)
    nodes, weights = np.polynomial.legendre.leggauss(20)
    position, speed = np.zeros(len(outputs)), np.zeros(len(outputs))
    t = 0.0
    for i, end in enumerate((*INPUT_TIMES[1:], END)):
        for label, given in stimuli(name, 3 * i).items():
            plain.set(label, given)
        plain.do_step(t, 0.0)
        while t < end:
            until = t
            announced = min(getattr(plain, "next_event_time", NO_EVENT), getattr(plain, "next_kink_time", NO_EVENT))
            target = min(end, announced, t + 5.0 * longest)
            for node, weight in zip(nodes, weights, strict=True):
                s = t + 0.5 * (node + 1.0) * (target - t)
                plain.do_step(until, s - until)
                until = s
                y = np.array([value(plain, label) for label in outputs])
                position += 0.5 * (target - t) * weight * FREQUENCY * math.sin(FREQUENCY * (END - s)) * y
                speed += 0.5 * (target - t) * weight * FREQUENCY**2 * math.cos(FREQUENCY * (END - s)) * y
            plain.do_step(until, target - until)
            t = target
    states = np.hstack([getattr(plain, state) for state in component.continuous_states or ()] or [np.zeros(0)])
    return np.hstack([states, position, speed])


def groups(name: str, found: np.ndarray) -> np.ndarray:
    """Norms of the FMU's states, and of each oscillator's position and speed / w."""
    count = len(outputs_of(components()[name]))
    states, position, speed = found[: -2 * count], found[-2 * count : -count], found[-count:]
    return np.hstack([np.linalg.norm(states), np.hypot(position, speed / FREQUENCY)])


@both_versions
@every_case
def test_runge_kutta_converges_with_order_four_through_all_events(name, values, fmi):
    """A quarter of the step divides the error by 256, in the limit; asked for are 100, where the error is above the plain
    component's own: rounding, or the integration's 1e-10 in each of some hundred steps. What is left is 1e-6 of the largest value,
    or the phase error of an undamped oscillation of the fastest eigenvalue, (w h)^4 / 120 radians per radian."""
    fastest = fastest_eigenvalue(name, fmi, values)
    longest = min(LONGEST, FASTEST / fastest) if fastest else LONGEST
    wanted = exact(name, values, longest)
    coarse, fine = [groups(name, integrated(name, fmi, values, step) - wanted) for step in (longest, 0.25 * longest)]
    own = 1e-10 * (500.0 if issubclass(components()[name], Integrated) else 1.0)
    assert np.all(fine <= np.maximum(coarse / 100.0, own * np.maximum(1.0, groups(name, wanted))))
    assert np.max(fine) < max(1e-6, (0.25 * longest * fastest) ** 4 / 120.0 * fastest * END) * np.max(groups(name, wanted))
