"""Places of boxes and wires [px]: columns from left to right, wires of horizontal and vertical lines between them."""

from __future__ import annotations

from collections.abc import Hashable, Mapping, Sequence
from dataclasses import dataclass, field, replace
from itertools import pairwise
from statistics import fmean

from shaper_fmu.drawing.diagram import OUTSIDE, Box, Diagram, Port, Wire, shown_ports
from shaper_fmu.drawing.layers import columns_of, ordered

HEAD, PITCH, MARGIN = 38.0, 18.0, 10.0
"""Heights of a box's head and of a connector, and the room inside its frame."""
LANE, GUTTER, GAP = 9.0, 18.0, 22.0
"""Between vertical lines of wires, beside them, and between boxes of a column."""
_LETTER = 7.4
"""Width of a letter at the size of texts, a little more than of most."""
_IN, _OUT = ("in", ""), ("out", "")

Point = tuple[float, float]


@dataclass
class Placed:
    """A box at its place; `ports` by (side, name): where its wires end. Without a frame it is the diagram's own connectors."""

    box: Box
    width: float
    height: float
    ports: dict[tuple[str, str], float]
    framed: bool = True
    inner: Layout | None = None
    x: float = 0.0
    y: float = 0.0

    def end(self, side: str, name: str) -> Point:
        """Where a wire ends."""
        return (self.x if side == "in" else self.x + self.width), self.y + self.ports[side, name]


@dataclass
class Layout:
    """A diagram with all its places; `wires` are lists of corners, `dots` where a wire branches."""

    diagram: Diagram
    width: float
    height: float
    boxes: list[Placed]
    wires: list[tuple[Wire, list[Point]]]
    dots: list[Point] = field(default_factory=list)


def text_width(text: str) -> float:
    """How wide a text is, about."""
    return _LETTER * sum(2 if ord(letter) > 0x2E80 else 1 for letter in text)


def layout(diagram: Diagram) -> Layout:
    """Place a diagram. Raises KeyError for wires to boxes or connectors that are not there."""
    nodes = _nodes(diagram)
    pairs = [(_node(wire.source, _IN), _node(wire.target, _OUT)) for wire in diagram.wires]
    column, back = columns_of(list(nodes), pairs)
    if _IN in nodes:  # the connectors of the system stand at its edges
        beside = any(one == 0 for node, one in column.items() if node != _IN)
        column = {node: 0 if node == _IN else one + beside for node, one in column.items()}
    if _OUT in nodes:
        column[_OUT] = max(one for node, one in column.items() if node != _OUT) + 1
    chains, lanes = _chains(diagram.wires, pairs, column, back)
    placed: dict[Hashable, Placed] = {**nodes, **lanes}
    column |= {lane: lane[2] for lane in lanes}
    lines = [[node for node in placed if column[node] == i] for i in range(1 + max(column.values(), default=0))]
    steps = [step for chain in chains for step in pairwise(chain)]
    lines = ordered(lines, steps)
    _stack(lines, placed, diagram.wires, chains)
    return _routed(diagram, lines, placed, chains, column)


def _node(name: str, outside: Hashable) -> Hashable:
    return outside if name == OUTSIDE else name


def _nodes(diagram: Diagram) -> dict[Hashable, Placed]:
    used: dict[tuple[str, str], set[str]] = {}
    for wire in diagram.wires:
        used.setdefault((wire.source, "out"), set()).add(wire.source_port)
        used.setdefault((wire.target, "in"), set()).add(wire.target_port)
    found: dict[Hashable, Placed] = {}
    if diagram.inputs:
        found[_IN] = _bare(diagram.inputs, "out")
    for box in diagram.boxes:
        sides = {side: shown_ports(getattr(box, f"{side}puts"), used.get((box.name, side), set())) for side in ("in", "out")}
        found[box.name] = _framed(replace(box, inputs=sides["in"], outputs=sides["out"]))
    if diagram.outputs:
        found[_OUT] = _bare(diagram.outputs, "in")
    return found


def _framed(box: Box) -> Placed:
    if box.inner is not None:
        inner = layout(box.inner)
        ports = {(side, p): y for one in inner.boxes if not one.framed for (side, p), y in _outer(one).items()}
        return Placed(box, inner.width, inner.height, ports, inner=inner)
    left = max((text_width(port.text) for port in box.inputs), default=0.0)
    right = max((text_width(port.text) for port in box.outputs), default=0.0)
    head = max(1.25 * text_width(box.name), text_width(box.text))
    width = max(head, left + right + 18.0 * bool(left and right)) + 2.0 * MARGIN
    rows = max(len(box.inputs), len(box.outputs))
    ports = {("in", port.name): HEAD + PITCH * (i + 0.5) for i, port in enumerate(box.inputs)}
    ports |= {("out", port.name): HEAD + PITCH * (i + 0.5) for i, port in enumerate(box.outputs)}
    return Placed(box, width, HEAD + PITCH * rows + 0.6 * MARGIN, ports)


