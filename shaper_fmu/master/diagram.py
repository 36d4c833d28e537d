"""A system in Python as it is drawn."""

from __future__ import annotations

from typing import TYPE_CHECKING

from shaper_fmu.drawing.diagram import OUTSIDE, Box, Diagram, Port, Wire

if TYPE_CHECKING:
    from shaper_fmu.master.structure import SystemStructure


def diagram_of(system: SystemStructure) -> Diagram:
    """The instances, their connections, and what drives inputs from outside; arrays that are connected as a whole are one wire."""
    sides: dict[str, dict[str, dict[str, str]]] = {}
    for instance, fmu in system.fmus.items():
        named = [(str(v.name), str(v.causality)) for v in fmu.variables.values() if v.causality in ("input", "output")]
        sides[instance] = {
            side: {name: fmu.unit_of(name) or "" for name, one in named if one == side} for side in ("input", "output")
        }
    wires: dict[tuple[str, ...], Wire] = {}
    for target, source in {**system.connections, **system.clock_connections}.items():
        gain, offset = system.scalings.get(target, (1.0, 0.0))
        note = f"{gain:g} * value + {offset:g}" if (gain, offset) != (1.0, 0.0) else ""
        ends = (source[1], target[1])
        if _index(ends[0]) == _index(ends[1]):
            ends = _whole(ends[0]), _whole(ends[1])
        for side, (instance, _), end, name in (("output", source, ends[0], source[1]), ("input", target, ends[1], target[1])):
            _join(sides[instance][side], name, end, system.unit((instance, name)))
        key = source[0], ends[0], target[0], ends[1]
        wires.setdefault(key, Wire(*key, note=note))
    inputs = []
    for instance, variable in system.signals:
        name = f"{instance}.{variable}"
        inputs.append(
            Port("signal" if len(system.signals) == 1 else f"signal {len(inputs) + 1}", system.unit((instance, variable)))
        )
        wires[name,] = Wire(OUTSIDE, inputs[-1].name, instance, variable)
    boxes = []
    for name, fmu in system.fmus.items():
        ports = {side: [Port(one, unit) for one, unit in found.items()] for side, found in sides[name].items()}
        boxes.append(Box(name, fmu.name, ports["input"], ports["output"]))
    return Diagram(system.name, boxes, list(wires.values()), inputs)


def _index(name: str) -> str:
    """The index of an element of an array, "[2]"; the name itself for what is none."""
    return name[name.rindex("[") :] if name.endswith("]") else name


def _whole(name: str) -> str:
    return name[: name.rindex("[")] + "[]" if name.endswith("]") else name


def _join(ports: dict[str, str], name: str, end: str, unit: str) -> None:
    """An element becomes a part of its array where this is connected as a whole; local variables appear when they are connected."""
    if end != name:
        ports.pop(name, None)
    ports.setdefault(end, unit)
