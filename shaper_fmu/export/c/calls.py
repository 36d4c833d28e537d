"""Calls: Python's built-in functions, `math`, and functions of the same kind as kernels."""

from __future__ import annotations

import ast
import math
from collections.abc import Callable, Iterator
from types import FunctionType
from typing import Any

from shaper_fmu.errors import nearest
from shaper_fmu.export.c import operators
from shaper_fmu.export.c import ranges as r
from shaper_fmu.export.c.code import PRODUCT, UNARY, Code, integers_of
from shaper_fmu.export.c.expressions import Expressions
from shaper_fmu.export.c.kinds import BOOLEAN, INTEGER, NOTHING, NUMBERS, REAL, Array, Callee, Struct
from shaper_fmu.export.c.operators import LOOSE, as_real
from shaper_fmu.export.c.source import UNKNOWN

_FINITE = {"fabs", "atan", "tanh", "asinh", "erf", "erfc"}
"""Functions of the mathematics library that have an answer to every number."""
_CHECKED = {
    "sqrt", "cbrt", "exp", "exp2", "expm1", "log", "log2", "log10", "log1p", "sin", "cos", "tan", "asin", "acos", "sinh", "cosh",
    "acosh", "atanh", "lgamma", "gamma",
}  # fmt: skip
_OF_TWO = {"atan2": "atan2", "copysign": "copysign", "fmod": "checked_fmod", "pow": "checked_pow", "hypot": "hypot"}
_CLASSIFIED = {"isnan", "isinf", "isfinite"}
_INTEGERS = {"floor": "floor", "ceil": "ceil", "trunc": "trunc"}
_RANGES = {
    "sqrt": r.Range(0.0, math.inf), "exp": r.Range(0.0, math.inf), "exp2": r.Range(0.0, math.inf), "cosh": r.Range(1.0, math.inf),
    "sin": r.Range(-1.0, 1.0), "cos": r.Range(-1.0, 1.0), "tanh": r.Range(-1.0, 1.0), "acos": r.Range(0.0, math.pi),
    "asin": r.Range(-2.0, 2.0), "atan": r.Range(-2.0, 2.0), "erf": r.Range(-1.0, 1.0), "erfc": r.Range(0.0, 2.0),
    "fabs": r.Range(0.0, math.inf),
}  # fmt: skip
_SAFE = {
    "sqrt": r.Range(0.0, math.inf), "acos": r.Range(-1.0, 1.0), "asin": r.Range(-1.0, 1.0), "exp": r.Range(-math.inf, 709.0),
    "sin": r.Range(-1.7e308, 1.7e308), "cos": r.Range(-1.7e308, 1.7e308), "cbrt": r.ANY,
}  # fmt: skip
"""Arguments that need no test."""

Translated = Callable[[Callee, list[Code], ast.AST], Code]


