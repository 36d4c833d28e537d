"""The execution order of a system's instances, and its loops without delay."""

from __future__ import annotations

from collections.abc import Callable, Iterable
from graphlib import CycleError, TopologicalSorter
from itertools import pairwise

Port = tuple[str, str]
"""Instance name and variable name."""


Loop = tuple[Port, ...]
"""Inputs that act on each other without delay, the first of them repeated at the end."""


def signal_order(
    connections: dict[Port, Port],
    inputs_of: Callable[[Port], Iterable[Port]],
    clocked: Callable[[Port], bool] = lambda port: False,
    sampled: set[Port] | None = None,
) -> tuple[list[Port], list[Loop]]:
    """The connected inputs, each after those that act on its source without delay; and the loops.

    `connections` maps an input to its source; `inputs_of` gives the inputs that an output depends on without delay. Each
    loop is cut at its first input, which then comes before what acts on it. A loop through a variable that is `clocked` is none:
    all its clocked inputs whose sources are not get what these were before the clock's tick; they are added to `sampled`.
    """
    causes = {target: [port for port in inputs_of(source) if port in connections] for target, source in connections.items()}
    places = {target: i for i, target in enumerate(connections)}
    loops: list[Loop] = []
    while True:
        try:
            return list(TopologicalSorter(causes).static_order()), loops
        except CycleError as error:
            cycle = list(reversed(error.args[1]))[:-1]
            pairs = zip(cycle, [cycle[-1], *cycle[:-1]], strict=True)  # each acts on the one before it
            samplers = [one for one, next_ in pairs if clocked(one) or clocked(connections[next_])]
            between = [one for one in samplers if clocked(one) and not clocked(connections[one])]
            if between:
                causes.update({one: [] for one in between})
                if sampled is not None:
                    sampled.update(between)
                continue
            if samplers:  # all are clocked, by clocks that do not tick together
                causes[min(samplers, key=places.__getitem__)] = []
                continue
            cut = cycle.index(min(cycle, key=places.__getitem__))
            cycle = cycle[cut:] + cycle[:cut]
            loops.append((*cycle, cycle[0]))
            causes[cycle[0]] = []


def instance_order(names: list[str], connections: dict[Port, Port], feedthrough: Callable[[Port], bool]) -> list[str]:
    """The instances, sources before their targets; a loop is cut at an input without direct feedthrough if it has one."""
    edges: dict[tuple[str, str], bool] = {}  # (source, target) -> some connection acts without delay
    for target, source in connections.items():
        if source[0] != target[0]:
            edge = (source[0], target[0])
            edges[edge] = edges.get(edge, False) or feedthrough(target)
    while True:
        sorter: TopologicalSorter[str] = TopologicalSorter({name: [] for name in names})
        for source, target in edges:
            sorter.add(target, source)
        try:
            return list(sorter.static_order())
        except CycleError as error:
            cycle = error.args[1]
            in_loop = [edge for edge in edges if edge in set(pairwise(cycle))]
            del edges[next((edge for edge in reversed(in_loop) if not edges[edge]), in_loop[-1])]
