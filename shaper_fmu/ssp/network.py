"""The wires between the connectors of a flattened system, and the paths along them.

A system's connectors and the signals of its dictionaries are nodes like those of components: a wire ends at each of them and
others begin there, so that a path of wires leads from an output through any number of levels to an input.
"""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from dataclasses import dataclass, field

from fmpy.model_description import ModelVariable

from shaper_fmu.errors import ModelError
from shaper_fmu.master.fmu import Fmu
from shaper_fmu.master.variables import items_of, kind_of, possible_values
from shaper_fmu.ssp.conversion import IDENTITY, Affine, affine_of, after, unit_conversion, value_table
from shaper_fmu.ssp.document import LinearTransformation, MappingTransformation, SystemElement, Transformation, Unit
from shaper_fmu.ssp.findings import Findings, Key, Weight
from shaper_fmu.ssp.meaning import Meaning, Scope, UnknownUnit, completed, fmu_meaning, fmu_unit
from shaper_fmu.ssp.structure import Place, Structure

SOURCES = ("output", "calculatedParameter", "constant", "local")
TARGETS = ("input", "parameter", "structuralParameter")
"""Kinds of connectors from which, and to which, values flow; seen from outside of their element."""


@dataclass(frozen=True)
class Node:
    """A connector: the path of its element ("" for the root system) and its name, or a dictionary's key and a signal.

    `side` distinguishes what goes "in" and "out" at a dictionary's reference, which are nodes of their own.
    """

    path: str
    name: str
    side: str = ""

    def __str__(self) -> str:
        return f"{self.path}.{self.name}" if self.path else self.name


@dataclass(frozen=True)
class Wire:
    """A wire from one node to another. `faults` are findings by which it may fail."""

    source: Node
    target: Node
    scope: Scope
    line: int = 0
    transformation: Transformation | None = None
    suppress: bool = False
    faults: tuple[Key, ...] = ()


class WireError(ModelError):
    """Values cannot go along a wire, because of its faults, or of a unit's that is not declared."""

    def __init__(self, wire: Wire, problems: list[str], *units: Unit | None):
        scope = wire.scope
        ends = " -> ".join(scope.label(node.path.rpartition("/")[2], node.name) for node in (wire.source, wire.target))
        message = [f"{ends}: {problem}" for problem in problems]
        super().__init__([f"{scope.file}, line {wire.line}: {one}" for one in message])
        self.wire: Wire = wire
        self.message: list[str] = message
        reported = tuple(key for unit in units if isinstance(unit, UnknownUnit) for key in unit.reported)
        self.faults: tuple[Key, ...] = reported or wire.faults

    def report(self, findings: Findings, weight: Weight = Weight.LOAD) -> None:
        """Refuse the system: by the findings for which the wire fails, or else by these messages."""
        findings.weigh(self.faults, weight)
        for one in () if self.faults else self.message:
            findings.report(self.wire.scope.file, self.wire.line, one, weight)


