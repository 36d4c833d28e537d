"""Decides which instances take new inputs at an event between the points of the grid.

An instance that announces events makes something of every change of its inputs: a shaper passes each on, once for every impulse.
At an event of somebody else a smooth input has changed a little, too; taken, that little step would come back as events of its
own, each of which would have the input taken again, and so on without end. So at an event off the grid such an instance takes
new inputs only if what acts on them has just had an event.
"""

from __future__ import annotations

from collections.abc import Collection, Mapping

from shaper_fmu.master.signals import Table
from shaper_fmu.master.structure import SystemStructure
from shaper_fmu.master.wiring import Port

TABLES = "tables"
"""The cause that stands for jumps of input tables."""


def causes_of_inputs(
    system: SystemStructure, connections: Mapping[Port, Port], announcing: Collection[str]
) -> dict[str, list[str]]:
    """For each instance of `announcing` with inputs that are fed: the instances whose events can make them jump, or `TABLES`."""
    found: dict[str, list[str]] = {}
    for name in announcing:
        fed = [port for port in [*connections, *system.signals] if port[0] == name]
        causes: dict[str, None] = {}
        for port in fed:
            _add_causes(system, connections, announcing, port, causes, set())
        if fed:
            found[name] = list(causes)
    return found


def _add_causes(
    system: SystemStructure,
    connections: Mapping[Port, Port],
    announcing: Collection[str],
    target: Port,
    causes: dict[str, None],
    seen: set[Port],
) -> None:
    """Follow an input back to its sources, through what acts without delay."""
    if target in seen:
        return
    seen.add(target)
    if target in system.signals:
        if isinstance(system.signals[target], Table):
            causes[TABLES] = None
        return
    if target not in connections:
        return
    instance, output = connections[target]
    if instance in announcing:
        causes[instance] = None
    for input_ in system.fmus[instance].inputs_of(output):
        _add_causes(system, connections, announcing, (instance, input_), causes, seen)
