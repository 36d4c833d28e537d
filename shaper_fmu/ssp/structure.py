"""Flattens nested systems: every element of a description under its path ("sub.inner"), with its FMU or dictionary.

Components that are other system structures (.ssd files of the same archive, "#id" of the same file, archives) are put in as the
systems that they are. Faults in names, sources, connectors and dictionaries are reported on the way.
"""

from __future__ import annotations

import copy
from collections.abc import Iterator, Mapping
from dataclasses import dataclass, field, replace

from shaper_fmu.errors import ShaperFmuError, nearest
from shaper_fmu.master.fmu import Fmu
from shaper_fmu.ssp.document import (
    Component,
    DictionaryReference,
    DictionarySource,
    Element,
    ParameterBinding,
    SignalDictionary,
    SystemDescription,
    SystemElement,
)
from shaper_fmu.ssp.files import Files
from shaper_fmu.ssp.findings import Key, Weight
from shaper_fmu.ssp.meaning import Scope, repeated
from shaper_fmu.ssp.names import DESCRIPTION, DICTIONARY_TYPE, SSD_TYPE, SSP_TYPE
from shaper_fmu.ssp.read import read_description, read_dictionary

_DEEPEST = 32
_MOST_ELEMENTS = 20_000


@dataclass(frozen=True)
class Place:
    """An element with its path ("" for the root system), that of its system, and its level (the root's is 0).

    `component` is what the element stands for if that is the system of another structure, `outer` the file of the component (its
    bindings are the last ones of the system). `dictionary` is the key of a reference's dictionary.
    """

    path: str
    parent: str
    element: Component | SystemElement | DictionaryReference
    scope: Scope
    depth: int
    dictionary: str = ""
    component: Component | None = None
    outer: Scope | None = None

    def bindings(self) -> Iterator[tuple[ParameterBinding, Scope]]:
        """The parameter bindings, each with the file that it is in."""
        yield from ((binding, self.scope) for binding in self.element.bindings)
        if self.component is not None:
            yield from ((binding, self.outer or self.scope) for binding in self.component.bindings)


@dataclass
class Structure:
    """The elements of a description by path, the outer ones first, its FMUs by path, and its dictionaries by key."""

    files: Files
    places: dict[str, Place] = field(default_factory=dict)
    fmus: dict[str, Fmu] = field(default_factory=dict)
    dictionaries: dict[str, tuple[SignalDictionary, Scope]] = field(default_factory=dict)
    signal_faults: dict[tuple[str, str], list[Key]] = field(default_factory=dict)
    """Path and connector of a dictionary's reference -> why its values are none of the signal."""
    _inside: dict[str, list[Place]] = field(default_factory=dict)

    def systems(self) -> Iterator[Place]:
        """The places of systems."""
        return (place for place in self.places.values() if isinstance(place.element, SystemElement))

    def inside(self, path: str) -> list[Place]:
        """The places of a system's direct elements."""
        return self._inside.get(path, [])

    def put(self, place: Place) -> None:
        """Add a place, after that of its system."""
        self.places[place.path] = place
        if place.path:
            self._inside.setdefault(place.parent, []).append(place)


class TooManyError(ShaperFmuError):
    """Structures that contain each other grow without end."""


def elements_of(description: SystemDescription, files: Files) -> Structure:
    """The elements only; none if they are too many."""
    structure = Structure(files)
    scope = Scope.of(description, description.file, "", files.findings)
    try:
        _Walk(structure, description).system(Place("", "", description.system, scope, 0), {})
    except TooManyError:
        return Structure(files, {"": Place("", "", description.system, scope, 0)})
    return structure


