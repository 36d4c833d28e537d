"""Finds loops of direct feedthrough, as far as the FMUs declare which outputs depend on which inputs."""

from __future__ import annotations

from shaper_fmu.master.fmu import Fmu
from shaper_fmu.master.wiring import Port, signal_order
from shaper_fmu.ssp.network import Network, Node


def check_loops(network: Network) -> None:
    """Name each loop in which values act on themselves without delay, at the first of its connections.

    An FMU that declares no dependencies gives no reason to think of a loop.
    """
    nodes = {_port(end): end for wire in network.into.values() for end in (wire.source, wire.target)}

    def acting(port: Port) -> list[Port]:
        """The connectors that act on a source without delay: inputs of its FMU, or the connector itself if something drives it."""
        node = nodes[port]
        fmu = network.fmus.get(node.path)
        return [port] if fmu is None else [_port(Node(node.path, name)) for name in declared_inputs(fmu, node.name)]

    connections = {_port(target): _port(wire.source) for target, wire in network.into.items()}
    for loop in signal_order(connections, acting)[1]:
        wires = [network.into[nodes[port]] for port in loop[:-1]]
        at = min(wires, key=lambda wire: wire.line)
        path = [node for wire in wires for node in (wire.source, wire.target) if node.path in network.places]
        ends = list(dict.fromkeys(at.scope.label(node.path, node.name) for node in path))
        message = " -> ".join([*ends, ends[0]])
        at.scope.report_deviation(at.line, f"a loop acts on itself without delay: {message}; put a delay or a state into it")


def declared_inputs(fmu: Fmu, output: str) -> list[str]:
    """Inputs on which an output depends without delay, as the FMU declares; none if it declares nothing."""
    for unknown in fmu.description.outputs:
        if unknown.variable is not None and output in (unknown.variable.name, *fmu.elements_of(str(unknown.variable.name))):
            return [str(v.name) for v in unknown.dependencies or [] if v.causality == "input"]
    return []


def _port(node: Node) -> Port:
    return f"{node.path}\0{node.side}", node.name
