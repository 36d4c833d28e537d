"""The meaning of a value (kind, unit and items), from the declarations of an SSP file or of an FMU."""

from __future__ import annotations

from collections.abc import Iterable, Iterator, Mapping
from dataclasses import dataclass, field

from shaper_fmu.errors import nearest
from shaper_fmu.master.fmu import Fmu
from shaper_fmu.master.variables import items_of, kind_of
from shaper_fmu.ssp.document import ParameterSet, SignalDictionary, SystemDescription
from shaper_fmu.ssp.document_parts import (
    DataType,
    Enumeration,
    LinearTransformation,
    MappingTransformation,
    Transformation,
    Unit,
)
from shaper_fmu.ssp.findings import Findings, Key, Weight
from shaper_fmu.ssp.names import INTEGER_BITS, REAL_TYPES
from shaper_fmu.units import BASE

_NUMBERS = (("real", "real"), ("integer", "integer"), ("integer", "real"))
Holder = SystemDescription | ParameterSet | SignalDictionary


@dataclass
class UnknownUnit(Unit):
    """A unit of which only the name is known: a base unit of its own, or the base unit of this name.

    `reported` are the findings on it: none if it is an FMU that does not define it.
    """

    reported: tuple[Key, ...] = ()


@dataclass(frozen=True)
class Meaning:
    """Kind ("real", "integer", ...), unit and enumeration items of a value; None if they are not declared."""

    kind: str
    unit: Unit | None = None
    items: Mapping[str, int] | None = None


@dataclass(frozen=True)
class Scope:
    """A file with its units and enumerations; messages name elements from its root system `root` on."""

    file: str
    root: str
    findings: Findings = field(repr=False)
    units: Mapping[str, Unit] = field(default_factory=dict)
    enumerations: Mapping[str, Enumeration] = field(default_factory=dict)

    @staticmethod
    def of(holder: Holder, file: str, root: str, findings: Findings) -> Scope:
        """The scope of a description, a dictionary or a parameter set; double declarations are reported."""
        scope = Scope(file, root, findings, {u.name: u for u in holder.units}, {e.name: e for e in holder.enumerations})
        for what, found in (("unit", holder.units), ("enumeration", holder.enumerations)):
            twice = repeated(item.name for item in found)
            for item in {item.name: item for item in found if item.name in twice}.values():
                scope.report_deviation(item.line, f"{what} {item.name!r} is declared twice")
        for enumeration in holder.enumerations:
            for value in sorted(repeated(str(value) for value in enumeration.items.values())):
                names = " and ".join(name for name, own in enumeration.items.items() if str(own) == value)
                scope.report_deviation(
                    enumeration.line, f"enumeration {enumeration.name!r}: items {names} have the same value {value}"
                )
        return scope

    def report(self, line: int, message: str, weight: Weight = Weight.LOAD) -> Key:
        """Note a finding in this file."""
        return self.findings.report(self.file, line, message, weight)

    def report_deviation(self, line: int, message: str) -> Key:
        """Note a finding that does not keep the system from being run as it was meant."""
        return self.report(line, message, Weight.DEVIATION)

    def label(self, path: str, name: str = "") -> str:
        """The name of an element, or of its connector, in messages."""
        if self.root and (path == self.root or path.startswith(f"{self.root}.")):
            path = path[len(self.root) + 1 :]
        return ".".join(filter(None, (path, name))) or "the system"

    def unit(self, name: str | None, what: str, line: int) -> Unit | None:
        """The unit of this name; if it is not declared, that is reported."""
        if name is None or name in self.units:
            return None if name is None else self.units[name]
        key = self.report_deviation(line, f"{what}: unit {name!r} is not declared in Units.{nearest(name, self.units)}")
        return UnknownUnit(name, {name: 1}, reported=(key,))

    def items(self, name: str | None, what: str, line: int) -> Mapping[str, int] | None:
        """The items of the enumeration of this name; if it is not declared, that is reported."""
        if name is None or name in self.enumerations:
            return None if name is None else self.enumerations[name].items
        self.report_deviation(
            line, f"{what}: enumeration {name!r} is not declared in Enumerations.{nearest(name, self.enumerations)}"
        )
        return None

    def meaning(self, type_: DataType, what: str, line: int) -> Meaning:
        """The meaning of a type of this file."""
        return Meaning(kind_of_type(type_.name), self.unit(type_.unit, what, line), self.items(type_.enumeration, what, line))


