"""Figures of runs: recorded variables over time, one figure per unit, and several runs over each other."""

from __future__ import annotations

import re
from collections.abc import Iterable, Mapping
from typing import TYPE_CHECKING

from shaper_fmu.errors import ModelError
from shaper_fmu.page.figures import Figure, Line, label

if TYPE_CHECKING:
    from shaper_fmu.master.results import Results

NEVER = 1e299
"""Times from here on are no times: an output `next_event_time` that is 1e300 while nothing is ahead."""


def time_figures(runs: Mapping[str, Results], names: Iterable[str] | None = None) -> list[Figure]:
    """The runs' variables over time [s], in the units for people; variables of equal unit share a figure.

    A line of several runs is called "variable, run"; one of a single run by its variable alone. Without `names`, all that
    are recorded in any of the runs but what never changes and times of events. Raises ModelError for an unknown name, and for a
    variable with different units.
    """
    wanted = [names] if isinstance(names, str) else names
    shown = list(wanted) if wanted is not None else [name for name in _all(runs) if _moves(runs, name)]
    by_unit: dict[str, list[Line]] = {}
    units: dict[str, str] = {}
    for name in shown:
        for run, results in runs.items():
            if wanted is None and name not in results.values:
                continue
            column, unit = results.display(name)
            if units.setdefault(name, unit) != unit:
                raise ModelError([f"{name} has the unit {units[name]!r} in one run, and {unit!r} in {run}"])
            text = name if len(runs) == 1 else f"{name}, {run}"
            by_unit.setdefault(unit, []).append(Line(text, results.time, column))
    return [
        Figure(f"response_{re.sub(r'[^A-Za-z0-9]+', '_', unit) or 'number'}", label("Time response", unit), "time [s]", unit, lines)
        for unit, lines in by_unit.items()
    ]


def number_text(value: float) -> str:
    """A recorded number for people: six digits, "never" for the time of an event that does not come."""
    return "never" if value >= NEVER else f"{value:.6g}"


def _all(runs: Mapping[str, Results]) -> list[str]:
    return list(dict.fromkeys(name for results in runs.values() for name in results.values))


def _moves(runs: Mapping[str, Results], name: str) -> bool:
    if name.endswith("next_event_time"):
        return False
    columns = [results.values[name] for results in runs.values() if name in results.values]
    return any(len(column) and column.min() != column.max() for column in columns)
