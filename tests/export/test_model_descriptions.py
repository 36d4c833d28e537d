"""The model descriptions of FMI 2.0 and 3.0, over all components: valid, and what is declared is what they say."""

from __future__ import annotations

import enum
import math
import sys
from pathlib import Path

import fmpy
from description_cases import (
    ALL,
    STARTED,
    TOKEN,
    both_versions,
    described,
    description_of,
    element,
    every_component,
    read_back,
    unknowns,
)
from lxml import etree

from shaper_fmu.component import Component, Output, Parameter, Variable
from shaper_fmu.export.model_description import (
    fmi2_model_description,
    fmi2_native_description,
    fmi3_native_description,
    visible_variables,
)

SCHEMAS = Path(fmpy.__file__).parent / "schema"


def number(text: str) -> float:
    return {"true": 1.0, "false": 0.0}[text] if text in ("true", "false") else float(text)


@both_versions
@every_component
def test_the_schema_and_fmpy_have_no_findings(name, version):
    xml = description_of(name, version)
    schema = etree.XMLSchema(file=str(SCHEMAS / f"fmi{version}" / f"fmi{version}ModelDescription.xsd"))
    schema.assertValid(etree.fromstring(xml))
    assert read_back(xml).guid == TOKEN


@every_component
def test_fmi2_splits_arrays_into_scalars_in_declared_order(name):
    found = described(name, "2").modelVariables
    scalars = [(v, label) for v in visible_variables(ALL[name]) for label in v.scalar_names]
    assert [v.name for v in found] == [label for _, label in scalars]
    assert [v.valueReference for v in found] == list(range(len(found)))
    types = {float: "Real", int: "Integer", bool: "Boolean"}
    for (variable, _), v in zip(scalars, found, strict=True):
        assert v.type == types.get(variable.kind, "Enumeration")


@every_component
def test_fmi3_has_one_variable_for_each_array_and_the_time_at_the_end(name):
    found = described(name, "3").modelVariables
    declared = visible_variables(ALL[name])
    assert [v.name for v in found[:-1]] == [v.name for v in declared]
    assert [v.valueReference for v in found] == [i + 1 for i in range(len(found))]  # their places: hosts mix them up
    types = {float: "Float64", int: "Int32", bool: "Boolean"}
    for variable, v in zip(declared, found[:-1], strict=True):
        assert v.type == types.get(variable.kind, "Enumeration")
        assert [d.start for d in v.dimensions] == ([] if variable.size is None else [variable.size])
    time = found[-1]
    assert (time.type, time.causality, time.variability, time.unit, time.start) == (
        "Float64",
        "independent",
        "continuous",
        "s",
        None,
    )
    assert time.name == ("time_" if name == "Ring" else "time")


@both_versions
@every_component
def test_start_initial_and_variability_follow_the_tables_of_the_standards(name, version):
    """FMI 2.0.5, section 2.2.7, and FMI 3.0.2, table of `initial`: inputs and parameters have a start value, nothing that is
    calculated has one; `initial` is not given for inputs and the time; only real variables are continuous."""
    root = etree.fromstring(description_of(name, version))
    for item in element(root, "ModelVariables"):
        variable = ALL[name].variables.get(str(item.get("name")).split("[")[0])
        typed = item[0] if version == "2" else item
        causality = item.get("causality")
        if variable is None or causality == "independent":
            assert causality == "independent"
            assert "initial" not in item.attrib
            assert "start" not in typed.attrib
            continue
        assert causality == variable.causality
        expected = {"input": None, "parameter": "exact"}.get(variable.causality, "calculated")
        assert item.get("initial") == expected
        assert ("start" in typed.attrib) == (causality in STARTED)
        if causality in ("parameter", "calculatedParameter"):
            assert item.get("variability") == ("tunable" if variable.tunable else "fixed")
        else:
            continuous = variable.kind is float and variable.name != "next_event_time"
            assert item.get("variability") == ("continuous" if continuous else "discrete")


@every_component
def test_what_is_computed_can_be_read_in_intermediate_updates(name):
    """FMI 3.0.2 forbids it for parameters; inputs are held over a step."""
    for item in element(etree.fromstring(description_of(name, "3")), "ModelVariables"):
        assert item.get("intermediateUpdate") == ("true" if item.get("causality") in ("output", "local") else None)


