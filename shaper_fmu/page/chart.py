"""The charts that pages carry: uPlot and the scripts in static/, 75 kB together, as one script and one style sheet to be put into a
page once."""

from __future__ import annotations

from functools import cache
from pathlib import Path

STATIC = Path(__file__).parent / "static"
_UPLOT = Path(__file__).parent / "uplot"
_SCRIPTS = ("downloads.js", "join.js", "marks.js", "chart.js")


@cache
def chart_script() -> str:
    """JavaScript that defines `uPlot` and `Chart` (see chart.js), with uPlot's licence."""
    licence = _UPLOT.joinpath("LICENSE").read_text(encoding="utf-8").strip()
    parts = [_UPLOT / "uPlot.iife.min.js", *(STATIC / name for name in _SCRIPTS)]
    return "\n".join([f"/* uPlot:\n{licence} */", *(part.read_text(encoding="utf-8") for part in parts)])


@cache
def chart_style() -> str:
    """Style sheet for it."""
    return "\n".join(part.read_text(encoding="utf-8") for part in (_UPLOT / "uPlot.min.css", STATIC / "chart.css"))


@cache
def map_script() -> str:
    """JavaScript that defines `HeatMap` (see map.js), after `chart_script`."""
    return STATIC.joinpath("map.js").read_text(encoding="utf-8")
