"""Checks of systems, their elements and connectors: names, types, and the connectors against the FMUs."""

from __future__ import annotations

import math
from collections.abc import Iterator

from fmpy.model_description import ModelVariable

from shaper_fmu.errors import nearest
from shaper_fmu.master.fmu import Fmu
from shaper_fmu.ssp.check_scene import (
    Meaning,
    Scene,
    binary_problem,
    do_not_convert,
    duplicates,
    find_variable,
    variable_meaning,
)
from shaper_fmu.ssp.document import (
    Component,
    Connector,
    DictionaryReference,
    Element,
    SignalDictionary,
    SystemDescription,
    SystemElement,
)
from shaper_fmu.ssp.document_parts import DataType
from shaper_fmu.ssp.names import FMU_TYPE, SSD_TYPE, SSP_TYPE

OF_DESCRIPTION = ": modelDescription.xml: "
"""In findings of FMUs that can be run all the same."""

Place = tuple[str, ...]
"""Names of the systems from the root's elements down to an element; () is the root system."""


def places(system: SystemElement, place: Place = ()) -> Iterator[tuple[Place, Element]]:
    """Every element of a system with its place, the system itself first."""
    yield place, system
    for element in system.elements:
        if isinstance(element, SystemElement):
            yield from places(element, (*place, element.name))
        else:
            yield (*place, element.name), element


def label(place: Place, connector: str = "") -> str:
    """How a place, or a connector there, is called in words."""
    return ".".join([*place, *([connector] if connector else [])]) or "the system"


def check_elements(scene: Scene) -> dict[Place, Fmu]:
    """Check all elements and their connectors; returns the FMUs that could be read."""
    fmus: dict[Place, Fmu] = {}
    for place, element in places(scene.description.system):
        if isinstance(element, SystemElement):
            _check_names(scene, place, element)
        _check_connectors(scene, place, element)
        if isinstance(element, Component):
            fmu = _component_fmu(scene, element)
            if fmu is not None:
                fmus[place] = fmu
                for connector in element.connectors:
                    _check_against_fmu(scene, label(place, connector.name), connector, fmu)
    return fmus


def _check_names(scene: Scene, place: Place, system: SystemElement) -> None:
    seen: dict[str, int] = {}
    for element in system.elements:
        if not element.name:
            scene.tell(element.line, f"an element of {label(place)} has an empty name")
        elif element.name in seen:
            scene.tell(
                element.line, f"element {label((*place, element.name))!r} is there twice, first in line {seen[element.name]}"
            )
        seen.setdefault(element.name, element.line)
    for name in sorted(duplicates(dictionary.name for dictionary in system.dictionaries)):
        line = [dictionary.line for dictionary in system.dictionaries if dictionary.name == name][1]
        scene.tell(line, f"signal dictionary {name!r} is there twice")


def _check_connectors(scene: Scene, place: Place, element: Element) -> None:
    seen: dict[str, int] = {}
    for connector in element.connectors:
        name = label(place, connector.name)
        if connector.name in seen:
            scene.tell(connector.line, f"connector {name!r} is there twice, first in line {seen[connector.name]}")
        seen.setdefault(connector.name, connector.line)
        if connector.kind == "inout" and not isinstance(element, DictionaryReference):
            scene.tell(connector.line, f"connector {name}: only connectors of signal dictionaries can be of kind inout")
        if connector.type is not None:
            check_type(scene, connector.type, f"connector {name}", connector.line)


def check_type(
    scene: Scene, type_: DataType, what: str, line: int, holder: SystemDescription | SignalDictionary | None = None, file: str = ""
) -> None:
    """Units and enumerations that a type names and its file (the description, or another that is given) does not declare."""
    meaning, holder = scene.meaning(type_, holder), holder or scene.description
    if type_.unit is not None and meaning.definition is None:
        known = nearest(type_.unit, [unit.name for unit in holder.units])
        scene.tell(line, f"{what}: unit {type_.unit!r} is not declared in Units.{known}", file)
    if type_.enumeration is not None and meaning.items is None:
        known = nearest(type_.enumeration, [enumeration.name for enumeration in holder.enumerations])
        scene.tell(line, f"{what}: enumeration {type_.enumeration!r} is not declared in Enumerations.{known}", file)


