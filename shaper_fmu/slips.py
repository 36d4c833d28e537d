"""Arguments of the wrong kind, as they are easily given: what is wrong, and an example of what is right."""

from __future__ import annotations

from collections.abc import Mapping
from numbers import Real
from typing import Any

import numpy as np

from shaper_fmu.errors import ArgumentError


def checked_mapping(what: str, given: Any, example: str) -> None:
    """Raise ArgumentError unless it is a mapping, or None."""
    if given is not None and not isinstance(given, Mapping):
        raise ArgumentError(f"{what} = {given!r:.80}: names with values are needed, such as {example}")


def checked_names(what: str, given: Any) -> None:
    """Raise ArgumentError for a text where a list of names is needed."""
    if isinstance(given, str):
        raise ArgumentError(f"{what} = {given!r}: a list of names is needed, such as {what}=[{given!r}]")


def checked_numbers(what: str, given: Any) -> None:
    """Raise ArgumentError for a text where a number, or several, are needed."""
    if isinstance(given, str | bytes):
        raise ArgumentError(f"{what} = {given!r}: a text where a number is needed{_meant(given)}")


def checked_number(what: str, given: Any) -> None:
    """Raise ArgumentError for what is no number."""
    checked_numbers(what, given)
    if not isinstance(given, Real | np.number):
        raise ArgumentError(f"{what} = {given!r:.80}: {type(given).__name__} where a number is needed")


def _meant(given: str | bytes) -> str:
    """The number that a text tells, "10%" as a share."""
    text = given.strip() if isinstance(given, str) else ""
    try:
        value = float(text.removesuffix("%")) * (0.01 if text.endswith("%") else 1.0)
    except ValueError:
        return ""
    return f"; did you mean {value:g}?"
