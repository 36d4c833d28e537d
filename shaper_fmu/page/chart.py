"""The chart that pages carry: uPlot and chart.js, 60 kB together, as one script and one style sheet to be put into a page once."""

from __future__ import annotations

from functools import cache
from pathlib import Path

_HERE = Path(__file__).parent
_UPLOT = _HERE / "uplot"


@cache
def chart_script() -> str:
    """JavaScript that defines `uPlot` and `Chart` (see chart.js), with uPlot's licence."""
    licence = _UPLOT.joinpath("LICENSE").read_text(encoding="utf-8").strip()
    parts = [_UPLOT / "uPlot.iife.min.js", _HERE / "chart.js"]
    return "\n".join([f"/* uPlot:\n{licence} */", *(part.read_text(encoding="utf-8") for part in parts)])


@cache
def chart_style() -> str:
    """Style sheet for it."""
    return "\n".join(part.read_text(encoding="utf-8") for part in (_UPLOT / "uPlot.min.css", _HERE / "chart.css"))
