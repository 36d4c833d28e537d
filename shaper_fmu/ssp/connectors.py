"""Checks the connectors of a description's elements against each other, their FMUs and their dictionaries."""

from __future__ import annotations

import math
from collections.abc import Mapping
from pathlib import PurePosixPath

from shaper_fmu.errors import ShaperFmuError, nearest
from shaper_fmu.master.fmu import Fmu, Interface, fmu_from_bytes
from shaper_fmu.ssp.document import Component, Connector, DictionaryReference, Element, SystemDescription
from shaper_fmu.ssp.files import Files
from shaper_fmu.ssp.findings import Weight
from shaper_fmu.ssp.meaning import Scope, fmu_meaning, unit_misfits
from shaper_fmu.ssp.names import FMU_TYPE, SSD_TYPE, SSP_TYPE
from shaper_fmu.ssp.structure import Place, Structure, elements_of

_FIXED_KINDS = ("input", "output", "parameter")
"""Kinds of connectors that an FMU's variable must be of; of others, its own causality counts."""


def flatten(description: SystemDescription, files: Files) -> Structure:
    """The elements of a description in an archive with these files, with their FMUs."""
    structure = elements_of(description, files)
    for place in structure.places.values():
        _check_connectors(structure, place)
        if isinstance(place.element, DictionaryReference):
            _check_signals(structure, place, place.element)
    return structure


def _check_connectors(structure: Structure, place: Place) -> None:
    """The connectors of an element, and against its FMU."""
    for element, scope in ((place.element, place.scope), (place.component, place.outer)):
        if element is not None and scope is not None:
            _check_declared(scope, place.path, element)
    if isinstance(place.element, Component):
        fmu = _component_fmu(structure.files, place.scope, place.element)
        if fmu is not None:
            structure.fmus[place.path] = fmu
            for connector in place.element.connectors:
                _check_against_fmu(place.scope, place.scope.label(place.path, connector.name), connector, fmu)


_INTERFACES: dict[str, Interface | None] = {"any": None, "CoSimulation": "co_simulation", "ModelExchange": "model_exchange"}
"""What components ask for by `implementation`."""


def _check_declared(scope: Scope, path: str, element: Element) -> None:
    seen: dict[str, int] = {}
    for connector in element.connectors:
        name = scope.label(path, connector.name)
        if connector.name in seen:
            scope.report_deviation(connector.line, f"connector {name!r} is there twice, first in line {seen[connector.name]}")
        seen.setdefault(connector.name, connector.line)
        if connector.kind == "inout" and not isinstance(element, DictionaryReference):
            scope.report_deviation(connector.line, f"connector {name}: only connectors of signal dictionaries can be of kind inout")
        if connector.type is not None:
            scope.meaning(connector.type, f"connector {name}", connector.line)


def _component_fmu(files: Files, scope: Scope, component: Component) -> Fmu | None:
    """The FMU of a component; None, with a finding, if it has none that can be run."""

    def report(message: str) -> None:
        scope.report(component.line, f"component {component.name!r}{message}")

    if component.source is None:
        report(" has no source: a design without an implementation cannot be run")
        return None
    if component.type in (SSD_TYPE, SSP_TYPE):
        return None  # reported
    if component.type != FMU_TYPE:
        report(f" is of type {component.type!r}; FMUs ({FMU_TYPE}) and systems can be run")
        return None
    path = files.find(component.source, scope.file, lambda message: report(f": {message}"))
    if path is None:
        return None
    if component.implementation not in _INTERFACES:
        report(f" asks for {component.implementation}; FMUs are run by CoSimulation and ModelExchange")
        return None
    try:
        return fmu_from_bytes(PurePosixPath(path).name, files.content[path]).with_interface(_INTERFACES[component.implementation])
    except ShaperFmuError as error:
        for problem in getattr(error, "problems", None) or [" ".join(str(error).split())]:
            report(f": {problem}")
        return None