def _outer(pins: Placed) -> dict[tuple[str, str], float]:
    """The connectors of a system in a box, on the box's other side: what goes in comes out of its edge inside."""
    return {("in" if side == "out" else "out", name): pins.y + y for (side, name), y in pins.ports.items()}


def _bare(ports: Sequence[Port], side: str) -> Placed:
    width = max(text_width(port.text) for port in ports) + MARGIN
    places = {(side, port.name): PITCH * (i + 0.5) for i, port in enumerate(ports)}
    box = Box("", outputs=ports) if side == "out" else Box("", inputs=ports)
    return Placed(box, width, PITCH * len(ports), places, framed=False)


def _chains(
    wires: Sequence[Wire], pairs: Sequence[tuple[Hashable, Hashable]], column: Mapping[Hashable, int], back: set
) -> tuple[list[list[Hashable]], dict[tuple[str, str, int], Placed]]:
    """The nodes that each wire passes, and the places that long wires get on their way; wires of one source share them.

    A wire that goes back has no chain: it runs below all boxes.
    """
    chains: list[list[Hashable]] = []
    lanes: dict[tuple[str, str, int], Placed] = {}
    for wire, (source, target) in zip(wires, pairs, strict=True):
        if (source, target) in back or column[source] >= column[target]:
            chains.append([])
            continue
        way = [(wire.source, wire.source_port, i) for i in range(column[source] + 1, column[target])]
        for lane in way:
            lanes[lane] = Placed(Box(""), 0.0, 0.0, {("in", ""): 0.0, ("out", ""): 0.0}, framed=False)
        chains.append([source, *way, target])
    return chains, lanes


def _port_at(chain: Sequence[Hashable], i: int, wire: Wire, side: str) -> tuple[str, str]:
    inside = 0 < i < len(chain) - 1
    return side, "" if inside else wire.target_port if side == "in" else wire.source_port


def _stack(
    lines: Sequence[Sequence[Hashable]],
    placed: Mapping[Hashable, Placed],
    wires: Sequence[Wire],
    chains: Sequence[Sequence[Hashable]],
) -> None:
    """The heights: each box where its wires come in straight, as far as the one above it leaves room."""
    wanted: dict[Hashable, list[tuple[Placed, float]]] = {node: [] for node in placed}
    for wire, chain in zip(wires, chains, strict=True):
        for i in range(1, len(chain)):
            source, target = placed[chain[i - 1]], placed[chain[i]]
            offset = source.ports[_port_at(chain, i - 1, wire, "out")] - target.ports[_port_at(chain, i, wire, "in")]
            wanted[chain[i]].append((source, offset))
    for line in lines:
        least = -1e9
        for node in line:
            one = placed[node]
            places = [source.y + offset for source, offset in wanted[node]]
            one.y = max(least, fmean(places) if places else (0.0 if least < -1e8 else least))
            least = one.y + one.height + (GAP if one.height else LANE)


def _routed(
    diagram: Diagram, lines: Sequence[Sequence[Hashable]], placed: Mapping[Hashable, Placed],
    chains: Sequence[Sequence[Hashable]], column: Mapping[Hashable, int],
) -> Layout:  # fmt: skip
    top = min((one.y for one in placed.values()), default=0.0)
    for one in placed.values():
        one.y += HEAD + MARGIN - top
    bottom = max((one.y + one.height for one in placed.values()), default=HEAD) + MARGIN
    runs, bottom = _runs(diagram.wires, chains, placed, column, bottom)
    x = MARGIN if _IN not in placed else 0.0
    lane_x, x = _gutter(-1, runs, {}, x)
    for i, line in enumerate(lines):
        width = max(placed[node].width for node in line)
        for node in line:
            one = placed[node]
            if not one.width:
                one.width = width  # a wire that passes this column
            one.x = x + (0.0 if node == _IN else width - one.width if node == _OUT else 0.5 * (width - one.width))
        x += width
        if i < len(lines) - 1 or any(gutter == i for gutter, *_ in runs):
            lane_x, x = _gutter(i, runs, lane_x, x)
    x += 0.0 if _OUT in placed else MARGIN
    width = max(x, 1.25 * text_width(diagram.title) + 2.0 * MARGIN, text_width(diagram.remark) + 2.0 * MARGIN)
    corners = [_corners(w, c, placed, column, lane_x, runs) for w, c in zip(diagram.wires, chains, strict=True)]
    if _OUT in placed:
        placed[_OUT].x += width - x
        corners = [[*line[:-1], (line[-1][0] + width - x, line[-1][1])] if w.target == OUTSIDE else line
                   for w, line in zip(diagram.wires, corners, strict=True)]  # fmt: skip
    boxes = [one for node, one in placed.items() if not (isinstance(node, tuple) and len(node) == 3)]
    height = bottom + (PITCH if diagram.remark else 0.0)
    return Layout(diagram, width, height, boxes, list(zip(diagram.wires, corners, strict=True)), _dots(runs, lane_x))


