"""A translation unit: a component's kernels and all that they reach, in C.

Kinds and bounds are inferred by translating over and over until nothing changes any more: what a pass finds out about a function's
arguments, variables and result is what the next one begins with. All of it only grows, and bounds that go on growing are given up.
The last pass writes the text; the ones before leave out what would find out nothing new.
"""

from __future__ import annotations

import enum
import math
import sys
from dataclasses import dataclass, field
from functools import lru_cache
from pathlib import Path
from types import FunctionType
from typing import Any

from shaper_fmu.component import Component
from shaper_fmu.export.c.code import UNARY, Code, integers_of
from shaper_fmu.export.c.kinds import (
    BOOLEAN,
    INTEGER,
    NOTHING,
    NUMBERS,
    REAL,
    Array,
    Callee,
    Kind,
    Mismatch,
    Struct,
    array,
    joined,
    struct,
)
from shaper_fmu.export.c.names import MACROS_OF_THE_LAYER, Names
from shaper_fmu.export.c.ranges import ANY, EXACT_INTEGERS, INT32, TRUTH, WHOLE32, Range, clipped_exactly, union, widest

_PASSES = 30
_GROWING = 6
"""Passes after which bounds that still grow are given up."""


class Refused(Exception):
    """What is not in the subset, and where."""

    def __init__(self, file: str, line: int, words: str):
        super().__init__(words)
        self.file: str = file
        self.line: int = line
        self.words: str = words


@dataclass
class Known:
    """What is known about a variable, an argument or a result."""

    kind: Kind | None = None
    range: Range | None = None
    whole: Range | None = None
    """Of a real number that may be an integer in Python: its bounds then."""


@dataclass
class Function:
    """What is known about a function for arguments of certain kinds, and its text."""

    name: str
    parameters: list[tuple[str, Kind]]
    variables: dict[str, Known] = field(default_factory=dict)
    result: Known = field(default_factory=Known)
    faults: bool = False
    reads: bool = False
    writes: bool = False
    locals: dict[str, str] = field(default_factory=dict)
    """Names in C of its variables, and of what its parameters that are functions capture ("parameter.captured")."""
    written: set[str] = field(default_factory=set)
    """Parameters through which memory is written."""
    text: str = ""
    active: bool = False
    translated: int = -1  # the last pass that has done it
    judged: tuple[int, bool] = (-1, False)  # the pass that has asked whether something is new, and the answer
    known_before: tuple[Any, ...] = ()  # what its last translation began with
    told: dict[int, tuple[Function, tuple[Any, ...]]] = field(default_factory=dict)
    """The functions that its last translation called, by identity, and what each told then."""

    def tells(self) -> tuple[Any, ...]:
        """What its callers use."""
        result = self.result
        return result.kind, result.range, result.whole, self.faults, self.reads, self.writes, len(self.written)

    def knows(self, unit: Unit) -> tuple[Any, ...]:
        """What a translation of its body depends on, beside what the functions that it calls tell."""
        own = [(name, known.kind, known.range, known.whole) for name, known in self.variables.items()]
        return *own, *self.tells(), len(unit.stored), *sorted(unit.whole.items())

    def is_settled(self, unit: Unit) -> bool:
        """Whether another translation would find out nothing new, about it and what it calls."""
        if self.judged[0] != unit.number:
            settled = self.translated >= 0 and self.known_before == self.knows(unit)
            self.judged = unit.number, settled and all(f.tells() == said and f.is_settled(unit) for f, said in self.told.values())
        return self.judged[1]


