"""A piece of C: the text of an expression, and what is known about it."""

from __future__ import annotations

from typing import Any, NamedTuple

from shaper_fmu.export.c.kinds import BOOLEAN, INTEGER, Kind
from shaper_fmu.export.c.ranges import ANY, Range

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
        whole: of a real number: whether it may be an integer in Python, whose zero has no sign.
        narrow: whether it has 32 bits in C, so that arithmetic with it must be widened.
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
    whole: bool = False
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
        return self.is_integer or self.whole

    def at(self, level: int) -> str:
        """The text as an operand of an operator of this level; in parentheses if it is held less strongly."""
        mixed = (level == OR and self.level == AND) or (SHIFT <= level <= BITS_OR and SUM <= self.level <= BITS_OR)
        return f"({self.text})" if self.level > level or mixed else self.text

    def wide(self, level: int) -> str:
        """The same for arithmetic with 64 bits."""
        return f"(int64_t){self.at(UNARY)}" if self.narrow else self.at(level)

    def effects_of(self, *others: Code) -> Code:
        """This code, which has been made of others."""
        reads, writes = self.reads or any(o.reads for o in others), self.writes or any(o.writes for o in others)
        return self if (reads, writes) == (self.reads, self.writes) else self._replace(reads=reads, writes=writes)


def literal(value: str) -> str:
    """A string literal of C."""
    return '"' + value.encode("ascii", "replace").decode().replace("\\", "\\\\").replace('"', '\\"') + '"'
