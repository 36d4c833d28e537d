"""The consoles to which the command line writes.

Texts are printed unchanged, since names come from outside, and `:smile:` may be one. Words are never broken, since names and paths
are copied and searched for: on a terminal lines break between words, and in a pipe or a file lines do not break.
"""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

from rich.cells import cell_len
from rich.console import Console
from rich.table import Table as RichTable
from rich.text import Text

from shaper_fmu.page.blocks import Table


class PlainConsole(Console):
    """A console without markup, emoji codes and highlighting, which never breaks words."""

    def __init__(self, **options: Any):
        super().__init__(highlight=False, markup=False, emoji=False, **options)
        if not self.width:  # COLUMNS=0, with which rich prints nothing
            self.width = 80

    @property
    def breaks_lines(self) -> bool:
        """Whether it is a terminal. FORCE_COLOR makes `is_terminal` true for a pipe, so that is not used."""
        return self.file.isatty()

    def print(self, *objects: Any, **options: Any) -> None:
        """As rich's, but no word is broken: lines with one that is longer than the terminal is wide are left to the terminal."""
        texts = [text for text in objects if isinstance(text, (str, Text))]
        longest = max((cell_len(word) for text in texts for word in str(text).split()), default=0)
        whole = not self.breaks_lines or len(texts) < len(objects) or longest > self.width
        settings: dict[str, Any] = {"soft_wrap": whole, **options}
        super().print(*objects, **settings)


out: PlainConsole = PlainConsole()
err: PlainConsole = PlainConsole(stderr=True)


def show(table: Table, lines: bool = False, styles: Mapping[str, str] | None = None) -> None:
    """Print a table; the first column left-aligned, the others right: all of them left if `left_aligned`.

    With `lines` between the rows; `styles` are of cells, by their texts. What is too wide for the terminal is printed
    cell by cell.
    """
    rows = [[_text(cell, styles) for cell in row] for row in table.rows]
    head = [_text(name) for name in table.head]
    widths = _widths([head, *rows], out.width if out.breaks_lines else None)
    if table.title:
        out.print(Text(table.title, style="table.title"))
    if widths is None:
        _show_cells(head, rows)
        return
    printed = RichTable(show_lines=lines, width=sum(widths) + _frame(len(widths)))
    for i, (name, width) in enumerate(zip(head, widths, strict=True)):
        printed.add_column(name, justify="right" if i and not table.left_aligned else "left", width=width)
    for row in rows:
        printed.add_row(*row)
    out.print(printed)


def _text(cell: str, styles: Mapping[str, str] | None = None) -> Text:
    return Text(cell.expandtabs(), style=(styles or {}).get(cell, ""))


def _frame(columns: int) -> int:
    """Width of the lines and spaces of a table with so many columns."""
    return 3 * columns + 1


def _widths(rows: list[list[Text]], room: int | None) -> list[int] | None:
    """Widths of the columns of a table within `room` in which no word is broken; None if that is impossible.

    Columns that need less than an equal share of the room beyond their longest words get what they need.
    """
    sizes = [[cell.__rich_measure__(out, out.options) for cell in column] for column in zip(*rows, strict=True)]
    widest = [max(size.maximum for size in column) for column in sizes]
    if room is None:
        return widest
    widths = [max(size.minimum for size in column) for column in sizes]
    left = room - _frame(len(widths)) - sum(widths)
    if left < 0:
        return None
    for rest, i in zip(range(len(widths), 0, -1), sorted(range(len(widths)), key=lambda i: widest[i] - widths[i]), strict=True):
        more = min(left // rest, widest[i] - widths[i])
        widths[i] += more
        left -= more
    return widths


def _show_cells(head: list[Text], rows: list[list[Text]]) -> None:
    """Each row as lines of their own, one for a cell, with the column's name."""
    for row in rows:
        for name, cell in zip(head, row, strict=True):
            out.print(Text.assemble(name, ": " if name.plain else "", cell))
        out.print()
