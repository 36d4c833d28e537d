"""Checks of connections: both ends are there, the direction is one that the standard allows, types and units fit, and no
input has two sources."""

from __future__ import annotations

from collections.abc import Mapping

from fmpy.model_description import ModelVariable

from shaper_fmu.errors import nearest
from shaper_fmu.master.fmu import Fmu
from shaper_fmu.ssp.check_scene import Meaning, Scene, do_not_convert, find_variable
from shaper_fmu.ssp.check_structure import Place, label, places
from shaper_fmu.ssp.document import Component, Connection, Connector, SystemElement
from shaper_fmu.ssp.document_parts import LinearTransformation, MappingTransformation, Transformation

End = tuple[str | None, str, tuple[int, ...]]
"""An end of a connection: the element (None is the system itself), the connector, and the indices in it."""

_INWARD = ("input", "inout")
_OUTWARD = ("calculatedParameter", "output", "local")
ALLOWED: dict[tuple[str, str], dict[str, tuple[str, ...]]] = {
    ("system", "structuralParameter"): {"system": _OUTWARD, "element": ("structuralParameter", "parameter", *_INWARD)},
    ("system", "parameter"): {"system": _OUTWARD, "element": ("parameter", *_INWARD)},
    ("system", "input"): {"system": ("output", "local"), "element": _INWARD},
    ("element", "constant"): {
        "system": ("constant", *_OUTWARD),
        "element": ("structuralParameter", "parameter", *_INWARD),
    },
    ("element", "calculatedParameter"): {"system": _OUTWARD, "element": ("parameter", *_INWARD)},
    ("element", "output"): {"system": ("output", "local"), "element": _INWARD},
    ("element", "local"): {"system": ("output", "local"), "element": _INWARD},
    ("element", "inout"): {"system": ("output", "local"), "element": ("input",)},
}
"""The standard's table of allowed connections: owner and kind of the source -> owner -> kinds of the destination."""


def check_connections(scene: Scene, fmus: Mapping[Place, Fmu]) -> dict[tuple[Place, str], tuple[Place, str]]:
    """Check all connections. Returns those that are in order, destination -> source, each as place and connector."""
    directed: dict[tuple[Place, str], tuple[Place, str]] = {}
    for place, system in places(scene.description.system):
        if isinstance(system, SystemElement):
            driven: dict[End, tuple[int, str]] = {}
            for connection in system.connections:
                ends = _directed(scene, place, system, connection)
                if ends is not None:
                    source, target = ends
                    _check_free(scene, place, connection, source, target, driven)
                    _check_fit(scene, place, system, connection, (source, target), fmus)
                    directed.setdefault((_place(place, target), target[1]), (_place(place, source), source[1]))
    return directed


def _place(place: Place, end: End) -> Place:
    return place if end[0] is None else (*place, end[0])


def _name(place: Place, end: End) -> str:
    indices = "[" + ",".join(map(str, end[2])) + "]" if end[2] else ""
    return label(_place(place, end), end[1]) + indices


def _directed(scene: Scene, place: Place, system: SystemElement, connection: Connection) -> tuple[End, End] | None:
    """Source and destination; None if an end dangles or no direction is allowed, which is told."""
    for side, element in (("startElement", connection.start_element), ("endElement", connection.end_element)):
        if element == "":
            words = f"connection with an empty {side}: leave the attribute out to name a connector of {label(place)}"
            scene.tell(connection.line, words)
    start: End = (connection.start_element or None, connection.start_connector, tuple(connection.start_indices))
    end: End = (connection.end_element or None, connection.end_connector, tuple(connection.end_indices))
    found = [_connector(scene, place, system, connection, side) for side in (start, end)]
    if found[0] is None or found[1] is None:
        return None
    one, other = (_Side(side[0] is None, connector.kind) for side, connector in zip((start, end), found, strict=True) if connector)
    if one.feeds(other):
        return start, end
    if other.feeds(one):
        return end, start
    scene.tell(
        connection.line,
        f"{_name(place, start)} -> {_name(place, end)}: {one} and {other} cannot be connected",
    )
    return None


class _Side:
    """An end of a connection by what the standard's table asks for: owner and kind."""

    def __init__(self, of_system: bool, kind: str):
        self.owner, self.kind = ("system" if of_system else "element"), kind

    def feeds(self, other: _Side) -> bool:
        """Whether values can go from here to the other end; a kind of "unspecified" is any."""
        sources = [kind for owner, kind in ALLOWED if owner == self.owner and self.kind in (kind, "unspecified")]
        return any(other.kind == "unspecified" or other.kind in ALLOWED[self.owner, kind].get(other.owner, ()) for kind in sources)

    def __str__(self) -> str:
        return f"{_a(self.kind)} of {'the system' if self.owner == 'system' else 'an element'}"


