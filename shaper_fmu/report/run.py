"""The report of one run: time responses, with one figure per unit."""

from __future__ import annotations

import re

from shaper_fmu.master.results import Results
from shaper_fmu.page.blocks import Block, Table
from shaper_fmu.page.figures import Figure, Line, label


def run_blocks(results: Results) -> list[Block]:
    """Blocks of the page; variables of equal unit share a figure, constant ones are only in the table."""
    by_unit: dict[str, list[Line]] = {}
    rows = []
    for name in results.values:
        column, unit = results.display(name)
        rows.append([name, f"{column[0]:.6g}", f"{column[-1]:.6g}", f"{column.min():.6g}", f"{column.max():.6g}", unit])
        if column.min() != column.max() and not name.endswith("next_event_time"):
            by_unit.setdefault(unit, []).append(Line(name, results.time, column))
    figures: list[Block] = [
        Figure(f"response_{re.sub(r'[^A-Za-z0-9]+', '_', unit) or 'number'}", label("Time response", unit), "time [s]", unit, lines)
        for unit, lines in by_unit.items()
    ]
    return [*figures, Table("Recorded variables", ["variable", "first", "last", "least", "greatest", "unit"], rows)]
