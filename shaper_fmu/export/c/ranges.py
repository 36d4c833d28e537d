"""Between which bounds a number lies: what decides where an index, a sum or a quotient needs no test.

A range of reals holds the value, or the value is NaN. Rounding never leaves a range whose ends are rounded alike.
"""

from __future__ import annotations

import math
from collections.abc import Callable
from typing import NamedTuple

INT32 = 2**31 - 1
INT64 = 2**63 - 1
EXACT = 2**53
"""Integers up to here are real numbers, too."""


class Range(NamedTuple):
    """All numbers from `low` to `high`."""

    low: float
    high: float

    def within(self, low: float, high: float) -> bool:
        return low <= self.low and self.high <= high

    @property
    def constant(self) -> float | None:
        return self.low if self.low == self.high else None

    @property
    def has_zero(self) -> bool:
        return self.low <= 0 <= self.high


WHOLE = Range(-(2**63), INT64)
WHOLE32 = Range(-(2**31), INT32)
ANY = Range(-math.inf, math.inf)
TRUTH = Range(0, 1)
EXACT_INTEGERS = Range(-EXACT, EXACT)


def widest(integer: bool) -> Range:
    return WHOLE if integer else ANY


def union(a: Range | None, b: Range) -> Range:
    return b if a is None else Range(min(a.low, b.low), max(a.high, b.high))


def fits(found: Range, bits: int = 64) -> bool:
    return found.within(-(2 ** (bits - 1)), 2 ** (bits - 1) - 1)


def clipped(found: Range) -> Range:
    """The range of an integer that has been tested: it fits into 64 bits, or it is 0 after a fault."""
    inside = found.low <= WHOLE.high and found.high >= WHOLE.low
    return union(Range(0, 0), Range(max(found.low, WHOLE.low), min(found.high, WHOLE.high))) if inside else WHOLE


def clipped_exactly(found: Range) -> Range:
    """The range of an integer that has been tested when it became a real number."""
    return Range(min(max(found.low, -EXACT), EXACT), max(min(found.high, EXACT), -EXACT))


def _corners(a: Range, b: Range, operation: Callable[[float, float], float]) -> Range:
    found = [operation(x, y) for x in a for y in b]
    if any(math.isnan(value) for value in found):
        return ANY
    return Range(min(found), max(found))


def added(a: Range, b: Range) -> Range:
    return _corners(a, b, lambda x, y: x + y)


def subtracted(a: Range, b: Range) -> Range:
    return _corners(a, b, lambda x, y: x - y)


def multiplied(a: Range, b: Range) -> Range:
    return _corners(a, b, lambda x, y: x * y)


def divided(a: Range, b: Range) -> Range:
    """Of a / b, real."""
    if b.has_zero or math.inf in (abs(b.low), abs(b.high)):
        return ANY
    return _corners(Range(float(a.low), float(a.high)), Range(float(b.low), float(b.high)), lambda x, y: x / y)


def quotient(a: Range, b: Range) -> Range:
    """Of a // b, integers."""
    if b.has_zero:
        far = max(abs(a.low), abs(a.high))
        return Range(-far, far)
    return _corners(a, b, lambda x, y: x // y)


def remainder(a: Range, b: Range, integer: bool) -> Range:
    """Of a % b, which has the sign of b."""
    if integer:
        return Range(min(b.low + 1, 0), max(b.high - 1, 0))
    return Range(min(b.low, 0.0), max(b.high, 0.0))


def negated(a: Range) -> Range:
    return Range(-a.high, -a.low)


def magnitude(a: Range) -> Range:
    return Range(0 if a.has_zero else min(abs(a.low), abs(a.high)), max(abs(a.low), abs(a.high)))


def shifted(a: Range, n: Range) -> Range:
    """Of a << n for n >= 0."""
    return _corners(a, Range(2 ** int(min(max(n.low, 0), 64)), 2 ** int(min(max(n.high, 0), 64))), lambda x, y: x * y)
