"""The FMI 2.0 model description of a container."""

from __future__ import annotations

from collections.abc import Callable, Sequence

from lxml import etree

from shaper_fmu.container.definitions import SECOND, Definitions
from shaper_fmu.container.dependencies import Dependencies
from shaper_fmu.container.description_variables import common_attributes, initial_unknowns, start_texts, states_of
from shaper_fmu.container.head import Capabilities, Head, add_experiment, new_document, time_name
from shaper_fmu.container.outside import OuterVariable
from shaper_fmu.export.description_parts import add_annotation, as_bytes, text
from shaper_fmu.master.structure import SystemStructure


def description2(system: SystemStructure, outer: Sequence[OuterVariable], head: Head) -> bytes:
    """modelDescription.xml; the independent variable, if there is one, comes last: its reference is the number of the others."""
    time = time_name(head, outer, 2)
    names = [variable.name for variable in outer] + ([time] if time else [])
    root = new_document(head, "2.0", "guid", names)
    etree.SubElement(root, "CoSimulation", {"modelIdentifier": head.identifier, **_capabilities(head.capabilities)})
    definitions = Definitions(2, names)
    variables = _variables(outer, definitions, time)
    definitions.add(root)
    head.add_categories(root, "fmi2")
    add_experiment(root, head.experiment)
    if head.capabilities.readable_after_set:
        add_annotation(root, "VendorAnnotations", "Tool", "name")
    root.append(variables)
    _add_structure(root, outer, Dependencies(system, outer, [len(outer)] if time else []))
    return as_bytes(root)


def _capabilities(can: Capabilities) -> dict[str, str]:
    flags = {
        "needsExecutionTool": can.needs_tool,
        "canHandleVariableCommunicationStepSize": can.variable_steps,
        "canInterpolateInputs": can.interpolates_inputs,
        "canBeInstantiatedOnlyOncePerProcess": can.only_once,
        "canNotUseMemoryManagementFunctions": can.own_memory,
        "canGetAndSetFMUstate": can.can_save_states,
        "canSerializeFMUstate": can.can_serialize,
    }
    order = {"maxOutputDerivativeOrder": str(can.max_output_derivative_order)}
    return {**{name: text(flag) for name, flag in flags.items()}, **order}


def _variables(outer: Sequence[OuterVariable], definitions: Definitions, time: str | None) -> etree._Element:
    parent = etree.Element("ModelVariables")
    states = states_of(outer)
    for variable in outer:
        typed = definitions.attributes(variable)
        if variable.reference in states:
            typed["derivative"] = str(states[variable.reference].reference + 1)
        if variable.starts:
            typed["start"] = start_texts(variable)[0]
        etree.SubElement(etree.SubElement(parent, "ScalarVariable", common_attributes(variable)), variable.type, typed)
    if time is not None:
        attributes = {"name": time, "valueReference": str(len(outer)), "causality": "independent", "variability": "continuous"}
        unit = definitions.unit(None, "s", SECOND)
        etree.SubElement(etree.SubElement(parent, "ScalarVariable", attributes), "Real", unit=unit)
    return parent


def _add_structure(root: etree._Element, outer: Sequence[OuterVariable], dependencies: Dependencies) -> None:
    """Outputs depend on inputs, and on the time if there is a variable for it; initial unknowns on parameters, too."""
    element = etree.SubElement(root, "ModelStructure")

    def add(title: str, unknowns: list[OuterVariable], knowns: Callable[[OuterVariable], list[int] | None]) -> None:
        parent = etree.SubElement(element, title) if unknowns else element
        for unknown in unknowns:
            listed = knowns(unknown)
            known = {} if listed is None else {"dependencies": " ".join(str(reference + 1) for reference in listed)}
            etree.SubElement(parent, "Unknown", {"index": str(unknown.reference + 1), **known})

    add("Outputs", [v for v in outer if v.causality == "output"], dependencies.of_output)
    add("InitialUnknowns", initial_unknowns(outer), dependencies.at_start)