class Unit:
    """The state of a translation; see `translate`."""

    def __init__(self, component: type[Component]):
        self.component: type[Component] = component
        self.functions: dict[Any, Function] = {}
        self.order: list[Function] = []
        self.structs: dict[str, Struct] = {}
        self.constants: dict[str, str] = {}
        self.names: Names = Names()
        self.locals: set[str] = set()
        self.stored: set[str] = set()
        """Variables of the record that a kernel changes: their declared bounds do not hold while it runs."""
        self.whole: dict[str, Range] = {}
        """Real variables of the record that a kernel sets to integers, and between which bounds these lie."""
        self.number: int = 0
        self.changed: bool = True
        self.final: bool = False
        """Whether this is the last pass, which writes the text."""

    def begin_pass(self) -> bool:
        """Whether another pass is needed."""
        if self.final:
            return False
        self.final = not self.changed
        if self.number > _PASSES:
            raise RuntimeError("the translation does not settle")
        self.changed = False
        self.number += 1
        self.order, self.structs, self.constants = [], {}, {}
        return True

    def learn(self, known: Known, code: Code) -> None:
        """Take in another value of a variable, an argument or a result. Raises Mismatch."""
        both = joined(known.kind, code.kind)
        grown = union(known.range, code.range)
        whole = known.whole
        if both == REAL:  # an integer is tested when it becomes a real number, see FunctionScope.as_kind
            before = [Code("", known.kind, known.range or ANY, whole=known.whole)] if known.kind is not None else []
            whole = integers_of([*before, code])
        elif code.whole is not None:  # an array of such
            whole = union(whole, code.whole)
        if whole != known.whole and self.number > _GROWING and known.whole is not None:
            whole = EXACT_INTEGERS
        if grown != known.range and self.number > _GROWING and known.range is not None:
            grown = widest(both in (INTEGER, BOOLEAN))
        if both == BOOLEAN:
            grown = TRUTH
        if (both, grown, whole) != (known.kind, known.range, known.whole):
            known.kind, known.range, known.whole = both, grown, whole
            self.changed = True

    def mark(self, found: set[str], name: str) -> None:
        if name not in found:
            found.add(name)
            self.changed = True

    def becomes_whole(self, name: str, integers: Range) -> None:
        """A real variable of the record is set to integers within these bounds."""
        known = self.whole.get(name)
        found = union(known, clipped_exactly(integers))
        if found != known:
            self.whole[name] = EXACT_INTEGERS if known is not None and self.number > _GROWING else found
            self.changed = True

    def flag(self, function: Function, name: str) -> None:
        if not getattr(function, name):
            setattr(function, name, True)
            self.changed = True

    def field(self, record: Code, name: str) -> Code:
        """A variable of the record."""
        v = self.component.variables[name]
        kind = REAL if v.kind is float else BOOLEAN if v.kind is bool else INTEGER
        text = f"{record.text}->{field_name(self.component, name)}"
        found = self._bounds(name, kind)
        if v.size is None:
            return Code(text, kind, found, reads=True, whole=self.whole.get(name), narrow=kind != REAL, root=record.root)
        return Code(text, array(kind, v.size), found, reads=True, whole=self.whole.get(name), root=record.root, field=name)

    def _bounds(self, name: str, kind: Kind) -> Range:
        v = self.component.variables[name]
        whole = ANY if kind == REAL else TRUTH if kind == BOOLEAN else WHOLE32
        if v.causality not in ("parameter", "input") or name in self.stored or name in self.component._slopes:
            return whole
        if issubclass(v.kind, enum.IntEnum):
            return Range(min(v.kind), max(v.kind))
        far = sys.float_info.max if kind == REAL else INT32  # what is not finite is refused before a kernel runs
        least = -far if kind == REAL else -far - 1
        low, high = least if v.min is None else v.min, far if v.max is None else v.max
        if v.exclusive in (True, "min") and v.min is not None:
            low = math.nextafter(low, math.inf) if kind == REAL else low + 1
        if v.exclusive in (True, "max") and v.max is not None:
            high = math.nextafter(high, -math.inf) if kind == REAL else high - 1
        return whole if kind == BOOLEAN else Range(low, high)

    def constant(self, value: Any, name: str = "") -> Code | None:
        """A constant of Python's; None for one that kernels cannot have. `name` is what it is called in Python."""
        if isinstance(value, enum.IntEnum):
            return self._member(value)
        if isinstance(value, bool):
            return Code(str(value).lower(), BOOLEAN, Range(int(value), int(value)))
        if isinstance(value, enum.Flag) or not (isinstance(value, enum.Enum) or _computes_as_python(value)):
            return None
        if isinstance(value, int | float):
            return self._number(value, name)
        if isinstance(value, FunctionType):
            return Code("", Callee("", value))
        if value is None:
            return Code("0", NOTHING)
        if isinstance(value, tuple) and value:
            return self._table(value, name)
        return None

    def _number(self, value: float, name: str) -> Code | None:
        kind = REAL if isinstance(value, float) else INTEGER
        if kind == INTEGER and not -(2**63) < value < 2**63:
            return None
        found = Range(value, value) if value == value else ANY
        text = number_text(value)
        if not name:
            return Code(text, kind, found, UNARY if text.startswith("-") else 0)
        c = self.names.given(name, (name, repr(value)), self.locals)
        small = kind == INTEGER and abs(value) <= INT32
        self.constants[c] = f"enum {{ {c} = {text} }};" if small else f"static const {kind.c}{c} = {text};"
        return Code(c, kind, found, narrow=small)

    def _member(self, item: enum.IntEnum) -> Code | None:
        if any(abs(other) > INT32 for other in type(item)):
            return self._number(int(item), "")
        kind = type(item)
        c = self.names.given(kind.__name__, kind, self.locals)
        named = {other: self.names.given(f"{c}_{other.name}", (kind, other), self.locals) for other in kind}
        items = ", ".join(f"{text} = {int(other)}" for other, text in named.items())
        self.constants[c] = f"enum {c} {{ {items} }};"
        return Code(named[item], INTEGER, Range(int(item), int(item)), narrow=True)

    def _table(self, value: tuple[Any, ...], name: str) -> Code | None:
        """A tuple of constants: a table, where all are of one kind."""
        codes = [self.constant(item) for item in value]
        if any(code is None for code in codes):
            return None
        found = [code for code in codes if code is not None]
        whole = struct(tuple(code.kind for code in found))
        try:
            element: Kind | None = None
            for code in found:
                element = joined(element, code.kind)
        except Mismatch:
            return Code("", whole, value=value)
        if element not in NUMBERS and not isinstance(element, Struct):
            return Code("", whole, value=value)
        ranges: Range | None = None
        for code in found:
            ranges = union(ranges, code.range)
        c = self.names.given(name or "table", ("table", name, repr(value)), self.locals)
        self.use(element)
        kind = array(element, len(value), True)
        rows = ", ".join(self.initial(code) for code in found)
        self.constants[c] = f"static {kind.c.removesuffix('*').strip()} {c}[{len(value)}] = {{{rows}}};"
        return Code(c, kind, ranges or ANY, whole=integers_of(found) if element == REAL else None, value=value)

    def initial(self, code: Code) -> str:
        """A constant in an initializer, which cannot name other constants."""
        if isinstance(code.value, tuple):
            return "{" + ", ".join(self.initial(c) for c in map(self.constant, code.value) if c is not None) + "}"
        return number_text(code.range.low) if code.range.constant is not None else code.text

    def use(self, kind: Kind | None) -> None:
        """Define the structs that a kind needs."""
        if isinstance(kind, Struct) and kind.c not in self.structs:
            for item in kind.items:
                self.use(item)
            self.structs[kind.c] = kind
        elif isinstance(kind, Array):
            self.use(kind.element)


def _computes_as_python(value: Any) -> bool:
    """Whether a number is one of Python's own: of numpy, or of a class with operators of its own, it computes otherwise."""
    return type(value) in (int, float) or not isinstance(value, int | float)


def field_name(component: type[Component], name: str) -> str:
    """The name of a variable in the record's struct, which is no other's."""
    return _field_names(tuple(component.variables))[name]


@lru_cache(maxsize=256)
def _field_names(variables: tuple[str, ...]) -> dict[str, str]:
    names = Names()
    return {name: names.given(name, name, MACROS_OF_THE_LAYER) for name in variables}


def number_text(value: float) -> str:
    if isinstance(value, float):
        text = "NAN" if value != value else "INFINITY" if abs(value) == float("inf") else repr(abs(value))
        return f"-{text}" if value < 0.0 or str(value).startswith("-") else text
    return str(int(value))


def file_label(name: str) -> str:
    """How a file is called in the code: its name; a made module by the module's."""
    return name.strip("<>").split(",")[0] if name.startswith("<") else Path(name).name
