"""Loops of direct feedthrough, as far as the FMUs declare which outputs depend on which inputs."""

from __future__ import annotations

from collections.abc import Mapping

from shaper_fmu.master.fmu import Fmu
from shaper_fmu.master.wiring import Port, signal_order
from shaper_fmu.ssp.check_scene import Scene
from shaper_fmu.ssp.check_structure import Place, label, places
from shaper_fmu.ssp.document import SystemElement

Ends = tuple[Place, str]


def check_loops(scene: Scene, fmus: Mapping[Place, Fmu], directed: Mapping[Ends, Ends]) -> None:
    """Name each loop in which values act on themselves without delay, at the first of its connections.

    `directed` are the connections, destination -> source. An FMU that declares no dependencies gives no reason to think of a loop.
    """

    def acting(port: Port) -> list[Port]:
        """What acts on a source without delay: inputs of its FMU, or the system's connector itself, which something drives."""
        end = ends[port]
        fmu = fmus.get(end[0])
        return [port] if fmu is None else [_port((end[0], name)) for name in declared_inputs(fmu, end[1])]

    ends = {_port(end): end for pair in directed.items() for end in pair}
    connections = {_port(target): _port(source) for target, source in directed.items()}
    lines = _lines(scene)
    for loop in signal_order(connections, acting)[1]:
        path = [end for port in loop[:-1] for end in (directed[ends[port]], ends[port])]
        line = min(lines.get(ends[port], 0) for port in loop)
        words = " -> ".join(label(*end) for end in [*path, path[0]])
        scene.tell(line, f"a loop acts on itself without delay: {words}; put a delay or a state into it")


def declared_inputs(fmu: Fmu, output: str) -> list[str]:
    """Inputs on which the FMU says that an output depends without delay; none if it says nothing."""
    for unknown in fmu.description.outputs:
        if unknown.variable is not None and output in (unknown.variable.name, *fmu.elements_of(str(unknown.variable.name))):
            return [str(v.name) for v in unknown.dependencies or [] if v.causality == "input"]
    return []


def _port(end: Ends) -> Port:
    return "\0".join(end[0]), end[1]


def _lines(scene: Scene) -> dict[Ends, int]:
    """The line of a connection by either of its ends."""
    found: dict[Ends, int] = {}
    for place, system in places(scene.description.system):
        for connection in system.connections if isinstance(system, SystemElement) else []:
            for element, connector in (
                (connection.start_element, connection.start_connector),
                (connection.end_element, connection.end_connector),
            ):
                found.setdefault(((*place, element) if element else place, connector), connection.line)
    return found
