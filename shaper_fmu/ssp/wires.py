"""Lays the wires of a flattened system: checks that both ends exist, that signals flow one way, and that each has one source.

The direction comes from the FMU for its variables, and from the file for other connectors. Connections that the standard's table
does not contain are reported, but stop nothing as long as values can flow; so are types and units that do not fit, until they
turn out to stop a value.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import Literal

from shaper_fmu.errors import nearest
from shaper_fmu.ssp.document import Component, Connection, DictionaryReference, SystemElement
from shaper_fmu.ssp.findings import Weight
from shaper_fmu.ssp.meaning import Meaning, completed, misfits
from shaper_fmu.ssp.network import SOURCES, TARGETS, Network, Node, Wire
from shaper_fmu.ssp.structure import Place, Structure

_INWARD = ("input", "inout")
_OUTWARD = ("calculatedParameter", "output", "local")
_ALLOWED: dict[tuple[str, str], dict[str, tuple[str, ...]]] = {
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
Drivers = dict[Node, list[tuple[Place, Node]]]
"""Signal of a dictionary -> references through which something drives it, and what."""


@dataclass(frozen=True)
class _End:
    """An end of a connection: its node, its direction, and its kind in the standard's table."""

    node: Node
    role: Literal["source", "target", "either"]
    owner: str
    kind: str

    def feeds(self, other: _End) -> bool:
        """Whether the table lets values go from here to the other end; a kind of "unspecified" is any."""
        sources = [kind for owner, kind in _ALLOWED if owner == self.owner and self.kind in (kind, "unspecified")]
        return any(other.kind == "unspecified" or other.kind in _ALLOWED[self.owner, kind].get(other.owner, ()) for kind in sources)

    def __str__(self) -> str:
        article = "an" if self.kind[:1].lower() in "aeiou" else "a"
        return f"{article} {self.kind or 'unknown kind'} of {'the system' if self.owner == 'system' else 'an element'}"


def make_network(structure: Structure) -> Network:
    """The wires of a flat system."""
    network, drivers = Network(structure), Drivers()
    for place in structure.places.values():
        if isinstance(place.element, DictionaryReference):
            for connector in place.element.connectors:
                signal, own = Node(place.dictionary, connector.name), Node(place.path, connector.name, "out")
                if own not in network.into:
                    network.add(Wire(signal, own, place.scope, connector.line, faults=_signal_faults(network, own)))
    for place in structure.systems():
        assert isinstance(place.element, SystemElement)
        for connection in place.element.connections:
            _lay(network, place, connection, drivers)
    order = {path: i for i, path in enumerate(structure.places)}
    for signal, found in drivers.items():
        (_, first), *others = sorted(found, key=lambda item: order[item[0].path])
        for place, source in others:
            element, scope = place.element, place.scope
            assert isinstance(element, DictionaryReference)
            what = f"signal {signal.name!r} of the dictionary {element.dictionary!r} is driven twice"
            ends = " and ".join(f"by {scope.label(node.path, node.name)}" for node in (first, source))
            line = next(connector.line for connector in element.connectors if connector.name == signal.name)
            scope.report(line, f"{what}: {ends}")
    return network


def _signal_faults(network: Network, node: Node) -> tuple[tuple[str, int, str], ...]:
    return tuple(network.structure.signal_faults.get((node.path, node.name), ()))


def _lay(network: Network, place: Place, connection: Connection, drivers: Drivers) -> None:
    """Lay the wire of a connection, in the direction of the connectors' kinds."""
    scope, line = place.scope, connection.line
    for side, element in (("startElement", connection.start_element), ("endElement", connection.end_element)):
        if element == "":  # as OMSimulator writes
            message = f"connection with an empty {side}: leave the attribute out to name a connector of {scope.label(place.path)}"
            scope.report_deviation(line, message)
    ends = [
        _end(network, place, line, element or None, connector, indices)
        for element, connector, indices in (
            (connection.start_element, connection.start_connector, connection.start_indices),
            (connection.end_element, connection.end_connector, connection.end_indices),
        )
    ]
    start, end = ends
    if start is None or end is None:
        return
    what = " -> ".join(scope.label(one.node.path, one.node.name) for one in (start, end))
    if connection.start_indices or connection.end_indices:
        scope.report(line, f"{what}: connections of single elements of arrays are not read; name the elements' own variables")
        return
    stuck = start.role == end.role != "either"
    if stuck or not (start.feeds(end) or end.feeds(start)):
        scope.report(line, f"{what}: {start} and {end} cannot be connected", Weight.LOAD if stuck else Weight.DEVIATION)
        if stuck:
            return
    if start.role == "target" or (start.role == "either" and end.role == "source"):
        start, end = end, start
    _wire(network, place, connection, start.node, end.node, drivers)


