"""Comparisons, in chains as in Python, and `in`."""

from __future__ import annotations

import ast
from functools import partial
from typing import TYPE_CHECKING

from shaper_fmu.export.c import operators
from shaper_fmu.export.c.code import Code
from shaper_fmu.export.c.kinds import REAL

if TYPE_CHECKING:
    from shaper_fmu.export.c.expressions import Expressions


def compare(e: Expressions, node: ast.Compare) -> Code:
    """The operands from left to right, each once, and none behind a comparison that does not hold."""
    first = [node.left, *([] if isinstance(node.ops[0], ast.In | ast.NotIn) else node.comparators[:1])]
    left, *second = e.in_turn(first)
    tests = []
    for i, (op, right) in enumerate(zip(node.ops, node.comparators, strict=True)):
        if isinstance(op, ast.Is | ast.IsNot):
            e.scope.refuse(node, "`is` compares Python's objects, numbers are compared with ==")
        if isinstance(op, ast.In | ast.NotIn):
            tests.append(_among(e, node, left, right, isinstance(op, ast.NotIn)))
            continue
        if i == 0:
            left, other = e.scope.in_order(node, [left, *second])
        else:
            with e.scope.unordered():
                other = e.of(right)
        if i > 0:  # it is evaluated only where the comparisons before hold
            twice = i < len(node.ops) - 1 and "fault" in other.text
            if twice or (other.writes and (left.reads or left.writes or i < len(node.ops) - 1)):
                e.scope.refuse(node, f"write {ast.unparse(right)} as a line of its own")
        elif i < len(node.ops) - 1 and not other.text.isidentifier() and other.range.constant is None:
            other = e.held_value(node, other)
        tests.append(operators.comparison(e.scope, node, op, left, other))
        left = other
    return tests[0] if len(tests) == 1 else operators.both(tests, False)


def _among(e: Expressions, node: ast.AST, value: Code, among: ast.expr, negative: bool) -> Code:
    """Whether a value is one of those of a tuple or a list."""
    if not value.text.isidentifier():
        value = e.held_value(node, value)
    if isinstance(among, ast.Tuple | ast.List):
        steps = [lambda: value, *[partial(e.number, element) for element in among.elts]]
        value, *codes = e.scope.one_by_one(steps)  # all of them, and then they are compared
        value, *codes = e.scope.in_order(node, [value, *codes])
        if any(code.writes or "fault" in code.text for code in codes):
            if not e.scope.ordered:
                e.scope.refuse(node, f"write the values of {ast.unparse(among)} as lines of their own")
            codes = [e.scope.temporary(code) if "fault" in code.text else code for code in codes]
    else:
        whole = e.of(among)
        if not isinstance(whole.value, tuple):
            e.scope.refuse(node, f"`in` looks into tuples of numbers; {ast.unparse(among)} is {whole.kind}")
        codes = [code for code in map(e.scope.unit.constant, whole.value) if code is not None]
    if not codes:
        e.scope.refuse(node, f"{ast.unparse(among)} has no elements")
    if value.kind == REAL and any(code.kind == REAL and _may_be_nan(code) for code in codes):
        codes = [_number_or_fault(e, node, value, code) for code in codes]
    operator = ast.NotEq() if negative else ast.Eq()
    tests = [operators.comparison(e.scope, node, operator, value, code) for code in codes]
    return tests[0] if len(tests) == 1 else operators.both(tests, not negative)


def _number_or_fault(e: Expressions, node: ast.AST, value: Code, code: Code) -> Code:
    """An element that is compared with a value. In Python NaN is among values that hold the same object, which C has not."""
    if code.kind != REAL or not _may_be_nan(code):
        return code
    text = f"no_nan({e.scope.fault()}, {value.text}, {code.text}, {e.scope.where(node)})"
    return Code(text, REAL, code.range).effects_of(code)


def _may_be_nan(code: Code) -> bool:
    return code.range.constant is None
