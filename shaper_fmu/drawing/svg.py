"""Drawings as SVG, without a script, font or style of their own: lines have the colour of the text around them.

So they suit a light and a dark page; a file of its own brings both, by what the reader prefers.
"""

from __future__ import annotations

from html import escape
from pathlib import Path

from shaper_fmu.archives import write_file
from shaper_fmu.drawing.diagram import Diagram
from shaper_fmu.drawing.layout import HEAD, MARGIN, Layout, Placed, Point, layout

_STYLE = """<style>svg{color:#222;background:#fff}@media(prefers-color-scheme:dark){svg{color:#ddd;background:#1c1c1c}}</style>"""
_TINT = "rgba(86,180,233,0.14)"  # of the palette's light blue
_SMALL, _LARGE = 12, 13.5


def svg_of(diagram: Diagram) -> str:
    """The diagram as an SVG element for a page, as wide as it needs, at most as the page."""
    return _svg(layout(diagram), "")


def write_drawing(path: Path | str, diagram: Diagram) -> Path:
    """Write the diagram as an SVG file for light and dark screens, replacing the file only when it is complete."""
    return write_file(Path(path), f"{_svg(layout(diagram), _STYLE)}\n".encode())


def _svg(placed: Layout, style: str) -> str:
    width, height = (f"{size + 2.0:.0f}" for size in (placed.width, placed.height))
    title = escape(f"Drawing of {placed.diagram.title}")
    return (
        f'<svg xmlns="http://www.w3.org/2000/svg" role="img" aria-label="{title}" width="{width}" height="{height}" '
        f'viewBox="-1 -1 {width} {height}" style="max-width:100%;height:auto" fill="none" stroke="currentColor" '
        f'font-family="system-ui, sans-serif" font-size="{_SMALL}">{style}<title>{title}</title>{_content(placed)}</svg>'
    )


def _content(placed: Layout) -> str:
    diagram = placed.diagram
    frame = f'<rect width="{placed.width:.1f}" height="{placed.height:.1f}" rx="6" stroke-opacity="0.35"/>'
    parts = [frame, _text((MARGIN, 22.0), diagram.title, size=_LARGE, bold=True)]
    for wire, points in placed.wires:
        corners = " ".join(f"{x:.1f},{y:.1f}" for x, y in points)
        ends = ".".join(filter(None, (wire.source, wire.source_port))), ".".join(filter(None, (wire.target, wire.target_port)))
        hint = escape(f"{ends[0]} \N{RIGHTWARDS ARROW} {ends[1]}{f' ({wire.note})' if wire.note else ''}")
        parts.append(f'<polyline points="{corners}" stroke-width="1.3" stroke-linejoin="round"><title>{hint}</title></polyline>')
        parts.append(_arrow(points[-1]))
    parts += [f'<circle cx="{x:.1f}" cy="{y:.1f}" r="2.4" fill="currentColor" stroke="none"/>' for x, y in placed.dots]
    parts += [_box(one) for one in placed.boxes]
    if diagram.remark:
        parts.append(_text((MARGIN, placed.height - 0.7 * MARGIN), diagram.remark, faint=True))
    return "".join(parts)


def _arrow(tip: Point) -> str:
    x, y = tip
    return f'<path d="M{x:.1f},{y:.1f} l-6.5,-3.2 v6.4 z" fill="currentColor" stroke="none"/>'


def _box(one: Placed) -> str:
    if one.inner is not None:
        return f'<g transform="translate({one.x:.1f},{one.y:.1f})">{_content(one.inner)}</g>'
    parts = []
    if one.framed:
        size = f'x="{one.x:.1f}" y="{one.y:.1f}" width="{one.width:.1f}" height="{one.height:.1f}"'
        parts.append(f'<rect {size} rx="5" fill="{_TINT}" stroke-width="1.2"/>')
        parts.append(_text((one.x + 0.5 * one.width, one.y + 16.0), one.box.name, "middle", _LARGE, bold=True))
        parts.append(_text((one.x + 0.5 * one.width, one.y + 0.82 * HEAD), one.box.text, "middle", faint=True))
    room = 0.7 * MARGIN
    for port in one.box.inputs:
        x, y = one.end("in", port.name) if ("in", port.name) in one.ports else (one.x, one.y)
        parts.append(_port((x + room, y + 4.0), port.name, port.unit, "start"))
    for port in one.box.outputs:
        x, y = one.end("out", port.name) if ("out", port.name) in one.ports else (one.x, one.y)
        parts.append(_port((x - room, y + 4.0), port.name, port.unit, "end"))
    return "".join(parts)


def _port(place: Point, name: str, unit: str, anchor: str) -> str:
    shown = f'<tspan fill-opacity="0.65"> [{escape(unit)}]</tspan>' if unit else ""
    return f"{_opening(place, anchor, _SMALL)}>{escape(name)}{shown}</text>"


def _text(place: Point, text: str, anchor: str = "start", size: float = _SMALL, bold: bool = False, faint: bool = False) -> str:
    if not text:
        return ""
    look = (' font-weight="600"' if bold else "") + (' fill-opacity="0.65"' if faint else "")
    return f"{_opening(place, anchor, size)}{look}>{escape(text)}</text>"


def _opening(place: Point, anchor: str, size: float) -> str:
    x, y = place
    return f'<text x="{x:.1f}" y="{y:.1f}" text-anchor="{anchor}" font-size="{size:g}" fill="currentColor" stroke="none"'
