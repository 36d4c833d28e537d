"""A piece of C: the text of an expression, and what is known about it."""

from __future__ import annotations

import json
from collections.abc import Iterable
from typing import Any, NamedTuple

from shaper_fmu.export.c.kinds import BOOLEAN, INTEGER, Kind
from shaper_fmu.export.c.ranges import ANY, INT32, Range, clipped_exactly, union

ATOM, UNARY, PRODUCT, SUM, SHIFT, RELATION, EQUALITY, BITS_AND, BITS_XOR, BITS_OR, AND, OR, CHOICE = range(13)
"""How strongly an expression is held together: the operators of C by precedence."""


class Code(NamedTuple):  # made by the hundred thousand: three times as fast as a frozen dataclass
    """An expression in C.

    Attributes:
        text: of the expression.
        kind: of its value.
        range: that its value lies in.
        level: of its outermost operator.
        reads: whether it depends on memory that a call may change.
        writes: whether it calls a function that changes memory.
        whole: of a real number that may be an integer in Python: between which bounds it then lies. Such a zero has no sign.
        narrow: whether it is an int in C, so that arithmetic with it must be widened; literals and Booleans are so anyway.
        root: the parameter whose memory an array or record is; `field` is the record's, where that is known.
        captured: of a function: the texts of what it captures.
        value: of a constant that is no number: a tuple, or None.
    """

    text: str
    kind: Kind
    range: Range = ANY
    level: int = ATOM
    reads: bool = False
    writes: bool = False
    whole: Range | None = None
    narrow: bool = False
    root: str = ""
    field: str = ""
    captured: tuple[str, ...] = ()
    value: Any = None

    @property
    def is_integer(self) -> bool:
        return self.kind in (INTEGER, BOOLEAN)

    @property
    def maybe_integer(self) -> bool:
        return self.integers is not None

    @property
    def integers(self) -> Range | None:
        """Between which bounds it may be an integer in Python; None if it never is one."""
        return self.range if self.is_integer else self.whole

    @property
    def is_literal(self) -> bool:
        return self.text.lstrip("-").isdigit()

    @property
    def is_int(self) -> bool:
        """Whether it is an int in C, in which a product of two would overflow: of 32 bits, or a truth value."""
        return self.narrow or self.kind == BOOLEAN or (self.is_literal and abs(int(self.text)) <= INT32)

    def at(self, level: int) -> str:
        """The text as an operand of an operator of this level; in parentheses if it is held less strongly."""
        mixed = (level == OR and self.level == AND) or (SHIFT <= level <= BITS_OR and SUM <= self.level <= BITS_OR)
        return f"({self.text})" if self.level > level or mixed else self.text

    def wide(self, level: int) -> str:
        """The same for arithmetic with 64 bits."""
        return f"(int64_t){self.at(UNARY)}" if self.is_int else self.at(level)

    def effects_of(self, *others: Code) -> Code:
        """This code, which has been made of others."""
        reads, writes = self.reads or any(o.reads for o in others), self.writes or any(o.writes for o in others)
        return self if (reads, writes) == (self.reads, self.writes) else self._replace(reads=reads, writes=writes)


def literal(value: str) -> str:
    """A string literal of C. JSON's escapes are C's, once nothing but ASCII is left; two question marks might begin a trigraph."""
    return json.dumps(value.encode("ascii", "replace").decode()).replace("??", "?\\?")


def integers_of(codes: Iterable[Code]) -> Range | None:
    """Between which bounds a real number, which is one of these, may be an integer in Python; None if none of them may."""
    found: Range | None = None
    for integers in (code.integers for code in codes):
        found = union(found, clipped_exactly(integers)) if integers is not None else found
    return found
