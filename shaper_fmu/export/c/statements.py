"""Statements: what a kernel does, line by line, in C."""

from __future__ import annotations

import ast

from shaper_fmu.export.c import operators
from shaper_fmu.export.c import ranges as r
from shaper_fmu.export.c.code import Code
from shaper_fmu.export.c.expressions import Expressions
from shaper_fmu.export.c.kinds import BOOLEAN, INTEGER, NOTHING, NUMBERS, REAL, RECORD, Array, Kind, Mismatch, Struct, joined
from shaper_fmu.export.c.scope import FunctionScope
from shaper_fmu.export.c.source import UNKNOWN, File, walked
from shaper_fmu.export.c.writing import Block, Body, Line

_ASSIGNING = {ast.Add: "+=", ast.Sub: "-=", ast.Mult: "*=", ast.Div: "/="}


class Statements:
    """Translates the statements of one function."""

    def __init__(self, scope: FunctionScope, expressions: Expressions, file: File | None):
        self.scope, self.e, self.file = scope, expressions, file
        self.flags: list[str] = []  # of the loops at work: a variable that tells whether a break ended it, or empty
        self.commented = scope.scope.lineno

    def body(self, statements: list[ast.stmt]) -> None:
        for s in statements:
            first = len(self.scope.lines)
            said = self._comments(s)
            if isinstance(s, ast.Expr) and isinstance(s.value, ast.Constant):
                continue  # a docstring
            getattr(self, f"_{type(s).__name__.lower()}", self._unknown)(s)
            if said and first < len(self.scope.lines):
                self.scope.lines[first].comment = said

    def block(self, statements: list[ast.stmt], block: Block) -> None:
        """The statements as the body of a block, which is put at the end."""
        with self.scope.inside(block.body):
            self.body(statements)
        self.scope.lines.append(block)

    def _comments(self, s: ast.stmt) -> str:
        """The comments on the lines before a statement, and on its first."""
        if self.file is None:
            return ""
        before = [self.file.comments[n] for n in sorted(self.file.own) if self.commented < n < s.lineno]
        last = s.lineno if hasattr(s, "body") else s.end_lineno or s.lineno
        own = [text for n in range(s.lineno, last + 1) if (text := self.file.comments.get(n))]
        self.commented = max(self.commented, last)
        return " ".join(text for text in [*before, *own] if not text.startswith(("fmt:", "noqa", "pyright:", "type:")))

    def _unknown(self, s: ast.stmt) -> None:
        self.scope.refuse(s, f"{type(s).__name__.lower()} does not compile")

    def _pass(self, s: ast.stmt) -> None:
        self.scope.say(";")

    def _nonlocal(self, s: ast.stmt) -> None:
        self.scope.refuse(s, "nonlocal does not compile; return the new value")

    def _expr(self, s: ast.Expr) -> None:
        code = self.e.of(s.value)
        if code.writes or isinstance(s.value, ast.Call):
            self.scope.say(f"{code.text};" if code.kind == NOTHING else f"(void){code.at(1)};")

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
        codes = [self.e.of(value) for value in values]
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
            if code.maybe_integer:
                self.scope.unit.mark(self.scope.unit.whole, _variable(target))
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
        target = self.e.number(_loaded(s.target))
        value = self.e.number(s.value)
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

    def _return(self, s: ast.Return) -> None:
        code = self.e.of(s.value) if s.value is not None else Code("", NOTHING)
        result = self.scope.function.result
        if (
            isinstance(code.kind, Array)
            or code.kind == RECORD
            or not (code.kind in (*NUMBERS, NOTHING) or isinstance(code.kind, Struct))
        ):
            self.scope.refuse(s, f"{code.kind} cannot be returned; return numbers, or a tuple of them")
        try:
            self.scope.unit.learn(result, code)
        except Mismatch as error:
            self.scope.refuse(s, f"{self.scope.function.name} returns {error}; return values of one type from every branch")
        assert result.kind is not None
        self.scope.unit.use(result.kind)
        self.scope.say("return;" if code.kind == NOTHING else f"return {self.scope.as_kind(code, result.kind, s)};")

    def _functiondef(self, s: ast.FunctionDef) -> None:
        self.commented = max(self.commented, s.end_lineno or 0)
        self.scope.bind(s, s.name, self.e.inner(s))

    # branches

    def _if(self, s: ast.If, joins: bool = False) -> None:
        before = len(self.scope.lines)
        test = self.e.truth(s.test)
        if joins and len(self.scope.lines) > before:  # the test needs lines of its own: into an else
            lines, self.scope.lines[before:] = self.scope.lines[before:], []
            block = Block("else {", lines, joins=True)
            with self.scope.inside(block.body):
                self._branches(s, test, False)
            self.scope.lines.append(block)
            return
        self._branches(s, test, joins)

    def _branches(self, s: ast.If, test: Code, joins: bool) -> None:
        self.block(s.body, Block(f"{'else ' if joins else ''}if ({test.text}) {{", joins=joins))
        if len(s.orelse) == 1 and isinstance(s.orelse[0], ast.If):
            self._if(s.orelse[0], joins=True)
        elif s.orelse:
            self.block(s.orelse, Block("else {", joins=True))

    def _match(self, s: ast.Match) -> None:
        subject = self.e.number(s.subject)
        if not subject.text.isidentifier():
            subject = self.scope.temporary(subject, "case")
        joins = False
        for case in s.cases:
            names = [n for n in walked(case.pattern) if isinstance(n, ast.MatchAs) and n.name]
            if names:
                self.scope.refuse(case.pattern, "match compares numbers alone; take the value before the match")
            with self.scope.unordered():
                tests = self._pattern(subject, case.pattern)
                found = [operators.both(tests, True) if len(tests) > 1 else tests[0]] if tests else []
                found += [self.e.truth(case.guard)] if case.guard is not None else []
            opening = f"if ({operators.both(found, False).text if len(found) > 1 else found[0].text}) {{" if found else "{"
            if not found and not joins:
                self.body(case.body)
                return
            self.block(case.body, Block(f"{'else ' if joins else ''}{opening}", joins=joins))
            joins = True
            if not found:
                return

    def _pattern(self, subject: Code, pattern: ast.pattern) -> list[Code]:
        """The tests of a pattern, one of which must hold; none for one that always does."""
        if isinstance(pattern, ast.MatchAs) and pattern.pattern is None:
            return []
        if isinstance(pattern, ast.MatchOr):
            return [test for one in pattern.patterns for test in self._pattern(subject, one)]
        if isinstance(pattern, ast.MatchValue):
            return [operators.comparison(self.scope, pattern, ast.Eq(), subject, self.e.number(pattern.value))]
        self.scope.refuse(pattern, "match compares numbers alone")

    # loops

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
            self.scope.temporaries += 1
            flag = f"ended_{self.scope.temporaries}"
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
        codes = scope.in_order(s, [self.e.of(argument) for argument in call.args])
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
        counter = scope.local(s.target.id) if own else self._fresh("n")
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
            known = scope.function.variables.setdefault(s.target.id, _known())
            scope.unit.learn(known, Code("", INTEGER, found))
            self._loop(s, block)
        else:
            self._bound(s, block, Code(counter, INTEGER, found))

    def _bound(self, s: ast.For, block: Block, code: Code) -> None:
        """A loop whose name is set at the beginning of its body."""
        with self.scope.inside(block.body):
            self.store(s.target, code)
        self._loop(s, block)

    def _fresh(self, base: str) -> str:
        self.scope.temporaries += 1
        return f"{base}_{self.scope.temporaries}"

    def _is_own_counter(self, s: ast.For) -> bool:
        """Whether a loop's name is set by `for` alone, and read inside of such loops alone: then it can count itself."""
        assert isinstance(s.target, ast.Name)
        name, inside = s.target.id, set()
        for loop in walked(self.scope.scope):
            if isinstance(loop, ast.For) and isinstance(loop.target, ast.Name) and loop.target.id == name:
                if not isinstance(loop.iter, ast.Call) or self.scope.names_value(loop.iter.func) is not range:
                    return False
                if len(loop.iter.args) == 3 and not isinstance(loop.iter.args[2], ast.Constant | ast.UnaryOp):
                    return False
                inside |= {id(n) for part in loop.body for n in walked(part)} | {id(loop.target)}
        used = [n for n in walked(self.scope.scope) if isinstance(n, ast.Name) and n.id == name]
        stored = [n for n in used if not isinstance(n.ctx, ast.Load)]
        targets = {id(n.target) for n in walked(self.scope.scope) if isinstance(n, ast.For)}
        arguments = {a.arg for a in self.scope.scope.args.args}
        return name not in arguments and all(id(n) in inside for n in used) and all(id(n) in targets for n in stored)

    def _is_steady(self, s: ast.For, end: Code, node: ast.expr) -> bool:
        """Whether a loop's end stays as it is while the body runs."""
        if end.range.constant is not None:
            return True
        names = {n.id for n in walked(node) if isinstance(n, ast.Name)}
        changed = {n.id for part in s.body for n in walked(part) if isinstance(n, ast.Name) and not isinstance(n.ctx, ast.Load)}
        fields = {n.attr for n in walked(node) if isinstance(n, ast.Attribute)}
        return not names & (changed | {getattr(s.target, "id", "")}) and not fields & self.scope.unit.stored and "(" not in end.text

    def _over_arrays(self, s: ast.For, nodes: list[ast.expr], first: Code | None) -> None:
        """A loop over the elements of arrays and tuples, counted from `first` if that is given."""
        scope = self.scope
        wholes = [self._iterated(s, node) for node in nodes]
        size = min(whole.kind.size for whole in wholes if isinstance(whole.kind, Array))
        counter = self._fresh("i")
        block = Block(f"for (int64_t {counter} = 0; {counter} < {size}; {counter}++) {{")
        items = [self._element(whole, counter) for whole in wholes]
        if first is not None:
            number = operators.binary(scope, s, ast.Add(), first, Code(counter, INTEGER, r.Range(0, size - 1)))
            items = [number, *items]
        targets = s.target.elts if isinstance(s.target, ast.Tuple) and len(items) > 1 else [s.target]
        if len(targets) != len(items):
            scope.refuse(s, f"{len(items)} values do not fit to {ast.unparse(s.target)}")
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
        codes = scope.in_order(s, [self.e.of(element) for element in node.elts])
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
        name = self._fresh("values")
        self.scope.say(f"const {kind.c}{name}[{len(codes)}] = {{{values}}};")
        table = Array(f"const {kind.c.strip()} *", kind, len(codes), True)
        return Code(name, table, found or r.ANY)


def _span(begin: r.Range, end: r.Range, by: float | None) -> r.Range:
    """Where the numbers of a range lie."""
    if by is None:
        return r.union(begin, end)
    if by > 0:
        return r.Range(begin.low, max(begin.low, end.high - 1))
    return r.Range(min(begin.high, end.low + 1), begin.high)


def _known():
    from shaper_fmu.export.c.unit import Known

    return Known()


def _variable(target: ast.expr) -> str:
    owner = target.value if isinstance(target, ast.Subscript) else target
    return owner.attr if isinstance(owner, ast.Attribute) else ast.unparse(owner)


def _loaded(target: ast.expr) -> ast.expr:
    """A target as an expression that is read."""
    copy = ast.parse(ast.unparse(target), mode="eval").body
    for node in walked(copy):
        ast.copy_location(node, target)
    return copy
