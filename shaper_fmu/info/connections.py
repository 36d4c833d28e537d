"""The connections of a system in the direction in which values go along them."""

from __future__ import annotations

from shaper_fmu.info.facts import ConnectionInfo
from shaper_fmu.ssp.document import Connection, LinearTransformation, MappingTransformation, SystemElement
from shaper_fmu.ssp.network import Network, Node, Wire
from shaper_fmu.ssp.structure import Place


def connections_of(network: Network, place: Place, system: SystemElement) -> list[ConnectionInfo]:
    """The connections in the system at a place."""
    return [_connection(network, place, one) for one in system.connections]


def _connection(network: Network, place: Place, connection: Connection) -> ConnectionInfo:
    ends = [(connection.start_element or "", connection.start_connector), (connection.end_element or "", connection.end_connector)]
    for (element, connector), (other, other_connector) in (ends, ends[::-1]):
        wire = _wire(network, _path(place, element), connector, _path(place, other), other_connector)
        if wire is not None:
            units = [network.unit(node) for node in (wire.source, wire.target)]
            one, two = (unit.name if unit is not None else "" for unit in units)
            names = _name(element, connector), _name(other, other_connector)
            return ConnectionInfo(*names, one, two, _change(connection), laid=True)
    start, end = ends
    return ConnectionInfo(_name(*start), _name(*end), "", "", _change(connection), laid=False)


def _path(place: Place, element: str) -> str:
    return ".".join(filter(None, (place.path, element)))


def _name(element: str, connector: str) -> str:
    return ".".join(filter(None, (element, connector)))


def _wire(network: Network, path: str, connector: str, other: str, other_connector: str) -> Wire | None:
    """The wire between two connectors; those of references to dictionaries have a node for each direction."""
    for target in (Node(other, other_connector), Node(other, other_connector, "in")):
        wire = network.into.get(target)
        if wire is not None and wire.source in (Node(path, connector), Node(path, connector, "out")):
            return wire
    return None


def _change(connection: Connection) -> str:
    """The transformation in words; "" if there is none."""
    change = connection.transformation
    if isinstance(change, LinearTransformation):
        return f"{change.factor:g} * value + {change.offset:g}"
    if isinstance(change, MappingTransformation):
        return ", ".join(f"{source} becomes {target}" for source, target in change.entries)
    return "without conversion of units" if connection.suppress_unit_conversion else ""
