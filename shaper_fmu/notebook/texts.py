"""Short texts of objects: `repr` in one line, whatever they hold."""

from __future__ import annotations

import math
from collections.abc import Sequence

_MOST = 6
"""Things that are named; the others are counted."""


def counted(number: int, what: str) -> str:
    """A number of things: "1 run", "2 runs"."""
    return f"{number} {what}{'' if number == 1 else 's'}"


def listed(texts: Sequence[str], most: int = _MOST) -> str:
    """The texts, or the first of them and how many more there are."""
    more = len(texts) - most
    return ", ".join(texts[:most]) + (f" and {more} more" if more > 0 else "")


def numbers(values: Sequence[float], most: int = _MOST) -> str:
    """Numbers with five digits, the first of them."""
    return listed([f"{value:.5g}" for value in values], most)


def percent(share: float) -> str:
    """A share in percent, with three digits."""
    return f"{100.0 * share:.3g} %"


def limit(value: float, unit: str, none: float) -> str:
    """A limit with its unit; "none" where it is not less than `none`, the number that stands for no limit."""
    return "none" if not value < none or math.isinf(value) else f"{value:.6g} {unit}"
