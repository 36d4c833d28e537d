"""The FMI 3.0 model description of a container."""

from __future__ import annotations

from collections.abc import Iterator, Sequence

from fmpy.model_description import VariableAlias
from lxml import etree

from shaper_fmu.container.definitions import REALS, SECOND, Definitions
from shaper_fmu.container.dependencies import Dependencies
from shaper_fmu.container.description_variables import common_attributes, initial_unknowns, start_texts, states_of
from shaper_fmu.container.head import Capabilities, Head, add_experiment, new_document, time_name
from shaper_fmu.container.interface import FIRST_REFERENCE, SET
from shaper_fmu.container.outside import OuterVariable
from shaper_fmu.export.description_parts import add_annotation, as_bytes, text
from shaper_fmu.master.structure import SystemStructure


def description3(system: SystemStructure, outer: Sequence[OuterVariable], head: Head) -> bytes:
    """modelDescription.xml; the independent variable comes last."""
    time = time_name(head, outer, 3) or "time"
    names = [variable.name for variable in outer] + [time]
    aliases = _aliases(outer, names)
    every = names + [name for found in aliases.values() for name, _ in found]
    root = new_document(head, "3.0", "instantiationToken", every)
    etree.SubElement(root, "CoSimulation", {"modelIdentifier": head.identifier, **_capabilities(head.capabilities)})
    definitions = Definitions(3, every)
    variables = _variables(outer, definitions, time, aliases)
    definitions.add(root)
    head.add_categories(root, "fmi3")
    add_experiment(root, head.experiment)
    root.append(variables)
    _add_structure(root, outer, Dependencies(system, outer, [FIRST_REFERENCE[3] + len(outer)], parameters=True))
    if head.capabilities.readable_after_set:
        add_annotation(root, "Annotations", "Annotation", "type")
    return as_bytes(root)


def _capabilities(can: Capabilities) -> dict[str, str]:
    flags = {
        "needsExecutionTool": can.needs_tool,
        "canHandleVariableCommunicationStepSize": can.variable_steps,
        "canBeInstantiatedOnlyOncePerProcess": can.only_once,
        "canGetAndSetFMUState": can.can_save_states,
        "canSerializeFMUState": can.can_serialize,
        "hasEventMode": can.has_event_mode,
        "mightReturnEarlyFromDoStep": can.has_event_mode,
    }
    order = {"maxOutputDerivativeOrder": str(can.max_output_derivative_order)}
    return {**{name: text(flag) for name, flag in flags.items()}, **order}


def _aliases(outer: Sequence[OuterVariable], names: Sequence[str]) -> dict[int, list[tuple[str, VariableAlias]]]:
    """The other names of inputs and parameters by reference, with what comes before the variable's own name outside.

    Those of outputs and local variables are variables of their own.
    """
    taken, found = set(names), {}
    for variable in outer:
        inner = str(variable.shown.name)
        whole = bool(variable.shown.dimensions) == bool(variable.dimensions)
        if inner and variable.name.endswith(inner) and whole and variable.causality in SET:
            before = variable.name.removesuffix(inner)
            new = [(f"{before}{alias.name}", alias) for alias in variable.shown.aliases]
            found[variable.reference] = [(name, alias) for name, alias in new if name not in taken]
            taken.update(name for name, _ in new)
    return found


def _variables(
    outer: Sequence[OuterVariable], definitions: Definitions, time: str, aliases: dict[int, list[tuple[str, VariableAlias]]]
) -> etree._Element:
    parent = etree.Element("ModelVariables")
    states = states_of(outer)
    for variable in outer:
        attributes = {**common_attributes(variable), **definitions.attributes(variable)}
        if variable.reference in states:
            attributes["derivative"] = str(states[variable.reference].reference)
        in_elements = variable.type in ("String", "Binary")
        if variable.starts and not in_elements:
            attributes["start"] = " ".join(start_texts(variable))
        element = etree.SubElement(parent, variable.type, attributes)
        for size in variable.dimensions:
            etree.SubElement(element, "Dimension", start=str(size))
        for start in start_texts(variable) if in_elements else []:
            etree.SubElement(element, "Start", value=start)
        for attributes in _alias_attributes(variable, definitions, aliases.get(variable.reference, [])):
            etree.SubElement(element, "Alias", attributes)
    unit = definitions.unit(None, "s", SECOND)
    etree.SubElement(parent, "Float64", {
        "name": time, "valueReference": str(FIRST_REFERENCE[3] + len(outer)), "description": "simulation time",
        "causality": "independent", "variability": "continuous", "unit": unit,
    })  # fmt: skip
    return parent


def _alias_attributes(
    variable: OuterVariable, definitions: Definitions, aliases: Sequence[tuple[str, VariableAlias]]
) -> Iterator[dict[str, str]]:
    shown = variable.shown
    unit = shown.unit or (shown.declaredType.unit if shown.declaredType is not None else None)
    for name, alias in aliases:
        attributes = {"name": name, **({"description": alias.description} if alias.description else {})}
        yield attributes | (definitions.display(variable.fmu, unit, alias.displayUnit) if variable.type in REALS else {})


def _add_structure(root: etree._Element, outer: Sequence[OuterVariable], dependencies: Dependencies) -> None:
    """FMI 3.0 wants every known that acts directly: inputs, parameters, and the time, on which FMUs may depend."""
    element = etree.SubElement(root, "ModelStructure")

    def add(title: str, unknown: OuterVariable, listed: list[int] | None) -> None:
        known = {} if listed is None else {"dependencies": " ".join(map(str, listed))}
        etree.SubElement(element, title, {"valueReference": str(unknown.reference), **known})

    for output in outer:
        if output.causality == "output":
            add("Output", output, dependencies.of_output(output))
    for unknown in initial_unknowns(outer):
        add("InitialUnknown", unknown, dependencies.at_start(unknown))