@both_versions
@every_component
def test_values_units_and_bounds_are_the_declared_ones(name, version):
    component = ALL[name]
    found = {v.name: v for v in described(name, version).modelVariables}
    for variable in visible_variables(component):
        labels = variable.scalar_names if version == "2" else [variable.name]
        starts = variable.starts if version == "2" else [variable.starts]
        for label, start in zip(labels, starts, strict=True):
            v = found[label]
            assert variable.description
            assert str(v.description).split("; greater than ")[0].split("; less than ")[0] == variable.description
            assert (v.description != variable.description) == bool(variable.exclusive)
            assert (v.unit or "") == (variable.unit if variable.kind is float else "")
            assert (v.displayUnit or "") == variable.display_unit
            if variable.causality in STARTED:
                given = [number(text) for text in str(v.start).split()]
                assert given == [float(s) for s in (start if isinstance(start, list) else [start])]
            for bound in ("min", "max"):
                given = getattr(v, bound)
                assert (None if given is None else float(str(given))) == variable.published_bounds.get(bound)
            if issubclass(variable.kind, enum.IntEnum):
                assert v.declaredType is not None
                items = {item.name: int(str(item.value)) for item in v.declaredType.items}
                assert items == {item.name: item.value for item in variable.kind}


@both_versions
@every_component
def test_every_unit_is_defined_once_by_base_units(name, version):
    description = described(name, version)
    used = {v.unit for v in description.modelVariables if v.unit}
    assert sorted(used) == sorted(str(unit.name) for unit in description.unitDefinitions)
    assert all(unit.baseUnit is not None for unit in description.unitDefinitions)


@both_versions
@every_component
def test_exactly_the_derivatives_of_states_are_marked_and_in_the_order_of_the_states(name, version):
    component = ALL[name]
    description = described(name, version)
    states = [component.variables[s] for s in component.continuous_states or ()]

    def labels(variable: Variable) -> list[str]:
        return variable.scalar_names if version == "2" else [variable.name]

    pairs = [(a, b) for s in states for a, b in zip(labels(s), labels(component.variables[s.derivative]), strict=True)]
    state_of = {v.name: v.derivative.name for v in description.modelVariables if v.derivative is not None}
    assert [(state_of[rate], rate) for rate, _ in unknowns(description, "derivatives")] == pairs
    assert set(state_of) == {b for _, b in pairs}
    assert description.numberOfContinuousStates == sum(s.size or 1 for s in states)


@every_component
def test_fmi2_capabilities(name):
    component = ALL[name]
    root = etree.fromstring(description_of(name, "2"))
    able = (
        "canGetAndSetFMUstate", "canSerializeFMUstate", "canNotUseMemoryManagementFunctions", "providesDirectionalDerivative",
    )  # fmt: skip
    saved = dict.fromkeys(able, "true")
    expected = {
        "modelIdentifier": name, **saved, "canHandleVariableCommunicationStepSize": "true",
        "maxOutputDerivativeOrder": str(longest_chain(component)),
        "canInterpolateInputs": str(any(v.slope for v in component.variables.values())).lower(),
    }  # fmt: skip
    assert dict(element(root, "CoSimulation").attrib) == expected
    exchange = root.find("ModelExchange")
    assert (exchange is not None) == (component.continuous_states is not None)
    if exchange is not None:
        not_needed = "false" if component.sampled else "true"
        assert dict(exchange.attrib) == {"modelIdentifier": name, **saved, "completedIntegratorStepNotNeeded": not_needed}
        assert root.get("numberOfEventIndicators") == "0"


@every_component
def test_fmi3_capabilities(name):
    component = ALL[name]
    root = etree.fromstring(description_of(name, "3"))
    saved = dict.fromkeys(("canGetAndSetFMUState", "canSerializeFMUState", "providesDirectionalDerivatives"), "true")
    can = (
        "canHandleVariableCommunicationStepSize", "providesIntermediateUpdate", "mightReturnEarlyFromDoStep",
        "canReturnEarlyAfterIntermediateUpdate", "hasEventMode",
    )  # fmt: skip
    expected = {"modelIdentifier": name, **saved, **dict.fromkeys(can, "true")}
    assert dict(element(root, "CoSimulation").attrib) == {**expected, "maxOutputDerivativeOrder": str(longest_chain(component))}
    exchange = root.find("ModelExchange")
    assert (exchange is not None) == (component.continuous_states is not None)
    if exchange is not None:
        needed = "true" if component.sampled else "false"
        assert dict(exchange.attrib) == {"modelIdentifier": name, **saved, "needsCompletedIntegratorStep": needed}
    assert root.get("fmiVersion") == "3.0"


