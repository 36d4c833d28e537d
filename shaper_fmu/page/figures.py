"""Figures as data, drawn the same way in a page (chart.js) and as a picture (matplotlib)."""

from __future__ import annotations

import math
from dataclasses import dataclass, field

import numpy as np

COLOURS = ("#0072B2", "#D55E00", "#009E73", "#CC79A7", "#E69F00", "#56B4E9", "#000000")
"""Okabe and Ito's palette, which the colour-blind can distinguish."""

DASHES = ("solid", "dash", "dashdot", "dot")
"""So that lines differ in black and white too."""

UNSHAPED_AND_SHAPED = (1, 0)
"""Styles of both, the same in all figures and on the live page."""

_BESIDE = {"rad/s": ("Hz", 0.5 / math.pi), "Hz": ("rad/s", 2.0 * math.pi)}

SYMBOLS = ("circle", "square", "diamond", "triangle-up", "cross")
"""So that points that no line joins do."""


@dataclass(frozen=True)
class Line:
    """A named curve.

    Attributes:
        x, y: arrays of shape (n,), in the units that the figure's labels tell.
        markers: whether the points are shown; without `joined` they are all that is shown.
        style: lines of one style look the same in every figure; None to style them in their order.
        right: whether it belongs to the axis on the right, `Figure.right_label`.
    """

    name: str
    x: np.ndarray
    y: np.ndarray
    markers: bool = False
    style: int | None = None
    joined: bool = True
    right: bool = False


@dataclass(frozen=True)
class Figure:
    """Curves over one pair of axes, or two that share the horizontal one.

    Attributes:
        key: short name, for the picture's file name.
        title, x_label, y_label: texts; labels tell the units, such as "position [m]".
        lines: the curves.
        levels: horizontal lines: (value, label).
        marks: vertical lines: (value, label).
        log_x: whether the horizontal axis is logarithmic.
        right_label: of a second vertical axis, on the right; "" for none.
        bands: ranges of the horizontal axis that are shaded: (low, high).
    """

    key: str
    title: str
    x_label: str
    y_label: str
    lines: list[Line]
    levels: list[tuple[float, str]] = field(default_factory=list)
    marks: list[tuple[float, str]] = field(default_factory=list)
    log_x: bool = False
    right_label: str = ""
    bands: list[tuple[float, float]] = field(default_factory=list)

    def beside(self) -> tuple[str, float] | None:
        """Second unit of a horizontal axis of frequencies, and its factor: Hz beside rad/s, and rad/s beside Hz."""
        quantity, _, unit = self.x_label.rpartition("[")
        return _BESIDE.get(unit.rstrip("]")) if "frequency" in quantity else None

    def styles(self) -> list[tuple[str, str]]:
        """Colour and dash of each line."""
        return [(COLOURS[n % len(COLOURS)], DASHES[n % len(DASHES)]) for n in self.numbers()]

    def symbols(self) -> list[str]:
        """Symbol of each line's points: circles, and different ones where no line joins them."""
        return ["circle" if line.joined else SYMBOLS[n % len(SYMBOLS)] for n, line in zip(self.numbers(), self.lines, strict=True)]

    def numbers(self) -> list[int]:
        """Number of each line's style."""
        return [i if line.style is None else line.style for i, line in enumerate(self.lines)]


@dataclass(frozen=True)
class Panels:
    """Figures that belong together, such as (a), (b), ... of a paper's figure: one picture, two in a row.

    Attributes:
        key: short name, for the picture's file name.
        title: of the whole.
        figures: the panels, each with its own key and title.
    """

    key: str
    title: str
    figures: list[Figure]


@dataclass(frozen=True)
class Map:
    """Values over two axes, in colours with contour lines, with one scale and a panel per case.

    Attributes:
        key: short name, for the picture's file name.
        title, x_label, y_label: texts; labels tell the units, such as "position [m]".
        lines: the curves.
        x, y: the axes' values, rising, shapes (n,) and (m,).
        panels: (name, values of shape (m, n)) in rows from left to right; a name may be "".
        levels: contour lines: (value, label), the first one drawn stronger.
        largest: end of the colour scale; values beyond have its colour. None for the largest value.
        points: marked points: (x, y).
    """

    key: str
    title: str
    x_label: str
    y_label: str
    value_label: str
    x: np.ndarray
    y: np.ndarray
    panels: list[tuple[str, np.ndarray]]
    levels: list[tuple[float, str]] = field(default_factory=list)
    largest: float | None = None
    points: list[tuple[float, float]] = field(default_factory=list)

    def __post_init__(self) -> None:
        shape = len(self.y), len(self.x)
        for name, values in self.panels:
            if values.shape != shape:
                raise ValueError(f"map {self.key!r}: panel {name!r} has the shape {values.shape}, but its axes ask for {shape}")

    def grid(self) -> tuple[int, int]:
        """Rows and columns of panels, three in a row at most."""
        columns = min(3, len(self.panels)) if len(self.panels) != 4 else 2
        return -(-len(self.panels) // columns), columns

    def scale(self) -> tuple[float, float]:
        """The ends of the colour scale: 0, or the smallest value below it, and `largest`."""
        smallest = min(float(np.nanmin(values)) for _, values in self.panels)
        greatest = max(float(np.nanmax(values)) for _, values in self.panels)
        return min(0.0, smallest), greatest if self.largest is None else self.largest


def label(quantity: str, unit: str) -> str:
    """An axis label: "quantity [unit]"."""
    return f"{quantity} [{unit}]" if unit else quantity
