"""Escapes texts in CSV tables that a spreadsheet would take for formulas."""

from __future__ import annotations

_FORMULA = ("=", "+", "-", "@", "\uff1d", "\uff0b", "\uff0d", "\uff20")  # and their wide forms
_BREAKS = ("\t", "\r", "\n")


def safe_text(text: str) -> str:
    """The text, behind an apostrophe if a spreadsheet could take it for a formula, or if it begins with one itself.

    Texts of numbers stay as they are. `plain_text` is the way back.
    """
    if not text.startswith(("'", *_BREAKS)) and not text.lstrip().startswith(_FORMULA):
        return text
    try:
        float(text)
    except ValueError:
        return f"'{text}"
    return text


def plain_text(cell: str) -> str:
    """The text that `safe_text` wrote."""
    return cell[1:] if cell.startswith("'") and safe_text(cell[1:]) != cell[1:] else cell
