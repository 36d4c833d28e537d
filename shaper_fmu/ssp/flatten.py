"""From nested systems to one level: every element under its path ("sub.inner"), and the wires between connectors.

A system's connectors and the signals of its dictionaries are nodes like those of components: a wire ends at each of them and
others begin there, so that a path of wires leads from an output through any number of levels to an input. Components that are
other system structures (.ssd files of the same archive, "#id" of the same file, archives) are put in as the systems that they are.
"""

from __future__ import annotations

import copy
from collections.abc import Callable, Iterator, Mapping
from dataclasses import dataclass, field
from posixpath import dirname, join, normpath
from typing import TypeVar
from urllib.parse import unquote

from shaper_fmu.archives import read_archive
from shaper_fmu.errors import ArchiveError, ModelError
from shaper_fmu.ssp.document import (
    Component,
    DictionaryReference,
    DictionarySource,
    Enumeration,
    ParameterBinding,
    ParameterSet,
    SignalDictionary,
    SystemDescription,
    SystemElement,
    Unit,
)
from shaper_fmu.ssp.names import DESCRIPTION, DICTIONARY_TYPE, SSD_TYPE, SSP_TYPE
from shaper_fmu.ssp.read import read_description, read_dictionary

T = TypeVar("T")
_DEEPEST = 32
_MOST_ELEMENTS = 20_000


@dataclass(frozen=True)
class Scope:
    """A file, with the units and enumerations that count in it."""

    file: str
    units: Mapping[str, Unit] = field(default_factory=dict)
    enumerations: Mapping[str, Enumeration] = field(default_factory=dict)

    @staticmethod
    def of(file: SystemDescription | SignalDictionary | ParameterSet, name: str) -> Scope:
        """The scope of a description, a dictionary or a parameter set."""
        return Scope(name, {unit.name: unit for unit in file.units}, {e.name: e for e in file.enumerations})

    def at(self, line: int, words: str) -> str:
        """A problem in words, with its place."""
        return f"{self.file}, line {line}: {words}"


@dataclass(frozen=True)
class Place:
    """An element where it is: its path ("" for the root system), that of its system, and its level (the root's is 0).

    `source` is the path of a component's file in the archive, and `dictionary` the key of a reference's dictionary. `added`
    are the bindings that a system has from the component which it stands for, in another file.
    """

    path: str
    parent: str
    element: Component | SystemElement | DictionaryReference
    scope: Scope
    depth: int
    source: str = ""
    dictionary: str = ""
    added: tuple[ParameterBinding, ...] = ()
    added_scope: Scope | None = None

    def bindings(self) -> Iterator[tuple[ParameterBinding, Scope]]:
        """The parameter bindings, each with the file that it is in."""
        yield from ((binding, self.scope) for binding in self.element.bindings)
        yield from ((binding, self.added_scope or self.scope) for binding in self.added)


@dataclass
class Flat:
    """The elements of a description by path, the outer ones first, its dictionaries by key, and what is wrong.

    `files` are the archive's, and those of inner archives under their paths.
    """

    places: dict[str, Place] = field(default_factory=dict)
    dictionaries: dict[str, tuple[SignalDictionary, Scope]] = field(default_factory=dict)
    problems: list[str] = field(default_factory=list)
    files: dict[str, bytes] = field(default_factory=dict)
    _inside: dict[str, list[Place]] = field(default_factory=dict)

    def components(self) -> Iterator[Place]:
        """The places of components."""
        return (place for place in self.places.values() if isinstance(place.element, Component))

    def systems(self) -> Iterator[Place]:
        """The places of systems."""
        return (place for place in self.places.values() if isinstance(place.element, SystemElement))

    def inside(self, path: str) -> Iterator[Place]:
        """The places of a system's direct elements."""
        return iter(self._inside.get(path, []))

    def put(self, place: Place) -> None:
        """Add a place, after that of its system."""
        self.places[place.path] = place
        if place.path:
            self._inside.setdefault(place.parent, []).append(place)


def flatten(description: SystemDescription, files: Mapping[str, bytes]) -> Flat:
    """The elements of a description in an archive with these files. Problems are in the result, with file and line.

    Raises ModelError if the elements are too many.
    """
    flattener = _Flattener(files)
    flattener.system(description.system, "", "", Scope.of(description, description.file), {}, description, 0)
    return flattener.flat


def file_named(source: str, base: str = "") -> str:
    """The path in the archive that a URI names which is relative to the file `base`; as it is if it leads elsewhere."""
    path = unquote(source.partition("#")[0])
    if not path or path.startswith("/") or ":" in path:
        return path
    return normpath(join(dirname(base), path))