@dataclass
class Network:
    """All wires of a flat system."""

    structure: Structure
    into: dict[Node, Wire] = field(default_factory=dict)
    out_of: dict[Node, list[Wire]] = field(default_factory=dict)

    def __post_init__(self) -> None:
        self.fmus: dict[str, Fmu] = self.structure.fmus
        self.places: dict[str, Place] = self.structure.places
        self.findings: Findings = self.structure.files.findings

    def add(self, wire: Wire) -> None:
        """Add a wire to a node that has none."""
        self.into[wire.target] = wire
        self.out_of.setdefault(wire.source, []).append(wire)

    def is_variable(self, node: Node) -> bool:
        """Whether the node is a variable of an FMU."""
        return node.path in self.fmus and not node.side

    def variable(self, node: Node) -> ModelVariable:
        """The FMU's variable at a node, the first element of an array."""
        fmu = self.fmus[node.path]
        return fmu.variables[fmu.elements_of(node.name)[0]]

    def path_to(self, node: Node) -> list[Wire]:
        """The wires that lead to a node, in the order of the flow. Raises WireError if they go round in a circle."""
        wires: list[Wire] = []
        while node in self.into:
            wires.append(self.into[node])
            node = wires[-1].source
            if len(wires) > len(self.into):
                raise WireError(wires[-1], ["connectors feed each other in a circle"])
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
        """The unit of the numbers at a node: the FMU's, or the declared one, or that of the connectors inside."""
        if self.is_variable(node) and (unit := fmu_unit(self.fmus[node.path], str(self.variable(node).name))) is not None:
            return unit
        declared = self.declared(node)
        return declared.unit if declared is not None and declared.unit is not None else self._deduced_unit(node)

    def declared(self, node: Node) -> Meaning | None:
        """The file's declaration of a connector or a signal."""
        dictionary, scope = self.structure.dictionaries.get(node.path, (None, None))
        if dictionary is not None and scope is not None:
            entry = next((entry for entry in dictionary.entries if entry.name == node.name), None)
            return scope.meaning(entry.type, f"signal {entry.name}", entry.line) if entry is not None else None
        place = self.places.get(node.path)
        connector = place.element.connector(node.name) if place is not None else None
        if place is None or connector is None or connector.type is None:
            return None
        return place.scope.meaning(connector.type, f"connector {place.scope.label(node.path, node.name)}", connector.line)

    def _deduced_unit(self, node: Node) -> Unit | None:
        """The unit of a system's connector that declares none: that of the connectors inside, if they agree."""
        place = self.places.get(node.path)
        if place is None or not isinstance(place.element, SystemElement):
            return None
        connector = place.element.connector(node.name)
        if connector is None or connector.kind in TARGETS:
            inner = {unit.name: unit for wire in self.out_of.get(node, []) if (unit := self.unit(wire.target)) is not None}
            return next(iter(inner.values())) if len(inner) == 1 else None
        return self.unit(self.into[node].source) if node in self.into else None

    def meaning(self, node: Node) -> Meaning | None:
        """The meaning of a node's signal: declared in the file, completed by the FMU's variable."""
        own = self.declared(node)
        theirs = fmu_meaning(self.fmus[node.path], node.name) if self.is_variable(node) else None
        return completed(own, theirs)

    def taken(self, node: Node) -> Meaning | None:
        """The meaning of the values that a node accepts: an FMU's variable, or a connector with a declared type."""
        if self.is_variable(node):
            found = fmu_meaning(self.fmus[node.path], node.name)
            return Meaning(found.kind, self.unit(node), found.items)
        declared = self.declared(node)
        return Meaning(declared.kind, self.unit(node), declared.items) if declared is not None else None

    def items(self, node: Node) -> Mapping[str, int] | None:
        """The items of the enumeration at a node, by name; None if it has none."""
        if self.is_variable(node):
            return items_of(self.variable(node)) or None
        declared = self.declared(node) if node.path in self.places else None
        return declared.items if declared is not None else None

    def affine(self, wires: list[Wire]) -> Affine:
        """The gain and offset of a path for an FMU's output. Raises WireError."""
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
                raise WireError(wire, ["a mapping of values is not for real numbers"])
        return total

    def conversion(self, wire: Wire, unit: Unit | None) -> tuple[Affine, Unit | None]:
        """The conversion from a value's unit to that of a wire's end, and that unit (or the old one). Raises WireError."""
        target = self.unit(wire.target)
        if wire.suppress:
            return IDENTITY, target or unit
        try:
            return unit_conversion(unit, target), target or unit
        except ModelError:
            one, other = (known.name for known in (unit, target) if known is not None)
            raise WireError(wire, [f"unit {one} does not convert to {other}"], unit, target) from None

    def mapping(self, wires: list[Wire]) -> dict[int, int] | None:
        """A path's mapping of a boolean (0, 1), an integer or an enumeration; None for real numbers. Raises WireError."""
        if not self._is_mapped(wires):
            return None
        # what no mapping names stays as it is, so that integers without bounds need no list of all
        values = targets = self._values(wires[0].source) or _named_integers(wires)
        for wire in wires:
            try:
                targets = value_table(wire.transformation, targets, self.items(wire.source), self.items(wire.target))
            except ModelError as error:
                raise WireError(wire, error.problems) from None
        return {value: target for value, target in zip(values, targets, strict=True) if value != target}

    def _is_mapped(self, wires: list[Wire]) -> bool:
        """Whether transformations change a value that is not a real number."""
        ends = [node for node in (wires[0].source, wires[-1].target) if self.is_variable(node)] if wires else []
        kinds = [kind_of(self.variable(node)) for node in ends]
        return bool(kinds) and "real" not in kinds and any(wire.transformation is not None for wire in wires)

    def _mapped_affine(self, wires: list[Wire]) -> Affine:
        """A mapping as a gain and an offset: where values are not set by the master, but by programs or in results."""
        mapping, values = self.mapping(wires) or {}, self._values(wires[0].source)
        found = affine_of(values, [mapping.get(value, value) for value in values]) if values else None
        if found is None:
            message = "here a mapping must be a gain and an offset; this one is not"
            raise WireError(next(wire for wire in wires if wire.transformation is not None), [message])
        return found

    def _values(self, node: Node) -> list[int]:
        """All values that a variable or a declared connector can have; none if they are too many, or not known."""
        if self.is_variable(node):
            return sorted(possible_values(self.variable(node)))
        declared = self.declared(node)
        if declared is not None and declared.kind == "boolean":
            return [0, 1]
        return sorted((declared.items or {}).values()) if declared is not None else []


def _named_integers(wires: list[Wire]) -> list[int]:
    """All numbers that mappings of integers name; both of booleans."""
    found = [wire.transformation for wire in wires if isinstance(wire.transformation, MappingTransformation)]
    booleans = {0, 1} if any(one.kind == "Boolean" for one in found) else set()
    return sorted({int(key) for one in found if one.kind == "Integer" for key, _ in one.entries} | booleans)
