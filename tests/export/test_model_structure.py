"""What depends on what, as the model descriptions declare it, against the kernels of all components."""

from __future__ import annotations

import enum
import itertools
from typing import Any

import numpy as np
from description_cases import ALL, STARTED, both_versions, described, every_component, unknowns

from shaper_fmu.component import Component, Variable
from shaper_fmu.errors import ComponentError
from shaper_fmu.export.model_description import dependencies, visible_variables


def declared_knowns(name: str, version: str, kind: str) -> dict[str, set[str]]:
    """The variables on which each unknown says it depends; of arrays, the whole one."""
    found: dict[str, set[str]] = {}
    for unknown, known in unknowns(described(name, version), kind):
        found.setdefault(unknown.split("[")[0], set()).update(k.split("[")[0] for k in known)
    return found


def nudged(variable: Variable, value: Any) -> Any:
    """The value, or all of an array, moved a little inside the domain; None where there is no such value."""
    if isinstance(value, list):
        moved = [nudged(variable, element) for element in value]
        return None if None in moved else moved
    if issubclass(variable.kind, enum.IntEnum):
        return None  # of another design much else may not fit
    if variable.kind is bool:
        return not value
    candidates = (
        [value + 1, value - 1] if variable.kind is int else [value * 1.0625 + 0.125, value * 0.9375 - 0.0625, value * 0.875]
    )
    return next((c for c in candidates if variable.problem(variable.name, c) is None), None)


def values_of(instance: Component) -> dict[str, Any]:
    values = {v.name: getattr(instance, v.name) for v in instance.variables.values() if v.causality != "state"}
    return {name: list(value) if isinstance(value, list) else value for name, value in values.items()}


def running(name: str) -> Component:
    """An instance that has come some way with inputs other than zero."""
    instance = ALL[name]()
    for variable in instance.variables.values():
        if variable.causality == "input" and variable.kind is float:
            setattr(instance, variable.name, 0.25 if variable.size is None else [0.25] * variable.size)
    instance.initialize(0.0)
    for k in range(5):
        instance.do_step(0.0625 * k, 0.0625)
    return instance


TIME = 5 * 0.0625


def at_an_instant(name: str, source: str = "", part: float = 1.0) -> dict[str, Any]:
    """All values after a step of length zero, with an input or state moved by this part of a nudge."""
    instance = running(name)
    if source:
        value = getattr(instance, source)
        moved = nudged(instance.variables[source], value)
        if part < 1.0:
            pairs = zip(np.atleast_1d(value).tolist(), np.atleast_1d(moved).tolist(), strict=True)
            few = [a + part * (b - a) for a, b in pairs]
            moved = few if isinstance(value, list) else few[0]
        setattr(instance, source, moved)
    instance.do_step(TIME, 0.0)
    return values_of(instance)


def changes_at_an_instant(name: str, source: str) -> set[str]:
    """What a step of length zero makes of a changed input or state; of a state that the component refuses, a nearer one."""
    before = at_an_instant(name)
    try:
        after = at_an_instant(name, source)
    except ComponentError:
        after = at_an_instant(name, source, 0.1)
    return {n for n in before if before[n] != after[n]} - {source}


@both_versions
@every_component
def test_outputs_and_derivatives_depend_on_no_more_than_they_say(name, version):
    component = ALL[name]
    declared = declared_knowns(name, version, "outputs") | declared_knowns(name, version, "derivatives")
    inputs = [v.name for v in component.variables.values() if v.causality == "input"]
    states = list(component.continuous_states or ())
    for source in [*inputs, *states]:
        for unknown in changes_at_an_instant(name, source) & set(declared):
            assert source in declared[unknown], f"{unknown} depends on {source} but does not say so"
    for state in set(states) & set(declared):
        assert declared[state] == {state}


def test_the_probe_sees_dependencies():
    """By the equations: m a = F - c v - k x; the crane's load is at p + l sin theta, its rope's tension has l theta'^2; the ring's rate is gear push / mass."""
    assert changes_at_an_instant("MassSpringDamper", "force") == {"acceleration"}
    assert changes_at_an_instant("MassSpringDamper", "velocity") == {"acceleration"}
    assert changes_at_an_instant("OverheadCrane", "rope_length") == {"load_position", "rope_tension", "swing_acceleration"}
    assert changes_at_an_instant("Ring", "push") == {"rate"}


