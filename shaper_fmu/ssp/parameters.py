"""Resolves parameter bindings: which value each variable of each component gets, and from where.

The standard's rules, as they are followed here:

- A binding's prefix comes before all names of its set. With a mapping, only the parameters that it names are applied, under
  the names that it gives; without one all are, under their own.
- A name at a component is one of its FMU's variables. A name at a system is one of the system's connectors, or an element's
  name, a dot and a name there, at any depth. A name that fits several is applied to all of them; one that fits none is ignored
  (here: noted).
- A value is converted from its unit to that of its target, unless the mapping's entry suppresses that, and then transformed.
- Of several values for one variable, an outer system's binding counts more than an inner one's, and at one level a later
  binding counts more than an earlier one. (A binding of a component that is itself a system structure counts as the last one of
  that structure's root system.)
- A system's parameter that has a value passes it on along its connections, with their conversions and transformations.
"""

from __future__ import annotations

import math
from collections.abc import Iterator
from dataclasses import dataclass
from typing import Any, TypeVar

from shaper_fmu.errors import ModelError, nearest
from shaper_fmu.master.variables import typed_value
from shaper_fmu.ssp.conversion import Scalar, applied, transformed
from shaper_fmu.ssp.document import (
    Component,
    MappingEntry,
    MappingReference,
    Parameter,
    ParameterBinding,
    ParameterMapping,
    ParameterSet,
    SystemElement,
)
from shaper_fmu.ssp.document_parts import Unit
from shaper_fmu.ssp.files import Reader, file_inside
from shaper_fmu.ssp.findings import Findings, Key, Weight
from shaper_fmu.ssp.meaning import Meaning, Scope, kind_of_type, misfits, repeated
from shaper_fmu.ssp.names import INTEGER_BITS, MAPPING_TYPE, REAL_TYPES, SET_TYPE
from shaper_fmu.ssp.network import Network, Node, Wire, WireError
from shaper_fmu.ssp.read import read_mapping, read_parameter_set
from shaper_fmu.ssp.structure import Place

T = TypeVar("T", ParameterSet, ParameterMapping)
_FLAGS = {"true": True, "1": True, "false": False, "0": False}
SETTABLE = ("parameter", "structuralParameter", "input")


@dataclass(frozen=True)
class Given:
    """A value of a set: its place and its name in messages; `faults` are findings by which it may be refused."""

    scope: Scope
    line: int
    what: str
    faults: tuple[Key, ...] = ()

    def refuse(self, problems: list[str]) -> None:
        """Refuse the system: by existing findings, or else by this message."""
        self.scope.findings.weigh(self.faults, Weight.LOAD)
        for problem in () if self.faults else problems:
            self.scope.report(self.line, f"{self.what}: {problem}")


@dataclass(frozen=True)
class Setting:
    """A value for a variable of an FMU, or one for each element of an array, and where it comes from."""

    value: Any
    given: Given


Settings = dict[tuple[str, str], Setting]
"""Values by component's path and variable's name."""


def collect_settings(network: Network) -> Settings:
    """The values that the bindings of a system give."""
    settings: Settings = {}
    for place in sorted(
        network.places.values(), key=lambda place: place.depth, reverse=True
    ):  # the outer ones last: they count more
        for binding, scope in place.bindings():
            values = bound_values(network, place, binding, scope)
            mapping = _mapping(network, place, binding.mapping, scope) if binding.mapping is not None else None
            if values is not None and (mapping is not None or binding.mapping is None):
                _Set(network, place, scope, settings).apply(values, binding.prefix, mapping)
    return settings


def settings_of(network: Network, values: ParameterSet, findings: Findings) -> Settings:
    """The values of a set for the whole system, as a last binding of its root would give them; all of them must be taken."""
    settings: Settings = {}
    scope = Scope(values.file, "", findings)
    _Set(network, network.places[""], scope, settings, Weight.LOAD).apply(values, "", None)
    return settings


def targets(network: Network, place: Place, name: str) -> list[Node] | None:
    """The connectors and variables that a name refers to at a place; None if that cannot be determined."""
    if isinstance(place.element, Component):
        fmu = network.fmus.get(place.path)
        if fmu is None:
            return None
        return [Node(place.path, name)] if fmu.elements_of(name)[0] in fmu.variables else []
    found: list[Node] | None = [Node(place.path, name)] if place.element.connector(name) is not None else []
    for inner in network.structure.inside(place.path) if isinstance(place.element, SystemElement) else ():
        if name.startswith(f"{inner.element.name}."):
            more = targets(network, inner, name.removeprefix(f"{inner.element.name}."))
            found = None if found is None or more is None else found + more
    return found


def known_names(network: Network, place: Place) -> Iterator[str]:
    """The names that a parameter can have at a place."""
    if isinstance(place.element, Component):
        fmu = network.fmus.get(place.path)
        yield from (str(v.name) for v in fmu.variables.values() if v.causality in SETTABLE) if fmu is not None else ()
        return
    yield from (connector.name for connector in place.element.connectors)
    for inner in network.structure.inside(place.path) if isinstance(place.element, SystemElement) else ():
        yield from (f"{inner.element.name}.{name}" for name in known_names(network, inner))


