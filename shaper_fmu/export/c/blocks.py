"""Statements in their order, with their comments: what all kinds of statements are built on."""

from __future__ import annotations

import ast

from shaper_fmu.export.c.expressions import Expressions
from shaper_fmu.export.c.scope import FunctionScope
from shaper_fmu.export.c.source import File
from shaper_fmu.export.c.writing import Block


class Blocks:
    """Translates statements one after the other, each by the method of its kind."""

    def __init__(self, scope: FunctionScope, expressions: Expressions, file: File | None):
        self.scope: FunctionScope = scope
        self.e: Expressions = expressions
        self.file: File | None = file
        self.flags: list[str] = []  # of the loops at work: a variable that tells whether a break ended it, or empty
        self.commented: int = scope.scope.lineno

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
