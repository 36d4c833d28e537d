"""HTML for notebooks: a heading, facts and tables, in the notebook's own colours, light or dark.

Names come from files of others: all texts are escaped, and nothing needs a script.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from html import escape

from shaper_fmu.page.blocks import Table

MOST_ROWS = 30
"""Rows of a table that are shown; the rest is counted."""

_CELL = "padding:0.15em 0.7em;border-bottom:1px solid rgba(128,128,128,0.35);"


def page(title: str, facts: Mapping[str, str], tables: Sequence[Table] = (), drawing: str = "") -> str:
    """An object: its title, what is known of it (empty texts are left out), an SVG `drawing` as it stands, and tables."""
    lines = "".join(f"<tr>{_cell(name, 'left', 'th')}{_cell(text, 'left')}</tr>" for name, text in facts.items() if text)
    known = f"<table>{lines}</table>" if lines else ""
    return f"<div><b>{escape(title)}</b>{known}{drawing}{''.join(map(table_html, tables))}</div>"


def table_html(table: Table) -> str:
    """A table; of a long one the first rows, and how many more there are."""
    head = "".join(_cell(name, _side(table, i), "th") for i, name in enumerate(table.head))
    rows = "".join(
        f"<tr>{''.join(_cell(text, _side(table, i)) for i, text in enumerate(row))}</tr>" for row in table.rows[:MOST_ROWS]
    )
    more = len(table.rows) - MOST_ROWS
    rest = f"<div>... and {more} more</div>" if more > 0 else ""
    title = f'<div style="margin-top:0.6em">{escape(table.title)}</div>' if table.title else ""
    return f"{title}<table><thead><tr>{head}</tr></thead><tbody>{rows}</tbody></table>{rest}"


def _side(table: Table, column: int) -> str:
    return "left" if table.left_aligned or column == 0 else "right"


def _cell(text: str, side: str, tag: str = "td") -> str:
    return f'<{tag} style="text-align:{side};{_CELL}">{escape(text)}</{tag}>'