def bound_values(network: Network, place: Place, binding: ParameterBinding, scope: Scope) -> ParameterSet | None:
    """The parameter set of a binding; None, with a finding, if there is none."""
    what = f"parameter binding of {scope.label(place.path)}"
    if binding.type != SET_TYPE:
        scope.report(binding.line, f"{what} is of type {binding.type!r}, which is not read; the standard's is {SET_TYPE}")
        return None
    return _document(network, place, scope, binding, what, "values", binding.values, read_parameter_set)


def _mapping(network: Network, place: Place, reference: MappingReference, scope: Scope) -> ParameterMapping | None:
    what = f"parameter mapping of {scope.label(place.path)}"
    if reference.type != MAPPING_TYPE:
        scope.report(reference.line, f"{what} is of type {reference.type!r}, which is not read")
        return None
    return _document(network, place, scope, reference, what, "entries", reference.mapping, read_mapping)


def _document(
    network: Network,
    place: Place,
    scope: Scope,
    reference: ParameterBinding | MappingReference,
    what: str,
    inside: str,
    inline: T | None,
    read: Reader[T],
) -> T | None:
    """The document that a reference's source names, in the archive or in the FMU, or the one inline."""
    source, line, files = reference.source, reference.line, network.structure.files
    if source is None or reference.source_base == "SSD":
        return files.document(scope, line, what, source, inline, inside, read, Weight.LOAD)
    if not isinstance(place.element, Component) or place.element.source is None:
        scope.report(line, f"{what}: sourceBase is 'component', but {scope.label(place.path)} is not a component with a source")
        return None
    fmu = network.fmus.get(place.path)
    if fmu is None:
        return None
    content = file_inside(fmu.folder, source)
    if content is None:
        scope.report(line, f"{what}: {source!r} is missing in {fmu.name}")
        return None
    return files.read(f"{place.element.source}/{source}", read, content)


