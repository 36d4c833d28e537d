"""The documentation page of an FMU, from the component's docstring and declarations, with a picture of its behaviour."""

from __future__ import annotations

import enum
import inspect
import re
from pathlib import Path
from typing import Any

import jinja2
from markupsafe import Markup, escape

from shaper_fmu.component import Component, Variable
from shaper_fmu.export.docstrings import docstring_blocks
from shaper_fmu.export.model_description import visible_variables
from shaper_fmu.export.picture import behaviour_picture

_PAGE = jinja2.Environment(autoescape=True, trim_blocks=True, lstrip_blocks=True).from_string("""\
<!DOCTYPE html>
<html lang="en">
<head>
<meta charset="utf-8">
<meta name="viewport" content="width=device-width, initial-scale=1">
<title>{{ name }}</title>
<style>
body { font-family: sans-serif; line-height: 1.5; max-width: 62rem; margin: 2rem auto; padding: 0 1rem; color: #222; }
table { border-collapse: collapse; margin: 0.5rem 0 1.5rem; width: 100%; }
.wide { overflow-x: auto; }
@media print { .wide { overflow: visible; } }
th, td { border-bottom: 1px solid #ccc; padding: 0.25rem 0.6rem; text-align: left; vertical-align: top; }
th { background: #f3f3f3; }
li { margin: 0.25rem 0; }
code, .name { font-family: monospace; font-size: 0.95em; }
.equation { font-family: serif; font-style: italic; font-size: 1.08em; }
figure { margin: 1.5rem 0; }
figure svg { width: 100%; max-width: 50rem; height: auto; }
figcaption { font-size: 0.9em; color: #555; }
</style>
</head>
<body>
<h1>{{ name }}</h1>
{% for kind, lines in blocks %}
{% if kind == "list" %}
<ul>
{% for line in lines %}
<li>{{ line }}</li>
{% endfor %}
</ul>
{% elif kind == "display" %}
<pre class="equation">{{ lines | join("\n") }}</pre>
{% else %}
<p>{{ lines | join(" ") }}</p>
{% endif %}
{% endfor %}
{% if picture %}
<h2>Behaviour</h2>
<figure>
{{ picture.svg | safe }}
<figcaption>{{ picture.caption }}</figcaption>
</figure>
{% endif %}
{% if live %}
<p>To see it move: <code>{{ live }}</code> writes a page with sliders, redrawn while they move.</p>
{% endif %}
{% for title, rows in sections %}
<h2>{{ title }}</h2>
<div class="wide" tabindex="0" role="region" aria-label="{{ title }}">
<table>
<tr>{% for column in rows[0] %}<th>{{ column | capitalize }}</th>{% endfor %}</tr>
{% for row in rows %}
<tr>{% for column, cell in row.items() %}\
<td>{% if column == "name" %}<code>{{ cell }}</code>{% else %}{{ cell }}{% endif %}</td>{% endfor %}</tr>
{% endfor %}
</table>
</div>
{% endfor %}
</body>
</html>
""")

_TITLES = {
    "input": "Inputs",
    "output": "Outputs",
    "local": "Local variables",
    "parameter": "Parameters",
    "calculatedParameter": "Calculated parameters",
}


def start_text(variable: Variable[Any]) -> str:
    """The start value, shortened where an array repeats one value."""
    shown = [
        v.name if isinstance(v, enum.IntEnum) else str(v).lower() if isinstance(v, bool) else f"{v:g}" for v in variable.starts
    ]
    return shown[0] if len(set(shown)) == 1 else ", ".join(shown)


def type_text(variable: Variable[Any]) -> str:
    """The FMI type, with the number of elements of an array."""
    name = (
        "Enumeration"
        if issubclass(variable.kind, enum.IntEnum)
        else {float: "Real", int: "Integer", bool: "Boolean"}[variable.kind]
    )
    return name if variable.size is None else f"{name}[{variable.size}]"


ON_EVERY_LIVE_PAGE = ("InputShaper", "MotionProfile", "PulseTrain", "PositionController")
"""Components that `shaper-fmu live` shows without being asked."""


