"""Checks of parameter bindings: sets and mappings that are missing, names that match nothing, values that do not fit."""

from __future__ import annotations

import math
from collections.abc import Iterator, Mapping
from dataclasses import dataclass

from fmpy.model_description import ModelVariable

from shaper_fmu.errors import ModelError, nearest
from shaper_fmu.master.fmu import Fmu
from shaper_fmu.master.variables import typed_value
from shaper_fmu.ssp.check_connections import check_values_fit
from shaper_fmu.ssp.check_scene import (
    Meaning,
    Scene,
    check_declarations,
    duplicates,
    find_variable,
    kind_of_type,
    unit_named,
    variable_meaning,
)
from shaper_fmu.ssp.check_structure import Place, label, places
from shaper_fmu.ssp.conversion import applied, transformed, unit_conversion
from shaper_fmu.ssp.document import (
    Component,
    Connector,
    Element,
    MappingEntry,
    MappingReference,
    Parameter,
    ParameterBinding,
    ParameterMapping,
    ParameterSet,
    SystemElement,
)
from shaper_fmu.ssp.names import MAPPING_TYPE, SET_TYPE
from shaper_fmu.ssp.read import read_mapping, read_parameter_set

SETTABLE = ("parameter", "structuralParameter", "input")


@dataclass(frozen=True)
class Target:
    """What a name stands for: a variable of an FMU, or a system's connector; and its full name."""

    name: str
    meaning: Meaning | None
    causality: str
    fmu: Fmu | None = None
    variable: ModelVariable | None = None


@dataclass
class Names:
    """What the names of parameters of an element can stand for."""

    scene: Scene
    fmus: Mapping[Place, Fmu]

    def find(self, place: Place, element: Element, name: str) -> list[Target] | None:
        """Every target of a name, of which there may be several; None if that cannot be told."""
        if isinstance(element, Component):
            return self._in_component(place, name)
        found: list[Target] | None = []
        connector = element.connector(name)
        if connector is not None:
            found.append(self._of_system(place, connector))
        for inner in element.elements if isinstance(element, SystemElement) else []:
            if name.startswith(f"{inner.name}."):
                targets = self.find((*place, inner.name), inner, name.removeprefix(f"{inner.name}."))
                found = None if targets is None or found is None else found + targets
        return found

    def _in_component(self, place: Place, name: str) -> list[Target] | None:
        fmu = self.fmus.get(place)
        if fmu is None:
            return None
        variable = find_variable(fmu, name)
        if variable is None:
            return []
        return [Target(label(place, name), variable_meaning(fmu, variable), str(variable.causality), fmu, variable)]

    def _of_system(self, place: Place, connector: Connector) -> Target:
        return Target(label(place, connector.name), self.scene.connector_meaning(connector, None), connector.kind)

    def all(self, place: Place, element: Element) -> Iterator[str]:
        """Names that can be set, for a hint."""
        if isinstance(element, Component):
            fmu = self.fmus.get(place)
            yield from (str(v.name) for v in fmu.variables.values() if v.causality in SETTABLE) if fmu else ()
            return
        yield from (connector.name for connector in element.connectors)
        for inner in element.elements if isinstance(element, SystemElement) else []:
            yield from (f"{inner.name}.{name}" for name in self.all((*place, inner.name), inner))


def check_parameters(scene: Scene, fmus: Mapping[Place, Fmu]) -> None:
    """Check every binding of every element."""
    names = Names(scene, fmus)
    for place, element in places(scene.description.system):
        for binding in element.bindings:
            _Binding(scene, names, place, element, binding).check()


def check_whole_set(scene: Scene, fmus: Mapping[Place, Fmu], path: str) -> None:
    """Check a set of the folder parameter_sets/, which is for the whole system and bound on demand."""
    binding = ParameterBinding(source=None)
    checked = _Binding(scene, Names(scene, fmus), (), scene.description.system, binding)
    found = scene.document(path, read_parameter_set)
    if isinstance(found, ParameterSet):
        checked.apply(found, path, None, "")