@dataclass
class _Set:
    """A parameter set that is applied to an element; `unmatched` is how grave it is if a name fits nothing."""

    network: Network
    place: Place
    scope: Scope
    settings: Settings
    unmatched: Weight = Weight.NOTE

    def apply(self, values: ParameterSet, prefix: str, mapping: ParameterMapping | None) -> None:
        """Give the values to all that their names mean, through a mapping if there is one."""
        scope = Scope.of(values, values.file, self.scope.root, self.scope.findings)
        own = {f"{prefix}{parameter.name}": parameter for parameter in values.parameters}
        for name in sorted(repeated(parameter.name for parameter in values.parameters)):
            line = [parameter.line for parameter in values.parameters if parameter.name == name][1]
            scope.report(line, f"parameter {name!r} is there twice", Weight.NOTE)
        sources = {name: (parameter, _meaning(scope, parameter)) for name, parameter in own.items()}
        if mapping is None:
            for name, (parameter, meaning) in sources.items():
                self._set(parameter, meaning, Given(scope, parameter.line, f"parameter {parameter.name}"), name, None)
            return
        inside = Scope(mapping.file, self.scope.root, self.scope.findings)
        seen: dict[str, MappingEntry] = {}
        for entry in mapping.entries:
            if seen.setdefault(entry.target, entry) != entry:
                inside.report(entry.line, f"two parameters are mapped to {entry.target!r}", Weight.NOTE)
            if entry.source not in own:
                message = f"mapping of {entry.source!r}: no such parameter in {values.file}.{nearest(entry.source, own)}"
                inside.report(entry.line, message, Weight.NOTE)
            else:
                self._set(*sources[entry.source], Given(inside, entry.line, f"mapping of {entry.source!r}"), entry.target, entry)

    def _set(self, parameter: Parameter, source: Meaning, given: Given, name: str, entry: MappingEntry | None) -> None:
        """Give a value to all that a name means."""
        scope, found = given.scope, targets(self.network, self.place, name)
        if found == []:
            known = nearest(name, known_names(self.network, self.place))
            message = f"{scope.label(self.place.path)} has nothing called {name!r}, so the value has no effect.{known}"
            scope.report(given.line, f"{given.what}: {message}", self.unmatched)
        without_value = parameter.value is None and not parameter.items  # that there is no value
        for node in found or () if not without_value else ():
            label = scope.label(node.path, node.name)
            faults = self._faults(source, given, node, label, entry)
            named = Given(scope, given.line, f"{given.what} -> {label}", faults)
            try:
                self._pass_on(parameter, source, node, entry, named)
            except WireError as error:
                error.report(scope.findings)
            except ModelError as error:
                named.refuse(error.problems)

    def _faults(self, source: Meaning, given: Given, node: Node, label: str, entry: MappingEntry | None) -> tuple[Key, ...]:
        """Why the value does not fit the node."""
        kind, scope = _kind(self.network, node), given.scope
        if kind not in SETTABLE:
            return (scope.report_deviation(given.line, f"{given.what}: {label} is not a parameter; its kind is {kind}"),)
        target = self.network.taken(node)
        if target is None:
            return ()
        transformation = entry.transformation if entry else None
        if transformation is None:  # items count by their names, or by their numbers: the form that most readers understand
            by_number = source.kind == "integer" and target.kind == "enumeration"
            source = Meaning("enumeration") if by_number else Meaning(source.kind, source.unit)
        suppressed = entry is not None and entry.suppress_unit_conversion
        return tuple(misfits(scope, given.line, f"{given.what} -> {label}", source, target, transformation, suppressed))

    def _pass_on(self, parameter: Parameter, source: Meaning, node: Node, entry: MappingEntry | None, given: Given) -> None:
        """Convert the values, and pass them on to all variables that the node feeds. Raises ModelError."""
        suppress = entry is not None and entry.suppress_unit_conversion
        wire = Wire(Node("", parameter.name), node, given.scope, given.line, suppress=suppress, faults=given.faults)
        step, unit = self.network.conversion(wire, source.unit)
        values = [applied(step, value) for value in _scalars(parameter)]
        if entry is not None:
            items = self.network.items(node)
            values = [transformed(entry.transformation, value, source.items, items) for value in values]
        for path in self.network.paths_from(node):
            end = path[-1].target if path else node
            passed = [_passed(self.network, value, unit, path) for value in values]
            name = given.scope.label(end.path, end.name)
            own = given if not path else Given(given.scope, given.line, f"{given.what} -> {name}", given.faults)
            faults = own.faults or tuple(self._number_faults(passed, end, own))
            value = passed[0] if len(passed) == 1 else passed
            self.settings[end.path, end.name] = Setting(value, Given(own.scope, own.line, own.what, faults))

    def _number_faults(self, values: list[Scalar], node: Node, given: Given) -> Iterator[Key]:
        """Problems of values in the FMU's type and unit, and by the FMU's limits."""
        fmu, variable = self.network.fmus[node.path], self.network.variable(node)
        unit = fmu.unit_of(str(variable.name))
        unit = f" {unit}" if unit and unit != "1" else ""
        for value in values:
            try:
                number = typed_value(variable, value, fmu.name)
            except ModelError as error:
                for problem in error.problems:
                    message = f"{given.what}: {problem.removeprefix(f'{fmu.name}: ')}"
                    yield given.scope.report_deviation(given.line, message)
                return
            message = None
            if not math.isfinite(number):
                message = f"{number} is not a finite number"
            elif variable.min is not None and number < float(str(variable.min)):
                message = f"{number:g}{unit} is less than the FMU's minimum {variable.min}{unit}"
            elif variable.max is not None and number > float(str(variable.max)):
                message = f"{number:g}{unit} is more than the FMU's maximum {variable.max}{unit}"
            if message is not None:
                given.scope.report(given.line, f"{given.what} = {message}", Weight.NOTE)
                return


def _meaning(scope: Scope, parameter: Parameter) -> Meaning:
    what, line = f"parameter {parameter.name}", parameter.line
    unit: Unit | None = scope.unit(parameter.unit, what, line)
    return Meaning(kind_of_type(parameter.type), unit, scope.items(parameter.enumeration, what, line))


def _kind(network: Network, node: Node) -> str:
    """The causality of an FMU's variable, or the kind of a system's connector."""
    if network.is_variable(node):
        return str(network.variable(node).causality)
    connector = network.places[node.path].element.connector(node.name)
    assert connector is not None
    return connector.kind


def _scalars(parameter: Parameter) -> list[Scalar]:
    """The values of a parameter, one or those of an array. Raises ModelError."""
    texts = parameter.items
    if parameter.value is not None:
        several = parameter.dimensions and parameter.type not in ("String", "Enumeration", "Binary")
        texts = parameter.value.split() if several else [parameter.value]
    return [_scalar(parameter.type, text) for text in texts]


def _scalar(kind: str, text: str) -> Scalar:
    try:
        if kind in REAL_TYPES or kind in INTEGER_BITS:
            if "_" in text:
                raise ValueError
            return float(text) if kind in REAL_TYPES else int(text)
        return _FLAGS[text.strip()] if kind == "Boolean" else text
    except (ValueError, KeyError):
        raise ModelError([f"{text!r} is not a value of kind {kind_of_type(kind)}"]) from None


def _passed(network: Network, value: Scalar, unit: Unit | None, path: tuple[Wire, ...]) -> Scalar:
    """A value at the end of a path of wires. Raises WireError, or ModelError where it is the value that does not go."""
    for wire in path:
        step, unit = network.conversion(wire, unit)
        value = transformed(wire.transformation, applied(step, value), network.items(wire.source), network.items(wire.target))
    return value
