"""Figures as elements of a page, with their data; static/report.js draws them."""

from __future__ import annotations

import json
import math
from collections.abc import Iterable, Sequence
from typing import Any

import numpy as np
from markupsafe import Markup

from shaper_fmu.page.figures import Figure, Map

_DIGITS = 6
"""Of curves' values: more than an eye can tell, and than the table needs; whole numbers fill the page."""
_TIME_DIGITS = 9
_MAP_DIGITS = 4


def interactive(figure: Figure) -> Markup:
    """The figure without its title as elements of a page that holds the scripts of charts."""
    xs = [_numbers(line.x, _TIME_DIGITS) for line in figure.lines]
    return _element(figure.key, {
        "title": figure.title,
        "x": figure.x_label,
        "y": figure.y_label,
        "right": figure.right_label,
        "beside": figure.beside(),
        "logX": figure.log_x,
        "lines": [
            {
                "name": line.name,
                "style": style,
                **({"right": True} if line.right else {}),
                **({"values": True} if line.markers and line.joined else {}),
                **({} if line.joined else {"symbols": symbol, "size": 11 if len(line.x) == 1 else 5}),
            }
            for line, style, symbol in zip(figure.lines, figure.numbers(), figure.symbols(), strict=True)
        ],
        "times": [next((k for k in range(i) if xs[k] == x), x) for i, x in enumerate(xs)],  # what another line has is its number
        "values": [_numbers(line.y, _DIGITS) for line in figure.lines],
        "levels": _marks(figure.levels),
        "marks": _marks(figure.marks),
        "bands": [list(map(float, band)) for band in figure.bands],
    })  # fmt: skip


def interactive_map(map_: Map) -> Markup:
    """The map without its title as elements of a page that holds the scripts of charts and maps."""
    low, high = map_.scale()
    return _element(map_.key, {
        "title": map_.title,
        "x": map_.x_label,
        "y": map_.y_label,
        "value": map_.value_label,
        "xs": _numbers(map_.x, _TIME_DIGITS),
        "ys": _numbers(map_.y, _TIME_DIGITS),
        "columns": map_.grid()[1],
        "panels": [[name, [_numbers(row, _MAP_DIGITS) for row in values]] for name, values in map_.panels],
        "low": low,
        "high": high,
        "more": map_.largest is not None,
        "levels": _marks(map_.levels),
        "points": [list(map(float, point)) for point in map_.points],
    })  # fmt: skip


def _numbers(values: Iterable[Any], digits: int) -> list[float | int | None]:
    """As JSON can hold them: none for what is not finite."""
    found = [float(f"{value:.{digits}g}") for value in np.asarray(values, dtype=float).tolist()]
    return [_short(value) if math.isfinite(value) else None for value in found]


def _short(value: float) -> float | int:
    """Without a .0 at the end."""
    return int(value) if value.is_integer() and abs(value) < 1e15 else value


def _marks(found: Sequence[tuple[float, str]]) -> list[list[float | str]]:
    return [[float(value), text] for value, text in found]


def _element(key: str, told: dict[str, Any]) -> Markup:
    text = json.dumps(told, separators=(",", ":"), ensure_ascii=False, allow_nan=False).replace("<", "\\u003c")  # no tag ends it
    element = Markup('<div id="{}"></div><script class="chart-data" type="application/json">{}</script>')
    return element.format(key, Markup(text))
