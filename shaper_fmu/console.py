"""What the command line writes to."""

from __future__ import annotations

import sys

from rich.console import Console
from rich.table import Table as RichTable

from shaper_fmu.report.page import Table

_PIPED_WIDTH = 160

out = Console(highlight=False, markup=False, soft_wrap=True, width=None if sys.stdout.isatty() else _PIPED_WIDTH)
err = Console(stderr=True, highlight=False, markup=False, soft_wrap=True)


def show(table: Table) -> None:
    """Print a table; the first column left-aligned, the others right."""
    printed = RichTable(title=table.title, title_justify="left")
    for i, name in enumerate(table.head):
        printed.add_column(name, justify="right" if i else "left")
    for row in table.rows:
        printed.add_row(*row)
    out.print(printed)
