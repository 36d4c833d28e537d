"""How events are treated: exactly, by steps that end at them, or on the grid, by means over the steps."""

from __future__ import annotations

from typing import NamedTuple

from shaper_fmu.master.structure import SystemStructure
from shaper_fmu.master.wiring import Port

MEAN = "_mean"
"""How the names of outputs end that are means over the step of others."""


class Treatment(NamedTuple):
    """Whether steps end at events, the connections that are used, and notes on both."""

    exact: bool
    connections: dict[Port, Port]
    notes: tuple[str, ...]


def treat_events(system: SystemStructure, exact: bool | None) -> Treatment:
    """Decide how a run treats events; `exact` is what the user has set, None for nothing.

    Steps end at events unless an FMU takes no steps of other lengths, or a mean over the step is wired, such as
    `shaped_mean`: it belongs to steps of one length. An FMU that keeps to the grid gets the mean of an output over each step
    in the output's place, where there is one.
    """
    rigid = [name for name, fmu in system.fmus.items() if not fmu.takes_any_step]
    means = [source for source in system.connections.values() if source[1].endswith(MEAN)]
    if exact is not None and not (exact and rigid):
        return Treatment(exact, system.connections, ())
    if not rigid and not means:
        return Treatment(True, system.connections, ())
    if not rigid:
        return Treatment(False, system.connections, (f"events are kept on the grid, since {'.'.join(means[0])} is a mean over it",))
    connections, notes = (
        dict(system.connections),
        [f"events are kept on the grid, since {rigid[0]} takes no steps of other lengths"],
    )
    for target, source in system.connections.items():
        mean = source[1] + MEAN
        if mean in system.fmus[source[0]].variables:
            connections[target] = (source[0], mean)
            notes.append(f"{'.'.join(target)} gets {source[0]}.{mean} in place of {'.'.join(source)}")
    return Treatment(False, connections, tuple(notes))