@dataclass
class _Binding:
    """One binding of one element."""

    scene: Scene
    names: Names
    place: Place
    element: Element
    binding: ParameterBinding

    def check(self) -> None:
        found = self._values()
        mapping = self._mapping(self.binding.mapping) if self.binding.mapping is not None else None
        if found is not None and (self.binding.mapping is None or mapping is not None):
            self.apply(*found, *(mapping or (None, "")))

    def _what(self, part: str) -> str:
        return f"{part} of {label(self.place)}"

    def _values(self) -> tuple[ParameterSet, str] | None:
        binding, what = self.binding, self._what("parameter binding")
        if binding.type != SET_TYPE:
            self.scene.tell(binding.line, f"{what} is of type {binding.type!r}, which is not read; the standard's is {SET_TYPE}")
            return None
        if (binding.source is None) == (binding.values is None):
            both = "both a source and values inline" if binding.source is not None else "neither a source nor values inline"
            self.scene.tell(binding.line, f"{what} has {both}")
        if binding.values is not None:
            return binding.values, self.scene.file
        found = self._file(binding.source, binding.source_base, binding.line, what)
        document = self.scene.document(found, read_parameter_set) if found is not None else None
        return (document, found) if isinstance(document, ParameterSet) and found is not None else None

    def _mapping(self, reference: MappingReference) -> tuple[ParameterMapping, str] | None:
        what = self._what("parameter mapping")
        if reference.type != MAPPING_TYPE:
            self.scene.tell(reference.line, f"{what} is of type {reference.type!r}, which is not read")
            return None
        if (reference.source is None) == (reference.mapping is None):
            both = "both a source and entries inline" if reference.source is not None else "neither a source nor entries inline"
            self.scene.tell(reference.line, f"{what} has {both}")
        if reference.mapping is not None:
            return reference.mapping, self.scene.file
        found = self._file(reference.source, reference.source_base, reference.line, what)
        document = self.scene.document(found, read_mapping) if found is not None else None
        return (document, found) if isinstance(document, ParameterMapping) and found is not None else None

    def _file(self, source: str | None, base: str, line: int, what: str) -> str | None:
        if source is None:
            return None
        component = self.element.source if isinstance(self.element, Component) else None
        if base == "component" and component is None:
            self.scene.tell(line, f"{what}: sourceBase is 'component', but {label(self.place)} is no component with a source")
            return None
        return self.scene.resource(source, line, what, (component or "") if base == "component" else "")

    def apply(self, values: ParameterSet, file: str, mapping: ParameterMapping | None, mapping_file: str) -> None:
        """Check a set against what it is bound to, through its mapping."""
        check_declarations(self.scene, values, file)
        own = {f"{self.binding.prefix}{parameter.name}": parameter for parameter in values.parameters}
        for name in sorted(duplicates(parameter.name for parameter in values.parameters)):
            line = [parameter.line for parameter in values.parameters if parameter.name == name][1]
            self.scene.tell(line, f"parameter {name!r} is there twice", file)
        for parameter in values.parameters:
            self._check_declared(values, parameter, file)
        if mapping is None:
            for name, parameter in own.items():
                self._set(values, parameter, file, name, None)
            return
        targets = [entry.target for entry in mapping.entries]
        for entry in mapping.entries:
            if targets.index(entry.target) != mapping.entries.index(entry):
                self.scene.tell(entry.line, f"two parameters are mapped to {entry.target!r}", mapping_file)
            elif entry.source not in own:
                self.scene.tell(
                    entry.line,
                    f"mapping of {entry.source!r}: no such parameter in {file}.{nearest(entry.source, own)}",
                    mapping_file,
                )
            else:
                self._set(values, own[entry.source], mapping_file, entry.target, entry)

    def _check_declared(self, values: ParameterSet, parameter: Parameter, file: str) -> None:
        if parameter.unit is not None and unit_named(parameter.unit, values.units) is None:
            known = nearest(parameter.unit, [unit.name for unit in values.units])
            self.scene.tell(
                parameter.line, f"parameter {parameter.name}: unit {parameter.unit!r} is not declared in Units.{known}", file
            )
        if parameter.enumeration is not None and _items(values, parameter) is None:
            words = f"parameter {parameter.name}: enumeration {parameter.enumeration!r} is not declared in Enumerations"
            self.scene.tell(parameter.line, words, file)

    def _set(self, values: ParameterSet, parameter: Parameter, file: str, name: str, entry: MappingEntry | None) -> None:
        line, what = (entry.line, f"mapping of {entry.source!r}") if entry else (parameter.line, f"parameter {parameter.name}")
        targets = self.names.find(self.place, self.element, name)
        if targets is None:
            return
        if not targets:
            known = nearest(name, self.names.all(self.place, self.element))
            self.scene.tell(
                line, f"{what}: {label(self.place)} has nothing called {name!r}, so the value has no effect.{known}", file
            )
        for target in targets:
            if target.causality not in SETTABLE:
                self.scene.tell(line, f"{what}: {target.name} is no parameter but of kind {target.causality}", file)
            else:
                self._check_value(values, parameter, file, line, what, target, entry)

    def _check_value(
        self,
        values: ParameterSet,
        parameter: Parameter,
        file: str,
        line: int,
        what: str,
        target: Target,
        entry: MappingEntry | None,
    ) -> None:
        if target.meaning is None:
            return
        source = Meaning(
            kind_of_type(parameter.type), parameter.unit, unit_named(parameter.unit, values.units), _items(values, parameter)
        )
        before = len(self.scene.told)
        transformation = entry.transformation if entry else None
        as_it_is = entry.suppress_unit_conversion if entry else False
        if source.kind == "integer" and target.meaning.kind == "enumeration" and transformation is None:
            source = Meaning("enumeration")  # by its number: the form that readers without enumerations understand
        named = Meaning(source.kind, source.unit, source.definition)  # items count by their names alone
        to = f"{what} -> {target.name}"
        check_values_fit(self.scene, to, line, source if transformation else named, target.meaning, transformation, as_it_is, file)
        if len(self.scene.told) > before or target.variable is None or target.fmu is None:
            return
        for text in parameter.items or [parameter.value or ""]:
            self._check_number(parameter, text, source, target, entry, (file, line, to))

    def _check_number(
        self, parameter: Parameter, text: str, source: Meaning, target: Target, entry: MappingEntry | None, at: tuple[str, int, str]
    ) -> None:
        """The value itself, in the FMU's type and unit, between the FMU's limits."""
        file, line, what = at
        variable, fmu, meaning = target.variable, target.fmu, target.meaning
        assert variable is not None
        assert fmu is not None
        assert meaning is not None
        if meaning.kind in ("string", "binary", "clock") or (meaning.kind == "real" and len(text.split()) > 1):
            return
        try:
            value = text if source.kind == "enumeration" else _plain(source.kind, text)
            if not (entry and entry.suppress_unit_conversion):
                value = applied(unit_conversion(source.definition, meaning.definition), value)
            if entry:
                value = transformed(entry.transformation, value, source.items, meaning.items)
            number = typed_value(variable, value, fmu.name)
        except ModelError as error:
            for problem in error.problems:
                self.scene.tell(line, f"{what}: {problem.removeprefix(f'{fmu.name}: ')}", file)
            return
        unit = f" {meaning.unit}" if meaning.unit and meaning.unit != "1" else ""
        if not math.isfinite(number):
            self.scene.tell(line, f"{what} = {number} is no finite number", file)
        elif variable.min is not None and number < float(str(variable.min)):
            self.scene.tell(line, f"{what} = {number:g}{unit} is less than the FMU's minimum {variable.min}{unit}", file)
        elif variable.max is not None and number > float(str(variable.max)):
            self.scene.tell(line, f"{what} = {number:g}{unit} is more than the FMU's maximum {variable.max}{unit}", file)


def _plain(kind: str, text: str) -> float | int | bool:
    """A value of a set by its kind. Raises ModelError."""
    try:
        if kind == "boolean":
            return {"true": True, "1": True, "false": False, "0": False}[text.strip()]
        return int(text) if kind == "integer" else float(text)
    except (KeyError, ValueError):
        raise ModelError([f"{text!r} is no value of kind {kind}"]) from None


def _items(values: ParameterSet, parameter: Parameter) -> Mapping[str, int] | None:
    return next((e.items for e in values.enumerations if e.name == parameter.enumeration), None)