def completed(own: Meaning | None, other: Meaning | None) -> Meaning | None:
    """A meaning, with its open parts taken from another one of the same kind."""
    if own is None or other is None or own.kind != other.kind:
        return own or other
    return Meaning(own.kind, own.unit or other.unit, own.items or other.items)


def kind_of_type(name: str) -> str:
    """The kind of an SSP type: real, integer, boolean, enumeration, string, binary or clock."""
    return "real" if name in REAL_TYPES else "integer" if name in INTEGER_BITS else name.lower()


def fmu_meaning(fmu: Fmu, name: str) -> Meaning:
    """The meaning of an FMU's variable in terms of SSP; of an array, that of its first element."""
    variable = fmu.variables[fmu.elements_of(name)[0]]
    return Meaning(kind_of(variable), fmu_unit(fmu, str(variable.name)), items_of(variable) or None)


def fmu_unit(fmu: Fmu, name: str) -> Unit | None:
    """The unit of an FMU's variable; without a definition, its name alone."""
    unit = fmu.unit_of(name)
    if not unit:
        return None
    definition = fmu.unit_definition(unit)
    base = definition.baseUnit if definition is not None else None
    if base is None:
        return UnknownUnit(unit, {unit: 1})
    exponents = {symbol: int(getattr(base, symbol) or 0) for symbol in BASE}
    return Unit(unit, {k: v for k, v in exponents.items() if v}, float(base.factor or 1.0), float(base.offset or 0.0))


def units_differ(one: Unit | None, other: Unit | None) -> bool:
    """Whether both units are declared, and of different kinds."""
    if one is None or other is None or one.exponents == other.exponents:
        return False
    return one.name != other.name or not (isinstance(one, UnknownUnit) or isinstance(other, UnknownUnit))


def misfits(
    scope: Scope, line: int, what: str, source: Meaning, target: Meaning, transformation: Transformation | None, suppressed: bool
) -> list[Key]:
    """Report why values of one meaning cannot become values of another. Returns the findings, new or existing."""
    if isinstance(transformation, MappingTransformation):
        return [
            scope.report_deviation(transformation.line, message) for message in _table_misfits(what, transformation, source, target)
        ]
    message = None
    if isinstance(transformation, LinearTransformation) and (source.kind, target.kind) not in _NUMBERS:
        line = transformation.line or line
        odd = source.kind if source.kind not in ("real", "integer") else target.kind
        message = f"a linear transformation cannot be applied to {_a(odd)}"
    elif source.kind != target.kind and (source.kind, target.kind) not in _NUMBERS:
        message = f"{_a(source.kind)} cannot become {_a(target.kind)}"
    elif source.items and target.items and source.items != target.items:
        odd = next(item for item in {**source.items, **target.items} if source.items.get(item) != target.items.get(item))
        message = f"the enumerations differ in {odd!r}; a mapping of items is needed"
    elif not suppressed:
        return unit_misfits(scope, line, source.unit, target.unit, "{what}: unit {one} does not convert to {other}", what=what)
    return [scope.report_deviation(line, f"{what}: {message}")] if message else []


def unit_misfits(scope: Scope, line: int, one: Unit | None, other: Unit | None, message: str, **more: str) -> list[Key]:
    """Report that units are of different kinds. An undeclared unit has been reported already; that finding is returned."""
    if one is None or other is None or not units_differ(one, other):
        return []
    reported = [key for unit in (one, other) if isinstance(unit, UnknownUnit) for key in unit.reported]
    return reported or [scope.report_deviation(line, message.format(one=one.name, other=other.name, **more))]


def _a(kind: str) -> str:
    return f"{'an' if kind[:1].lower() in 'aeiou' else 'a'} {kind or 'unknown kind'}"


def _table_misfits(what: str, table: MappingTransformation, source: Meaning, target: Meaning) -> Iterator[str]:
    for side, meaning, items in (
        ("source", source, [s for s, _ in table.entries]),
        ("target", target, [t for _, t in table.entries]),
    ):
        if meaning.kind != table.kind.lower():
            yield f"{what}: {_a(table.kind)}MappingTransformation, but the {side} is {_a(meaning.kind)}"
        elif meaning.items is not None:
            for item in dict.fromkeys(item for item in items if item not in meaning.items):
                yield f"{what}: {item!r} is not an item of the {side}'s enumeration.{nearest(item, meaning.items)}"


def repeated(names: Iterable[str]) -> set[str]:
    """Names that occur more than once."""
    seen: set[str] = set()
    return {name for name in names if name in seen or seen.add(name)}