def live_command(component: type[Component]) -> str:
    """What writes a page on which the component moves; "" where there is none, without a real input and output.

    A component with other start values has the kernels of another one, which the page shows.
    """
    while "step" not in vars(component) and component.__base__ not in (None, Component):
        component = component.__base__
    if component.__name__ in ON_EVERY_LIVE_PAGE:
        return "shaper-fmu live"
    real = {v.causality for v in component.variables.values() if v.kind is float and (v.size is None or v.causality != "input")}
    if not {"input", "output"} <= real:
        return ""
    shipped = component.__module__.startswith("shaper_fmu.")
    return f"shaper-fmu live --plant {component.__name__ if shipped else Path(inspect.getfile(component)).name}"


def documentation_page(component: type[Component]) -> str:
    """A self-contained HTML page."""
    sections = []
    for causality, title in _TITLES.items():
        rows = [
            {
                "name": v.name, "type": type_text(v), "unit": v.unit,
                "start": start_text(v) if causality in ("input", "parameter") else "",
                "domain": v.domain, "description": _with_names(escape(v.description)),
            }
            for v in visible_variables(component)
            if v.causality == causality
        ]  # fmt: skip
        if rows:
            empty = {column for column in rows[0] if not any(row[column] for row in rows)}
            sections.append((title, [{column: cell for column, cell in row.items() if column not in empty} for row in rows]))
    blocks = [
        (kind, lines if kind == "display" else [marked_up(line) for line in lines])
        for kind, lines in docstring_blocks(inspect.getdoc(component) or "")
    ]
    picture = behaviour_picture(component)
    return _PAGE.render(name=component.__name__, blocks=blocks, sections=sections, picture=picture, live=live_command(component))


_SIGN = re.compile(r"^(=|<|>|<=|>=|\+|-|/|\*)$")
_QUANTITY = re.compile(r"^[|(\-]*([A-Za-z]'*|\w*\d\w*|\w+_\w+|[a-z]+'+|.*[()^/|].*|[\d.]+|[a-z]{2}\d?)$")
_NAMES = {"sin", "cos", "sqrt", "theta", "zeta", "omega", "pi", "frac", "exp"}
_WORDS = {"a", "an", "as", "at", "be", "by", "do", "if", "in", "is", "it", "no", "of", "on", "or", "so", "to", "up", "us", "we"}


def marked_up(line: str) -> Markup:
    """A line with its equations and its names between backticks marked.

    An equation is what surrounds an "=": signs and short or composed names on both sides. Words end it, and so does
    punctuation.
    """
    words = line.split(" ")
    inside: set[int] = set()
    for i, word in enumerate(words):
        if word == "=" and 0 < i < len(words) - 1:
            inside |= _equation_around(words, i)
    shown: list[Markup] = []
    for i, word in enumerate(words):
        core, rest = _without_punctuation(word)
        opening = Markup('<span class="equation">') if i in inside and i - 1 not in inside else Markup("")
        ends = i in inside and (i + 1 not in inside)
        shown.append(opening + escape(core) + (Markup("</span>") if ends else Markup("")) + escape(rest))
    return _with_names(Markup(" ").join(shown))


def _with_names(line: Markup) -> Markup:
    """Names between backticks, marked."""
    return Markup(re.sub(r"`([^`<]+)`", r'<span class="name">\1</span>', str(line)))


def _equation_around(words: list[str], sign: int) -> set[int]:
    first = last = sign
    while first > 0 and _is_mathematical(words, first - 1) and not _without_punctuation(words[first - 1])[1]:
        first -= 1
    while last + 1 < len(words) and not _without_punctuation(words[last])[1] and _is_mathematical(words, last + 1):
        last += 1
    return set(range(first, last + 1)) if first < sign < last else set()


def _is_mathematical(words: list[str], i: int) -> bool:
    """Whether the word belongs to an equation; short English words only next to a sign."""
    word = _without_punctuation(words[i])[0]
    if word in _WORDS:
        return any(_SIGN.match(neighbour) for neighbour in words[max(0, i - 1) : i + 2])
    return bool(_SIGN.match(word) or _QUANTITY.match(word)) or word in _NAMES


def _without_punctuation(word: str) -> tuple[str, str]:
    """A word, and the punctuation at its end."""
    core = word.rstrip(".,;:")
    return core, word[len(core) :]