def _connector(scene: Scene, place: Place, system: SystemElement, connection: Connection, end: End) -> Connector | None:
    element = system if end[0] is None else system.element(end[0])
    if element is None:
        known = nearest(end[0] or "", [inner.name for inner in system.elements])
        scene.tell(connection.line, f"connection to {_name(place, end)}: {label(place)} has no element {end[0]!r}.{known}")
        return None
    connector = element.connector(end[1])
    if connector is None:
        known = nearest(end[1], [own.name for own in element.connectors])
        owner = label(_place(place, end))
        scene.tell(connection.line, f"connection to {_name(place, end)}: {owner} has no connector {end[1]!r}.{known}")
    return connector


def _check_free(
    scene: Scene, place: Place, connection: Connection, source: End, target: End, driven: dict[End, tuple[int, str]]
) -> None:
    for other, (line, by) in driven.items():
        if other[:2] == target[:2] and (other[2] == target[2] or not other[2] or not target[2]):
            name = _name(place, target)
            scene.tell(connection.line, f"{name} is driven twice: by {_name(place, source)}, and by {by} in line {line}")
            return
    driven[target] = connection.line, _name(place, source)


def _check_fit(
    scene: Scene, place: Place, system: SystemElement, connection: Connection, ends: tuple[End, End], fmus: Mapping[Place, Fmu]
) -> None:
    """Types and units of both ends, with the connection's transformation between them."""
    source, target = (_meaning(scene, place, system, end, fmus) for end in ends)
    if source is None or target is None:
        return
    what = f"{_name(place, ends[0])} -> {_name(place, ends[1])}"
    check_values_fit(scene, what, connection.line, source, target, connection.transformation, connection.suppress_unit_conversion)


def check_values_fit(
    scene: Scene,
    what: str,
    line: int,
    source: Meaning,
    target: Meaning,
    transformation: Transformation | None,
    as_it_is: bool,
    file: str = "",
) -> None:
    """Whether values of one meaning can become values of another, with or without a transformation."""
    if isinstance(transformation, MappingTransformation):
        _check_table(scene, what, transformation, source, target, file)
        return
    if isinstance(transformation, LinearTransformation) and (source.kind, target.kind) not in _NUMBERS:
        kind = source.kind if source.kind not in ("real", "integer") else target.kind
        scene.tell(transformation.line or line, f"{what}: a linear transformation cannot be applied to {_a(kind)}", file)
    elif source.kind != target.kind and (source.kind, target.kind) not in _NUMBERS:
        scene.tell(line, f"{what}: {_a(source.kind)} cannot become {_a(target.kind)}", file)
    elif source.items and target.items and source.items != target.items:
        odd = next(item for item in {**source.items, **target.items} if source.items.get(item) != target.items.get(item))
        scene.tell(line, f"{what}: the enumerations differ in {odd!r}; a mapping of items is needed", file)
    elif do_not_convert(source, target) and not as_it_is:
        scene.tell(line, f"{what}: unit {source.unit} does not convert to {target.unit}", file)


_NUMBERS = (("real", "real"), ("integer", "integer"), ("integer", "real"))


def _a(kind: str) -> str:
    return f"{'an' if kind[:1].lower() in 'aeiou' else 'a'} {kind or 'unknown kind'}"


def _check_table(scene: Scene, what: str, table: MappingTransformation, source: Meaning, target: Meaning, file: str) -> None:
    for side, meaning, items in (
        ("source", source, [s for s, _ in table.entries]),
        ("target", target, [t for _, t in table.entries]),
    ):
        if meaning.kind != table.kind.lower():
            words = f"{what}: {_a(table.kind)}MappingTransformation, but the {side} is {_a(meaning.kind)}"
            scene.tell(table.line, words, file)
        elif meaning.items is not None:
            for item in dict.fromkeys(item for item in items if item not in meaning.items):
                words = f"{what}: {item!r} is no item of the {side}'s enumeration.{nearest(item, meaning.items)}"
                scene.tell(table.line, words, file)


def _meaning(scene: Scene, place: Place, system: SystemElement, end: End, fmus: Mapping[Place, Fmu]) -> Meaning | None:
    element = system if end[0] is None else system.element(end[0])
    connector = element.connector(end[1]) if element is not None else None
    if connector is None:
        return None
    variable = _variable(fmus.get(_place(place, end)), end[1]) if isinstance(element, Component) else None
    return scene.connector_meaning(connector, variable)


def _variable(fmu: Fmu | None, name: str) -> tuple[Fmu, ModelVariable] | None:
    found = find_variable(fmu, name) if fmu is not None else None
    return (fmu, found) if fmu is not None and found is not None else None
