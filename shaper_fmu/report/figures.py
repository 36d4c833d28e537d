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
    """A named curve; arrays of shape (n,). `markers` shows the points."""

    name: str
    x: np.ndarray
    y: np.ndarray
    markers: bool = False


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


def label(quantity: str, unit: str) -> str:
    """An axis label: "quantity [unit]"."""
    return f"{quantity} [{unit}]" if unit else quantity
