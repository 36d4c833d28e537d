"""Writes the tables of methods and metrics in docs/, between marked lines.

`python -m shaper_fmu.design.method_tables FILE.md ...` writes them.
"""

from __future__ import annotations

import math
import re
import sys
from collections.abc import Callable, Iterable
from pathlib import Path

from shaper_fmu.design.shapers import shaper
from shaper_fmu.kinds.profiles import PROFILES
from shaper_fmu.kinds.pulses import PULSES
from shaper_fmu.kinds.shapers import SHAPERS
from shaper_fmu.methods.record import FIRST_FOREIGN, Method
from shaper_fmu.metrics.known import METRICS


def _rows(head: list[str], methods: Iterable[Method], more: Callable[[Method], list[str]]) -> str:
    rows = [[f"`{one.name}`", *more(one), one.described] for one in methods if one.number < FIRST_FOREIGN]
    return "\n".join("| " + " | ".join(row) + " |" for row in [head, ["---"] * len(head), *rows])


def _of_shaper(method: Method) -> list[str]:
    """Duration in periods and insensitivity at 5 %, undamped, with the parameters' start values."""
    sequence = shaper(method.name, 1.0)
    return [f"{sequence.duration / (2.0 * math.pi):.3f}", f"{sequence.insensitivity(1.0):.3f}"]


def _metrics() -> str:
    """A row per metric: its kind, its keys besides `output`, and its meaning."""
    rows = []
    for kind, metric in METRICS.items():
        if metric.__module__.startswith("shaper_fmu."):
            keys = ", ".join(f"`{key}`" for key in metric.fields() if key != "output")
            rows.append([f"`{kind}`", f"`{metric.__name__}`", keys, metric.unit or "of the output", metric.summary()])
    head = ["kind", "in Python", "keys besides `output`", "unit", "what it is"]
    return "\n".join("| " + " | ".join(row) + " |" for row in [head, ["---"] * len(head), *rows])


TABLES: dict[str, Callable[[], str]] = {
    "shapers": lambda: _rows(["name", "duration / T", "I(5 %)", "what it is"], SHAPERS.values(), _of_shaper),
    "profiles": lambda: _rows(["name", "what it is"], PROFILES.values(), lambda one: []),
    "pulse designs": lambda: _rows(["design", "what it is"], PULSES.values(), lambda one: []),
    "metrics": _metrics,
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
