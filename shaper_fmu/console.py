"""What the command line writes to: texts are printed as they are, for names come from outside, and `:smile:` may be one."""

from __future__ import annotations

import sys
from typing import Any

from rich.console import Console
from rich.table import Table as RichTable

from shaper_fmu.report.page import Table

_PIPED_WIDTH = 160


def _plain(**options: Any) -> Console:
    return Console(highlight=False, markup=False, emoji=False, **options)


out = _plain(soft_wrap=True, width=None if sys.stdout.isatty() else _PIPED_WIDTH)
err = _plain(stderr=True, soft_wrap=True)
wrapping = _plain()
"""For long texts in tables: `out` neither wraps nor colours."""


def show(table: Table) -> None:
    """Print a table; the first column left-aligned, the others right."""
    printed = RichTable(title=table.title, title_justify="left")
    for i, name in enumerate(table.head):
        printed.add_column(name, justify="right" if i else "left")
    for row in table.rows:
        printed.add_row(*row)
    out.print(printed)