class _Flattener:
    """The walk through a description."""

    def __init__(self, files: Mapping[str, bytes]):
        self.files = dict(files)
        self.flat = Flat(files=self.files)

    def system(
        self,
        system: SystemElement,
        path: str,
        parent: str,
        scope: Scope,
        known: Mapping[str, str],
        file: SystemDescription,
        depth: int,
        added: tuple[tuple[ParameterBinding, ...], Scope] | None = None,
    ) -> None:
        """A system and what is in it; `known` are the keys of dictionaries by the names that references use here.

        `added` are bindings from another file, and that file.
        """
        bindings, where = added or ((), scope)
        self._put(Place(path, parent, system, scope, depth, added=bindings, added_scope=where))
        if depth > _DEEPEST:
            self._problem(scope, system.line, f"system {path!r} is nested deeper than {_DEEPEST} levels, or in itself")
            return
        known = {**known, **{source.name: self._dictionary(source, path, scope) for source in system.dictionaries}}
        for element in system.elements:
            inner = f"{path}.{element.name}" if path else element.name
            if isinstance(element, SystemElement):
                self.system(element, inner, path, scope, known, file, depth + 1)
            elif isinstance(element, DictionaryReference):
                self._reference(element, inner, path, scope, known, depth + 1)
            elif element.type in (SSD_TYPE, SSP_TYPE):
                self._substructure(element, inner, path, scope, known, file, depth)
            else:
                self._put(Place(inner, path, element, scope, depth + 1, file_named(element.source or "", scope.file)))

    def _put(self, place: Place) -> None:
        if place.path in self.flat.places:
            self._problem(place.scope, place.element.line, f"there is already an element {place.path!r}")
            return
        if len(self.flat.places) >= _MOST_ELEMENTS:  # structures that contain each other grow without end
            raise ModelError([place.scope.at(place.element.line, f"more than {_MOST_ELEMENTS} elements")])
        self.flat.put(place)

    def _reference(
        self, element: DictionaryReference, path: str, parent: str, scope: Scope, known: Mapping[str, str], depth: int
    ) -> None:
        if element.dictionary not in known:
            self._problem(scope, element.line, f"{path!r} stands for the signal dictionary {element.dictionary!r}, which is none")
            return
        self._put(Place(path, parent, element, scope, depth, dictionary=known[element.dictionary]))

    def _dictionary(self, source: DictionarySource, path: str, scope: Scope) -> str:
        key = f"{path}/{source.name}"
        dictionary, name = source.dictionary, scope.file
        if source.source is not None:
            name = file_named(source.source, scope.file)
            dictionary = None
            if source.type != DICTIONARY_TYPE:
                self._problem(
                    scope, source.line, f"signal dictionary {source.name!r} is of type {source.type}, which cannot be read"
                )
            elif name not in self.files:
                self._problem(scope, source.line, f"{source.source} is missing in the archive")
            else:
                dictionary = self._read(lambda: read_dictionary(self.files[name], name))
        if dictionary is not None:
            self.flat.dictionaries[key] = dictionary, Scope.of(dictionary, name)
        return key

    def _substructure(
        self,
        element: Component,
        path: str,
        parent: str,
        scope: Scope,
        known: Mapping[str, str],
        file: SystemDescription,
        depth: int,
    ) -> None:
        """A component that is another system structure: its system, with the component's name and its bindings as the last."""
        source, inner_scope = element.source or "", scope
        name, _, fragment = source.partition("#")
        if not name and element.type == SSD_TYPE:
            found = next((s for s in _systems(file.system) if s.id == fragment), None)
            if found is None:
                self._problem(scope, element.line, f"component {path!r}: no system of this file has the id {fragment!r}")
                return
        else:
            inner = file_named(name, scope.file)
            if element.type == SSP_TYPE and inner in self.files:
                inner = self._unpacked(inner, fragment)
            if inner not in self.files:
                self._problem(scope, element.line, f"component {path!r}: {source} is missing in the archive")
                return
            read = self._read(lambda: read_description(self.files[inner], inner))
            if read is None:
                return
            found, file, inner_scope = read.system, read, Scope.of(read, inner)
        system = copy.copy(found)
        system.name = element.name
        self.system(system, path, parent, inner_scope, known, file, depth + 1, (tuple(element.bindings), scope))

    def _unpacked(self, archive: str, variant: str) -> str:
        """Put the files of an inner archive under its path, and tell that of its description."""
        inner = self._read(lambda: read_archive(self.files[archive], archive)) or {}
        self.files.update({f"{archive}/{name}": content for name, content in inner.items()})
        return f"{archive}/{variant or DESCRIPTION}"

    def _read(self, read: Callable[[], T]) -> T | None:
        try:
            return read()
        except ModelError as error:
            self.flat.problems += error.problems
        except ArchiveError as error:
            self.flat.problems.append(str(error))
        return None

    def _problem(self, scope: Scope, line: int, words: str) -> None:
        self.flat.problems.append(scope.at(line, words))


def _systems(system: SystemElement) -> Iterator[SystemElement]:
    yield system
    for element in system.elements:
        if isinstance(element, SystemElement):
            yield from _systems(element)
