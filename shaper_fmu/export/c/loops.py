"""Loops: `while`, and `for` over ranges, arrays and tuples."""

from __future__ import annotations

import ast

from shaper_fmu.export.c import operators
from shaper_fmu.export.c import ranges as r
from shaper_fmu.export.c.assignments import Assignments
from shaper_fmu.export.c.code import Code, integers_of
from shaper_fmu.export.c.kinds import BOOLEAN, INTEGER, NUMBERS, REAL, Array, Kind, Mismatch, Struct, joined
from shaper_fmu.export.c.source import UNKNOWN, read_names, walked
from shaper_fmu.export.c.unit import Known
from shaper_fmu.export.c.writing import Block, Body, Line


class Loops(Assignments):
    """Translates loops."""

    def _while(self, s: ast.While) -> None:
        body: Body = []
        with self.scope.inside(body):
            test = self.e.truth(s.test)
        going = f"!{self.scope.fault()}->what"  # a fault may have spoiled what would end the loop
        always = isinstance(s.test, ast.Constant) and bool(s.test.value)
        opening = f"while ({going}) {{" if body or always else f"while ({going} && {test.at(10)}) {{"
        if body:
            body.append(Block(f"if ({operators.negation(self.scope, s, test).text}) {{", [Line("break;")]))
        self._loop(s, Block(opening, body))

    def _loop(self, s: ast.While | ast.For, block: Block) -> None:
        """A loop's body, and what is done if no break has ended it."""
        flag = ""
        if s.orelse:
            flag = self.scope.fresh("ended")
            self.scope.say(f"bool {flag} = true;")
        self.flags.append(flag)
        self.block(s.body, block)
        self.flags.pop()
        if s.orelse:
            self.block(s.orelse, Block(f"if ({flag}) {{"))

    def _break(self, s: ast.Break) -> None:
        if self.flags and self.flags[-1]:
            self.scope.say(f"{self.flags[-1]} = false;")
        self.scope.say("break;")

    def _continue(self, s: ast.Continue) -> None:
        self.scope.say("continue;")

    def _for(self, s: ast.For) -> None:
        call = s.iter
        function = self.scope.names_value(call.func) if isinstance(call, ast.Call) else UNKNOWN
        if isinstance(call, ast.Call) and function is range:
            self._over_range(s, call)
        elif isinstance(call, ast.Call) and function is enumerate and 1 <= len(call.args) <= 2:
            first = self.e.number(call.args[1]) if len(call.args) == 2 else Code("0", INTEGER, r.Range(0, 0))
            self._over_arrays(s, [call.args[0]], first)
        elif isinstance(call, ast.Call) and function is zip and call.args:
            self._over_arrays(s, call.args, None)
        else:
            self._over_arrays(s, [call], None)

    def _over_range(self, s: ast.For, call: ast.Call) -> None:
        scope = self.scope
        if not isinstance(s.target, ast.Name) or not 1 <= len(call.args) <= 3 or call.keywords:
            scope.refuse(s, f"write 'for name in range(...)', not {ast.unparse(s.target)} in {ast.unparse(call)}")
        codes = scope.in_order(s, self.e.in_turn(call.args))
        for code, argument in zip(codes, call.args, strict=True):
            if code.kind not in (INTEGER, BOOLEAN):
                scope.refuse(s, f"range({ast.unparse(argument)}) is of {code.kind}; write int(...)")
        zero, one = Code("0", INTEGER, r.Range(0, 0)), Code("1", INTEGER, r.Range(1, 1))
        begin, end, step = (zero, codes[0], one) if len(codes) == 1 else (codes[0], codes[1], codes[2] if len(codes) == 3 else one)
        by = step.range.constant
        if by == 0:
            scope.refuse(s, "the step of a range must not be 0")
        found = _span(begin.range, end.range, by)
        own = self._is_own_counter(s)
        counter = scope.local(s.target.id) if own else self.scope.fresh("n")
        if by is None:
            length = scope.temporary(
                Code(f"range_length({scope.fault()}, {begin.text}, {end.text}, {step.text}, {scope.where(s)})", INTEGER), "length"
            )
            first, by_text = scope.temporary(begin, "first"), scope.temporary(step, "step")
            block = Block(f"for (int64_t {counter} = 0; {counter} < {length.text}; {counter}++) {{")
            self._bound(s, block, Code(f"{first.text} + {counter} * {by_text.text}", INTEGER, found, 3))
            return
        if not self._is_steady(s, end, call.args[0] if len(codes) == 1 else call.args[1]):
            end = scope.temporary(end, "end")
        order, move = (
            ("<", f"{counter}++" if by == 1 else f"{counter} += {int(by)}")
            if by > 0
            else (">", f"{counter}--" if by == -1 else f"{counter} -= {int(-by)}")
        )
        block = Block(f"for (int64_t {counter} = {begin.text}; {counter} {order} {end.at(4)}; {move}) {{")
        if abs(by) > 1 and not r.fits(r.added(end.range, r.Range(-abs(by), abs(by)))):
            scope.refuse(s, "the end of this range may be as large as an integer can be; bound it")
        if own:
            known = scope.function.variables.setdefault(s.target.id, Known())
            scope.unit.learn(known, Code("", INTEGER, found))
            self._loop(s, block)
        else:
            self._bound(s, block, Code(counter, INTEGER, found))

    def _bound(self, s: ast.For, block: Block, code: Code) -> None:
        """A loop whose name is set at the beginning of its body."""
        with self.scope.inside(block.body):
            self.store(s.target, code)
        self._loop(s, block)

    def _is_own_counter(self, s: ast.For) -> bool:
        """Whether a loop's name is set by `for` alone, and read inside of such loops alone: then it can count itself."""
        assert isinstance(s.target, ast.Name)
        name, inside = s.target.id, set()
        for inner in walked(self.scope.scope):
            if isinstance(inner, ast.FunctionDef | ast.Lambda) and inner is not self.scope.scope and name in read_names(inner):
                return False  # it may be called after the loop
        for loop in walked(self.scope.scope):
            if isinstance(loop, ast.For) and isinstance(loop.target, ast.Name) and loop.target.id == name:
                if not isinstance(loop.iter, ast.Call) or self.scope.names_value(loop.iter.func) is not range:
                    return False
                if len(loop.iter.args) == 3 and not isinstance(loop.iter.args[2], ast.Constant | ast.UnaryOp):
                    return False
                body = [n for part in loop.body for n in walked(part)]
                if any(isinstance(n, ast.For) and isinstance(n.target, ast.Name) and n.target.id == name for n in body):
                    return False
                inside |= {id(n) for n in body} | {id(loop.target)}
        used = [n for n in walked(self.scope.scope) if isinstance(n, ast.Name) and n.id == name]
        stored = [n for n in used if not isinstance(n.ctx, ast.Load)]
        targets = {id(n.target) for n in walked(self.scope.scope) if isinstance(n, ast.For)}
        arguments = {a.arg for a in self.scope.scope.args.args}
        return name not in arguments and all(id(n) in inside for n in used) and all(id(n) in targets for n in stored)

    def _is_steady(self, s: ast.For, end: Code, node: ast.expr) -> bool:
        """Whether a loop's end stays as it is while the body runs."""
        if end.range.constant is not None:
            return True
        if any(isinstance(n, ast.Subscript) for n in walked(node)):
            return False  # an element may be changed by another name of its array
        names = {n.id for n in walked(node) if isinstance(n, ast.Name)}
        changed = {n.id for part in s.body for n in walked(part) if isinstance(n, ast.Name) and not isinstance(n.ctx, ast.Load)}
        fields = {n.attr for n in walked(node) if isinstance(n, ast.Attribute)}
        return not names & (changed | {getattr(s.target, "id", "")}) and not fields & self.scope.unit.stored and "(" not in end.text

    def _over_arrays(self, s: ast.For, nodes: list[ast.expr], first: Code | None) -> None:
        """A loop over the elements of arrays and tuples, counted from `first` if that is given."""
        scope = self.scope
        wholes = [self._iterated(s, node) for node in nodes]
        size = min(whole.kind.size for whole in wholes if isinstance(whole.kind, Array))
        counter = self.scope.fresh("i")
        block = Block(f"for (int64_t {counter} = 0; {counter} < {size}; {counter}++) {{")
        items = [self._element(whole, counter) for whole in wholes]
        if first is not None:
            number = operators.binary(scope, s, ast.Add(), first, Code(counter, INTEGER, r.Range(0, size - 1)))
            items = [number, *items]
        targets = s.target.elts if isinstance(s.target, ast.Tuple) and len(items) > 1 else [s.target]
        if len(targets) != len(items):
            scope.refuse(s, f"{len(items)} values do not fit to {ast.unparse(s.target)}")
        if all(isinstance(target, ast.Name) and target.id not in scope.read for target in targets):
            for whole in wholes:
                scope.say(f"(void){whole.text};")
        with scope.inside(block.body):
            for target, item in zip(targets, items, strict=True):
                self.store(target, item)
        self._loop(s, block)

    def _element(self, whole: Code, counter: str) -> Code:
        assert isinstance(whole.kind, Array)
        kind = whole.kind.element
        narrow = kind in (INTEGER, BOOLEAN) and not whole.kind.constant
        return Code(f"{whole.text}[{counter}]", kind, whole.range, reads=not whole.kind.constant, whole=whole.whole, narrow=narrow)

    def _iterated(self, s: ast.For, node: ast.expr) -> Code:
        """An array or a table to loop over; a display of values becomes an array of its own."""
        scope = self.scope
        if not isinstance(node, ast.Tuple | ast.List):
            whole = self.e.of(node)
            if isinstance(whole.kind, Struct) and whole.value is None:
                held = whole if whole.text.isidentifier() else scope.temporary(whole)
                return self._gathered(s, [self.e.item(held, i) for i in range(len(whole.kind.items))])
            if not isinstance(whole.kind, Array):
                scope.refuse(
                    s,
                    f"for does not run over {ast.unparse(node)}, which is {whole.kind}; it runs over range(...), arrays and tuples",
                )
            return whole
        codes = scope.in_order(s, self.e.in_turn(node.elts))
        return self._gathered(s, codes)

    def _gathered(self, s: ast.For, codes: list[Code]) -> Code:
        kind: Kind | None = None
        found: r.Range | None = None
        for code in codes:
            try:
                kind = joined(kind, code.kind)
            except Mismatch as error:
                self.scope.refuse(s, f"the values that this loop runs over are {error}")
            found = r.union(found, code.range)
        if kind not in NUMBERS and not isinstance(kind, Struct):
            self.scope.refuse(s, f"for does not run over {kind}")
        self.scope.unit.use(kind)
        values = ", ".join(self.scope.as_kind(code, kind) for code in codes)
        name = self.scope.fresh("values")
        self.scope.say(f"const {kind.c}{name}[{len(codes)}] = {{{values}}};")
        table = Array(f"const {kind.c.strip()} *", kind, len(codes), True)
        return Code(name, table, found or r.ANY, whole=integers_of(codes) if kind == REAL else None)


def _span(begin: r.Range, end: r.Range, by: float | None) -> r.Range:
    """Where the numbers of a range lie."""
    if by is None:
        return r.union(begin, end)
    if by > 0:
        return r.Range(begin.low, max(begin.low, end.high - 1))
    return r.Range(min(begin.high, end.low + 1), begin.high)