def _component_fmu(scene: Scene, component: Component) -> Fmu | None:
    what = f"component {component.name!r}"
    if component.source is None:
        scene.tell(component.line, f"{what} has no source: a design without an implementation cannot be run")
        return None
    if component.type in (SSD_TYPE, SSP_TYPE):
        scene.resource(component.source, component.line, what)
        return None
    if component.type != FMU_TYPE:
        scene.tell(component.line, f"{what} is of type {component.type!r}; FMUs ({FMU_TYPE}) and systems can be run")
        return None
    fmu = scene.fmu(component)
    if fmu is not None:
        if component.implementation not in ("any", "CoSimulation"):
            scene.tell(component.line, f"{what} asks for {component.implementation}; FMUs are run by co-simulation alone")
        for finding in fmu.findings:
            scene.tell(component.line, f"{what}: {fmu.name}{OF_DESCRIPTION}{finding}")
        problem = binary_problem(fmu)
        if problem:
            scene.tell(component.line, f"{what}: {problem}")
    return fmu


def _check_against_fmu(scene: Scene, name: str, connector: Connector, fmu: Fmu) -> None:
    """A connector must be a variable of the FMU, of its causality, type and kind of unit."""
    variable = find_variable(fmu, connector.name)
    if variable is None:
        known = [v.name for v in fmu.variables.values() if v.causality == connector.kind] or list(fmu.variables)
        scene.tell(connector.line, f"connector {name} is no variable of {fmu.name}.{nearest(connector.name, known)}")
        return
    if connector.kind not in (variable.causality, "unspecified"):
        scene.tell(connector.line, f"connector {name} is of kind {connector.kind}, but {variable.causality} in {fmu.name}")
    if connector.type is not None:
        own, theirs = scene.meaning(connector.type), variable_meaning(fmu, variable)
        line = connector.type.line or connector.line
        if own.kind != theirs.kind:
            scene.tell(line, f"connector {name} is of type {connector.type.name}, but {variable.type} in {fmu.name}")
        elif do_not_convert(own, theirs):
            scene.tell(line, f"connector {name} is in {own.unit}, which does not convert to {theirs.unit} of {fmu.name}")
        _check_items(scene, name, own, theirs, fmu, line)
    _check_dimensions(scene, name, connector, fmu, variable)


def _check_items(scene: Scene, name: str, own: Meaning, theirs: Meaning, fmu: Fmu, line: int) -> None:
    if own.items is None or theirs.items is None:
        return
    wrong = {item: value for item, value in own.items.items() if theirs.items.get(item, value) != value}
    unknown = [item for item in own.items if item not in theirs.items]
    for item, value in wrong.items():
        scene.tell(line, f"connector {name}: item {item!r} has the value {value}, but {theirs.items[item]} in {fmu.name}")
    for item in unknown:
        scene.tell(line, f"connector {name}: {fmu.name} has no item {item!r}.{nearest(item, theirs.items)}")


def _check_dimensions(scene: Scene, name: str, connector: Connector, fmu: Fmu, variable: ModelVariable) -> None:
    elements = len(fmu.elements_of(connector.name))
    sizes = [dimension.size for dimension in connector.dimensions]
    if sizes and None not in sizes and math.prod(size or 0 for size in sizes) != elements:
        said = " x ".join(str(size) for size in sizes)
        scene.tell(connector.line, f"connector {name} has {said} elements, but {elements} in {fmu.name}")
    elif not sizes and variable.name != connector.name:
        scene.tell(connector.line, f"connector {name} is an array of {elements} elements in {fmu.name}; tell its dimensions")
