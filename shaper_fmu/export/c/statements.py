"""Statements: what a kernel does, line by line, in C."""

from __future__ import annotations

import ast

from shaper_fmu.export.c import operators
from shaper_fmu.export.c.code import Code
from shaper_fmu.export.c.kinds import NOTHING, NUMBERS, RECORD, Array, Mismatch, Struct
from shaper_fmu.export.c.loops import Loops
from shaper_fmu.export.c.source import walked
from shaper_fmu.export.c.writing import Block


class Statements(Loops):
    """Translates the statements of one function."""

    def _pass(self, s: ast.stmt) -> None:
        self.scope.say(";")

    def _nonlocal(self, s: ast.stmt) -> None:
        self.scope.refuse(s, "nonlocal does not compile; return the new value")

    def _expr(self, s: ast.Expr) -> None:
        code = self.e.of(s.value)
        if code.writes or "fault" in code.text or isinstance(s.value, ast.Call):
            self.scope.say(f"{code.text};" if code.kind == NOTHING else f"(void){code.at(1)};")

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
        self.commented: int = max(self.commented, s.end_lineno or 0)
        if s.decorator_list:
            self.scope.refuse(s.decorator_list[0], "a decorator of an inner function does not compile; call what it does")
        self.scope.bind(s, s.name, self.e.inner(s))

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