def _wire(network: Network, place: Place, connection: Connection, start: Node, end: Node, drivers: Drivers) -> None:
    scope, line = place.scope, connection.line
    names = [scope.label(node.path, node.name) for node in (start, end)]
    one, other = (_meaning(network, place, node) for node in (start, end))
    how, faults = (connection.transformation, connection.suppress_unit_conversion), []
    if one is not None and other is not None:
        faults = misfits(scope, line, " -> ".join(names), one, other, *how)
    source, target = _side(network, start, "out"), _side(network, end, "in")
    known = network.into.get(target)
    if known is not None:
        by = scope.label(known.source.path, known.source.name)
        scope.report(line, f"{names[1]} is driven twice: by {names[0]}, and by {by} in line {known.line}")
        return
    network.add(Wire(source, target, scope, line, *how, tuple(faults)))
    if target.side:
        reference = network.places[target.path]
        signal = Node(reference.dictionary, target.name)
        drivers.setdefault(signal, []).append((reference, start))
        if signal not in network.into:
            network.add(Wire(target, signal, scope, line, faults=_signal_faults(network, target)))


def _meaning(network: Network, place: Place, node: Node) -> Meaning | None:
    """The meaning of a node's signal, seen from the connection's file."""
    found, theirs = network.places[node.path], network.meaning(node)
    connector = found.component.connector(node.name) if found.component is not None and found is not place else None
    if connector is None or connector.type is None or found.outer is None:
        return theirs
    what = f"connector {found.outer.label(node.path, node.name)}"
    return completed(found.outer.meaning(connector.type, what, connector.line), theirs)


def _side(network: Network, node: Node, side: str) -> Node:
    return Node(node.path, node.name, side) if isinstance(network.places[node.path].element, DictionaryReference) else node


def _end(network: Network, place: Place, line: int, element: str | None, connector: str, indices: list[int]) -> _End | None:
    """An end of a connection in the system at `place`; None, with a finding, if it does not exist."""
    scope = place.scope
    path = place.path if element is None else f"{place.path}.{element}" if place.path else element
    at = f"[{','.join(map(str, indices))}]" if indices else ""
    what = f"connection to {scope.label(path, connector)}{at}"
    found = network.places.get(path)
    if found is None or (element is not None and found.parent != place.path):  # one further down that is named with its path
        known = nearest(str(element), [inside.element.name for inside in network.structure.inside(place.path)])
        weight = Weight.LOAD if found is None else Weight.DEVIATION
        scope.report(line, f"{what}: {scope.label(place.path)} has no element {element!r}.{known}", weight)
    if found is None:
        return None
    declared = (found.component or found.element if element is not None else found.element).connector(connector)
    own = found.element.connector(connector)
    kind = own.kind if own is not None else None
    if isinstance(found.element, Component):
        kind = _causality(network, path, connector) if path in network.fmus else kind
    unreadable = isinstance(found.element, Component) and path not in network.fmus  # that its FMU cannot be read
    weight = Weight.DEVIATION if kind is not None or unreadable else Weight.LOAD
    if declared is None:
        names = [one.name for one in (found.component or found.element).connectors] or (
            _ports(network, path) if kind is None else []
        )
        scope.report(line, f"{what}: {scope.label(path)} has no connector {connector!r}.{nearest(connector, names)}", weight)
    elif kind is None and found.component is not None:
        known = nearest(connector, [own.name for own in found.element.connectors])
        scope.report(line, f"{what}: the system in {found.component.source} has no connector {connector!r}.{known}")
    if kind is None:
        return None
    role = "source" if kind in SOURCES else "target" if kind in TARGETS else "either"
    if element is None and role != "either":  # a system's own connector is seen from inside
        role = "target" if role == "source" else "source"
    return _End(Node(path, connector), role, "element" if element is not None else "system", declared.kind if declared else kind)


def _causality(network: Network, path: str, name: str) -> str | None:
    """The causality of the FMU's variable, whatever the file declares, since the FMU determines the flow."""
    fmu = network.fmus[path]
    variable = fmu.variables.get(fmu.elements_of(name)[0])
    return str(variable.causality) if variable is not None else None


def _ports(network: Network, path: str) -> list[str]:
    """The inputs and outputs of an FMU."""
    variables = network.fmus[path].variables.values() if path in network.fmus else ()
    return [str(variable.name) for variable in variables if variable.causality in ("input", "output")]
