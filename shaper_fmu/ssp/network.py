"""The wires between the connectors of a flattened system, and the paths along them."""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from dataclasses import dataclass, field

from shaper_fmu.errors import ModelError
from shaper_fmu.master.fmu import Fmu
from shaper_fmu.master.variables import kind_of
from shaper_fmu.ssp.conversion import IDENTITY, Affine, affine_of, after, unit_conversion, value_table
from shaper_fmu.ssp.document import (
    LinearTransformation,
    MappingTransformation,
    SystemElement,
    Transformation,
    Unit,
)
from shaper_fmu.ssp.flatten import Flat, Scope

SOURCES = ("output", "calculatedParameter", "constant", "local")
TARGETS = ("input", "parameter", "structuralParameter")
"""Kinds of connectors from which, and to which, values flow; seen from outside of their element."""
_MOST_VALUES = 4096


@dataclass(frozen=True)
class Node:
    """A connector: the path of its element ("" for the root system) and its name, or a dictionary's key and a signal.

    `side` tells what goes "in" and "out" at a dictionary's reference, which are nodes of their own.
    """

    path: str
    name: str
    side: str = ""

    def __str__(self) -> str:
        return f"{self.path}.{self.name}" if self.path else self.name


@dataclass(frozen=True)
class Wire:
    """What leads from one node to another."""

    source: Node
    target: Node
    scope: Scope
    line: int = 0
    transformation: Transformation | None = None
    suppress: bool = False


