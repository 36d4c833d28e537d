"""Numbers with a unit, as people type them ("0.8Hz", "2 kg", "5%"), as numbers in a variable's own unit."""

from __future__ import annotations

import math
import re
from collections.abc import Mapping
from dataclasses import dataclass

from shaper_fmu.errors import ComponentError, ShaperFmuError
from shaper_fmu.units import parse_unit

_QUANTITY = re.compile(r"\s*([+-]?(?:\d++\.?\d*+|\.\d++)(?:[eE][+-]?\d++)?+)\s*([A-Za-z%\u00b0\u00b5\u03bc][^\s,]*)\s*")
_BARE = {"", "1", "-"}
"""Names of the unit of a share."""


@dataclass(frozen=True)
class Defined:
    """What a file says of a unit: value in SI = factor * value + offset, and the exponents of the base units."""

    exponents: Mapping[str, int]
    factor: float = 1.0
    offset: float = 0.0


def in_unit(text: str, unit: str, where: str, defined: Defined | None = None) -> str | float:
    """The number of a text in `unit`, if the text has a unit of its own; all other texts unchanged.

    Hz and rad/s are turned into each other by 2 pi, which no definition of them tells: 1/s may be meant by both.

    Args:
        text: such as "0.8Hz"; a number alone is in `unit` already.
        unit: the variable's, "" if it has none.
        where: the variable, for messages.
        defined: what the variable's file says of its unit; default: what its name says.

    Raises ComponentError for an unknown unit, one of another kind, and a variable without a unit or with one that nobody defines.
    """
    match = _QUANTITY.fullmatch(text)
    if match is None:
        return text
    number, given = float(match[1]), match[2]
    if given == unit:
        return number
    if given == "%" and unit in _BARE:
        return number / 100.0
    if not unit:
        raise ComponentError(f"{where} = {text}: it has no unit, so give the number alone")
    try:
        source = parse_unit(given)
    except ShaperFmuError as error:
        raise ComponentError(f"{where} = {text}: {error} It is in {unit}") from None
    target = _target(unit, where, text, defined)
    exponents, factor = dict(source.exponents), source.factor
    if given == "Hz" and target.exponents == {"rad": 1, "s": -1}:
        exponents, factor = dict(target.exponents), 2.0 * math.pi
    elif unit == "Hz" and exponents == {"rad": 1, "s": -1} and target.exponents == {"s": -1}:
        exponents, factor = {"s": -1}, factor / (2.0 * math.pi)
    if exponents != target.exponents:
        raise ComponentError(f"{where} = {text}: it is in {unit}, and {given} is a unit of another kind")
    return (factor * number - target.offset) / target.factor


def _target(unit: str, where: str, text: str, defined: Defined | None) -> Defined:
    if defined is None:
        try:
            found = parse_unit(unit)
        except ShaperFmuError:
            raise ComponentError(f"{where} = {text}: its unit {unit} is not defined, so give the number alone, in {unit}") from None
        return Defined(dict(found.exponents), found.factor, found.offset)
    exponents = {base: power for base, power in defined.exponents.items() if power}
    if (
        re.search(r"rad|rev|rpm|deg(?![CF])", unit) and "rad" not in exponents
    ):  # some tools leave out the radian, and 1/s may be Hz then
        exponents["rad"] = 1
    return Defined(exponents, defined.factor, defined.offset)
