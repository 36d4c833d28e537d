"""A report: one self-contained HTML page, and a picture of each figure beside it."""

from __future__ import annotations

import os
from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path

import jinja2
import markupsafe

from shaper_fmu.errors import ShaperFmuError
from shaper_fmu.report.figures import Figure


@dataclass(frozen=True)
class Text:
    """A paragraph."""

    text: str


@dataclass(frozen=True)
class Table:
    """A table of texts under a heading; the first column is left-aligned, the others right."""

    title: str
    head: list[str]
    rows: list[list[str]]


Block = Text | Table | Figure

_PAGE = jinja2.Environment(autoescape=True, trim_blocks=True, lstrip_blocks=True).from_string("""\
<!DOCTYPE html>
<html lang="en">
<head>
<meta charset="utf-8">
<meta name="viewport" content="width=device-width, initial-scale=1">
<title>{{ title }}</title>
<style>
body { font-family: system-ui, sans-serif; line-height: 1.5; max-width: 64rem; margin: 2rem auto; padding: 0 1rem; color: #222; }
h1 { font-size: 1.6rem; }
h2 { font-size: 1.2rem; margin-top: 2rem; }
table { border-collapse: collapse; margin: 0.5rem 0 1.5rem; }
th, td { border-bottom: 1px solid #ccc; padding: 0.3rem 0.9rem; text-align: right; }
th:first-child, td:first-child { text-align: left; }
thead th { border-bottom: 2px solid #555; }
@media print { .js-plotly-plot { break-inside: avoid; } }
</style>
<script>{{ script }}</script>
</head>
<body>
<h1>{{ title }}</h1>
{% for kind, block in blocks %}
{% if kind == "Text" %}
<p>{{ block.text }}</p>
{% elif kind == "Table" %}
<h2>{{ block.title }}</h2>
<table>
<thead><tr>{% for cell in block.head %}<th>{{ cell }}</th>{% endfor %}</tr></thead>
<tbody>
{% for row in block.rows %}
<tr>{% for cell in row %}<td>{{ cell }}</td>{% endfor %}</tr>
{% endfor %}
</tbody>
</table>
{% else %}
{{ block }}
{% endif %}
{% endfor %}
</body>
</html>
""")


def write_report(path: Path | str, title: str, blocks: Sequence[Block]) -> list[Path]:
    """Write the page and a PNG of each figure, named <page>_<figure>.png; returns all paths, the page first.

    Raises ShaperFmuError when the report's extra packages are missing.
    """
    try:
        from shaper_fmu.report.interactive import interactive, plotly_script
        from shaper_fmu.report.pictures import write_picture
    except ImportError as error:
        raise ShaperFmuError(f"reports need the package {error.name}: pip install 'shaper-fmu[report]'") from None
    path = Path(path)
    path.parent.mkdir(parents=True, exist_ok=True)
    shown = [("Figure", markupsafe.Markup(interactive(b))) if isinstance(b, Figure) else (type(b).__name__, b) for b in blocks]
    draft = path.with_name(f".{path.name}.draft")
    draft.write_text(_PAGE.render(title=title, script=markupsafe.Markup(plotly_script()), blocks=shown), encoding="utf-8")
    os.replace(draft, path)
    figures = [block for block in blocks if isinstance(block, Figure)]
    return [path, *(write_picture(figure, path.with_name(f"{path.stem}_{figure.key}.png")) for figure in figures)]