Net = tuple[str, str]
Runs = dict[tuple[int, Net, str], list[float]]
"""By gutter, source and part of its way ("back" at the end of one that goes back): the heights that a vertical line joins."""


def _runs(
    wires: Sequence[Wire], chains: Sequence[Sequence[Hashable]], placed: Mapping[Hashable, Placed],
    column: Mapping[Hashable, int], bottom: float,
) -> tuple[Runs, float]:  # fmt: skip
    runs: Runs = {}
    below: dict[Net, float] = {}
    for wire, chain in zip(wires, chains, strict=True):
        net = wire.source, wire.source_port
        source, target = placed[_node(wire.source, _IN)], placed[_node(wire.target, _OUT)]
        begin, end = source.end("out", wire.source_port)[1], target.end("in", wire.target_port)[1]
        first = column[_node(wire.source, _IN)]
        if chain:
            heights = [begin, *(placed[node].y for node in chain[1:-1]), end]
            for i, pair in enumerate(pairwise(heights)):
                runs.setdefault((first + i, net, ""), []).extend(pair)
            continue
        if net not in below:
            below[net], bottom = bottom, bottom + LANE
        runs.setdefault((first, net, ""), []).extend((begin, below[net]))
        runs.setdefault((column[_node(wire.target, _OUT)] - 1, net, "back"), []).extend((end, below[net]))
    return runs, bottom + (MARGIN if below else 0.0)


def _gutter(
    i: int, runs: Runs, lane_x: dict[tuple[int, Net, str], float], x: float
) -> tuple[dict[tuple[int, Net, str], float], float]:
    """Places of the vertical lines right of column i, and where the next column begins: those that go up first, topmost first."""
    mine = [key for key in runs if key[0] == i]
    if not mine and i < 0:
        return lane_x, x
    bent = [key for key in mine if max(runs[key]) - min(runs[key]) > 0.5]

    def order(key: tuple[int, Net, str]) -> tuple[bool, float]:
        down = max(runs[key]) - runs[key][0] > runs[key][0] - min(runs[key])
        return down, -runs[key][0] if down else runs[key][0]

    places = {key: x + GUTTER + LANE * n for n, key in enumerate(sorted(bent, key=order))}
    straight = dict.fromkeys((key for key in mine if key not in places), x + GUTTER)
    return {**lane_x, **places, **straight}, x + 2.0 * GUTTER + LANE * max(0, len(bent) - 1)


def _corners(
    wire: Wire, chain: Sequence[Hashable], placed: Mapping[Hashable, Placed], column: Mapping[Hashable, int],
    lane_x: Mapping[tuple[int, Net, str], float], runs: Runs,
) -> list[Point]:  # fmt: skip
    net, first = (wire.source, wire.source_port), column[_node(wire.source, _IN)]
    begin = placed[_node(wire.source, _IN)].end("out", wire.source_port)
    end = placed[_node(wire.target, _OUT)].end("in", wire.target_port)
    points = [begin]
    if chain:
        for i, node in enumerate(chain[1:]):
            x = lane_x[first + i, net, ""]
            y = end[1] if i == len(chain) - 2 else placed[node].y
            points += [(x, points[-1][1]), (x, y)]
    else:
        last = column[_node(wire.target, _OUT)] - 1
        out, back, low = lane_x[first, net, ""], lane_x[last, net, "back"], runs[first, net, ""]
        points += [(out, begin[1]), (out, max(low)), (back, max(low)), (back, end[1])]
    return [*points, end]


def _dots(runs: Runs, lane_x: Mapping[tuple[int, Net, str], float]) -> list[Point]:
    """Where horizontal lines join a vertical one between its ends."""
    return [
        (lane_x[key], y)
        for key, heights in runs.items()
        for y in sorted(set(heights))
        if min(heights) + 0.5 < y < max(heights) - 0.5
    ]