@dataclass
class _Walk:
    """The walk through a description's file."""

    structure: Structure
    file: SystemDescription

    def system(self, place: Place, known: Mapping[str, str]) -> None:
        """A system and its contents; `known` are the keys of dictionaries by the names that references use here."""
        system, scope = place.element, place.scope
        assert isinstance(system, SystemElement)
        self._put(place)
        if place.depth > _DEEPEST:
            message = f"system {system.name!r} is nested deeper than {_DEEPEST} levels, or in itself"
            (place.outer or scope).report((place.component or system).line, message)
            return
        self._check_names(place, system)
        known = {**known, **{source.name: self._dictionary(source, place) for source in system.dictionaries}}
        for element in system.elements:
            inner = Place(self._path(place.path, element), place.path, element, scope, place.depth + 1)
            if isinstance(element, SystemElement):
                self.system(inner, known)
            elif isinstance(element, DictionaryReference):
                self._reference(inner, element, known)
            elif element.source is not None and element.type in (SSD_TYPE, SSP_TYPE):
                self._substructure(inner, element, known)
            else:
                self._put(inner)

    def _put(self, place: Place) -> None:
        if len(self.structure.places) >= _MOST_ELEMENTS:
            place.scope.report(place.element.line, f"more than {_MOST_ELEMENTS} elements")
            raise TooManyError
        self.structure.put(place)

    def _path(self, parent: str, element: Element) -> str:
        """The path of an element; if its name is empty or taken, that is reported, and the path contains its line."""
        path = f"{parent}.{element.name}" if parent else element.name
        if not element.name or path in self.structure.places:
            path += f"(line {element.line})"
        while path in self.structure.places:
            path += "*"
        return path

    def _check_names(self, place: Place, system: SystemElement) -> None:
        seen: dict[str, int] = {}
        for element in system.elements:
            if not element.name:
                place.scope.report(element.line, f"an element of {place.scope.label(place.path)} has an empty name")
            elif element.name in seen:
                name = place.scope.label(place.path, element.name)
                place.scope.report(element.line, f"element {name!r} is there twice, first in line {seen[element.name]}")
            seen.setdefault(element.name, element.line)
        for name in sorted(repeated(dictionary.name for dictionary in system.dictionaries)):
            line = [dictionary.line for dictionary in system.dictionaries if dictionary.name == name][1]
            place.scope.report(line, f"signal dictionary {name!r} is there twice", Weight.NOTE)

    def _reference(self, place: Place, element: DictionaryReference, known: Mapping[str, str]) -> None:
        if element.dictionary not in known:
            message = f"{place.scope.label(place.path)} stands for the signal dictionary {element.dictionary!r}, which is none"
            place.scope.report(element.line, f"{message}.{nearest(element.dictionary, known)}")
        self._put(replace(place, dictionary=known.get(element.dictionary, f"/{element.dictionary}")))

    def _dictionary(self, source: DictionarySource, place: Place) -> str:
        """Read a dictionary; returns its key."""
        key, scope, what = f"{place.path}/{source.name}", place.scope, f"signal dictionary {source.name!r}"
        own = source.source, source.dictionary
        if source.type != DICTIONARY_TYPE:
            weight = Weight.DEVIATION if source.source is None else Weight.LOAD
            scope.report(source.line, f"{what} is of type {source.type!r}, which is not read", weight)
            own = None, source.dictionary if source.source is None else SignalDictionary()
        dictionary = self.structure.files.document(scope, source.line, what, *own, "entries", read_dictionary, Weight.NOTE)
        if dictionary is not None:
            own = Scope.of(dictionary, dictionary.file, scope.root, scope.findings)
            for entry in dictionary.entries:
                own.meaning(entry.type, f"signal {entry.name}", entry.line)
            for name in sorted(repeated(entry.name for entry in dictionary.entries)):
                line = [entry.line for entry in dictionary.entries if entry.name == name][1]
                own.report(line, f"signal {name!r} is there twice", Weight.NOTE)
            self.structure.dictionaries[key] = dictionary, own
        return key

    def _substructure(self, place: Place, component: Component, known: Mapping[str, str]) -> None:
        """A component that is another system structure: its system, with the component's name."""
        scope, found = place.scope, self._described(place, component)
        if found is None:
            self._put(place)
            return
        file, system, inner = found
        system = copy.copy(system)
        system.name = component.name
        _Walk(self.structure, file).system(replace(place, element=system, scope=inner, component=component, outer=scope), known)

    def _described(self, place: Place, component: Component) -> tuple[SystemDescription, SystemElement, Scope] | None:
        """The description that a component refers to, and its system; None, with a finding, if there is none."""
        scope, source, files = place.scope, component.source or "", self.structure.files
        name, _, fragment = source.partition("#")

        def report(message: str) -> None:
            scope.report(component.line, f"component {component.name!r}: {message}")

        if not name and component.type == SSD_TYPE:
            inner = Scope(scope.file, place.path, scope.findings, scope.units, scope.enumerations)
            system = next((system for system in _systems(self.file.system) if system.id == fragment), None)
            if system is None:
                report(f"no system of this file has the id {fragment!r}")
            return (self.file, system, inner) if system is not None else None
        path = files.find(name, scope.file, report)
        if path is not None and component.type == SSP_TYPE:
            archive, path = path, f"{path}/{fragment or DESCRIPTION}"
            if path not in files.content:
                files.unpack(archive)
            if path not in files.content:
                known = [name.removeprefix(f"{archive}/") for name in files.content if name.startswith(f"{archive}/")]
                report(f"{archive} has no {fragment or DESCRIPTION}.{nearest(fragment, known) if fragment else ''}")
                return None
        file = files.read(path, read_description) if path is not None else None
        return (file, file.system, Scope.of(file, file.file, place.path, scope.findings)) if file is not None else None


def _systems(system: SystemElement) -> Iterator[SystemElement]:
    yield system
    for element in system.elements:
        if isinstance(element, SystemElement):
            yield from _systems(element)
