"""Operators: Python's arithmetic in C, with tests where the bounds of the operands do not exclude a fault."""

from __future__ import annotations

import ast

from shaper_fmu.export.c import ranges as r
from shaper_fmu.export.c.code import AND, BITS_AND, BITS_OR, BITS_XOR, EQUALITY, OR, PRODUCT, RELATION, SHIFT, SUM, UNARY, Code
from shaper_fmu.export.c.kinds import BOOLEAN, INTEGER, NUMBERS, REAL
from shaper_fmu.export.c.scope import FunctionScope

_SYMBOLS: dict[type[ast.AST], tuple[str, int]] = {
    ast.Add: ("+", SUM), ast.Sub: ("-", SUM), ast.Mult: ("*", PRODUCT),
    ast.BitAnd: ("&", BITS_AND), ast.BitOr: ("|", BITS_OR), ast.BitXor: ("^", BITS_XOR),
    ast.Lt: ("<", RELATION), ast.LtE: ("<=", RELATION), ast.Gt: (">", RELATION), ast.GtE: (">=", RELATION),
    ast.Eq: ("==", EQUALITY), ast.NotEq: ("!=", EQUALITY),
}  # fmt: skip
LOOSE = 99
"""The level of an argument of a function, which needs no parentheses."""
_RANGES = {ast.Add: r.added, ast.Sub: r.subtracted, ast.Mult: r.multiplied}
_CHECKED = {ast.Add: "checked_sum", ast.Sub: "checked_difference", ast.Mult: "checked_product"}


def numbers(scope: FunctionScope, node: ast.AST, *codes: Code) -> None:
    """Refuse operands that are no numbers."""
    for code in codes:
        if code.kind not in NUMBERS:
            scope.refuse(
                node, f"this computes with {code.kind}; a kernel computes with single numbers, arrays element by element in a loop"
            )


def binary(scope: FunctionScope, node: ast.AST, op: ast.operator, a: Code, b: Code) -> Code:
    """a `op` b of numbers."""
    numbers(scope, node, a, b)
    a, b = scope.in_order(node, [a, b])
    real = REAL in (a.kind, b.kind)
    if isinstance(op, ast.Add | ast.Sub | ast.Mult):
        found = _arithmetic(scope, node, op, a, b, real)
    elif isinstance(op, ast.Div):
        found = _division(scope, node, a, b)
    elif isinstance(op, ast.FloorDiv | ast.Mod):
        found = _floored(scope, node, op, a, b, real)
    elif isinstance(op, ast.Pow):
        found = _power(scope, node, a, b, real)
    elif isinstance(op, ast.MatMult) or real:
        scope.refuse(node, f"{ast.unparse(node)} is not for real numbers")
    elif isinstance(op, ast.LShift | ast.RShift):
        found = _shift(scope, node, op, a, b)
    else:
        found = _bits(op, a, b)
    return found.effects_of(a, b)


def _arithmetic(scope: FunctionScope, node: ast.AST, op: ast.operator, a: Code, b: Code, real: bool) -> Code:
    symbol, level = _SYMBOLS[type(op)]
    found = _RANGES[type(op)](a.range, b.range)
    if real:
        text = f"{_real_operand(scope, node, a, level)} {symbol} {_real_operand(scope, node, b, level - 1)}"
        return Code(text, REAL, found, level, whole=_whole_result(scope, node, op, a, b))
    if not r.fits(found):
        text = f"{_CHECKED[type(op)]}({scope.fault()}, {a.text}, {b.text}, {scope.where(node)})"
        return Code(text, INTEGER, r.clipped(found))
    if found.constant is not None and a.is_literal and b.is_literal:
        return scope.unit.constant(int(found.low)) or a
    narrow = r.fits(found, 32)  # then C's int is wide enough
    left, right = (code.at(at) if narrow or code.is_literal else code.wide(at) for code, at in ((a, level), (b, level - 1)))
    return Code(f"{left} {symbol} {right}", INTEGER, found, level, narrow=a.is_int and b.is_int and narrow)


def _whole_result(scope: FunctionScope, node: ast.AST, op: ast.operator, a: Code, b: Code) -> r.Range | None:
    """Between which bounds a real result may be an integer in Python. Integers must be exact, and their zero has no sign."""
    if a.integers is None or b.integers is None:
        return None
    found = _RANGES[type(op)](a.integers, b.integers)
    signed = (a.integers.has_zero and b.integers.low < 0) or (b.integers.has_zero and a.integers.low < 0)
    if not found.within(-r.EXACT, r.EXACT) or (isinstance(op, ast.Mult) and signed):
        _only_real(scope, node, a, b)
    return found


