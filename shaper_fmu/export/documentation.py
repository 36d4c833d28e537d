"""The documentation page of an FMU, from the component's docstring and declarations."""

from __future__ import annotations

import enum
import inspect

import jinja2

from shaper_fmu.component import Component, Variable
from shaper_fmu.export.model_description import visible_variables

_PAGE = jinja2.Environment(autoescape=True, trim_blocks=True, lstrip_blocks=True).from_string("""\
<!DOCTYPE html>
<html lang="en">
<head>
<meta charset="utf-8">
<title>{{ name }}</title>
<style>
body { font-family: sans-serif; line-height: 1.5; max-width: 62rem; margin: 2rem auto; padding: 0 1rem; color: #222; }
table { border-collapse: collapse; margin: 0.5rem 0 1.5rem; width: 100%; }
th, td { border-bottom: 1px solid #ccc; padding: 0.25rem 0.6rem; text-align: left; vertical-align: top; }
th { background: #f3f3f3; }
code { font-size: 0.95em; }
</style>
</head>
<body>
<h1>{{ name }}</h1>
{% for paragraph in paragraphs %}
<p>{{ paragraph }}</p>
{% endfor %}
{% for title, rows in sections %}
<h2>{{ title }}</h2>
<table>
<tr><th>Name</th><th>Type</th><th>Unit</th><th>Start</th><th>Domain</th><th>Description</th></tr>
{% for row in rows %}
<tr><td><code>{{ row.name }}</code></td><td>{{ row.type }}</td><td>{{ row.unit }}</td><td>{{ row.start }}</td>\
<td>{{ row.domain }}</td><td>{{ row.description }}</td></tr>
{% endfor %}
</table>
{% endfor %}
</body>
</html>
""")

_TITLES = {"input": "Inputs", "output": "Outputs", "parameter": "Parameters", "calculatedParameter": "Calculated parameters"}


def domain_text(variable: Variable) -> str:
    """The values that a variable may have: "> 0", "0 <= . < 1", or the items of an enumeration."""
    if issubclass(variable.kind, enum.IntEnum):
        return ", ".join(f"{item.name} = {item.value}" for item in variable.kind)
    low, high = ("<" if variable.exclusive in (True, side) else "<=" for side in ("min", "max"))
    if variable.min is not None and variable.max is not None:
        return f"{variable.min:g} {low} . {high} {variable.max:g}"
    if variable.min is not None:
        return f"{low.replace('<', '>')} {variable.min:g}"
    return f"{high} {variable.max:g}" if variable.max is not None else ""


def start_text(variable: Variable) -> str:
    """The start value, shortened where an array repeats one value."""
    shown = [
        v.name if isinstance(v, enum.IntEnum) else str(v).lower() if isinstance(v, bool) else f"{v:g}" for v in variable.starts
    ]
    return shown[0] if len(set(shown)) == 1 else ", ".join(shown)


def type_text(variable: Variable) -> str:
    """The FMI type, with the number of elements of an array."""
    name = (
        "Enumeration"
        if issubclass(variable.kind, enum.IntEnum)
        else {float: "Real", int: "Integer", bool: "Boolean"}[variable.kind]
    )
    return name if variable.size is None else f"{name}[{variable.size}]"


def documentation_page(component: type[Component]) -> str:
    """A self-contained HTML page."""
    sections = []
    for causality, title in _TITLES.items():
        rows = [
            {
                "name": v.name, "type": type_text(v), "unit": v.unit, "description": v.description, "domain": domain_text(v),
                "start": start_text(v) if causality in ("input", "parameter") else "",
            }
            for v in visible_variables(component)
            if v.causality == causality
        ]  # fmt: skip
        if rows:
            sections.append((title, rows))
    paragraphs = [" ".join(text.split()) for text in (inspect.getdoc(component) or "").split("\n\n")]
    return _PAGE.render(name=component.__name__, paragraphs=paragraphs, sections=sections)