def longest_chain(component: type[Component]) -> int:
    """By the definition: d(n) = 1 + d(derivative of n)."""

    def depth(variable: Variable) -> int:
        return 1 + depth(component.variables[variable.derivative]) if variable.derivative else 0

    return max(depth(v) for v in component.variables.values() if v.causality == "output")


def test_position_velocity_acceleration_make_two_derivatives():
    for name in ("MotionProfile", "MassSpringDamper", "OverheadCrane", "Ring"):
        co_simulation = described(name, "2").coSimulation
        assert co_simulation is not None
        assert str(co_simulation.maxOutputDerivativeOrder) == "2"


@both_versions
def test_log_categories(version):
    names = [c.name for c in described("InputShaper", version).logCategories]
    assert names == ["logEvents", "logStatusWarning", "logStatusDiscard", "logStatusError", "logStatusFatal"]


@every_component
def test_without_model_exchange_no_state_is_exposed(name):
    xml = fmi2_model_description(ALL[name], TOKEN, "the test", {"canGetAndSetFMUstate": "true"})
    description = read_back(xml)
    inputs = {v.name for v in description.modelVariables if v.causality == "input"}
    assert description.modelExchange is None
    assert description.derivatives == []
    assert all(v.derivative is None for v in description.modelVariables)
    assert all(set(known) <= inputs for _, known in unknowns(description, "outputs"))
    assert [c.name for c in description.logCategories] == [f"logStatus{s}" for s in ("Warning", "Discard", "Error", "Fatal")]


@every_component
def test_what_may_be_read_before_a_step_is_said_in_both_versions_and_by_both_backends(name):
    """The annotation that docs/components.md documents, for any master to read."""
    said = etree.tostring(etree.fromstring('<DirectFeedthrough outputsBetweenSetAndStep="true"/>'))
    python = fmi2_model_description(ALL[name], TOKEN, "the test", {})
    for xml, path in (
        (description_of(name, "2"), "VendorAnnotations/Tool[@name='io.shaper-fmu']/*"),
        (python, "VendorAnnotations/Tool[@name='io.shaper-fmu']/*"),
        (description_of(name, "3"), "Annotations/Annotation[@type='io.shaper-fmu']/*"),
    ):
        assert [etree.tostring(found).strip() for found in etree.fromstring(xml).findall(path)] == [said]


@both_versions
@every_component
def test_published_bounds_are_in_the_domain_and_the_numbers_before_them_are_not(name, version):
    """FMI's min and max are inclusive; where others are told than the domain's, these are not, and the description tells them."""
    for v in described(name, version).modelVariables:
        if v.causality not in ("input", "parameter"):
            continue
        variable = ALL[name].variables[v.name.split("[")[0]]
        for bound, beyond in ((v.min, -math.inf), (v.max, math.inf)):
            if bound is not None and variable.kind in (float, int):
                given = variable.kind(str(bound))
                assert variable.problem(v.name, given) is None
                outside = given + int(math.copysign(1, beyond)) if variable.kind is int else math.nextafter(given, beyond)
                end = variable.min if beyond < 0.0 else variable.max
                excluded = variable.exclusive in (True, "min" if beyond < 0.0 else "max")
                assert variable.problem(v.name, end if excluded and end is not None else outside) is not None
                assert not excluded or f"{'greater' if beyond < 0.0 else 'less'} than {end:g}" in str(v.description)


@both_versions
def test_integers_and_negative_bounds_are_published_inclusive(version):
    class Bounded(Component):
        count = Parameter(3, "", "count", min=1, max=9, exclusive=True)
        share = Parameter(-0.5, "", "share", min=-1.0, max=0.0, exclusive=True)
        angle = Parameter(0.5, "", "angle", min=-2.0, max=2.0, exclusive="min")
        result = Output("", "result")

        def step(self, t, h):
            pass

    make = fmi2_native_description if version == "2" else fmi3_native_description
    declared = read_back(make(Bounded, TOKEN, "x")).modelVariables[:3]
    found = {v.name: (float(str(v.min)), float(str(v.max))) for v in declared}
    assert found["count"] == (2, 8)
    assert found["share"] == (math.nextafter(-1.0, 0.0), -sys.float_info.min)
    assert found["angle"] == (math.nextafter(-2.0, 0.0), 2.0)
    assert [v.description for v in declared] == [
        "count; greater than 1 and less than 9",
        "share; greater than -1 and less than 0",
        "angle; greater than -2",
    ]


@both_versions
@every_component
def test_the_announced_event_is_discrete(name, version):
    found = {v.name: v.variability for v in described(name, version).modelVariables}
    assert found.get("next_event_time", "discrete") == "discrete"
