"""The FMI 2.0 model description of a component: arrays are split into scalars, which are referenced by position."""

from __future__ import annotations

import enum
from collections.abc import Iterable, Sequence
from typing import Any

from lxml import etree

from shaper_fmu.component import Component, Variable
from shaper_fmu.export import description_parts as parts
from shaper_fmu.export import model_structure as structure

_NATIVE = {
    "canNotUseMemoryManagementFunctions": "true", "canGetAndSetFMUstate": "true", "canSerializeFMUstate": "true",
    "providesDirectionalDerivative": "true",
}  # fmt: skip


def fmi2_native_description(component: type[Component], guid: str, generator: str) -> bytes:
    """modelDescription.xml of a native FMU: co-simulation, and model exchange if the component declares its states.

    Raises BuildError if the declared states, derivatives or dependencies do not fit together.
    """
    co_simulation = {
        "canHandleVariableCommunicationStepSize": "true",
        "canInterpolateInputs": parts.text(any(v.slope for v in component.variables.values())),
        "maxOutputDerivativeOrder": str(structure.output_derivative_order(component)),
        **_NATIVE,
    }
    exchange = {"completedIntegratorStepNotNeeded": parts.text(not component.sampled), **_NATIVE}
    return fmi2_model_description(
        component,
        guid,
        generator,
        co_simulation,
        exchange if component.continuous_states is not None else None,
        log_events=True,
        sources=parts.COMPILED_SOURCES,
    )


def fmi2_model_description(
    component: type[Component],
    guid: str,
    generator: str,
    capabilities: dict[str, str],
    model_exchange: dict[str, str] | None = None,
    *,
    log_events: bool = False,
    sources: Sequence[str] = (),
) -> bytes:
    """modelDescription.xml; value references count the scalars in the order of their declaration.

    `capabilities` are attributes of the CoSimulation element, beside modelIdentifier; `model_exchange` those of the
    ModelExchange element, or None for none: then continuous states are not exposed. Raises BuildError.
    """
    states = structure.continuous_states(component) if model_exchange is not None else []
    root = parts.new_document(component, "2.0", {"guid": guid}, generator)
    if model_exchange is not None:
        root.set("numberOfEventIndicators", "0")
        _add_sources(etree.SubElement(root, "ModelExchange", {"modelIdentifier": component.__name__, **model_exchange}), sources)
    _add_sources(etree.SubElement(root, "CoSimulation", {"modelIdentifier": component.__name__, **capabilities}), sources)
    parts.add_units(root, component)
    _add_types(root, component)
    parts.add_log_categories(root, "fmi2", log_events)
    parts.add_default_experiment(root, component)
    parts.add_annotation(root, "VendorAnnotations", "Tool", "name")
    positions = _positions(component)
    _add_variables(root, component, positions, {rate.name: state.name for state, rate in states})
    _add_structure(root, component, positions, states)
    return parts.as_bytes(root)


def _add_sources(element: etree._Element, sources: Sequence[str]) -> None:
    """The files of the folder sources/ that are compiled; what they include is not listed."""
    if sources:
        parent = etree.SubElement(element, "SourceFiles")
        for name in sources:
            etree.SubElement(parent, "File", name=name)


def _positions(component: type[Component]) -> dict[str, list[int]]:
    """The positions of each variable's scalars among all, counted from 1; FMI calls them indices."""
    positions: dict[str, list[int]] = {}
    count = 0
    for variable in structure.visible_variables(component):
        size = variable.size or 1
        positions[variable.name] = list(range(count + 1, count + 1 + size))
        count += size
    return positions


def _add_types(root: etree._Element, component: type[Component]) -> None:
    kinds = parts.enumerations(component)
    if kinds:
        definitions = etree.SubElement(root, "TypeDefinitions")
        for name, kind in kinds.items():
            parts.add_items(
                etree.SubElement(etree.SubElement(definitions, "SimpleType", name=name), "Enumeration"), kind, component
            )


def _type_name(variable: Variable[Any]) -> str:
    if issubclass(variable.kind, enum.IntEnum):
        return "Enumeration"
    return {float: "Real", int: "Integer", bool: "Boolean"}[variable.kind]


def _add_variables(
    root: etree._Element, component: type[Component], positions: dict[str, list[int]], state_of: dict[str, str]
) -> None:
    parent = etree.SubElement(root, "ModelVariables")
    nominals = structure.nominals(component)
    for variable in structure.visible_variables(component):
        for i, label in enumerate(variable.scalar_names):
            attributes = parts.common_attributes(variable, label, positions[variable.name][i] - 1)
            typed = parts.typed_attributes(variable)
            if variable.name in nominals:
                typed["nominal"] = parts.text(nominals[variable.name][i])
            if parts.has_start(variable):
                typed["start"] = parts.text(variable.starts[i])
            if variable.name in state_of:
                typed["derivative"] = str(positions[state_of[variable.name]][i])
            etree.SubElement(etree.SubElement(parent, "ScalarVariable", attributes), _type_name(variable), typed)


def _add_structure(
    root: etree._Element,
    component: type[Component],
    positions: dict[str, list[int]],
    states: list[tuple[Variable[Any], Variable[Any]]],
) -> None:
    """Outputs and derivatives depend on inputs and exposed states; parameters count at the start alone in FMI 2.0, and without
    a variable for the time every unknown is taken to depend on it."""
    element = etree.SubElement(root, "ModelStructure")
    names = tuple(state.name for state, _ in states)

    def of(known: Iterable[str]) -> list[int]:
        return [i for name in known for i in positions[name]]

    def add(title: str, unknowns: dict[str, list[int]]) -> None:
        if not unknowns:
            return
        parent = etree.SubElement(element, title)
        for name, known in unknowns.items():
            for i in positions[name]:
                listed = [i] if i in known else known  # an element of a state depends on itself alone
                etree.SubElement(parent, "Unknown", index=str(i), dependencies=" ".join(map(str, sorted(listed))))

    outputs = [component.variables[name] for name in structure.names_of(component, "output")]
    add("Outputs", {v.name: of(structure.knowns(component, v, names)) for v in outputs})
    add("Derivatives", {v.name: of(structure.knowns(component, v, names)) for _, v in states})
    initial = structure.initial_unknowns(component, states)
    add("InitialUnknowns", {v.name: of(structure.initial_knowns(component, v)) for v in initial})
