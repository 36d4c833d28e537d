"""Python's syntax trees, for components that are built side by side."""

from __future__ import annotations

import ast
import threading

_one_at_a_time = threading.Lock()


def parse(source: str) -> ast.Module:
    """The syntax tree of a source.

    CPython 3.11 counts the depth of a tree that it makes once for all threads: where another one comes between, it raises
    SystemError, "AST constructor recursion depth mismatch".
    """
    with _one_at_a_time:
        return ast.parse(source)


def parse_expression(source: str) -> ast.expr:
    """The syntax tree of an expression."""
    with _one_at_a_time:
        return ast.parse(source, mode="eval").body
