"""The FMI 2.0 model description of a component."""

from __future__ import annotations

import enum
import inspect
from typing import Any

from lxml import etree

from shaper_fmu.component import Component, Variable
from shaper_fmu.units import parse_unit


def summary(component: type[Component]) -> str:
    """The first sentence-paragraph of the component's docstring, on one line."""
    return " ".join((inspect.getdoc(component) or component.__name__).split("\n\n")[0].split())


def visible_variables(component: type[Component]) -> list[Variable]:
    """The variables that the FMU shows, in the order of their declaration."""
    return [v for v in component.variables.values() if v.causality != "state"]


def dependencies(component: type[Component], output: Variable) -> tuple[str, ...]:
    """Names of the inputs that act on the output without delay."""
    if output.depends is not None:
        return output.depends
    return tuple(v.name for v in component.variables.values() if v.causality == "input")


def fmi2_model_description(component: type[Component], guid: str, generator: str, capabilities: dict[str, str]) -> bytes:
    """modelDescription.xml for co-simulation; value references count the scalars in the order of their declaration.

    `capabilities` are attributes of the CoSimulation element, beside modelIdentifier.
    """
    root = etree.Element("fmiModelDescription", {
        "fmiVersion": "2.0", "modelName": component.__name__, "guid": guid, "description": summary(component),
        "author": "shaper-fmu", "license": "BSD-2-Clause", "generationTool": generator, "variableNamingConvention": "structured",
    })  # fmt: skip
    etree.SubElement(root, "CoSimulation", {"modelIdentifier": component.__name__, **capabilities})
    _add_units(root, component)
    _add_types(root, component)
    _add_log_categories(root)
    etree.SubElement(root, "DefaultExperiment", {
        "startTime": "0", "stopTime": _text(component.default_stop_time), "stepSize": _text(component.default_step_size),
    })  # fmt: skip
    reference = 0
    variables = etree.SubElement(root, "ModelVariables")
    for variable in visible_variables(component):
        for label, start in zip(variable.scalar_names, variable.starts, strict=True):
            _add_variable(variables, variable, label, start, reference)
            reference += 1
    _add_structure(root, component)
    return etree.tostring(root, xml_declaration=True, encoding="UTF-8", pretty_print=True)


def _text(value: Any) -> str:
    if isinstance(value, enum.IntEnum):
        return str(int(value))
    return str(value).lower() if isinstance(value, bool) else f"{value:.17g}" if isinstance(value, float) else str(value)


def _add_units(root: etree._Element, component: type[Component]) -> None:
    shown: dict[str, set[str]] = {}
    for variable in visible_variables(component):
        if variable.unit:
            shown.setdefault(variable.unit, set()).update({variable.display_unit} - {""})
    if not shown:
        return
    definitions = etree.SubElement(root, "UnitDefinitions")
    for name, displays in sorted(shown.items()):
        unit = parse_unit(name)
        element = etree.SubElement(definitions, "Unit", name=name)
        base = {symbol: str(exponent) for symbol, exponent in unit.exponents}
        etree.SubElement(element, "BaseUnit", base if unit.factor == 1.0 else {**base, "factor": _text(unit.factor)})
        for display in sorted(displays):
            etree.SubElement(element, "DisplayUnit", name=display, factor=_text(unit.factor / parse_unit(display).factor))


def _add_types(root: etree._Element, component: type[Component]) -> None:
    kinds = {v.kind.__name__: v.kind for v in visible_variables(component) if issubclass(v.kind, enum.IntEnum)}
    if kinds:
        definitions = etree.SubElement(root, "TypeDefinitions")
        for name, kind in kinds.items():
            enumeration = etree.SubElement(etree.SubElement(definitions, "SimpleType", name=name), "Enumeration")
            for item in kind:
                etree.SubElement(enumeration, "Item", name=item.name, value=str(item.value))


def _add_log_categories(root: etree._Element) -> None:
    categories = etree.SubElement(root, "LogCategories")
    for status in ("Warning", "Discard", "Error", "Fatal"):
        etree.SubElement(categories, "Category", name=f"logStatus{status}", description=f"Messages with the status fmi2{status}.")


def _add_variable(parent: etree._Element, variable: Variable, label: str, start: Any, reference: int) -> None:
    continuous = variable.kind is float and variable.causality in ("input", "output")
    fixed = "tunable" if variable.tunable else "fixed"
    attributes = {
        "name": label,
        "valueReference": str(reference),
        "description": variable.description,
        "causality": variable.causality,
        "variability": fixed if "arameter" in variable.causality else "continuous" if continuous else "discrete",
    }
    if variable.causality != "input":
        attributes["initial"] = "exact" if variable.causality == "parameter" else "calculated"
    typed = {}
    if issubclass(variable.kind, enum.IntEnum):
        type_name, typed["declaredType"] = "Enumeration", variable.kind.__name__
    else:
        type_name = {float: "Real", int: "Integer", bool: "Boolean"}[variable.kind]
    if variable.kind is float and variable.unit:
        typed["unit"] = variable.unit
        if variable.display_unit:
            typed["displayUnit"] = variable.display_unit
    if variable.kind in (float, int):
        typed.update({key: _text(bound) for key, bound in (("min", variable.min), ("max", variable.max)) if bound is not None})
    if variable.causality in ("input", "parameter"):
        typed["start"] = _text(start)
    etree.SubElement(etree.SubElement(parent, "ScalarVariable", attributes), type_name, typed)


def _add_structure(root: etree._Element, component: type[Component]) -> None:
    index: dict[str, list[int]] = {}  # 1-based positions among the scalars
    count = 0
    for variable in visible_variables(component):
        index[variable.name] = list(range(count + 1, count + 1 + (variable.size or 1)))
        count += variable.size or 1
    by_causality = {
        c: [v for v in visible_variables(component) if v.causality == c] for c in ("output", "parameter", "calculatedParameter")
    }
    parameters = [i for v in by_causality["parameter"] for i in index[v.name]]
    structure = etree.SubElement(root, "ModelStructure")

    def add(parent: etree._Element, variable: Variable, known: list[int]) -> None:
        for i in index[variable.name]:
            etree.SubElement(parent, "Unknown", index=str(i), dependencies=" ".join(map(str, sorted(known))))

    inputs = {v.name: [i for name in dependencies(component, v) for i in index[name]] for v in by_causality["output"]}
    if by_causality["output"]:
        outputs = etree.SubElement(structure, "Outputs")
        for variable in by_causality["output"]:
            add(outputs, variable, inputs[variable.name])
    unknowns = [v for v in visible_variables(component) if v.causality in ("output", "calculatedParameter")]
    if unknowns:
        initial = etree.SubElement(structure, "InitialUnknowns")
        for variable in unknowns:
            add(initial, variable, inputs.get(variable.name, []) + parameters)
