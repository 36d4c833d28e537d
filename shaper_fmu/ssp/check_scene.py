"""What all checks of one description share: the archive, the FMUs in it, what its units and types mean, and the findings."""

from __future__ import annotations

import posixpath
import re
from collections.abc import Callable, Iterable, Mapping
from dataclasses import dataclass, field
from pathlib import Path, PurePosixPath
from urllib.parse import unquote

import fmpy
from fmpy.model_description import ModelVariable

from shaper_fmu.errors import ArchiveError, ModelError, nearest
from shaper_fmu.master.fmu import Fmu, fmu_from_bytes
from shaper_fmu.master.variables import kind_of
from shaper_fmu.ssp.document import Component, Connector, ParameterSet, SignalDictionary, SystemDescription
from shaper_fmu.ssp.document_parts import DataType, Enumeration, Unit
from shaper_fmu.ssp.names import INTEGER_BITS, REAL_TYPES
from shaper_fmu.ssp.read_parts import PartlyRead
from shaper_fmu.ssp.schemas import schema_problems

_SCHEME = re.compile(r"([A-Za-z][A-Za-z0-9+.-]*):")
_BASE = ("kg", "m", "s", "A", "K", "mol", "cd", "rad")


@dataclass(frozen=True)
class Meaning:
    """What a value is: its kind ("real", "integer", ...), unit (and its definition, None if unknown) and enumeration's items."""

    kind: str
    unit: str | None = None
    definition: Unit | None = None
    items: Mapping[str, int] | None = None


@dataclass
class Scene:
    """One description with all it needs; `told` are findings as (file, line, words), `lost` the lines that could not be read."""

    files: Mapping[str, bytes]
    description: SystemDescription
    file: str
    told: list[tuple[str, int, str]] = field(default_factory=list)
    lost: set[tuple[str, int]] = field(default_factory=set)
    _read: dict[str, object] = field(default_factory=dict)

    def tell(self, line: int, words: str, file: str = "") -> None:
        """Note a finding, unless meaning is lost in its line, which is told already."""
        if (file or self.file, line) not in self.lost:
            self.told.append((file or self.file, line, words))

    def resource(self, source: str, line: int, what: str, base: str = "") -> str | None:
        """The archive's file that a source names, relative to the description or the file `base`; None if that is told as wrong."""
        path = unquote(source.partition("#")[0])
        if _SCHEME.match(source) or source.startswith("//"):
            self.tell(line, f"{what}: source {source!r} lies outside the archive; only paths in the archive are read")
            return None
        found = posixpath.normpath(posixpath.join(posixpath.dirname(base or self.file), path))
        if path.startswith("/") or found.startswith("..") or "\\" in path:
            self.tell(line, f"{what}: source {source!r} leads out of the archive; a path relative to the description is needed")
        elif not path or found not in self.files:
            self.tell(line, f"{what}: {source!r} is missing in the archive.{nearest(found, self.files) if path else ''}")
        else:
            return found
        return None

    def fmu(self, component: Component) -> Fmu | None:
        """The component's FMU; None if it has none that can be used, which is told once for each component."""
        what = f"component {component.name!r}"
        if component.source is None or component.name == "":
            return None
        path = self.resource(component.source, component.line, what)
        if path is None:
            return None
        try:
            return fmu_from_bytes(PurePosixPath(path).name, self.files[path])
        except ModelError as error:
            for problem in error.problems:
                self.tell(component.line, f"{what}: {problem}")
        except ArchiveError as error:
            self.tell(component.line, f"{what}: {' '.join(str(error).split())}")
        return None

    def document(self, path: str, read: Callable[[bytes, str], object]) -> object | None:
        """A parameter set, mapping or dictionary of the archive, validated; None if it cannot be read, which is told once."""
        if path not in self._read:
            found = read_validated(self.files[path], path, read)
            self._read[path] = found.document
            self.told += found.told
            self.lost |= found.lost
        return self._read[path]

    # Meanings

    def meaning(self, type_: DataType, holder: SystemDescription | SignalDictionary | None = None) -> Meaning:
        """What a type means by the units and enumerations of the description, or of the file that holds it."""
        holder = holder or self.description
        items = next((e.items for e in holder.enumerations if e.name == type_.enumeration), None)
        return Meaning(kind_of_type(type_.name), type_.unit, unit_named(type_.unit, holder.units), items)

    def connector_meaning(self, connector: Connector, variable: tuple[Fmu, ModelVariable] | None) -> Meaning | None:
        """What goes through a connector: by its own type, and what that leaves open by the FMU's variable."""
        own = self.meaning(connector.type) if connector.type else None
        theirs = variable_meaning(*variable) if variable else None
        if own is None or theirs is None or own.kind != theirs.kind:
            return own or theirs
        unit, definition = (own.unit, own.definition) if own.unit else (theirs.unit, theirs.definition)
        return Meaning(own.kind, unit, definition, own.items or theirs.items)


