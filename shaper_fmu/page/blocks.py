"""Writes a report: one self-contained HTML page, and a picture of each figure beside it."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass
from pathlib import Path

import jinja2
import markupsafe

from shaper_fmu.drafts import draft_of
from shaper_fmu.errors import ShaperFmuError
from shaper_fmu.page.figures import Figure, Map, Panels


@dataclass(frozen=True)
class Text:
    """A paragraph."""

    text: str


@dataclass(frozen=True)
class Table:
    """A table of texts under a heading; the first column is left-aligned, the others right: all of them left if `left_aligned`."""

    title: str
    head: list[str]
    rows: list[list[str]]
    left_aligned: bool = False


@dataclass(frozen=True)
class Heading:
    """Begins a section of the page, and is listed at its top."""

    text: str


Block = Heading | Text | Table | Figure | Map | Panels

Progress = Callable[[float, float], None]
"""Called now and then with what is done, and of how much."""

_WORD = 24
"""Letters of the longest word that is never broken; paths and numbers can be longer."""


def _breakable(text: str) -> bool:
    """Whether a word of a cell may be broken where the page is narrow, since it is longer than any word of a language."""
    return any(len(word) > _WORD for word in text.split())


_PAGES = jinja2.Environment(autoescape=True, trim_blocks=True, lstrip_blocks=True)
_PAGES.tests["breakable"] = _breakable
_PAGE = _PAGES.from_string("""\
<!DOCTYPE html>
<html lang="en">
<head>
<meta charset="utf-8">
<meta http-equiv="Content-Security-Policy" content="default-src 'none'; script-src 'unsafe-inline'; {{ "" -}}
style-src 'unsafe-inline'; img-src data: blob:">
<meta name="viewport" content="width=device-width, initial-scale=1">
<title>{{ title }}</title>
<style>
:root { color-scheme: only light; background: #fff; }  /* as the figures, which are drawn on white */
body { font-family: system-ui, sans-serif; line-height: 1.5; max-width: 64rem; margin: 2rem auto; padding: 0 1rem; color: #222; }
h1 { font-size: 1.6rem; }
h2 { font-size: 1.2rem; margin-top: 2rem; }
table { border-collapse: collapse; margin: 0.5rem 0 1.5rem; }
th, td { border-bottom: 1px solid #ccc; padding: 0.3rem 0.9rem; text-align: right; }
th:first-child, td:first-child { text-align: left; }
.left-aligned th, .left-aligned td { text-align: left; vertical-align: top; }
thead th { border-bottom: 2px solid #555; }
h3 { font-size: 1.05rem; margin: 1.5rem 0 0.3rem; }
td, th { overflow-wrap: break-word; max-width: 40rem; }
td.long { overflow-wrap: anywhere; }
.scrolled { overflow-x: auto; }
.wide { min-width: 40rem; }
nav ul { columns: 2; padding-left: 1.2rem; }
figure { margin: 1.5rem 0; min-width: 0; }
figcaption { font-size: 1.05rem; }
.panels { display: grid; grid-template-columns: 1fr 1fr; }
@media screen and (max-width: 44rem) {  /* a row of texts is too narrow to read: its cells one below the other, with their heads */
  .left-aligned thead { display: none; }
  .left-aligned tr, .left-aligned td { display: block; max-width: none; }
  .left-aligned tr { border-bottom: 1px solid #ccc; padding: 0.6rem 0; }
  .left-aligned td { border: 0; padding: 0.1rem 0; }
  .left-aligned td::before { content: attr(data-head) ": "; color: #666; }
  .left-aligned td:first-child { font-weight: 600; }
  .left-aligned td:first-child::before { content: ""; }
  th, td { padding: 0.3rem 0.5rem; }
  .panels { grid-template-columns: 1fr; }
  nav ul { columns: 1; }
}
@page { size: A4; margin: 14mm; }
@media print {
  .scrolled { overflow-x: visible; }
  body { max-width: none; margin: 0; padding: 0; font-size: 9.5pt; }
  figure, tr { break-inside: avoid; }
  h2, h3 { break-after: avoid; }
  thead { display: table-header-group; }
  .modebar { display: none; }
}
</style>
<script>{{ script }}</script>
<script>
function fit(width) {
  for (const plot of document.querySelectorAll(".js-plotly-plot")) Plotly.relayout(plot, width ? { width } : { autosize: true });
}
addEventListener("beforeprint", () => fit(680));  // the printed width of an A4 page
addEventListener("afterprint", () => fit(null));
</script>
</head>
<body>
<h1>{{ title }}</h1>
{% set headings = blocks | selectattr(0, "equalto", "Heading") | map(attribute=1) | list %}
{% if headings %}
<nav><ul>
{% for heading in headings %}
<li><a href="#section-{{ loop.index }}">{{ heading.text }}</a></li>
{% endfor %}
</ul></nav>
{% endif %}
{% set section = namespace(number=0) %}
{% for kind, block in blocks %}
{% if kind == "Heading" %}
{% set section.number = section.number + 1 %}
<h2 id="section-{{ section.number }}">{{ block.text }}</h2>
{% elif kind == "Text" %}
<p>{{ block.text }}</p>
{% elif kind == "Table" %}
<h{{ 3 if headings else 2 }}>{{ block.title }}</h{{ 3 if headings else 2 }}>
<div class="scrolled"><table{% if block.left_aligned %} class="left-aligned"{% endif %}>
<thead><tr>{% for cell in block.head %}<th>{{ cell }}</th>{% endfor %}</tr></thead>
<tbody>
{% for row in block.rows %}
<tr>
{%- for cell in row %}<td{% if block.left_aligned %} data-head="{{ block.head[loop.index0] }}"{% endif %}
{{- ' class="long"' if cell is breakable }}>{{ cell }}</td>{% endfor -%}
</tr>
{% endfor %}
</tbody>
</table></div>
{% elif kind == "Panels" %}
<figure><figcaption>{{ block.title }}</figcaption><div class="panels">
{% for figure in block.figures %}
<figure><figcaption>{{ figure.title }}</figcaption>{{ drawn(figure) }}</figure>
{% endfor %}
</div></figure>
{% else %}
<figure><figcaption>{{ block.title }}</figcaption>
{% if kind == "Map" and block.grid()[1] > 2 %}
<div class="scrolled"><div class="wide">{{ drawn(block) }}</div></div>
{% else %}
{{ drawn(block) }}
{% endif %}
</figure>
{% endif %}
{% endfor %}
</body>
</html>
""")


def write_report(
    path: Path | str, title: str, blocks: Sequence[Block], pictures: Sequence[str] = ("png",), progress: Progress | None = None
) -> list[Path]:
    """Write the page and pictures of each figure, <page>_<figure>.png or .svg; returns all paths, the page first.

    Raises ShaperFmuError for a path that does not end as a page, and when the report's extra packages are missing.
    """
    path = Path(path)
    if path.suffix.lower() not in (".html", ".htm"):
        raise ShaperFmuError(f"{path}: a report is a page, and its file's name ends with .html")
    try:
        from shaper_fmu.page.interactive import interactive, interactive_map, plotly_script
        from shaper_fmu.page.pictures import write_map_picture, write_picture, write_pictures
    except ImportError as error:
        raise ShaperFmuError(f"reports need the package {error.name}: pip install 'shaper-fmu[report]'") from None
    path.parent.mkdir(parents=True, exist_ok=True)

    def drawn(block: Figure | Map) -> markupsafe.Markup:
        return markupsafe.Markup(interactive(block) if isinstance(block, Figure) else interactive_map(block))

    shown = [(type(block).__name__, block) for block in blocks]
    with draft_of(path) as draft:
        text = _PAGE.render(title=title, script=markupsafe.Markup(plotly_script()), blocks=shown, drawn=drawn)
        draft.write_text(text, encoding="utf-8")
    written, figures = [path], [block for block in blocks if isinstance(block, Figure | Map | Panels)]
    for i, block in enumerate(figures):
        files = [path.with_name(f"{path.stem}_{block.key}.{kind}") for kind in pictures]
        if files and isinstance(block, Figure):
            write_picture(block, *files)
        elif files and isinstance(block, Map):
            write_map_picture(block, *files)
        elif files and isinstance(block, Panels):
            write_pictures(block.figures, *files, columns=2, title=block.title)
        written += files
        if progress is not None:
            progress(i + 1, len(figures))
    return written
