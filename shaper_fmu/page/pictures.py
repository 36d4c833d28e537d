"""Draws figures as pictures with matplotlib, without a display."""

from __future__ import annotations

import itertools
import textwrap
import warnings
from collections.abc import Sequence
from pathlib import Path
from typing import Any

import matplotlib
import numpy as np
from matplotlib.backends.backend_agg import FigureCanvasAgg
from matplotlib.figure import Figure as Canvas
from matplotlib.patheffects import withStroke

from shaper_fmu.page.figures import Figure, Map

_TITLE = 32
"""Letters in a line of a map's panel's title."""
WIDE_TITLE, HALF_TITLE = 76, 56
"""The same of a figure that has the picture's width for itself, and of one beside another."""

_SYMBOLS = {"circle": "o", "square": "s", "diamond": "D", "triangle-up": "^", "cross": "P"}
_STYLES = {"solid": "-", "dash": "--", "dashdot": "-.", "dot": ":"}


def write_picture(figure: Figure, *paths: Path) -> Path:
    """Draw the figure into files, PNG or SVG by the paths' ends; returns the first path. Folders that are missing are made.

    Needs matplotlib. Raises OSError where a file cannot be written.
    """
    return write_pictures([figure], *paths)


def write_pictures(figures: Sequence[Figure], *paths: Path, columns: int = 1, title: str = "") -> Path:
    """Draw the figures, one below the other or in `columns`, into files, PNG or SVG by the paths' ends; returns the first path."""
    rows = -(-len(figures) // columns)
    canvas = Canvas(figsize=(8.0 if columns == 1 else 6.0 * columns, 4.5 * rows), layout="constrained")
    FigureCanvasAgg(canvas)
    places = canvas.subplots(rows, columns, squeeze=False).flat
    for axes, figure in itertools.zip_longest(places, figures):
        axes.set_axis_off() if figure is None else draw(figure, axes, WIDE_TITLE if columns == 1 else HALF_TITLE)
    canvas.suptitle(_escaped(title))
    return _save(canvas, paths)


def draw(figure: Figure, axes: Any, title_letters: int = WIDE_TITLE) -> None:
    """Draw the figure on axes of matplotlib; a title of more than `title_letters` gets further lines."""
    right = axes.twinx() if figure.right_label else axes
    drawn = []
    for line, (colour, dash), symbol in zip(figure.lines, figure.styles(), figure.symbols(), strict=True):
        drawn += (right if line.right else axes).plot(
            line.x, line.y, color=colour, label=_escaped(line.name),
            linestyle=_STYLES[dash] if line.joined else "",
            marker=_SYMBOLS[symbol] if line.markers or not line.joined else "",
            markersize=4 if line.joined else 8 if len(line.x) == 1 else 2.5,
        )  # fmt: skip
    for low, high in figure.bands:
        axes.axvspan(low, high, facecolor="#eeeeee", edgecolor="#bbbbbb", hatch="//", linewidth=0.0, zorder=0)
    for value, text in figure.levels:
        axes.axhline(value, color="#555555", linewidth=0.8, linestyle=":")
        axes.annotate(
            _escaped(text),
            (1.0, value),
            xycoords=("axes fraction", "data"),
            ha="right",
            va="bottom",
            fontsize="small",
            color="#555555",
        )
    for value, text in figure.marks:
        axes.axvline(value, color="#555555", linewidth=0.8, linestyle=":")
        axes.annotate(
            _escaped(text),
            (value, 0.985),
            xycoords=("data", "axes fraction"),
            ha="right",
            va="top",
            rotation=90,
            fontsize="small",
            color="#555555",
        )
    if figure.log_x:
        axes.set_xscale("log")
    axes.set(
        title=_escaped(textwrap.fill(figure.title, title_letters)), xlabel=_escaped(figure.x_label), ylabel=_escaped(figure.y_label)
    )
    if beside := figure.beside():
        unit, factor = beside
        above = axes.secondary_xaxis("top", functions=(lambda x: x * factor, lambda x: x / factor))
        above.set_xlabel(f"[{unit}]", fontsize="small")
        above.tick_params(labelsize="small")
    if axes.get_ylim()[0] > 0.0:
        axes.set_ylim(bottom=0.0)  # as in the page
    axes.grid(True, linewidth=0.4, color="#cccccc")
    if figure.right_label:
        right.set_ylabel(_escaped(figure.right_label))
    if drawn:
        right.legend(handles=drawn, framealpha=0.85, edgecolor="none")  # on the upper one of both axes


def write_map_picture(map_: Map, *paths: Path) -> Path:
    """Draw the map into files, PNG or SVG by the paths' ends; returns the first path."""
    rows, columns = map_.grid()
    canvas = Canvas(figsize=(1.6 + 2.8 * columns, 0.6 + 2.6 * rows), layout="constrained")
    FigureCanvasAgg(canvas)
    low, high = map_.scale()
    panels = canvas.subplots(rows, columns, sharex=True, sharey=True, squeeze=False)
    drawn = None
    for axes in panels.flat[len(map_.panels) :]:
        axes.set_axis_off()
    for axes, (name, values) in zip(panels.flat, map_.panels, strict=False):
        drawn = axes.pcolormesh(map_.x, map_.y, values, cmap="cividis", vmin=low, vmax=high, shading="gouraud", rasterized=True)
        for k, (level, text) in enumerate(map_.levels):
            if np.nanmin(values) < level < np.nanmax(values):
                edge = [withStroke(linewidth=1.5 if k else 3.0, foreground="black")]  # seen on every colour, and in print
                lines = axes.contour(map_.x, map_.y, values, [level], colors="white", linewidths=0.8 if k else 1.8)
                lines.set_path_effects(edge)
                for label in axes.clabel(lines, fmt={level: _escaped(text)}, fontsize="small"):
                    label.set_path_effects([withStroke(linewidth=2.0, foreground="black")])
        for x, y in map_.points:
            axes.plot(x, y, "+", color="white", markersize=9, markeredgewidth=2.0)
        axes.set_title(_escaped(textwrap.fill(name, _TITLE)), fontsize="medium")
    if drawn is not None:
        canvas.colorbar(drawn, ax=panels, label=_escaped(map_.value_label), extend="neither" if map_.largest is None else "max")
    canvas.suptitle(_escaped(map_.title))
    canvas.supxlabel(_escaped(map_.x_label), fontsize="medium")
    canvas.supylabel(_escaped(map_.y_label), fontsize="medium")
    return _save(canvas, paths)


def _save(canvas: Canvas, paths: Sequence[Path]) -> Path:
    with warnings.catch_warnings():
        warnings.filterwarnings("ignore", message="Glyph")  # a name in a script that the font lacks is no error
        canvas.draw_without_rendering()
        canvas.set_layout_engine("none")  # it is laid out now, once for all files
        for path in paths:
            path.parent.mkdir(parents=True, exist_ok=True)
            metadata = {"Date": None} if path.suffix.lower() == ".svg" else {"Software": None}
            with matplotlib.rc_context({"svg.hashsalt": path.stem}):  # the same file for the same figure
                canvas.savefig(path, dpi=150, metadata=metadata)
    return paths[0]


def _escaped(text: str) -> str:
    """Text as matplotlib shows it as it stands: $ begins a formula, and legends leave out names that begin with _."""
    escaped = text.replace("$", r"\$")
    return f" {escaped}" if escaped.startswith("_") else escaped
