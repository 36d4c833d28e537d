"""Figures as data, drawn the same way in an interactive page (plotly) and as a picture (matplotlib)."""

from __future__ import annotations

from dataclasses import dataclass, field

import numpy as np

COLOURS = ("#0072B2", "#D55E00", "#009E73", "#CC79A7", "#E69F00", "#56B4E9", "#000000")
"""Okabe and Ito's palette, which the colour-blind can tell apart."""

DASHES = ("solid", "dash", "dashdot", "dot")
"""So that lines differ in black and white too."""


@dataclass(frozen=True)
class Line:
    """A named curve; arrays of shape (n,). `markers` shows the points.

    Lines of one `style` look the same in every figure; without it, lines are styled in their order.
    """

    name: str
    x: np.ndarray
    y: np.ndarray
    markers: bool = False
    style: int | None = None


@dataclass(frozen=True)
class Figure:
    """Curves over one pair of axes.

    Attributes:
        key: short name, for the picture's file name.
        levels: horizontal lines: (value, label).
        marks: vertical lines: (value, label).
    """

    key: str
    title: str
    x_label: str
    y_label: str
    lines: list[Line]
    levels: list[tuple[float, str]] = field(default_factory=list)
    marks: list[tuple[float, str]] = field(default_factory=list)

    def styles(self) -> list[tuple[str, str]]:
        """Colour and dash of each line."""
        numbers = [i if line.style is None else line.style for i, line in enumerate(self.lines)]
        return [(COLOURS[n % len(COLOURS)], DASHES[n % len(DASHES)]) for n in numbers]


def label(quantity: str, unit: str) -> str:
    """An axis label: "quantity [unit]"."""
    return f"{quantity} [{unit}]" if unit else quantity
