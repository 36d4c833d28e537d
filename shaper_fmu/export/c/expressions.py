"""Expressions: what a kernel computes, in C."""

from __future__ import annotations

import ast
import enum
import math
from collections.abc import Callable, Iterable
from functools import partial
from types import ModuleType
from typing import Any

from shaper_fmu.export.c import operators
from shaper_fmu.export.c.code import ATOM, CHOICE, OR, Code, integers_of, literal
from shaper_fmu.export.c.comparisons import compare
from shaper_fmu.export.c.kinds import (
    BOOLEAN,
    EITHER,
    INTEGER,
    NOTHING,
    REAL,
    RECORD,
    Array,
    Callee,
    Mismatch,
    Struct,
    joined,
    struct,
)
from shaper_fmu.export.c.ranges import EXACT_INTEGERS, TRUTH, union, widest
from shaper_fmu.export.c.scope import FunctionScope
from shaper_fmu.export.c.source import UNKNOWN, own_names, walked

Caller = Callable[["Expressions", ast.Call], Code]


class Expressions:
    """Translates the expressions of one function; `calls` translates calls."""

    def __init__(self, scope: FunctionScope, calls: Caller):
        self.scope: FunctionScope = scope
        self.calls: Caller = calls
        self.indexes: dict[ast.Subscript, Code] = {}  # that were evaluated before

    def of(self, node: ast.expr) -> Code:
        """The expression in C. Raises Refused."""
        method = getattr(self, f"_{type(node).__name__.lower()}", None)
        if method is None:
            self.scope.refuse(node, f"{ast.unparse(node)} is nothing that a kernel can compute")
        return method(node)

    def number(self, node: ast.expr) -> Code:
        code = self.of(node)
        operators.numbers(self.scope, node, code)
        return code

    def in_turn(self, nodes: Iterable[ast.expr]) -> list[Code]:
        """Expressions of which each is evaluated after the one before."""
        return self.scope.one_by_one([partial(self.of, node) for node in nodes])

    def truth(self, node: ast.expr) -> Code:
        """Whether an expression counts as true; `and`, `or` and `not` of such."""
        if isinstance(node, ast.BoolOp):
            return self._both(node)
        if isinstance(node, ast.UnaryOp) and isinstance(node.op, ast.Not):
            return operators.negation(self.scope, node, self.truth(node.operand))
        return operators.truth(self.scope, node, self.of(node))

    def _both(self, node: ast.BoolOp) -> Code:
        parts = [self.truth(node.values[0])]
        with self.scope.unordered():
            parts += [self.truth(value) for value in node.values[1:]]
        return operators.both(parts, isinstance(node.op, ast.Or))

    def _constant(self, node: ast.Constant) -> Code:
        code = self.scope.unit.constant(node.value)
        if code is None or isinstance(node.value, str | bytes | complex):
            self.scope.refuse(node, f"{node.value!r} is no number that a kernel can have")
        return code

    def _name(self, node: ast.Name) -> Code:
        if node.id in self.scope.own:
            return self.scope.variable(node)
        return self._outside(node, node.id, self.scope.outside.get(node.id, UNKNOWN))

    def _outside(self, node: ast.expr, name: str, value: Any) -> Code:
        code = None if value is UNKNOWN else self.scope.unit.constant(value, name)
        if code is None:
            kind = type(value).__name__
            self.scope.refuse(
                node, f"{name} does not compile: it is of type {kind}; a kernel reads numbers, tuples of numbers and the record"
            )
        return code

    def _attribute(self, node: ast.Attribute) -> Code:
        value = self.scope.names_value(node)
        if value is not UNKNOWN:
            owner = self.scope.names_value(node.value)
            named = isinstance(owner, ModuleType) and not (isinstance(value, float) and not math.isfinite(value))
            return (
                self._outside(node, node.attr if named else "", value)
                if not isinstance(value, enum.IntEnum)
                else self._member(node, value)
            )
        owner = self.of(node.value)
        owner = owner._replace(text=owner.at(ATOM), level=ATOM)
        if owner.kind == RECORD and node.attr in self.scope.unit.component.variables:
            return self.scope.unit.field(owner, node.attr)
        if owner.kind == RECORD:
            self.scope.refuse(node, f"{ast.unparse(node)} is not declared")
        self.scope.refuse(node, f"{ast.unparse(node.value)} is {owner.kind} and has no {node.attr!r}")

    def _member(self, node: ast.expr, value: enum.IntEnum) -> Code:
        code = self.scope.unit.constant(value)
        if code is None:
            self.scope.refuse(node, f"{value!r} does not fit into 64 bits")
        return code

    def _subscript(self, node: ast.Subscript) -> Code:
        owner = self.of(node.value)
        if isinstance(node.slice, ast.Slice):
            self.scope.refuse(node, f"{ast.unparse(node)} is a copy in Python; use the array itself, element by element in a loop")
        if isinstance(owner.kind, Struct) or isinstance(owner.value, tuple):
            fixed = _fixed_index(node.slice)
            size = len(owner.kind.items) if isinstance(owner.kind, Struct) else len(owner.value)
            if fixed is not None and not -size <= fixed < size:
                self.scope.refuse(node, f"{ast.unparse(node)}: there are {size} items, numbered from 0")
            if fixed is not None:
                return self.item(owner, fixed % size)
        if isinstance(owner.kind, Struct):
            self.scope.refuse(node, f"{ast.unparse(node)}: the items of this tuple are taken by numbers that are written out")
        if not isinstance(owner.kind, Array):
            self.scope.refuse(node, f"{ast.unparse(node.value)} is {owner.kind}, and has no elements")
        at = self.indexes.get(node) or self.index(node, owner, self.of(node.slice))
        kind = owner.kind.element
        narrow = kind in (INTEGER, BOOLEAN) and not owner.kind.constant
        text = f"{owner.at(ATOM)}[{at.text}]"
        reads = not owner.kind.constant
        return Code(text, kind, owner.range, reads=reads, whole=owner.whole, narrow=narrow, root=owner.root).effects_of(owner, at)

    def hold_index(self, node: ast.Subscript) -> None:
        """Evaluate the index of an element here, and once."""
        owner = self.of(node.value)
        if isinstance(owner.kind, Array):
            if owner.writes:
                self.scope.refuse(node, "write the call as a line of its own")
            self.indexes[node] = self.scope.temporary(self.index(node, owner, self.of(node.slice)), "at")

    def index(self, node: ast.Subscript, owner: Code, at: Code) -> Code:
        """An index, tested unless its bounds are those of the array."""
        assert isinstance(owner.kind, Array)
        if at.kind not in (INTEGER, BOOLEAN):
            self.scope.refuse(node, f"the index {ast.unparse(node.slice)} is {at.kind}; write int(...) or math.floor(...)")
        size = owner.kind.size
        if at.range.within(0, size - 1):
            return at
        if at.range.constant is not None and -size <= at.range.low < 0:
            return Code(str(int(at.range.low) + size), INTEGER, at.range)
        if at.range.low >= size or at.range.high < -size:
            self.scope.refuse(node, f"{ast.unparse(node)}: the index is outside of the {size} elements, which are numbered from 0")
        name = literal(ast.unparse(node.value))
        text = f"checked_index({self.scope.fault()}, {at.text}, {size}, {name}, {self.scope.where(node)})"
        return Code(text, INTEGER).effects_of(at)

    def item(self, owner: Code, number: int) -> Code:
        """An item of a tuple."""
        if isinstance(owner.value, tuple):
            code = self.scope.unit.constant(owner.value[number])
            assert code is not None
            return code
        assert isinstance(owner.kind, Struct)
        kind = owner.kind.items[number]
        found = TRUTH if kind == BOOLEAN else widest(kind == INTEGER)
        kind, whole = (REAL, EXACT_INTEGERS) if kind == EITHER else (kind, None)
        return Code(f"{owner.at(ATOM)}.item{number}", kind, found, reads=owner.reads, writes=owner.writes, whole=whole)

    def _binop(self, node: ast.BinOp) -> Code:
        left, right = self.in_turn([node.left, node.right])
        operators.numbers(self.scope, node, left, right)
        return operators.binary(self.scope, node, node.op, left, right)

    def _unaryop(self, node: ast.UnaryOp) -> Code:
        if isinstance(node.op, ast.Not):
            return self.truth(node)
        return operators.unary(self.scope, node, self.number(node.operand))

    def _boolop(self, node: ast.BoolOp) -> Code:
        """`and` and `or` as values: Python's give the operand that decides."""
        with self.scope.unordered():
            kinds = {self.number(value).kind for value in node.values[1:]}
        first = self.number(node.values[0])
        if kinds | {first.kind} == {BOOLEAN}:
            return self._both(node)
        for value in node.values[1:]:
            held = first if first.text.isidentifier() else self.held_value(node, first)
            with self.scope.unordered():
                other = self.number(value)
            yes, no = (other, held) if isinstance(node.op, ast.And) else (held, other)
            first = self._chosen(operators.truth(self.scope, node, held), yes, no)
        return first

    def held_value(self, node: ast.AST, code: Code) -> Code:
        if not self.scope.ordered and code.writes:
            self.scope.refuse(node, "write the call as a line of its own")
        return self.scope.temporary(code) if self.scope.ordered else code

    def _ifexp(self, node: ast.IfExp) -> Code:
        test = self.truth(node.test)
        with self.scope.unordered():
            yes, no = self.of(node.body), self.of(node.orelse)
        if yes.kind == NOTHING or no.kind == NOTHING:
            self.scope.refuse(node, f"{ast.unparse(node)} is nothing (None) in one case; give it numbers in both")
        try:
            return self._chosen(test, yes, no)
        except Mismatch as error:
            self.scope.refuse(node, f"{ast.unparse(node)} is {error}")

    def _chosen(self, test: Code, yes: Code, no: Code) -> Code:
        kind = joined(yes.kind, no.kind)
        if isinstance(kind, Struct) and any(code.kind != kind and (code.writes or "fault" in code.text) for code in (yes, no)):
            raise Mismatch("a tuple of other types in each case; give them items of the same types")
        texts = [self.scope.as_kind(code, kind) for code in (yes, no)]
        texts = [code.at(OR) if text == code.text else text for code, text in zip((yes, no), texts, strict=True)]
        if kind == INTEGER and all(text.isidentifier() for text in texts):  # C++ warns of constants of two enums
            texts = [f"(int64_t){text}" for text in texts]
        root = yes.root if yes.root == no.root else ""
        text = f"{test.at(OR)} ? {texts[0]} : {texts[1]}"
        return Code(
            text,
            kind,
            union(yes.range, no.range),
            CHOICE,
            whole=integers_of([yes, no]) if kind == REAL else None,
            narrow=kind == INTEGER and yes.is_int and no.is_int,
            root=root,
        ).effects_of(test, yes, no)

    def _compare(self, node: ast.Compare) -> Code:
        return compare(self, node)

    def _tuple(self, node: ast.Tuple) -> Code:
        codes = self.scope.in_order(node, self.in_turn(node.elts))
        return self.tuple_of(node, codes)

    def tuple_of(self, node: ast.AST, codes: list[Code]) -> Code:
        """A tuple of values: a struct, or a table if all are constants."""
        if not codes:
            self.scope.refuse(node, "an empty tuple holds nothing that a kernel can use")
        for code in codes:
            if code.kind in (NOTHING, RECORD) or isinstance(code.kind, Array | Callee):
                self.scope.refuse(node, f"a tuple of {code.kind} does not compile; a kernel's tuples hold numbers")
        kind = struct(tuple(EITHER if code.whole is not None else code.kind for code in codes))
        self.scope.unit.use(kind)
        text = f"make_{kind.c.strip()}({', '.join(code.text for code in codes)})"
        return Code(text, kind).effects_of(*codes)

    def _lambda(self, node: ast.Lambda) -> Code:
        return self.inner(node)

    def inner(self, node: ast.Lambda | ast.FunctionDef) -> Code:
        """A function that is defined inside: it captures what it uses of the one around it."""
        scope = self.scope
        for default in node.args.defaults:
            if _number_written(default) is None:
                scope.refuse(default, f"the default {ast.unparse(default)} of an inner function must be a number, written out")
        inside = own_names(node)
        used = [n.id for n in walked(node) if isinstance(n, ast.Name) and n.id in scope.own and n.id not in inside]
        captured, texts = [], []
        for name in dict.fromkeys(used):
            known = scope.function.variables.get(name)
            if known is None or known.kind is None:
                scope.refuse(node, f"{name} has no value yet where the inner function is defined; define it afterwards")
            if isinstance(known.kind, Callee) and known.kind.captured:
                scope.refuse(node, f"{name} is itself a function that uses variables around it; pass it as an argument")
            captured.append((name, known.kind))
            texts.append(scope.local(name))
        kind = Callee("", None, node, scope.home, tuple(captured))
        return Code("", kind, captured=tuple(texts))

    def _call(self, node: ast.Call) -> Code:
        return self.calls(self, node)

    def _starred(self, node: ast.Starred) -> Code:
        self.scope.refuse(node, "* stands in calls of a kernel's functions alone")


def _number_written(node: ast.expr) -> float | None:
    """A number that is written out."""
    try:
        value = ast.literal_eval(node)
    except ValueError:
        return None
    return value if isinstance(value, int | float) else None


def _fixed_index(node: ast.expr) -> int | None:
    """The number of an index that is written out."""
    value = _number_written(node)
    return value if isinstance(value, int) and not isinstance(value, bool) else None