@dataclass(frozen=True)
class Validated:
    """What could be read of a file, None if nothing; findings as (file, line, words); and the lines of which meaning is lost."""

    document: object | None
    told: list[tuple[str, int, str]]
    lost: set[tuple[str, int]] = field(default_factory=set)


def read_validated(content: bytes, path: str, read: Callable[[bytes, str], object]) -> Validated:
    """Read a file. Its findings are the schema's, and the reader's at lines of which the schema says nothing."""
    try:
        told = [split_problem(problem, path) for problem in schema_problems(content, path)]
    except ArchiveError as error:
        return Validated(None, [(path, 0, str(error).removeprefix(f"{path}: "))])
    try:
        return Validated(read(content, path), told)
    except ModelError as error:
        lines = {line for _, line, _ in told}
        found = [split_problem(problem, path) for problem in error.problems]
        rest = error.rest if isinstance(error, PartlyRead) else None
        own = [(file, line, words) for file, line, words in found if line not in lines]
        return Validated(rest, told + own, {(file, line) for file, line, _ in found})


def split_problem(problem: str, file: str) -> tuple[str, int, str]:
    """Line and words of "file, line N: words"."""
    match = re.match(r"(.*?), line (\d+): (.*)", problem, re.DOTALL)
    return (match[1], int(match[2]), match[3]) if match else (file, 0, problem.removeprefix(f"{file}: "))


def kind_of_type(name: str) -> str:
    """The kind of an SSP type: real, integer, boolean, enumeration, string, binary or clock."""
    return "real" if name in REAL_TYPES else "integer" if name in INTEGER_BITS else name.lower()


def variable_meaning(fmu: Fmu, variable: ModelVariable) -> Meaning:
    """What an FMU's variable is, in the words of SSP."""
    unit = fmu.unit_of(variable.name)
    base = getattr(fmu.unit_definition(unit), "baseUnit", None) if unit else None
    exponents = {symbol: int(getattr(base, symbol) or 0) for symbol in _BASE} if base is not None else {}
    known = {k: v for k, v in exponents.items() if v}
    definition = Unit(unit or "", known, float(base.factor), float(base.offset)) if base is not None else None
    declared = variable.declaredType
    items = {str(i.name): int(str(i.value)) for i in declared.items} if variable.type == "Enumeration" and declared else None
    return Meaning(kind_of(variable), unit, definition, items)


def unit_named(name: str | None, units: Iterable[Unit]) -> Unit | None:
    """The definition of a unit, or None."""
    return next((unit for unit in units if unit.name == name), None)


def do_not_convert(one: Meaning, other: Meaning) -> bool:
    """Whether both units are known and of different kinds."""
    known = one.definition is not None and other.definition is not None
    return known and one.definition.exponents != other.definition.exponents  # pyright: ignore[reportOptionalMemberAccess]


def find_variable(fmu: Fmu, name: str) -> ModelVariable | None:
    """The variable of this name; of an array, its first element."""
    return fmu.variables.get(fmu.elements_of(name)[0])


def binary_problem(fmu: Fmu) -> str | None:
    """What is wrong with the FMU's library for this machine."""
    folder, name = (fmpy.platform_tuple if fmu.version == 3 else fmpy.platform), fmu.co_simulation.modelIdentifier
    if (fmu.folder / "binaries" / folder / f"{name}{fmpy.sharedLibraryExtension}").is_file():
        return None
    others = sorted({Path(path).parent.name for path in (fmu.folder / "binaries").glob("*/*")})
    return f"{fmu.name} has no library for this machine ({folder}); it has {', '.join(others) or 'none at all'}"


def duplicates(names: Iterable[str]) -> set[str]:
    """Names that are there more than once."""
    seen: set[str] = set()
    return {name for name in names if name in seen or seen.add(name)}


Holder = SystemDescription | ParameterSet | SignalDictionary


def check_declarations(scene: Scene, holder: Holder, file: str) -> None:
    """Units and enumerations declared twice, and items of one name or value."""
    for what, found in (("unit", holder.units), ("enumeration", holder.enumerations)):
        twice = duplicates(item.name for item in found)
        for item in {item.name: item for item in found if item.name in twice}.values():
            scene.tell(item.line, f"{what} {item.name!r} is declared twice", file)
    for enumeration in holder.enumerations:
        _check_items(scene, enumeration, file)


def _check_items(scene: Scene, enumeration: Enumeration, file: str) -> None:
    twice = duplicates(str(value) for value in enumeration.items.values())
    for value in sorted(twice):
        names = " and ".join(name for name, own in enumeration.items.items() if str(own) == value)
        scene.tell(enumeration.line, f"enumeration {enumeration.name!r}: items {names} have the same value {value}", file)
