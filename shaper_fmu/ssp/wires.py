"""Laying the wires of a flattened system: which way values flow through a connection, and that each end has one source."""

from __future__ import annotations

from collections.abc import Callable
from typing import Literal

from shaper_fmu.errors import nearest
from shaper_fmu.master.fmu import Fmu
from shaper_fmu.ssp.document import Component, Connection, DictionaryReference, SystemElement
from shaper_fmu.ssp.flatten import Flat, Place
from shaper_fmu.ssp.network import SOURCES, TARGETS, Network, Node, Wire

Role = Literal["source", "target", "either"]


def make_network(flat: Flat, fmus: dict[str, Fmu]) -> Network:
    """The wires of a flat system. Problems are in the result, with file and line."""
    network = Network(flat, fmus)
    for place in flat.places.values():
        if isinstance(place.element, DictionaryReference):
            for connector in place.element.connectors:
                signal = Node(place.dictionary, connector.name)
                network.out_of.setdefault(signal, []).append(Wire(signal, Node(place.path, connector.name, "out"), place.scope))
                network.into[Node(place.path, connector.name, "out")] = network.out_of[signal][-1]
    for place in flat.systems():
        assert isinstance(place.element, SystemElement)
        for connection in place.element.connections:
            _lay(network, place, connection)
    return network


def _lay(network: Network, place: Place, connection: Connection) -> None:
    """Lay the wire of a connection, in the direction that the connectors' kinds tell."""

    def problem(words: str) -> None:
        network.problems.append(place.scope.at(connection.line, words))

    ends = [
        _end(network, place, element, connector, problem)
        for element, connector in (
            (connection.start_element or None, connection.start_connector),  # OMSimulator writes "" for the system itself
            (connection.end_element or None, connection.end_connector),
        )
    ]
    first, last = ends
    if first is None or last is None:
        return
    (start, role), (end, other) = first, last
    if connection.start_indices or connection.end_indices:
        problem(f"{start} -> {end}: connections of single elements of arrays are not read; name the elements' own variables")
        return
    if role == other != "either":
        both = "outputs" if role == "source" else "inputs"
        problem(f"{start} and {end} are both {both} here, so nothing flows between them")
        return
    if role == "target" or (role == "either" and other == "source"):
        start, end = end, start
    start, end = _side(network, start, "out"), _side(network, end, "in")
    transformation, suppress = connection.transformation, connection.suppress_unit_conversion
    _add(network, Wire(start, end, place.scope, connection.line, transformation, suppress), problem)
    if end.side:
        signal = Node(network.flat.places[end.path].dictionary, end.name)
        _add(network, Wire(end, signal, place.scope, connection.line), problem)


def _side(network: Network, node: Node, side: str) -> Node:
    place = network.flat.places[node.path]
    return Node(node.path, node.name, side) if isinstance(place.element, DictionaryReference) else node


def _add(network: Network, wire: Wire, problem: Callable[[str], None]) -> None:
    known = network.into.get(wire.target)
    if known is not None:
        problem(f"{wire.target} is already driven by {known.source} (line {known.line})")
        return
    network.into[wire.target] = wire
    network.out_of.setdefault(wire.source, []).append(wire)


def _end(
    network: Network, place: Place, element: str | None, connector: str, problem: Callable[[str], None]
) -> tuple[Node, Role] | None:
    """The node at an end of a connection, and whether something flows from it or to it."""
    path = place.path if element is None else f"{place.path}.{element}" if place.path else element
    found = network.flat.places.get(path)
    if found is None:
        inner = [inside.element.name for inside in network.flat.inside(place.path)]
        problem(f"there is no element {element!r} in this system.{nearest(str(element), inner)}")
        return None
    declared = found.element.connector(connector)
    kind = declared.kind if declared is not None else None
    if isinstance(found.element, Component):
        kind = _kind_of_variable(network, path, connector, problem) if path in network.fmus else None
    elif kind is None:
        known = [c.name for c in found.element.connectors]
        problem(f"{Node(path, connector)}: there is no such connector.{nearest(connector, known)}")
    if kind is None:
        return None
    role: Role = "source" if kind in SOURCES else "target" if kind in TARGETS else "either"
    if element is None and role != "either":  # a system's own connector is seen from inside
        role = "target" if role == "source" else "source"
    return Node(path, connector), role


def _kind_of_variable(network: Network, path: str, name: str, problem: Callable[[str], None]) -> str | None:
    """The causality of the FMU's variable, whatever the file says: the flow is the FMU's."""
    fmu = network.fmus[path]
    elements = fmu.elements_of(name)
    if elements[0] not in fmu.variables:
        known = [v.name for v in fmu.variables.values() if v.causality in ("input", "output")]
        problem(f"{path}.{name}: {fmu.name} has no input or output {name!r}.{nearest(name, known)}")
        return None
    return str(fmu.variables[elements[0]].causality)