def _check_against_fmu(scope: Scope, name: str, connector: Connector, fmu: Fmu) -> None:
    """A connector must be a variable of the FMU, of its causality, type and kind of unit."""
    variable = fmu.variables.get(fmu.elements_of(connector.name)[0])
    if variable is None:
        known = [v.name for v in fmu.variables.values() if v.causality == connector.kind] or list(fmu.variables)
        scope.report(connector.line, f"connector {name} is not a variable of {fmu.name}.{nearest(connector.name, known)}")
        return
    if connector.kind not in (variable.causality, "unspecified"):
        weight = Weight.LOAD if connector.kind in _FIXED_KINDS else Weight.DEVIATION
        scope.report(
            connector.line, f"connector {name} is of kind {connector.kind}, but {variable.causality} in {fmu.name}", weight
        )
    if connector.type is not None:
        own, theirs = scope.meaning(connector.type, f"connector {name}", connector.line), fmu_meaning(fmu, connector.name)
        line = connector.type.line or connector.line
        if own.kind != theirs.kind:
            scope.report_deviation(line, f"connector {name} is of type {connector.type.name}, but {variable.type} in {fmu.name}")
        else:
            message = "connector {name} is in {one}, which does not convert to {other} of {fmu}"
            unit_misfits(scope, line, own.unit, theirs.unit, message, name=name, fmu=fmu.name)
        if own.items is not None and theirs.items is not None:
            _check_items(scope, name, own.items, theirs.items, fmu, line)
    _check_dimensions(scope, name, connector, fmu, str(variable.name))


def _check_items(scope: Scope, name: str, own: Mapping[str, int], theirs: Mapping[str, int], fmu: Fmu, line: int) -> None:
    for item, value in own.items():
        if item not in theirs:
            scope.report_deviation(line, f"connector {name}: {fmu.name} has no item {item!r}.{nearest(item, theirs)}")
        elif theirs[item] != value:
            scope.report_deviation(line, f"connector {name}: item {item!r} has the value {value}, but {theirs[item]} in {fmu.name}")


def _check_dimensions(scope: Scope, name: str, connector: Connector, fmu: Fmu, first: str) -> None:
    elements = len(fmu.elements_of(connector.name))
    sizes = [dimension.size for dimension in connector.dimensions]
    if sizes and None not in sizes and math.prod(size or 0 for size in sizes) != elements:
        shown = " x ".join(str(size) for size in sizes)
        scope.report_deviation(connector.line, f"connector {name} has {shown} elements, but {elements} in {fmu.name}")
    elif not sizes and first != connector.name:
        scope.report_deviation(
            connector.line, f"connector {name} is an array of {elements} elements in {fmu.name}; declare its dimensions"
        )


def _check_signals(structure: Structure, place: Place, reference: DictionaryReference) -> None:
    """The connectors of a reference must be signals of its dictionary."""
    dictionary, home = structure.dictionaries.get(place.dictionary, (None, place.scope))
    if dictionary is None:
        return
    for connector in reference.connectors:
        scope, what = place.scope, f"connector {place.scope.label(place.path, connector.name)}"
        entry = next((entry for entry in dictionary.entries if entry.name == connector.name), None)
        if entry is None:
            known = nearest(connector.name, [entry.name for entry in dictionary.entries])
            scope.report_deviation(connector.line, f"{what} is not a signal of the dictionary {reference.dictionary!r}.{known}")
        elif connector.type is not None:
            own = scope.meaning(connector.type, what, connector.line)
            signal = home.meaning(entry.type, f"signal {entry.name}", entry.line)
            faults = structure.signal_faults.setdefault((place.path, connector.name), [])
            if own.kind != signal.kind:
                message = f"{what} is of type {connector.type.name}, but {entry.type.name} in the dictionary"
                faults.append(scope.report_deviation(connector.line, message))
            else:
                message = "{what} is in {one}, which does not convert to {other} of the dictionary"
                faults += unit_misfits(scope, connector.line, own.unit, signal.unit, message, what=what)
