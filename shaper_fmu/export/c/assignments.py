"""Assignments: to names, variables of the record, elements, and several of them at once."""

from __future__ import annotations

import ast

from shaper_fmu.export.c import operators
from shaper_fmu.export.c import ranges as r
from shaper_fmu.export.c.blocks import Blocks
from shaper_fmu.export.c.code import Code
from shaper_fmu.export.c.kinds import BOOLEAN, NUMBERS, REAL, Array, Struct
from shaper_fmu.export.c.source import walked
from shaper_fmu.syntax import parse_expression

_ASSIGNING = {ast.Add: "+=", ast.Sub: "-=", ast.Mult: "*=", ast.Div: "/="}


class Assignments(Blocks):
    """Translates what gives values to names and variables."""

    def _assign(self, s: ast.Assign) -> None:
        if len(s.targets) == 1 and isinstance(s.targets[0], ast.Tuple) and isinstance(s.value, ast.Tuple):
            self._several(s, s.targets[0].elts, s.value.elts)
            return
        code = self.e.of(s.value)
        if len(s.targets) > 1 and not code.text.isidentifier():
            code = self.scope.temporary(code)
        for target in s.targets:
            self.store(target, code)

    def _annassign(self, s: ast.AnnAssign) -> None:
        if s.value is not None:
            self.store(s.target, self.e.of(s.value))

    def _several(self, s: ast.Assign, targets: list[ast.expr], values: list[ast.expr]) -> None:
        """a, b = x, y: all values before any is stored."""
        if len(targets) != len(values) or any(isinstance(v, ast.Starred) for v in [*targets, *values]):
            self.scope.refuse(s, f"{len(values)} values do not fit to {len(targets)} names")
        codes = self.e.in_turn(values)
        if any(code.range.constant is None for code in codes[1:]) or any(not isinstance(t, ast.Name) for t in targets):
            codes = [
                code if code.kind in NUMBERS and code.range.constant is not None else self.scope.temporary(code) for code in codes
            ]
        for target, code in zip(targets, codes, strict=True):
            self.store(target, code)

    def store(self, target: ast.expr, code: Code) -> None:
        """Put a value into a name, a variable of the record, an element, or several of them."""
        if isinstance(target, ast.Name):
            self.scope.bind(target, target.id, code)
        elif isinstance(target, ast.Tuple | ast.List):
            self._unpack(target, code)
        else:
            if isinstance(target, ast.Subscript) and (code.writes or _calls(target.slice)):  # the value comes before the index
                code = self.scope.temporary(code)
            place = self.place(target)
            self.scope.say(f"{place.text} = {self._fitting(target, place, code)};")

    def place(self, target: ast.expr) -> Code:
        """A variable of the record, or an element of an array, to be written."""
        place = self.e.of(target)
        if isinstance(place.kind, Array):
            self.scope.refuse(target, f"{ast.unparse(target)} is {place.kind}; the types do not fit: set its elements in a loop")
        if not place.root or not isinstance(target, ast.Attribute | ast.Subscript):
            self.scope.refuse(target, f"{ast.unparse(target)} cannot be set")
        self.wrote(target, place)
        return place

    def wrote(self, target: ast.expr, place: Code) -> None:
        unit, function = self.scope.unit, self.scope.function
        unit.mark(function.written, place.root)
        unit.flag(function, "writes")
        owner = target.value if isinstance(target, ast.Subscript) else target
        if isinstance(owner, ast.Attribute):
            unit.mark(unit.stored, owner.attr)

    def _fitting(self, target: ast.expr, place: Code, code: Code) -> str:
        """The text of a value as one that fits to a place in the record."""
        if code.kind not in NUMBERS:
            self.scope.refuse(target, f"{ast.unparse(target)} is set to {code.kind}; the types do not fit")
        if place.kind == REAL:
            if code.integers is not None:
                owner = target.value if isinstance(target, ast.Subscript) else target
                if not isinstance(owner, ast.Attribute):
                    words = f"{ast.unparse(target)} is a real number and is set to an integer; write float(...), or 0.0 for 0"
                    self.scope.refuse(target, words)
                self.scope.unit.becomes_whole(owner.attr, code.integers)
            return self.scope.as_kind(code, REAL, target)
        if place.kind == BOOLEAN and code.kind != BOOLEAN:
            self.scope.refuse(
                target, f"{ast.unparse(target)} is a Boolean and is set to {code.kind}; write bool(...), or a comparison"
            )
        if code.kind == REAL:
            words = (
                f"{ast.unparse(target)} is an integer and is set to a real number; write int(...), round(...) or math.floor(...)"
            )
            self.scope.refuse(target, words)
        if r.fits(code.range, 32):
            return code.text if code.narrow or code.text.lstrip("-").isdigit() or code.kind == BOOLEAN else f"(int32_t){code.at(1)}"
        return f'integer32({self.scope.fault()}, {code.text}, "{_variable(target)}", {self.scope.where(target)})'

    def _unpack(self, target: ast.Tuple | ast.List, code: Code) -> None:
        size = len(code.kind.items) if isinstance(code.kind, Struct) else len(code.value) if isinstance(code.value, tuple) else None
        if size is None or any(isinstance(t, ast.Starred) for t in target.elts):
            self.scope.refuse(target, f"{code.kind} cannot be unpacked into names")
        if size != len(target.elts):
            self.scope.refuse(target, f"{size} values do not fit to {len(target.elts)} names")
        if code.value is None:
            code = self.scope.temporary(code, "both" if size == 2 else "all")
        for i, one in enumerate(target.elts):
            self.store(one, self.e.item(code, i))

    def _augassign(self, s: ast.AugAssign) -> None:
        if isinstance(s.target, ast.Subscript) and (_calls(s.target) or _calls(s.value)):
            self.e.hold_index(s.target)  # it is evaluated once, before the value
        loaded = s.target if isinstance(s.target, ast.Subscript) else _loaded(s.target)
        target, value = self.e.in_turn([loaded, s.value])
        code = operators.binary(self.scope, s, s.op, target, value)
        symbol = _ASSIGNING.get(type(s.op))
        if isinstance(s.target, ast.Name):
            self.scope.bind(s, s.target.id, code)
        elif (
            target.kind == REAL
            and symbol
            and not value.writes
            and "(fault," not in code.text.replace(value.text, "").replace(target.text, "")
        ):
            place = self.place(s.target)
            self.scope.say(f"{place.text} {symbol} {value.text};")
        else:
            self.store(s.target, code)


def _calls(node: ast.expr) -> bool:
    return any(isinstance(n, ast.Call) for n in walked(node))


def _variable(target: ast.expr) -> str:
    owner = target.value if isinstance(target, ast.Subscript) else target
    return owner.attr if isinstance(owner, ast.Attribute) else ast.unparse(owner)


def _loaded(target: ast.expr) -> ast.expr:
    """A target as an expression that is read."""
    copy = parse_expression(ast.unparse(target))
    for node in walked(copy):
        ast.copy_location(node, target)
    return copy