def as_real(scope: FunctionScope, node: ast.AST, code: Code, level: int) -> str:
    """The text of a number as a real one, exactly."""
    if code.kind == REAL:
        return code.at(level)
    if code.is_literal:
        text = f"{code.text}.0"
        return f"({text})" if code.level > level else text
    if code.range.within(-r.EXACT, r.EXACT):
        return f"(double){code.at(UNARY)}"
    return f"exact_real({scope.fault()}, {code.text}, {scope.where(node)})"


def _real_operand(scope: FunctionScope, node: ast.AST, code: Code, level: int) -> str:
    """An operand of a real operation; C itself converts integers that real numbers hold exactly."""
    if code.kind == REAL or code.range.within(-r.EXACT, r.EXACT):
        return code.at(level)
    return f"(double){code.at(UNARY)}"  # rounded as Python rounds it


def _only_real(scope: FunctionScope, node: ast.AST, *codes: Code) -> None:
    """Refuse what has another meaning in Python for integers, where real numbers may be such."""
    if all(code.maybe_integer for code in codes):
        shown = ast.unparse(node)
        scope.refuse(
            node, f"{shown} computes with numbers that are integers on one path and real on another; write float(...), or 0.0 for 0"
        )


def _division(scope: FunctionScope, node: ast.AST, a: Code, b: Code) -> Code:
    found = r.divided(a.range, b.range)
    left = as_real(scope, node, a, PRODUCT) if b.kind != REAL or not a.is_integer else a.at(PRODUCT)
    if not b.range.has_zero:
        right = as_real(scope, node, b, PRODUCT - 1)
        return Code(f"{left} / {right}", REAL, found, PRODUCT)
    left, right = as_real(scope, node, a, LOOSE), as_real(scope, node, b, LOOSE)
    return Code(f"divided({scope.fault()}, {left}, {right}, {scope.where(node)})", REAL, found)


def _floored(scope: FunctionScope, node: ast.AST, op: ast.operator, a: Code, b: Code, real: bool) -> Code:
    remains = isinstance(op, ast.Mod)
    if real:
        _only_real(scope, node, a, b)
        left, right = as_real(scope, node, a, LOOSE), as_real(scope, node, b, LOOSE)
        found = r.remainder(a.range, b.range, False) if remains else r.ANY
        if not b.range.has_zero:
            return Code(f"{'real_remainder' if remains else 'real_floor_quotient'}({left}, {right})", REAL, found)
        name = "checked_real_remainder" if remains else "checked_real_quotient"
        return Code(f"{name}({scope.fault()}, {left}, {right}, {scope.where(node)})", REAL, found)
    found = r.remainder(a.range, b.range, True) if remains else r.quotient(a.range, b.range)
    if a.range.low >= 0 and b.range.low > 0:
        return Code(
            f"{a.at(PRODUCT)} {'%' if remains else '/'} {b.at(PRODUCT - 1)}", INTEGER, found, PRODUCT, narrow=a.is_int and b.is_int
        )
    safe = not b.range.has_zero and not (a.range.low == r.WHOLE.low and b.range.low <= -1 <= b.range.high)
    name = "remainder" if remains else "quotient"
    if safe:
        return Code(f"floor_{name}({a.text}, {b.text})", INTEGER, found)
    return Code(f"checked_{name}({scope.fault()}, {a.text}, {b.text}, {scope.where(node)})", INTEGER, r.clipped(found))


def _power(scope: FunctionScope, node: ast.AST, a: Code, b: Code, real: bool) -> Code:
    if not real and b.range.low >= 0:
        found = r.WHOLE
        if a.range.within(-1e3, 1e3) and b.range.high <= 1000:
            far = int(max(abs(a.range.low), abs(a.range.high))) ** int(b.range.high)
            found = r.clipped(r.Range(0 if a.range.low >= 0 else -max(far, 1), max(far, 1)))
        return Code(f"checked_power({scope.fault()}, {a.text}, {b.text}, {scope.where(node)})", INTEGER, found)
    if not real and b.range.high >= 0:
        words = "an integer to the power of an integer that may be negative is sometimes a real number; write float(...) ** ..."
        scope.refuse(node, f"{ast.unparse(node)}: {words}, or bound the exponent (min=0)")
    if real:
        _only_real(scope, node, a, b)
    left, right = as_real(scope, node, a, LOOSE), as_real(scope, node, b, LOOSE)
    found = r.Range(0.0, r.ANY.high) if a.range.low >= 0 else r.ANY
    return Code(f"real_power({scope.fault()}, {left}, {right}, {scope.where(node)})", REAL, found)


