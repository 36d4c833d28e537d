"""Figures as pictures: matplotlib, without a display."""

from __future__ import annotations

from pathlib import Path

from matplotlib.backends.backend_agg import FigureCanvasAgg
from matplotlib.figure import Figure as Canvas

from shaper_fmu.report.figures import Figure

_STYLES = {"solid": "-", "dash": "--", "dashdot": "-.", "dot": ":"}


def write_picture(figure: Figure, path: Path) -> Path:
    """Draw the figure into a PNG file and return its path."""
    canvas = Canvas(figsize=(8.0, 4.5), layout="constrained")
    FigureCanvasAgg(canvas)
    axes = canvas.add_subplot()
    for line, (colour, dash) in zip(figure.lines, figure.styles(), strict=True):
        axes.plot(line.x, line.y, _STYLES[dash], color=colour, label=line.name, marker="o" if line.markers else "", markersize=4)
    for value, text in figure.levels:
        axes.axhline(value, color="#555555", linewidth=0.8, linestyle=":")
        axes.annotate(
            text, (1.0, value), xycoords=("axes fraction", "data"), ha="right", va="bottom", fontsize="small", color="#555555"
        )
    for value, text in figure.marks:
        axes.axvline(value, color="#555555", linewidth=0.8, linestyle=":")
        axes.annotate(
            text,
            (value, 0.985),
            xycoords=("data", "axes fraction"),
            ha="right",
            va="top",
            rotation=90,
            fontsize="small",
            color="#555555",
        )
    axes.set(title=figure.title, xlabel=figure.x_label, ylabel=figure.y_label)
    axes.grid(True, linewidth=0.4, color="#cccccc")
    axes.legend(frameon=False)
    path.parent.mkdir(parents=True, exist_ok=True)
    canvas.savefig(path, dpi=150, metadata={"Software": None})
    return path
