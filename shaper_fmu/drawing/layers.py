"""Columns of boxes: from sources on the left to targets on the right, and their order in each column.

Layered drawing after Sugiyama, Tagawa and Toda 1981: wires that close a loop are set aside, a box stands right of all its
sources, long wires get a place in the columns that they cross, and boxes are ordered by the mean place of their neighbours.
"""

from __future__ import annotations

from collections.abc import Hashable, Iterable, Mapping, Sequence
from statistics import fmean

Edge = tuple[Hashable, Hashable]
_SWEEPS = 6


def columns_of(nodes: Sequence[Hashable], edges: Iterable[Edge]) -> tuple[dict[Hashable, int], set[Edge]]:
    """The column of each node, from 0, and the edges that go back: those that close a loop, in the nodes' order."""
    targets: dict[Hashable, list[Hashable]] = {node: [] for node in nodes}
    for source, target in edges:
        targets[source].append(target)
    back, done, order = set[Edge](), set[Hashable](), list[Hashable]()
    for start in nodes:
        _visit(start, targets, back, done, order)
    column = dict.fromkeys(nodes, 0)
    for node in reversed(order):
        for target in targets[node]:
            if (node, target) not in back:
                column[target] = max(column[target], column[node] + 1)
    return column, back


def _visit(
    start: Hashable, targets: Mapping[Hashable, list[Hashable]], back: set[Edge], done: set[Hashable], order: list[Hashable]
) -> None:
    """Depth first, without recursion, since chains can be long; `order` gets each node after its targets."""
    if start in done:
        return
    path, stack = {start}, [(start, iter(targets[start]))]
    while stack:
        node, rest = stack[-1]
        for target in rest:
            if target in path:
                back.add((node, target))
            elif target not in done:
                path.add(target)
                stack.append((target, iter(targets[target])))
                break
        else:
            stack.pop()
            path.discard(node)
            done.add(node)
            order.append(node)


def ordered(columns: Sequence[Sequence[Hashable]], edges: Iterable[Edge]) -> list[list[Hashable]]:
    """The columns with their nodes in an order with few crossings; edges go from a column to the next one."""
    found = [list(column) for column in columns]
    left: dict[Hashable, list[Hashable]] = {node: [] for column in found for node in column}
    right: dict[Hashable, list[Hashable]] = {node: [] for column in found for node in column}
    for source, target in edges:
        right[source].append(target)
        left[target].append(source)
    for sweep in range(_SWEEPS):
        forth = sweep % 2 == 0
        neighbours = left if forth else right
        for column in found if forth else reversed(found):
            place = {node: i for line in found for i, node in enumerate(line)}
            mean = {node: fmean(place[n] for n in neighbours[node]) if neighbours[node] else place[node] for node in column}
            column.sort(key=mean.__getitem__)
    return found
