"""The report of one run: time responses, with one figure per unit."""

from __future__ import annotations

from shaper_fmu.master.results import Results
from shaper_fmu.master.time_figures import number_text, time_figures
from shaper_fmu.page.blocks import Block, Table


def run_blocks(results: Results) -> list[Block]:
    """Blocks of the page; variables of equal unit share a figure, constant ones are only in the table."""
    rows = []
    for name in results.values:
        column, unit = results.display(name)
        rows.append([name, *(number_text(value) for value in (column[0], column[-1], column.min(), column.max())), unit])
    figures = time_figures({"": results})
    return [*figures, Table("Recorded variables", ["variable", "first", "last", "least", "greatest", "unit"], rows)]
