"""Parses units such as "N.s/m" into exponents of the SI base units, as FMI writes them."""

from __future__ import annotations

import re
from dataclasses import dataclass
from typing import Protocol

from shaper_fmu.errors import ComponentError, nearest

BASE = ("kg", "m", "s", "A", "K", "mol", "cd", "rad")

_SYMBOLS: dict[str, tuple[float, dict[str, int]]] = {
    **{symbol: (1.0, {symbol: 1}) for symbol in BASE},
    "1": (1.0, {}),
    "Hz": (1.0, {"s": -1}),
    "N": (1.0, {"kg": 1, "m": 1, "s": -2}),
    "Pa": (1.0, {"kg": 1, "m": -1, "s": -2}),
    "J": (1.0, {"kg": 1, "m": 2, "s": -2}),
    "W": (1.0, {"kg": 1, "m": 2, "s": -3}),
    "V": (1.0, {"kg": 1, "m": 2, "s": -3, "A": -1}),
    "deg": (0.017453292519943295, {"rad": 1}),
    "mm": (1e-3, {"m": 1}),
    "ms": (1e-3, {"s": 1}),
    "g": (1e-3, {"kg": 1}),
    "min": (60.0, {"s": 1}),
    "h": (3600.0, {"s": 1}),
    "bar": (1e5, {"kg": 1, "m": -1, "s": -2}),
    "L": (1e-3, {"m": 3}),
}
_TERM = re.compile(r"([A-Za-z]+|1)(-?\d+)?$")


@dataclass(frozen=True)
class Unit:
    """A unit as FMI defines it: value in SI = factor * value + offset, with base unit exponents.

    Attributes:
        exponents: pairs (base unit, exponent), in the order of `BASE`, zero exponents left out.
        factor: SI units per this unit.
        offset: SI value of zero in this unit.
    """

    exponents: tuple[tuple[str, int], ...]
    factor: float = 1.0
    offset: float = 0.0


class Scaled(Protocol):
    """A unit as its factor and offset to SI; may be FMI's, SSP's or ours."""

    @property
    def factor(self) -> float: ...

    @property
    def offset(self) -> float: ...


def conversion(source: Scaled, target: Scaled) -> tuple[float, float]:
    """Gain and offset from a value in `source` to one in `target`, units of one kind: value in SI = factor * value + offset."""
    factor = float(target.factor)
    return float(source.factor) / factor, (float(source.offset) - float(target.offset)) / factor


def parse_unit(text: str) -> Unit:
    """The unit written as symbols with integer exponents joined by "." and "/" ("m/s2", "N.s/m").

    A "/" applies to the one symbol behind it. Raises ComponentError for an unknown symbol.
    """
    factor, exponents = 1.0, {str(base): 0 for base in BASE}
    sign = 1
    for token in re.split(r"([./])", text):
        if token in "./":
            sign = -1 if token == "/" else 1
            continue
        match = _TERM.match(token)
        if not match or match[1] not in _SYMBOLS:
            raise ComponentError(f"unit {text!r}: {token!r} is not a known unit symbol.{nearest(token, _SYMBOLS)}")
        power = sign * int(match[2] or 1)
        scale, dimensions = _SYMBOLS[match[1]]
        factor *= scale**power
        for base, exponent in dimensions.items():
            exponents[base] += exponent * power
    return Unit(tuple((base, exponent) for base, exponent in exponents.items() if exponent), factor)
