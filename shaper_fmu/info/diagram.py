"""FMUs and systems as they are drawn, by the facts that their files tell."""

from __future__ import annotations

from collections.abc import Iterable, Sequence
from dataclasses import replace

from shaper_fmu.drawing.diagram import OUTSIDE, Box, Diagram, Port, Wire
from shaper_fmu.info.facts import ConnectionInfo, ConnectorInfo, ElementInfo, FmuInfo, SspInfo, VariableInfo


def fmu_diagram(fmu: FmuInfo) -> Diagram:
    """An FMU as one box with its inputs and outputs."""
    inputs, outputs = (list(map(_of_variable, side)) for side in (fmu.inputs, fmu.outputs))
    text = f"FMI {fmu.fmi_version}, {', '.join(fmu.kinds) or 'of no kind'}"
    return Diagram(fmu.file, [Box(fmu.name or fmu.file, text, inputs, outputs)])


def system_diagram(system: SspInfo) -> Diagram:
    """A system with the systems in it. Connections that cannot be laid are counted below it."""
    name = system.name if system.name not in ("", system.system.name) else system.file
    return replace(_of_system(system.system, system), title=name)


def _of_variable(variable: VariableInfo) -> Port:
    return Port(variable.name + "".join(f"[{size}]" for size in variable.dimensions), variable.unit)


def _of_system(element: ElementInfo, system: SspInfo) -> Diagram:
    named = {one.name: one for one in element.elements if one.name != OUTSIDE}
    names = sorted(named, key=len, reverse=True)
    wires = [_wire(one, names) for one in element.connections if one.laid]
    boxes = [_box(one, system, wires) for one in named.values()]
    inputs, outputs = _sides(element.connectors)
    _complete(inputs, (wire.source_port for wire in wires if wire.source == OUTSIDE))
    _complete(outputs, (wire.target_port for wire in wires if wire.target == OUTSIDE))
    missing = [("element", len(element.elements) - len(named)), ("connection", len(element.connections) - len(wires))]
    remarks = [f"{count} {what}{'s' if count > 1 else ''}" for what, count in missing if count]
    remark = f"not drawn, since they are wrong: {', '.join(remarks)}; `shaper-fmu check` tells why" if remarks else ""
    return Diagram(element.name, boxes, wires, inputs, outputs, remark)


def _wire(one: ConnectionInfo, elements: Sequence[str]) -> Wire:
    note = one.change or (f"{one.source_unit} to {one.target_unit}" if one.source_unit != one.target_unit else "")
    return Wire(*_end(one.source, elements), *_end(one.target, elements), note)


def _box(element: ElementInfo, system: SspInfo, wires: list[Wire]) -> Box:
    """An element with the connectors that it declares; a component that declares none with the variables of its FMU."""
    if element.kind == "system" and (element.elements or element.connectors):
        return Box(element.name, inner=_of_system(element, system))
    inputs, outputs = _sides(element.connectors)
    fmu = system.fmus.get(element.fmu)
    if fmu is not None and not element.connectors:
        inputs, outputs = (list(map(_of_variable, side)) for side in (fmu.inputs, fmu.outputs))
    _complete(inputs, (wire.target_port for wire in wires if wire.target == element.name))
    _complete(outputs, (wire.source_port for wire in wires if wire.source == element.name))
    return Box(element.name, element.source.rpartition("/")[2] or element.kind, inputs, outputs)


def _sides(connectors: Sequence[ConnectorInfo]) -> tuple[list[Port], list[Port]]:
    """The connectors through which values go in, and come out: inputs and outputs; parameters are many, and seldom connected."""
    ports = {kind: [Port(one.name, one.unit) for one in connectors if one.kind == kind] for kind in ("input", "output")}
    return ports["input"], ports["output"]


def _complete(ports: list[Port], used: Iterable[str]) -> None:
    """Add what a wire ends at, and is no input or output: a parameter, a local variable, an entry of a dictionary."""
    known = {port.name for port in ports}
    ports += [Port(name) for name in dict.fromkeys(used) if name not in known]


def _end(name: str, elements: Iterable[str]) -> tuple[str, str]:
    """The element and the connector of an end; `OUTSIDE` for a connector of the system itself."""
    for element in elements:
        if name.startswith(f"{element}."):
            return element, name[len(element) + 1 :]
    return OUTSIDE, name
