"""Writes the tables of methods, metrics and public names in docs/, between marked lines.

`python -m shaper_fmu.design.method_tables FILE.md ...` writes them.
"""

from __future__ import annotations

import importlib
import inspect
import math
import re
import sys
from collections.abc import Callable, Iterable
from pathlib import Path
from types import UnionType
from typing import get_args

from shaper_fmu.design.shapers import shaper
from shaper_fmu.design.smoothers import smoother
from shaper_fmu.kinds.profiles import PROFILES
from shaper_fmu.kinds.pulses import PULSES
from shaper_fmu.kinds.shapers import SHAPERS
from shaper_fmu.kinds.smoothers import SMOOTHERS
from shaper_fmu.methods.record import FIRST_FOREIGN, Method
from shaper_fmu.metrics.known import METRICS
from shaper_fmu.public_names import packages, public


def _rows(head: list[str], methods: Iterable[Method], more: Callable[[Method], list[str]]) -> str:
    rows = [[f"`{one.name}`", *more(one), one.described] for one in methods if one.number < FIRST_FOREIGN]
    return "\n".join("| " + " | ".join(row) + " |" for row in [head, ["---"] * len(head), *rows])


def _of_shaper(method: Method) -> list[str]:
    """Duration in periods and insensitivity at 5 %, undamped, with the parameters' start values."""
    sequence = shaper(method.name, 1.0)
    return [f"{sequence.duration / (2.0 * math.pi):.3f}", f"{sequence.insensitivity(1.0):.3f}"]


def _of_smoother(method: Method) -> list[str]:
    """Duration and mean delay in periods and insensitivity at 5 %, at a damping ratio of 0.02, with the start values."""
    kernel = smoother(method.name, 1.0, 0.02)
    width = kernel.insensitivity(1.0, 0.02)
    period = 2.0 * math.pi
    return [
        f"{kernel.duration / period:.3f}",
        f"{kernel.mean_delay / period:.3f}",
        f"{width:.3f}" if width < 5.0 else "no upper end",
    ]


def _metrics() -> str:
    """A row per metric: its kind, its keys besides `output`, and its meaning."""
    rows = []
    for kind, metric in METRICS.items():
        if metric.__module__.startswith("shaper_fmu."):
            keys = ", ".join(f"`{key}`" for key in metric.fields() if key != "output")
            rows.append([f"`{kind}`", f"`{metric.__name__}`", keys, metric.unit or "of the output", metric.summary()])
    head = ["kind", "in Python", "keys besides `output`", "unit", "what it is"]
    return "\n".join("| " + " | ".join(row) + " |" for row in [head, ["---"] * len(head), *rows])


def _public_names() -> str:
    return "\n\n".join(_names_of(package) for package in packages())


def _names_of(package: str) -> str:
    """A section with the names of a package, and what each is in a sentence."""
    module = importlib.import_module(package)
    rows = [f"| `{name}` | {_sentence(getattr(module, name))} |" for name in public(package)]
    intro = _sentence(module)
    return "\n".join([f"## {package}", "", intro, "", "| name | what it is |", "| --- | --- |", *rows])


def _sentence(thing: object) -> str:
    """The first sentence of a docstring; of a number its value, of a union its types."""
    if isinstance(thing, float):
        return f"{thing:g}"
    if isinstance(thing, UnionType):
        return " or ".join(f"`{one.__name__}`" for one in get_args(thing))
    paragraph = (inspect.getdoc(thing) or "").split("\n\n")[0].replace("\n", " ").replace("|", "\\|")
    return re.split(r"(?<=\.)\s", paragraph)[0].rstrip(".")


TABLES: dict[str, Callable[[], str]] = {
    "shapers": lambda: _rows(["name", "duration / T", "I(5 %)", "what it is"], SHAPERS.values(), _of_shaper),
    "smoothers": lambda: _rows(
        ["name", "duration / T", "mean delay / T", "I(5 %)", "what it is"], SMOOTHERS.values(), _of_smoother
    ),
    "profiles": lambda: _rows(["name", "what it is"], PROFILES.values(), lambda one: []),
    "pulse designs": lambda: _rows(["design", "what it is"], PULSES.values(), lambda one: []),
    "metrics": _metrics,
    "public names": _public_names,
}


def with_tables(page: str) -> str:
    """The page with its tables as they are now."""

    def table(found: re.Match[str]) -> str:
        return f"<!-- table of {found[1]} -->\n{TABLES[found[1]]()}\n<!-- end of the table -->"

    return re.sub(r"<!-- table of ([\w ]+) -->\n.*?<!-- end of the table -->", table, page, flags=re.DOTALL)


def _update(paths: list[str]) -> None:
    for path in map(Path, paths):
        path.write_text(with_tables(path.read_text()))


if __name__ == "__main__":
    _update(sys.argv[1:])
