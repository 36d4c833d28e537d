"""Definite assignment: a name that is read must have a value on every path that leads there."""

from __future__ import annotations

import ast
from collections.abc import Callable, Iterable

from shaper_fmu.export.c.source import Scope, own_names, walked

Names = frozenset[str]


def check_assigned(scope: Scope, refuse: Callable[[ast.AST, str], None]) -> None:
    """Call `refuse` for every name of the function that is read where it may have no value yet."""
    _Paths(scope, refuse).function()


class _Paths:
    """Follows the paths through a function with the set of names that have a value; None where no path leads."""

    def __init__(self, scope: Scope, refuse: Callable[[ast.AST, str], None]):
        self.scope, self.refuse, self.own = scope, refuse, own_names(scope)
        self.breaks: list[list[Names]] = []
        self.continues: list[list[Names]] = []

    def function(self) -> None:
        arguments = self.scope.args
        known = frozenset(a.arg for a in [*arguments.posonlyargs, *arguments.args, *arguments.kwonlyargs])
        if isinstance(self.scope, ast.Lambda):
            self.read(self.scope.body, known)
        else:
            self.block(self.scope.body, known)

    def block(self, statements: Iterable[ast.stmt], known: Names | None) -> Names | None:
        for statement in statements:
            if known is None:
                return None
            known = self.statement(statement, known)
        return known

    def read(self, node: ast.AST | None, known: Names) -> None:
        for found in walked(node) if node is not None else ():
            if not (isinstance(found, ast.Name) and isinstance(found.ctx, ast.Load)):
                continue
            if found.id in self.own - known and not self._is_inner(found, node):
                self.refuse(found, f"{found.id} may have no value here: it is not set on every path; set it before")
                known |= {found.id}

    def _is_inner(self, found: ast.Name, node: ast.AST | None) -> bool:
        """Whether a name is an argument of a lambda inside of the expression."""
        lambdas = [x for x in walked(node) if isinstance(x, ast.Lambda)] if node else []
        return any(found.id in own_names(x) and found in set(walked(x)) for x in lambdas)

    def statement(self, s: ast.stmt, known: Names) -> Names | None:
        if isinstance(s, ast.Assign | ast.AnnAssign):
            self.read(s.value, known)
            targets = s.targets if isinstance(s, ast.Assign) else [s.target]
            return self.bound(targets, known) if s.value is not None else known
        if isinstance(s, ast.AugAssign):
            self.read(ast.Name(s.target.id, ast.Load(), lineno=s.lineno) if isinstance(s.target, ast.Name) else s.target, known)
            self.read(s.value, known)
            return known
        if isinstance(s, ast.Return):
            self.read(s.value, known)
            return None
        if isinstance(s, ast.If):
            self.read(s.test, known)
            return _both(self.block(s.body, known), self.block(s.orelse, known))
        if isinstance(s, ast.For | ast.While):
            return self.loop(s, known)
        if isinstance(s, ast.Break | ast.Continue):
            (self.breaks if isinstance(s, ast.Break) else self.continues)[-1].append(known)
            return None
        if isinstance(s, ast.Match):
            return self.match(s, known)
        if isinstance(s, ast.FunctionDef):  # what it uses of this function must have a value by now
            for found in walked(s):
                if isinstance(found, ast.Name) and found.id in self.own - known - own_names(s) - {s.name}:
                    self.refuse(found, f"{found.id} may have no value here: it is not set on every path; set it before")
            return known | {s.name}
        self.read(s, known)
        return known

    def bound(self, targets: Iterable[ast.expr], known: Names) -> Names:
        for target in targets:
            for node in walked(target):
                if isinstance(node, ast.Name) and not isinstance(node.ctx, ast.Load):
                    known |= {node.id}
        for target in targets:
            self.read(target, known)
        return known

    def loop(self, s: ast.For | ast.While, known: Names) -> Names | None:
        self.read(s.iter if isinstance(s, ast.For) else s.test, known)
        inside = self.bound([s.target], known) if isinstance(s, ast.For) else known
        self.breaks.append([])
        self.continues.append([])
        once = self.block(s.body, inside)
        for known_there in self.continues.pop():
            once = _both(once, known_there)
        if isinstance(s, ast.While) and isinstance(s.test, ast.Constant) and s.test.value:
            after: Names | None = None  # it ends by break alone
        else:
            after = once if isinstance(s, ast.For) and _runs(s.iter) and once is not None else known
            after = self.block(s.orelse, after)
        for known_there in self.breaks.pop():
            after = _both(after, known_there)
        return after

    def match(self, s: ast.Match, known: Names) -> Names | None:
        self.read(s.subject, known)
        after: Names | None = None
        complete = False
        for case in s.cases:
            names = {n.name for n in walked(case.pattern) if isinstance(n, ast.MatchAs) and n.name}
            self.read(case.guard, known | names)
            after = _both(after, self.block(case.body, known | names))
            complete |= case.guard is None and isinstance(case.pattern, ast.MatchAs) and case.pattern.pattern is None
        return after if complete else _both(after, known)


def _both(a: Names | None, b: Names | None) -> Names | None:
    return b if a is None else a if b is None else a & b


def _runs(iterated: ast.expr) -> bool:
    """Whether a loop's body is run at least once: over range(number), or a display of values."""
    if isinstance(iterated, ast.Call) and isinstance(iterated.func, ast.Name) and iterated.func.id == "range":
        ends = [a.value for a in iterated.args if isinstance(a, ast.Constant) and isinstance(a.value, int)]
        return len(ends) == len(iterated.args) and len(range(*ends)) > 0
    return isinstance(iterated, ast.Tuple | ast.List) and bool(iterated.elts)