@dataclass
class Network:
    """All wires of a flat system, with the FMUs of its components by path, and what is wrong."""

    flat: Flat
    fmus: dict[str, Fmu]
    into: dict[Node, Wire] = field(default_factory=dict)
    out_of: dict[Node, list[Wire]] = field(default_factory=dict)
    problems: list[str] = field(default_factory=list)

    def is_variable(self, node: Node) -> bool:
        """Whether the node is a variable of an FMU."""
        return node.path in self.fmus and not node.side

    def variable(self, node: Node):  # its type is fmpy's
        """The FMU's variable at a node, the first element of an array."""
        fmu = self.fmus[node.path]
        return fmu.variables[fmu.elements_of(node.name)[0]]

    def path_to(self, node: Node) -> list[Wire]:
        """The wires that lead to a node, in the order of the flow. Raises ModelError if they go round in a circle."""
        wires: list[Wire] = []
        while node in self.into:
            wires.append(self.into[node])
            node = wires[-1].source
            if len(wires) > len(self.into):
                raise ModelError([wires[-1].scope.at(wires[-1].line, f"connectors feed each other in a circle, through {node}")])
        return wires[::-1]

    def paths_from(self, node: Node, before: tuple[Wire, ...] = ()) -> Iterator[tuple[Wire, ...]]:
        """The paths from a node to all variables of FMUs that it feeds; an empty one if it is such a variable."""
        if self.is_variable(node):
            yield before
            return
        if len(before) > len(self.into):
            return
        for wire in self.out_of.get(node, []):
            yield from self.paths_from(wire.target, (*before, wire))

    def unit(self, node: Node) -> Unit | None:
        """The unit of the numbers at a node: the FMU's, what the file declares, or that of the connectors inside."""
        if self.is_variable(node):
            fmu = self.fmus[node.path]
            return fmu_unit(fmu, fmu.elements_of(node.name)[0])
        if node.path in self.flat.dictionaries:
            dictionary, scope = self.flat.dictionaries[node.path]
            types = [entry.type for entry in dictionary.entries if entry.name == node.name]
        else:
            place = self.flat.places[node.path]
            connector, scope = place.element.connector(node.name), place.scope
            types = [connector.type] if connector is not None else []
        for type_ in types:
            if type_ is not None and type_.unit is not None:
                return scope.units.get(type_.unit) or undefined_unit(type_.unit)
        return self._deduced_unit(node)

    def _deduced_unit(self, node: Node) -> Unit | None:
        """The unit of a system's connector that declares none: that of the connectors inside, if they agree."""
        place = self.flat.places.get(node.path)
        if place is None or not isinstance(place.element, SystemElement):
            return None
        connector = place.element.connector(node.name)
        if connector is None or connector.kind in TARGETS:
            inner = {unit.name: unit for wire in self.out_of.get(node, []) if (unit := self.unit(wire.target)) is not None}
            return next(iter(inner.values())) if len(inner) == 1 else None
        return self.unit(self.into[node].source) if node in self.into else None

    def items(self, node: Node) -> Mapping[str, int] | None:
        """The items of the enumeration at a node, by name; None if it has none."""
        if self.is_variable(node):
            declared = self.variable(node).declaredType
            items = {str(item.name): int(str(item.value)) for item in (declared.items if declared is not None else None) or []}
            return items or None
        place = self.flat.places.get(node.path)
        connector = place.element.connector(node.name) if place is not None else None
        if place is None or connector is None or connector.type is None or connector.type.enumeration is None:
            return None
        found = place.scope.enumerations.get(connector.type.enumeration)
        return found.items if found is not None else None

    def affine(self, wires: list[Wire]) -> Affine:
        """What a path does to the value of an FMU's output, as gain and offset. Raises ModelError, with file and line."""
        if not wires:
            return IDENTITY
        if self._is_mapped(wires):
            return self._mapped_affine(wires)
        total, unit = IDENTITY, self.unit(wires[0].source)
        for wire in wires:
            step, unit = self.conversion(wire, unit)
            total = after(total, step)
            if isinstance(wire.transformation, LinearTransformation):
                total = after(total, (wire.transformation.factor, wire.transformation.offset))
            elif wire.transformation is not None:
                raise ModelError([at(wire, "a mapping of values is not for real numbers")])
        return total

    def conversion(self, wire: Wire, unit: Unit | None) -> tuple[Affine, Unit | None]:
        """From the unit of a value to that of a wire's end; and that unit, or the old one if there is none."""
        target = self.unit(wire.target)
        if wire.suppress:
            return IDENTITY, target or unit
        try:
            return unit_conversion(unit, target), target or unit
        except ModelError:
            names = [known.name for known in (unit, target) if known is not None]
            words = f"{wire.source} is in {names[0]} but {wire.target} in {names[-1]}; they cannot be connected"
            raise ModelError([at(wire, words)]) from None

    def mapping(self, wires: list[Wire]) -> dict[int, int] | None:
        """What a path changes of a boolean (0, 1), an integer or an enumeration; None for real numbers. Raises ModelError."""
        if not self._is_mapped(wires):
            return None
        # what no mapping names stays as it is, so that integers without bounds need no list of all
        values = targets = self._values(wires[0].source) or _named_integers(wires)
        for wire in wires:
            try:
                targets = value_table(wire.transformation, targets, self.items(wire.source), self.items(wire.target))
            except ModelError as error:
                raise ModelError([at(wire, problem) for problem in error.problems]) from None
        return {value: target for value, target in zip(values, targets, strict=True) if value != target}

    def _is_mapped(self, wires: list[Wire]) -> bool:
        """Whether transformations change a value that is no real number."""
        ends = [node for node in (wires[0].source, wires[-1].target) if self.is_variable(node)] if wires else []
        kinds = [kind_of(self.variable(node)) for node in ends]
        return bool(kinds) and "real" not in kinds and any(wire.transformation is not None for wire in wires)

    def _mapped_affine(self, wires: list[Wire]) -> Affine:
        """A mapping as a gain and an offset: where values are not set by the master, but by programs or in results."""
        mapping, values = self.mapping(wires) or {}, self._values(wires[0].source)
        found = affine_of(values, [mapping.get(value, value) for value in values]) if values else None
        if found is None:
            words = f"{wires[0].source} -> {wires[-1].target}: here a mapping must be a gain and an offset; this one is not"
            raise ModelError([at(next(wire for wire in wires if wire.transformation is not None), words)])
        return found

    def _values(self, node: Node) -> list[int]:
        """All values that a variable can have; none if they are too many, or not known."""
        if not self.is_variable(node):
            return []
        variable, items = self.variable(node), self.items(node)
        if kind_of(variable) == "boolean":
            return [0, 1]
        if items:
            return list(items.values())
        low, high = (None if bound is None else int(str(bound)) for bound in (variable.min, variable.max))
        return [] if low is None or high is None or high - low >= _MOST_VALUES else list(range(low, high + 1))


def _named_integers(wires: list[Wire]) -> list[int]:
    """All numbers that mappings of integers name."""
    found = [wire.transformation for wire in wires if isinstance(wire.transformation, MappingTransformation)]
    return sorted({int(key) for one in found if one.kind == "Integer" for key, _ in one.entries})


def undefined_unit(name: str) -> Unit:
    """A unit of which nothing but the name is known: a base unit of its own, or the one that is called so."""
    return Unit(name, {name: 1})


def fmu_unit(fmu: Fmu, name: str) -> Unit | None:
    """The unit of an FMU's variable; without a definition, its name alone."""
    unit = fmu.unit_of(name)
    if not unit:
        return None
    definition = fmu.unit_definition(unit)
    base = definition.baseUnit if definition is not None else None
    if base is None:
        return undefined_unit(unit)
    exponents = {symbol: int(getattr(base, symbol) or 0) for symbol in ("kg", "m", "s", "A", "K", "mol", "cd", "rad")}
    return Unit(unit, {k: v for k, v in exponents.items() if v}, float(base.factor or 1.0), float(base.offset or 0.0))


def at(wire: Wire, words: str) -> str:
    """A problem of a wire, with its place."""
    return wire.scope.at(wire.line, words)