def _shift(scope: FunctionScope, node: ast.AST, op: ast.operator, a: Code, b: Code) -> Code:
    left = isinstance(op, ast.LShift)
    found = r.clipped(r.shifted(a.range, b.range)) if left else r.union(a.range, r.Range(-1, 0))
    return Code(f"shift_{'left' if left else 'right'}({scope.fault()}, {a.text}, {b.text}, {scope.where(node)})", INTEGER, found)


def _bits(op: ast.operator, a: Code, b: Code) -> Code:
    symbol, level = _SYMBOLS[type(op)]
    both = a.kind == b.kind == BOOLEAN
    found = r.TRUTH if both else r.WHOLE
    if not both and a.range.low >= 0 and b.range.low >= 0:
        bits = max(int(a.range.high).bit_length(), int(b.range.high).bit_length())
        high = min(a.range.high, b.range.high) if symbol == "&" else 2**bits - 1
        found = r.Range(0, high)
    kind = BOOLEAN if both else INTEGER
    return Code(f"{a.at(level)} {symbol} {b.at(level)}", kind, found, level, narrow=a.is_int and b.is_int)


def unary(scope: FunctionScope, node: ast.UnaryOp, a: Code) -> Code:
    """`not`, -, + and ~ of a number."""
    if isinstance(node.op, ast.Not):
        return negation(scope, node, a)
    numbers(scope, node, a)
    if isinstance(node.op, ast.UAdd):
        return as_integer(a) if a.kind == BOOLEAN else a
    if isinstance(node.op, ast.Invert):
        if a.kind == REAL:
            scope.refuse(node, "~ is not for real numbers")
        return Code(f"~{a.wide(UNARY)}", INTEGER, r.Range(-a.range.high - 1, -a.range.low - 1), UNARY).effects_of(a)
    found = r.negated(a.range)
    if a.whole is not None and a.whole.has_zero:
        _only_real(scope, node, a)
    if a.kind != REAL and not r.fits(found):
        return Code(f"checked_negative({scope.fault()}, {a.text}, {scope.where(node)})", INTEGER, r.clipped(found)).effects_of(a)
    inner = a.at(UNARY) if a.kind == REAL or r.fits(found, 32) else a.wide(UNARY)
    text = f"-({inner})" if inner.startswith("-") else f"-{inner}"
    whole = r.negated(a.whole) if a.whole is not None else None
    narrow = a.kind != REAL and a.is_int and r.fits(found, 32)
    return Code(text, REAL if a.kind == REAL else INTEGER, found, UNARY, whole=whole, narrow=narrow).effects_of(a)


def as_integer(a: Code) -> Code:
    """A Boolean as a number."""
    return a._replace(kind=INTEGER, narrow=a.is_int)


def truth(scope: FunctionScope, node: ast.AST, a: Code) -> Code:
    """Whether a value counts as true."""
    numbers(scope, node, a)
    if a.kind == BOOLEAN:
        return a
    return Code(f"{a.at(EQUALITY)} != {'0.0' if a.kind == REAL else '0'}", BOOLEAN, r.TRUTH, EQUALITY).effects_of(a)


def negation(scope: FunctionScope, node: ast.AST, a: Code) -> Code:
    numbers(scope, node, a)
    if a.kind == BOOLEAN:
        return Code(f"!{a.at(UNARY)}", BOOLEAN, r.TRUTH, UNARY).effects_of(a)
    return Code(f"{a.at(EQUALITY)} == {'0.0' if a.kind == REAL else '0'}", BOOLEAN, r.TRUTH, EQUALITY).effects_of(a)


def comparison(scope: FunctionScope, node: ast.AST, op: ast.cmpop, a: Code, b: Code) -> Code:
    """a `op` b; integers are compared with real numbers exactly."""
    numbers(scope, node, a, b)
    symbol, level = _SYMBOLS[type(op)]
    tight = SHIFT  # comparisons of comparisons get parentheses
    if REAL in (a.kind, b.kind) and a.kind != b.kind:
        whole = a if a.kind != REAL else b
        if not whole.range.within(-r.EXACT, r.EXACT):
            other, zero = (b if whole is a else a), Code("0.0", REAL)
            compared = Code(f"compared({whole.text}, {other.text})", REAL).effects_of(a, b)
            a, b = (compared, zero) if whole is a else (zero, compared)
    return Code(f"{a.at(tight)} {symbol} {b.at(tight)}", BOOLEAN, r.TRUTH, level).effects_of(a, b)


def both(parts: list[Code], is_or: bool) -> Code:
    """Parts joined by `and` or `or`, all of them truth values."""
    level = OR if is_or else AND
    text = (" || " if is_or else " && ").join(part.at(level) for part in parts)
    return Code(text, BOOLEAN, r.TRUTH, level).effects_of(*parts)
