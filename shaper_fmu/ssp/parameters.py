"""Parameter bindings: which value each variable of each component gets, and from where.

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

from collections.abc import Iterator, Mapping
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any

from shaper_fmu.errors import ArchiveError, ModelError, nearest
from shaper_fmu.ssp.conversion import Scalar, applied, transformed
from shaper_fmu.ssp.document import (
    Component,
    MappingEntry,
    Parameter,
    ParameterBinding,
    ParameterMapping,
    ParameterSet,
    SystemElement,
    Unit,
)
from shaper_fmu.ssp.flatten import Place, Scope, file_named
from shaper_fmu.ssp.names import INTEGER_BITS, MAPPING_TYPE, REAL_TYPES, SET_TYPE
from shaper_fmu.ssp.network import Network, Node, Wire, at, undefined_unit
from shaper_fmu.ssp.read import read_mapping, read_parameter_set

_FLAGS = {"true": True, "1": True, "false": False, "0": False}


@dataclass(frozen=True)
class Setting:
    """A value for a variable of an FMU, or one for each element of an array, and where it comes from."""

    value: Any
    file: str
    line: int


@dataclass
class Settings:
    """Values by component's path and variable's name; what is wrong, and what was ignored."""

    values: dict[tuple[str, str], Setting] = field(default_factory=dict)
    problems: list[str] = field(default_factory=list)
    notes: list[str] = field(default_factory=list)


@dataclass(frozen=True)
class _Given:
    """A parameter of a binding: the name to look for, its value and unit, and what its mapping does."""

    name: str
    parameter: Parameter
    scope: Scope
    entry: MappingEntry | None = None

    @property
    def unit(self) -> Unit | None:
        name = self.parameter.unit
        return None if name is None else self.scope.units.get(name) or undefined_unit(name)


def collect_settings(network: Network, files: Mapping[str, bytes]) -> Settings:
    """The values that the bindings of a system give. Problems and notes are in the result, with file and line."""
    settings = Settings()
    for place in sorted(
        network.flat.places.values(), key=lambda place: place.depth, reverse=True
    ):  # the outer ones last: they count more
        for binding, scope in place.bindings():
            try:
                for given in _given(network, place, binding, scope, files):
                    _apply(network, place, given, settings)
            except ModelError as error:
                settings.problems += error.problems
            except ArchiveError as error:
                settings.problems.append(str(error))
    return settings


def settings_of(network: Network, values: ParameterSet) -> Settings:
    """The values of a set for the whole system, as a last binding of its root would give them."""
    settings = Settings()
    for given in _unmapped(values, ""):
        _apply(network, network.flat.places[""], given, settings)
    return settings


def targets(network: Network, place: Place, name: str) -> Iterator[Node]:
    """The connectors and variables that a name means at a place."""
    if isinstance(place.element, Component):
        fmu = network.fmus.get(place.path)
        if fmu is not None and fmu.elements_of(name)[0] in fmu.variables:
            yield Node(place.path, name)
    elif isinstance(place.element, SystemElement):
        if place.element.connector(name) is not None:
            yield Node(place.path, name)
        for inner in network.flat.inside(place.path):
            if name.startswith(f"{inner.element.name}."):
                yield from targets(network, inner, name.removeprefix(f"{inner.element.name}."))


def known_names(network: Network, place: Place) -> Iterator[str]:
    """The names that a parameter can have at a place."""
    if isinstance(place.element, Component):
        fmu = network.fmus.get(place.path)
        yield from fmu.variables if fmu is not None else ()
    elif isinstance(place.element, SystemElement):
        yield from (connector.name for connector in place.element.connectors)
        for inner in network.flat.inside(place.path):
            yield from (f"{inner.element.name}.{name}" for name in known_names(network, inner))


def _given(network: Network, place: Place, binding: ParameterBinding, scope: Scope, files: Mapping[str, bytes]) -> Iterator[_Given]:
    """The parameters that a binding of a file gives, with its prefix and its mapping."""

    def problem(words: str) -> ModelError:
        return ModelError([scope.at(binding.line, words)])

    def content(source: str, base: str) -> tuple[str, bytes]:
        """The name and the content of a file of the archive, or of the FMU."""
        if base == "component":
            name = file_named(source)
            inside = (fmu.folder / name).resolve() if fmu is not None else Path()
            if fmu is None or not inside.is_relative_to(fmu.folder) or not inside.is_file():
                raise problem(f"{source} is missing in the component")
            return name, inside.read_bytes()
        name = file_named(source, scope.file)
        if name not in files:
            raise problem(f"{source} is missing in the archive")
        return name, files[name]

    if binding.type != SET_TYPE:
        raise problem(f"a parameter binding of type {binding.type} cannot be read")
    fmu = network.fmus.get(place.path)
    values = binding.values
    if binding.source is not None:
        name, text = content(binding.source, binding.source_base)
        values = read_parameter_set(text, name)
    if values is None:
        raise problem("the parameter binding has neither a source nor values")
    if binding.mapping is None:
        return _unmapped(values, binding.prefix)
    mapping = binding.mapping.mapping
    if binding.mapping.type != MAPPING_TYPE:
        raise problem(f"a parameter mapping of type {binding.mapping.type} cannot be read")
    if binding.mapping.source is not None:
        name, text = content(binding.mapping.source, binding.mapping.source_base)
        mapping = read_mapping(text, name)
    if mapping is None:
        raise problem("the parameter mapping has neither a source nor entries")
    return _mapped(values, binding.prefix, mapping)


def _unmapped(values: ParameterSet, prefix: str) -> Iterator[_Given]:
    scope = Scope.of(values, values.file)
    for parameter in values.parameters:
        yield _Given(prefix + parameter.name, parameter, scope)


def _mapped(values: ParameterSet, prefix: str, mapping: ParameterMapping) -> Iterator[_Given]:
    known = {given.name: given for given in _unmapped(values, prefix)}
    for entry in mapping.entries:
        if entry.source in known:
            given = known[entry.source]
            yield _Given(entry.target, given.parameter, given.scope, entry)


def _scalars(parameter: Parameter) -> list[Scalar]:
    """The values of a parameter, one or those of an array. Raises ModelError."""
    texts = parameter.items
    if parameter.value is not None:
        several = parameter.dimensions and parameter.type not in ("String", "Enumeration", "Binary")
        texts = parameter.value.split() if several else [parameter.value]
    try:
        return [_scalar(parameter.type, text) for text in texts]
    except (ValueError, KeyError):
        raise ModelError([f"{parameter.name} = {parameter.value!r} is not of type {parameter.type}"]) from None


def _scalar(kind: str, text: str) -> Scalar:
    if kind in REAL_TYPES or kind in INTEGER_BITS:
        if "_" in text:
            raise ValueError
        return float(text) if kind in REAL_TYPES else int(text)
    return _FLAGS[text.strip()] if kind == "Boolean" else text


def _apply(network: Network, place: Place, given: _Given, settings: Settings) -> None:
    """Give a value to all that its name means; a note if that is nothing."""
    line, here = given.parameter.line, f" of {place.path}" if place.path else ""
    found = list(targets(network, place, given.name))
    if not found:
        words = f"no variable{here} is called {given.name!r}.{nearest(given.name, known_names(network, place))}"
        settings.notes.append(given.scope.at(line, f"{words} The value is ignored"))
    for node in found:
        try:
            values, unit = _arrived(network, node, given)
            for path in network.paths_from(node):
                end = path[-1].target if path else node
                value = values[0] if len(values) == 1 else values
                if path:
                    passed = [_passed(network, v, unit, path) for v in values]
                    value = passed[0] if len(passed) == 1 else passed
                settings.values[end.path, end.name] = Setting(value, given.scope.file, line)
        except ModelError as error:
            settings.problems += [given.scope.at(line, problem) for problem in error.problems]


def _arrived(network: Network, node: Node, given: _Given) -> tuple[list[Scalar], Unit | None]:
    """The values in the unit of the first node, transformed as the mapping says; and that unit. Raises ModelError."""
    values, entry = _scalars(given.parameter), given.entry
    wire = Wire(Node("", given.name), node, given.scope, suppress=entry is not None and entry.suppress_unit_conversion)
    target = network.unit(node)
    try:
        step, unit = network.conversion(wire, given.unit)
    except ModelError:
        own = "the FMU's" if network.is_variable(node) else "its"
        own = f"{own} unit is {target.name if target else 'none'}"
        raise ModelError([f"{node} is given in {given.parameter.unit}, but {own}"]) from None
    if entry is None:
        return [applied(step, value) for value in values], unit
    names = (_own_items(given), network.items(node))
    return [transformed(entry.transformation, applied(step, value), *names) for value in values], unit


def _own_items(given: _Given) -> Mapping[str, int] | None:
    found = given.scope.enumerations.get(given.parameter.enumeration or "")
    return found.items if found is not None else None


def _passed(network: Network, value: Scalar, unit: Unit | None, path: tuple[Wire, ...]) -> Scalar:
    """A value at the end of a path of wires. Raises ModelError."""
    for wire in path:
        step, unit = network.conversion(wire, unit)
        try:
            value = transformed(wire.transformation, applied(step, value), network.items(wire.source), network.items(wire.target))
        except ModelError as error:
            raise ModelError([at(wire, problem) for problem in error.problems]) from None
    return value
