"""The documentation page of a container: what is inside, whose it is, and what it shows."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from pathlib import Path

import jinja2

from shaper_fmu.container.outside import OuterVariable
from shaper_fmu.master.fmu import Fmu
from shaper_fmu.master.structure import SystemStructure

_PAGE = jinja2.Environment(autoescape=True, trim_blocks=True, lstrip_blocks=True).from_string("""\
<!DOCTYPE html>
<html lang="en">
<head>
<meta charset="utf-8">
<meta name="viewport" content="width=device-width, initial-scale=1">
<title>{{ name }}</title>
<style>
:root { color-scheme: light dark; }
body { font-family: sans-serif; line-height: 1.5; max-width: 62rem; margin: 2rem auto; padding: 0 1rem; }
.wide { overflow-x: auto; }
table { border-collapse: collapse; margin: 0.5rem 0 1.5rem; width: 100%; }
th, td { border-bottom: 1px solid #8884; padding: 0.25rem 0.6rem; text-align: left; vertical-align: top; }
code { font-family: monospace; font-size: 0.95em; }
</style>
</head>
<body>
<h1>{{ name }}</h1>
{% if description %}
<p>{{ description }}</p>
{% endif %}
<p>This FMU holds {{ inside | length }} FMU{{ "" if inside | length == 1 else "s" }}, coupled by the master loop of shaper-fmu\
{{ ": its steps end at the events inside, whatever step the host takes" if exact }}.</p>
{% for note in notes %}
<p>{{ note }}</p>
{% endfor %}
<h2>Inside</h2>
<div class="wide"><table>
<tr><th>Instance</th><th>FMU</th><th>FMI</th><th>Made by</th><th>Licence and documentation</th></tr>
{% for row in inside %}
<tr><td><code>{{ row.name }}</code></td><td>{{ row.fmu }}</td><td>{{ row.version }}</td><td>{{ row.tool }}</td><td>\
{{ row.licence }}{% for file in row.files %} <a href="../resources/{{ row.folder }}/{{ file }}">{{ file }}</a>{% endfor %}</td></tr>
{% endfor %}
</table></div>
{% if connections %}
<h2>Connections</h2>
<div class="wide"><table>
<tr><th>From</th><th>To</th></tr>
{% for source, target in connections %}
<tr><td><code>{{ source }}</code></td><td><code>{{ target }}</code></td></tr>
{% endfor %}
</table></div>
{% endif %}
<h2>Variables</h2>
<div class="wide"><table>
<tr><th>Name</th><th>Causality</th><th>Stands for</th><th>Unit</th><th>Start</th><th>Description</th></tr>
{% for row in variables %}
<tr><td><code>{{ row.name }}</code></td><td>{{ row.causality }}</td><td><code>{{ row.stands_for }}</code></td>\
<td>{{ row.unit }}</td>\
<td>{{ row.start }}</td><td>{{ row.description }}</td></tr>
{% endfor %}
</table></div>
</body>
</html>
""")
_MOST_FILES = 12


def container_page(
    name: str,
    description: str,
    system: SystemStructure,
    variables: Sequence[OuterVariable],
    folders: Mapping[str, str],
    notes: Sequence[str],
    exact: bool,
) -> str:
    """The page as HTML; `folders`: of the FMUs below the resources; `exact`: whether steps inside end at events."""
    inside = [
        {
            "name": instance, "fmu": fmu.name, "version": fmu.description.fmiVersion, "folder": folders[instance],
            "tool": fmu.description.generationTool or "", "licence": fmu.description.license or "", "files": _documents(fmu),
        }
        for instance, fmu in system.fmus.items()
    ]  # fmt: skip
    connections = [(".".join(source), ".".join(target)) for target, source in system.connections.items()]
    rows = [_row(variable) for variable in variables]
    return _PAGE.render(
        name=name, description=description, inside=inside, connections=connections, variables=rows, notes=list(notes), exact=exact
    )


def _documents(fmu: Fmu) -> list[str]:
    """The FMU's licences and the page with which its documentation begins."""
    folder = fmu.folder / "documentation"
    paths = [path.relative_to(fmu.folder) for path in sorted(folder.rglob("*")) if path.is_file()]
    wanted = [path for path in paths if _is_licence(path) or path.name in ("index.html", "_main.html")]
    return [path.as_posix() for path in wanted[:_MOST_FILES]]


def _is_licence(path: Path) -> bool:
    return any("licens" in part.lower() or "licenc" in part.lower() for part in path.parts)


def _row(variable: OuterVariable) -> dict[str, str]:
    targets = [".".join(target.port) for element in variable.elements[:1] for target in element]
    unit = variable.unit.name if variable.unit is not None else variable.shown.unit
    declared = variable.shown.declaredType
    return {
        "name": variable.name,
        "causality": variable.causality,
        "stands_for": ", ".join(targets) + (" ..." if len(variable.elements) > 1 else ""),
        "unit": str(unit or (declared.unit if declared is not None else None) or ""),
        "start": " ".join(str(start) for start in variable.starts[:4]) + (" ..." if len(variable.starts) > 4 else ""),
        "description": str(variable.shown.description or ""),
    }