def test_known_dependencies_of_the_mass_on_a_spring():
    assert declared_knowns("MassSpringDamper", "2", "outputs") == {
        "position": {"position"}, "velocity": {"velocity"}, "acceleration": {"force", "position", "velocity"},
    }  # fmt: skip
    parameters = {"mass", "stiffness", "damping"}
    assert declared_knowns("MassSpringDamper", "3", "derivatives") == {
        "velocity": {"velocity"}, "acceleration": {"force", "position", "velocity"} | parameters,
    }  # fmt: skip
    assert declared_knowns("MassSpringDamper", "3", "initialUnknowns")["acceleration"] == {"force"} | parameters


def test_an_element_of_an_array_state_depends_on_itself_alone():
    outputs = dict(unknowns(described("Ring", "2"), "outputs"))
    assert {name: outputs[name] for name in outputs if name != "time"} == {f"position[{i}]": [f"position[{i}]"] for i in (1, 2, 3)}


def initial_values(name: str, time: float = 0.0, **values: Any) -> dict[str, Any]:
    instance = ALL[name]()
    for variable, value in values.items():
        setattr(instance, variable, value)
    instance.initialize(time)
    return values_of(instance)


@both_versions
@every_component
def test_initial_values_depend_on_no_more_than_they_say(name, version):
    component = ALL[name]
    declared = declared_knowns(name, version, "initialUnknowns")
    before = initial_values(name)
    compared = 0
    for source in [v for v in component.variables.values() if v.causality in STARTED]:
        value = nudged(source, source.start)
        if value is None:
            continue
        try:
            after = initial_values(name, **{source.name: value})
        except ComponentError:  # a value that the component refuses tells nothing
            continue
        compared += 1
        for unknown in declared:
            assert before[unknown] == after[unknown] or source.name in declared[unknown]
        assert {n for n in before if before[n] != after[n]} <= {*declared, source.name} | unexposed(component)
    assert compared > 1


def unexposed(component: type[Component]) -> set[str]:
    """Locals that are neither states nor their derivatives, which the standards keep out of the initial unknowns."""
    states = set(component.continuous_states or ())
    exposed = states | {component.variables[s].derivative for s in states}
    return {v.name for v in component.variables.values() if v.causality == "local"} - exposed


@every_component
def test_fmi3_names_the_time_where_it_acts(name):
    """The plants' equations and the controller's do not contain the time; profiles and pulse trains are functions of it."""
    outputs = declared_knowns(name, "3", "outputs")
    initial = declared_knowns(name, "3", "initialUnknowns")
    label = next(v.name for v in described(name, "3").modelVariables if v.causality == "independent")
    acts = name in (
        "FeedbackInverse",
        "HoistingShaper",
        "InputShaper",
        "LimitedShaper",
        "MotionProfile",
        "OperatorPanel",
        "PulseTrain",
        "PulseWidthModulator",
        "ShapedStop",
        "SmoothShaper",
    )
    assert {label in known for known in outputs.values()} == {acts}
    calculated = {v.name for v in visible_variables(ALL[name]) if v.causality == "calculatedParameter"}
    assert {label in known for unknown, known in initial.items() if unknown not in calculated} == {acts}
    assert not any(label in initial[unknown] for unknown in calculated)
    first, second = initial_values(name, 0.0), initial_values(name, 0.21875)
    assert acts or first == second


@both_versions
@every_component
def test_the_initial_unknowns_are_those_of_the_standard_in_order(name, version):
    """FMI 2.0.5 and 3.0.2: outputs, calculated parameters, states and derivatives, each once; FMI 2.0 by rising index."""
    component = ALL[name]
    description = described(name, version)
    listed = [unknown for unknown, _ in unknowns(description, "initialUnknowns")]
    wanted = [
        v.name
        for v in visible_variables(component)
        if v.causality in ("output", "calculatedParameter") or (v.causality == "local" and v.name not in unexposed(component))
    ]
    assert [key for key, _ in itertools.groupby(unknown.split("[")[0] for unknown in listed)] == wanted
    positions = {v.name: i for i, v in enumerate(description.modelVariables)}
    references = [positions[unknown] for unknown in listed]
    assert references == sorted(set(references))


def test_dependencies_are_all_inputs_unless_declared():
    ring = ALL["Ring"]
    assert dependencies(ring, ring.variables["rate"]) == ("push", "gear")
    assert dependencies(ring, ring.variables["position"]) == ()
