"""The kinds of values that kernels compute with, and what they are in C."""

from __future__ import annotations

import ast
from dataclasses import dataclass
from types import FunctionType


class Mismatch(Exception):
    """Two kinds that no variable can have both of."""


@dataclass(frozen=True)
class Kind:
    """A kind of value; `c` is its type in C, with the space or star before a name."""

    c: str

    def __str__(self) -> str:
        return {"double ": "a real number", "int64_t ": "an integer", "bool ": "a Boolean", "void ": "nothing"}.get(self.c, self.c)


@dataclass(frozen=True)
class Either(Kind):
    """Of an item of a tuple: a real number in C that may be an integer in Python."""


REAL, INTEGER, BOOLEAN, NOTHING, RECORD = Kind("double "), Kind("int64_t "), Kind("bool "), Kind("void "), Kind("Record *")
EITHER = Either("double ")
NUMBERS = (REAL, INTEGER, BOOLEAN)


@dataclass(frozen=True)
class Array(Kind):
    """`size` values of one kind in memory: a variable of the record, a part of one, or a table of constants."""

    element: Kind = REAL
    size: int = 0
    constant: bool = False

    def __str__(self) -> str:
        return f"an array of {self.size}"


def array(element: Kind, size: int, constant: bool = False) -> Array:
    """The kind of an array. Integers and Booleans of the record have 32 bits."""
    c = "int32_t *" if element in (INTEGER, BOOLEAN) and not constant else f"{element.c.strip()} *"
    return Array(f"const {c}" if constant else c, element, size, constant)


@dataclass(frozen=True)
class Struct(Kind):
    """A tuple: a struct whose members are item0, item1, ..."""

    items: tuple[Kind, ...] = ()

    def __str__(self) -> str:
        return f"a tuple of {len(self.items)}"


def struct(items: tuple[Kind, ...]) -> Struct:
    """The kind of a tuple; its name tells the kinds of its items."""
    return Struct(f"Tuple{_letters(items)} ", items)


def _letters(items: tuple[Kind, ...]) -> str:
    return "".join({"double ": "R", "int64_t ": "I", "bool ": "B"}.get(item.c) or f"_{item.c.strip(' *')}_" for item in items)


@dataclass(frozen=True)
class Callee(Kind):
    """A function as a value, known when the kernel is translated. What it captures of the function around it is passed along."""

    function: FunctionType | None = None
    node: ast.FunctionDef | ast.Lambda | None = None
    home: FunctionType | None = None
    captured: tuple[tuple[str, Kind], ...] = ()

    def __str__(self) -> str:
        return f"the function {self.name}"

    @property
    def name(self) -> str:
        return self.function.__name__ if self.function else getattr(self.node, "name", "lambda")


def joined(a: Kind | None, b: Kind) -> Kind:
    """The kind that holds values of both. Raises Mismatch."""
    if a is None or a == b:
        return b
    if a in NUMBERS and b in NUMBERS:
        return REAL if REAL in (a, b) else INTEGER
    if isinstance(a, Struct) and isinstance(b, Struct) and len(a.items) == len(b.items):
        return struct(tuple(_joined_items(x, y) for x, y in zip(a.items, b.items, strict=True)))
    if isinstance(a, Array) and isinstance(b, Array) and (a.element, a.size) == (b.element, b.size):
        if a.constant or b.constant:
            return array(a.element, a.size, True) if a.element == REAL else _different(a, b)
        return array(a.element, a.size)
    return _different(a, b)


def _joined_items(a: Kind, b: Kind) -> Kind:
    """Of two tuples' items."""
    if a != b and {a, b} <= {*NUMBERS, EITHER} and not {a, b} <= {INTEGER, BOOLEAN}:
        return EITHER
    return joined(a, b)


def _different(a: Kind, b: Kind) -> Kind:
    raise Mismatch(f"{a} in one place and {b} in another")
