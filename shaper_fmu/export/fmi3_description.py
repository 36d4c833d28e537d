"""The FMI 3.0 model description of a component: arrays are single variables, referenced by value reference."""

from __future__ import annotations

import enum
from collections.abc import Iterable
from typing import Any

from lxml import etree

from shaper_fmu.component import Component, Variable
from shaper_fmu.export import description_parts as parts
from shaper_fmu.export import model_structure as structure

_NATIVE = {"canGetAndSetFMUState": "true", "canSerializeFMUState": "true", "providesDirectionalDerivatives": "true"}
_CO_SIMULATION = {
    **_NATIVE,
    "canHandleVariableCommunicationStepSize": "true",
    "providesIntermediateUpdate": "true",
    "mightReturnEarlyFromDoStep": "true",
    "canReturnEarlyAfterIntermediateUpdate": "true",
    "hasEventMode": "true",
}


def fmi3_native_description(component: type[Component], token: str, generator: str) -> bytes:
    """modelDescription.xml of a native FMU: co-simulation, and model exchange if the component declares its states.

    Value references count the visible variables from 1, in the order of their declaration; the time comes last. Raises BuildError
    if the declared states, derivatives or dependencies do not fit together.
    """
    states = structure.continuous_states(component)
    root = parts.new_document(component, "3.0", {"instantiationToken": token}, generator)
    identifier = {"modelIdentifier": component.__name__}
    if component.continuous_states is not None:
        needed = {"needsCompletedIntegratorStep": parts.text(component.sampled)}
        etree.SubElement(root, "ModelExchange", {**identifier, **_NATIVE, **needed})
    order = {"maxOutputDerivativeOrder": str(structure.output_derivative_order(component))}
    etree.SubElement(root, "CoSimulation", {**identifier, **_CO_SIMULATION, **order})
    parts.add_units(root, component, "s")  # of the time
    _add_types(root, component)
    parts.add_log_categories(root, "fmi3", events=True)
    parts.add_default_experiment(root, component)
    # as the places of the variables, from 1 on: OMSimulator takes dependencies for places
    references = {v.name: i for i, v in enumerate(structure.visible_variables(component), 1)}
    _add_variables(root, component, references, {rate.name: state.name for state, rate in states})
    _add_structure(root, component, references, states)
    parts.add_annotation(root, "Annotations", "Annotation", "type")
    return parts.as_bytes(root)


def _add_types(root: etree._Element, component: type[Component]) -> None:
    kinds = parts.enumerations(component)
    if kinds:
        definitions = etree.SubElement(root, "TypeDefinitions")
        for name, kind in kinds.items():
            parts.add_items(etree.SubElement(definitions, "EnumerationType", name=name), kind, component)


def _type_name(variable: Variable[Any]) -> str:
    if issubclass(variable.kind, enum.IntEnum):
        return "Enumeration"
    return {float: "Float64", int: "Int32", bool: "Boolean"}[variable.kind]


def _add_variables(root: etree._Element, component: type[Component], references: dict[str, int], state_of: dict[str, str]) -> None:
    """All visible variables, then the time. What is computed can be read in intermediate updates; inputs hold over a step."""
    parent = etree.SubElement(root, "ModelVariables")
    nominals = structure.nominals(component)
    for variable in structure.visible_variables(component):
        attributes = {
            **parts.common_attributes(variable, variable.name, references[variable.name]),
            **parts.typed_attributes(variable),
        }
        if variable.causality in ("output", "local"):
            attributes["intermediateUpdate"] = "true"
        if variable.name in nominals:  # one for all elements: the smallest, which asks most of a solver
            attributes["nominal"] = parts.text(min(nominals[variable.name]))
        if parts.has_start(variable):
            attributes["start"] = " ".join(map(parts.text, variable.starts))
        if variable.name in state_of:
            attributes["derivative"] = str(references[state_of[variable.name]])
        element = etree.SubElement(parent, _type_name(variable), attributes)
        if variable.size is not None:
            etree.SubElement(element, "Dimension", start=str(variable.size))
    name = "time"
    while name in references:  # a component may call a variable of its own so
        name += "_"
    etree.SubElement(parent, "Float64", {
        "name": name, "valueReference": str(len(references) + 1), "description": "simulation time",
        "causality": "independent", "variability": "continuous", "unit": "s",
    })  # fmt: skip


def _add_structure(
    root: etree._Element, component: type[Component], references: dict[str, int], states: list[tuple[Variable[Any], Variable[Any]]]
) -> None:
    """FMI 3.0 wants every known that acts directly: inputs, states, parameters, and the time where the kernel reads it."""
    element = etree.SubElement(root, "ModelStructure")
    names = tuple(state.name for state, _ in states)
    parameters = structure.names_of(component, "parameter")
    time = [len(references) + 1] if structure.reads_time(component) else []

    def add(title: str, variable: Variable[Any], known: Iterable[str], more: list[int]) -> None:
        listed = sorted([*{references[name] for name in known}, *more])
        etree.SubElement(element, title, valueReference=str(references[variable.name]), dependencies=" ".join(map(str, listed)))

    def add_unknown(title: str, variable: Variable[Any]) -> None:
        if variable.name in names:
            add(title, variable, [variable.name], [])
        else:
            add(title, variable, [*structure.knowns(component, variable, names), *parameters], time)

    for name in structure.names_of(component, "output"):
        add_unknown("Output", component.variables[name])
    for _, rate in states:
        add_unknown("ContinuousStateDerivative", rate)
    for variable in structure.initial_unknowns(component, states):
        calculated = variable.causality == "calculatedParameter"
        add("InitialUnknown", variable, structure.initial_knowns(component, variable), [] if calculated else time)