class Calls:
    """Translates the calls of one function; `function` gives the call of a function of a kernel's kind."""

    def __init__(self, function: Translated):
        self.function: Translated = function

    def __call__(self, e: Expressions, node: ast.Call) -> Code:
        scope = e.scope
        target = scope.names_value(node.func)
        builtin = {abs: self._abs, min: self._extreme, max: self._extreme, float: self._float, int: self._int, bool: self._bool,
                   len: self._len, round: self._round, divmod: self._divmod, pow: self._pow}  # fmt: skip
        if isinstance(node.func, ast.Attribute) and scope.names_value(node.func.value) is math:
            return self._math(e, node, node.func.attr)
        if getattr(target, "__module__", None) == "math" and getattr(math, getattr(target, "__name__", ""), None) is target:
            return self._math(e, node, target.__name__)
        if isinstance(node.func, ast.Lambda) or target is UNKNOWN or isinstance(target, FunctionType):
            return self._plain(e, node)
        if isinstance(target, type | type(abs)) and target in builtin:
            if node.keywords or any(isinstance(a, ast.Starred) for a in node.args):
                scope.refuse(node, f"{ast.unparse(node)}: write the arguments out, without names")
            return builtin[target](e, node, e.in_turn(node.args))
        if target is sum:
            scope.refuse(node, "sum does not compile: from Python 3.12 on it compensates for rounding; add in a loop")
        scope.refuse(node, f"{ast.unparse(node.func)!r} does not compile; a kernel may call functions of math, and plain functions")

    # functions of the same kind

    def _plain(self, e: Expressions, node: ast.Call) -> Code:
        scope = e.scope
        target = e.of(node.func)
        if not isinstance(target.kind, Callee):
            scope.refuse(node, f"{ast.unparse(node.func)} is {target.kind}, and cannot be called")
        arguments = self._bound(e, node, target.kind)
        captured = [
            self._captured(e, name, kind, text) for (name, kind), text in zip(target.kind.captured, target.captured, strict=True)
        ]
        arguments = scope.in_order(node, arguments)
        return self.function(target.kind, [*captured, *arguments], node)

    def _captured(self, e: Expressions, name: str, kind: Any, text: str) -> Code:
        known = e.scope.function.variables.get(name) if text == e.scope.local(name) else None
        found = known.range if known is not None and known.range is not None else r.widest(kind in (INTEGER, BOOLEAN))
        root = text if not isinstance(kind, type(NOTHING)) or kind not in NUMBERS else ""
        return Code(text, kind, found, whole=known.whole if known is not None else None, root=root)

    def _bound(self, e: Expressions, node: ast.Call, callee: Callee) -> list[Code]:
        """The arguments in the order of the function's."""
        scope = e.scope
        names, defaults = parameters_of(callee)
        one_by_one = [argument for argument in node.args if not isinstance(argument, ast.Starred)]
        values = iter(e.in_turn([*one_by_one, *[keyword.value for keyword in node.keywords]]))
        given = list(self._given(e, node, values))
        keywords = list(values)
        ordered = scope.in_order(node, [*given, *keywords])  # as they are written
        given, keywords = ordered[: len(given)], ordered[len(given) :]
        if len(given) > len(names):
            scope.refuse(node, f"{callee.name} takes {len(names)} arguments, and is given {len(given)} (too many)")
        found = dict(zip(names, given, strict=False))
        alone = _positions_alone(callee)
        for keyword, code in zip(node.keywords, keywords, strict=True):
            if keyword.arg is None or keyword.arg not in names[alone:] or keyword.arg in found:
                scope.refuse(node, f"{callee.name} cannot be given {keyword.arg!r} here.{nearest(str(keyword.arg), names)}")
            found[keyword.arg] = code
        for name in names:
            if name not in found and name in defaults:
                default = scope.unit.constant(defaults[name])
                if default is None:
                    scope.refuse(node, f"the default of {name} in {callee.name} is no number")
                found[name] = default
        missing = [name for name in names if name not in found]
        if missing:
            scope.refuse(node, f"{callee.name} is not given {', '.join(missing)}")
        return [found[name] for name in names]

    def _given(self, e: Expressions, node: ast.Call, values: Iterator[Code]) -> Iterator[Code]:
        for argument in node.args:
            if not isinstance(argument, ast.Starred):
                yield next(values)
                continue
            packed = e.of(argument.value)
            if not isinstance(packed.kind, Struct) and not isinstance(packed.value, tuple):
                e.scope.refuse(node, f"*{ast.unparse(argument.value)} is no tuple")
            if packed.value is None and not packed.text.isidentifier():
                packed = e.held_value(node, packed)
            size = len(packed.kind.items) if isinstance(packed.kind, Struct) else len(tuple(packed.value or ()))
            yield from (e.item(packed, i) for i in range(size))

    # built-in functions

    def _count(self, e: Expressions, node: ast.Call, codes: list[Code], least: int, most: int) -> None:
        if not least <= len(codes) <= most:
            e.scope.refuse(node, f"{ast.unparse(node)}: this takes {least if least == most else f'{least} to {most}'} arguments")

    def _abs(self, e: Expressions, node: ast.Call, codes: list[Code]) -> Code:
        self._count(e, node, codes, 1, 1)
        operators.numbers(e.scope, node, *codes)
        found = r.magnitude(codes[0].range)
        if codes[0].kind == REAL:
            whole = codes[0].whole and r.magnitude(codes[0].whole)
            return Code(f"fabs({codes[0].text})", REAL, found, whole=whole).effects_of(codes[0])
        if r.fits(found):
            return Code(f"magnitude({codes[0].text})", INTEGER, found).effects_of(codes[0])
        return Code(
            f"checked_magnitude({e.scope.fault()}, {codes[0].text}, {e.scope.where(node)})", INTEGER, r.clipped(found)
        ).effects_of(codes[0])

    def _extreme(self, e: Expressions, node: ast.Call, codes: list[Code]) -> Code:
        """min and max of numbers, or of a tuple."""
        scope = e.scope
        if len(codes) == 1 and isinstance(codes[0].value, tuple):
            codes = [c for c in map(scope.unit.constant, codes[0].value) if c is not None]
        elif len(codes) == 1 and isinstance(codes[0].kind, Struct):
            whole = codes[0] if codes[0].text.isidentifier() else e.held_value(node, codes[0])
            codes = [e.item(whole, i) for i in range(len(codes[0].kind.items))]
        operators.numbers(scope, node, *codes)
        if not codes or (len(codes) == 1):
            scope.refuse(node, f"{ast.unparse(node)}: give two or more numbers")
        codes = scope.in_order(node, codes)
        real, least = any(c.kind == REAL for c in codes), scope.names_value(node.func) is min
        name = ("smaller" if least else "larger") + ("" if real else "_integer")
        side = min if least else max
        text, found = as_real(scope, node, codes[0], LOOSE) if real else codes[0].text, codes[0].range
        for code in codes[1:]:
            text = f"{name}({text}, {as_real(scope, node, code, LOOSE) if real else code.text})"
            beyond = r.Range(side(found.low, code.range.low), side(found.high, code.range.high))
            maybe_nan = code.kind == REAL and code.range.constant is None  # then the one before stays
            found = r.union(found, beyond) if maybe_nan else beyond
        return Code(text, REAL if real else INTEGER, found, whole=integers_of(codes) if real else None).effects_of(*codes)

    def _float(self, e: Expressions, node: ast.Call, codes: list[Code]) -> Code:
        self._count(e, node, codes, 1, 1)
        operators.numbers(e.scope, node, *codes)
        code = codes[0]
        if code.kind == REAL:
            return code._replace(whole=None)
        low, high = float(code.range.low), float(code.range.high)
        return Code(f"(double){code.at(UNARY)}", REAL, r.Range(low, high), UNARY).effects_of(code)

    def _int(self, e: Expressions, node: ast.Call, codes: list[Code]) -> Code:
        self._count(e, node, codes, 1, 1)
        operators.numbers(e.scope, node, *codes)
        if codes[0].kind != REAL:
            return operators.as_integer(codes[0])
        return self._whole(e, node, codes[0], "trunc")

    def _whole(self, e: Expressions, node: ast.Call, code: Code, how: str) -> Code:
        """A real number to an integer."""
        low, high = code.range
        found = r.WHOLE
        if math.isfinite(low) and math.isfinite(high) and max(abs(low), abs(high)) < 2.0**62:
            found = r.union(r.Range(0, 0), r.Range(math.floor(low), math.ceil(high)))  # 0 after a fault: the number may be NaN
        text = f'integer({e.scope.fault()}, {how}({code.text}), "{"int" if how == "trunc" else how}", {e.scope.where(node)})'
        return Code(text, INTEGER, found).effects_of(code)

    def _bool(self, e: Expressions, node: ast.Call, codes: list[Code]) -> Code:
        self._count(e, node, codes, 1, 1)
        return operators.truth(e.scope, node, codes[0])

    def _len(self, e: Expressions, node: ast.Call, codes: list[Code]) -> Code:
        self._count(e, node, codes, 1, 1)
        kind = codes[0].kind
        size = len(codes[0].value) if isinstance(codes[0].value, tuple) else kind.size if isinstance(kind, Array) else None
        size = len(kind.items) if isinstance(kind, Struct) and size is None else size
        if size is None:
            e.scope.refuse(node, f"{ast.unparse(node)}: {kind} has no length")
        if codes[0].writes or "fault" in codes[0].text:  # its items are computed, though nobody asks for them
            e.held_value(node, codes[0])
        return Code(str(size), INTEGER, r.Range(size, size))

    def _round(self, e: Expressions, node: ast.Call, codes: list[Code]) -> Code:
        if len(codes) > 1:
            e.scope.refuse(
                node, f"{ast.unparse(node)} rounds in decimal numbers, which does not compile; write round(x * 100.0) / 100.0"
            )
        operators.numbers(e.scope, node, *codes)
        if codes[0].kind != REAL:
            return operators.as_integer(codes[0])
        return self._whole(e, node, codes[0], "rint")

    def _divmod(self, e: Expressions, node: ast.Call, codes: list[Code]) -> Code:
        self._count(e, node, codes, 2, 2)
        a, b = (c if c.text.isidentifier() or c.range.constant is not None else e.held_value(node, c) for c in codes)
        parts = [operators.binary(e.scope, node, op, a, b) for op in (ast.FloorDiv(), ast.Mod())]
        return e.tuple_of(node, parts)

    def _pow(self, e: Expressions, node: ast.Call, codes: list[Code]) -> Code:
        self._count(e, node, codes, 2, 2)
        return operators.binary(e.scope, node, ast.Pow(), codes[0], codes[1])

    # math

    def _math(self, e: Expressions, node: ast.Call, name: str) -> Code:
        scope = e.scope
        codes = e.in_turn(node.args)
        operators.numbers(scope, node, *codes)
        codes = scope.in_order(node, codes)
        if node.keywords:
            scope.refuse(node, f"{ast.unparse(node)}: write the arguments without names")
        if name in ("floor", "ceil", "trunc") and len(codes) == 1:
            return operators.as_integer(codes[0]) if codes[0].kind != REAL else self._whole(e, node, codes[0], name)
        texts = [as_real(scope, node, code, LOOSE) for code in codes]
        found = self._of_one(e, node, name, codes, texts) if len(codes) == 1 else self._of_two(e, node, name, codes, texts)
        return found.effects_of(*codes)

    def _of_one(self, e: Expressions, node: ast.Call, name: str, codes: list[Code], texts: list[str]) -> Code:
        range_ = _RANGES.get(name, r.ANY)
        if name == "sqrt" and codes[0].range.low > 0:
            range_ = r.Range(math.sqrt(codes[0].range.low), math.inf)
        if name in _CLASSIFIED:
            return Code(f"({name}({texts[0]}) != 0)", BOOLEAN, r.TRUTH)
        if name in ("degrees", "radians"):
            factor = 180.0 / math.pi if name == "degrees" else math.pi / 180.0
            return Code(f"{codes[0].at(PRODUCT)} * {factor!r}", REAL, r.ANY, PRODUCT)
        safe = _SAFE.get(name)
        if name in _FINITE or (safe is not None and codes[0].range.within(*safe)):
            return Code(f"{name}({texts[0]})", REAL, range_)
        if name in _CHECKED:
            c = "tgamma" if name == "gamma" else name
            return Code(f"checked_{c}({e.scope.fault()}, {texts[0]}, {e.scope.where(node)})", REAL, range_)
        e.scope.refuse(node, f"math.{name} does not compile, or not with one argument.{nearest(name, [*_CHECKED, *_FINITE])}")

    def _of_two(self, e: Expressions, node: ast.Call, name: str, codes: list[Code], texts: list[str]) -> Code:
        if len(codes) == 2 and name == "log":
            parts = [self._of_one(e, node, "log", [code], [text]) for code, text in zip(codes, texts, strict=True)]
            return operators.binary(e.scope, node, ast.Div(), *parts)
        if len(codes) != 2 or name not in _OF_TWO:
            e.scope.refuse(node, f"math.{name} does not compile with {len(codes)} arguments")
        c = _OF_TWO[name]
        if c == name:
            found = r.Range(-4.0, 4.0) if name == "atan2" else r.ANY
            return Code(f"{c}({', '.join(texts)})", REAL, found)
        return Code(f"{c}({e.scope.fault()}, {', '.join(texts)}, {e.scope.where(node)})", REAL)


def _positions_alone(callee: Callee) -> int:
    """How many of a function's arguments cannot be given by name."""
    if callee.function is not None:
        return callee.function.__code__.co_posonlyargcount
    return len(callee.node.args.posonlyargs) if callee.node else 0


def parameters_of(callee: Callee) -> tuple[list[str], dict[str, Any]]:
    """Names of a function's arguments, and the defaults that are constants."""
    if callee.function is not None:
        code = callee.function.__code__
        names = list(code.co_varnames[: code.co_argcount])
        defaults = callee.function.__defaults__ or ()
        return names, dict(zip(names[len(names) - len(defaults) :], defaults, strict=True))
    assert callee.node is not None
    names = [a.arg for a in [*callee.node.args.posonlyargs, *callee.node.args.args]]
    values = [ast.literal_eval(default) for default in callee.node.args.defaults]
    return names, dict(zip(names[len(names) - len(values) :], values, strict=True))
