"""Shares and times, as they are typed."""

from __future__ import annotations

import math
import re

import typer


def share(text: str, option: str | None = None) -> float:
    """A share, written as 5% or 0.05. Raises BadParameter for anything else, and for a percentage that lacks its sign."""
    number = text.strip()
    try:
        value = float(number[:-1]) / 100.0 if number.endswith("%") else float(number)
    except ValueError:
        value = math.nan
    if not math.isfinite(value):
        raise typer.BadParameter(f"{text!r} is not a share; write 5% or 0.05", param_hint=option)
    if abs(value) >= 1.0 and not number.endswith("%"):
        raise typer.BadParameter(
            f"{number} would be {100.0 * value:g} %: did you mean {number}%? If not, write {100.0 * value:g}%", param_hint=option
        )
    return value


_UNITS = {"": 1.0, "s": 1.0, "min": 60.0, "h": 3600.0}


def duration_of(text: str) -> float:
    """A time [s], written as 90, 90s, 2min or 1h. Raises BadParameter for anything else."""
    found = re.fullmatch(r"\s*([0-9.eE+-]+?)\s*(s|min|h|)\s*", str(text))
    try:
        value = float(found[1]) * _UNITS[found[2]] if found else math.nan
    except ValueError:
        value = math.nan
    if not 0.0 < value < math.inf:
        raise typer.BadParameter(f"{text!r} is no time above 0; write 90s, 2min or 1h")
    return value
