"""A system as it is drawn: boxes with connectors, and wires between them."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, field

MOST_PORTS = 12
"""Connectors on a side of a box; of those that no wire uses as many as there is room for, the others are counted."""

MOST_DRAWN = 150
"""Boxes of a drawing that is made unasked, such as in a notebook: a larger one is no help."""

OUTSIDE = ""
"""The name of the diagram itself as the end of a wire: its own connectors."""


@dataclass(frozen=True)
class Port:
    """A connector. `unit` is "" if it has none."""

    name: str
    unit: str = ""

    @property
    def text(self) -> str:
        """Its name and unit."""
        return f"{self.name} [{self.unit}]" if self.unit else self.name


@dataclass(frozen=True)
class Wire:
    """A connection: the names of two boxes and of their connectors; `OUTSIDE` for the diagram's own. `note`: what changes on it."""

    source: str
    source_port: str
    target: str
    target_port: str
    note: str = ""


@dataclass(frozen=True)
class Box:
    """A box: an element of a system, or with `inner` a system in it, whose own connectors are then the box's."""

    name: str
    text: str = ""
    inputs: Sequence[Port] = ()
    outputs: Sequence[Port] = ()
    inner: Diagram | None = None


@dataclass(frozen=True)
class Diagram:
    """Boxes of different names, wires between them, and the connectors to the outside. `remark` is written below."""

    title: str
    boxes: Sequence[Box] = ()
    wires: Sequence[Wire] = ()
    inputs: Sequence[Port] = ()
    outputs: Sequence[Port] = ()
    remark: str = field(default="")


def shown_ports(ports: Sequence[Port], used: set[str], most: int = MOST_PORTS) -> list[Port]:
    """The ports that are drawn, in their order: all that wires use, others while there is room; the last one counts the rest."""
    room = max(0, most - sum(port.name in used for port in ports))
    shown = []
    for port in ports:
        if port.name in used or room > 0:
            shown.append(port)
            room -= port.name not in used
    more = len(ports) - len(shown)
    return [*shown, Port(f"and {more} more")] if more else shown
