"""A function's source: its syntax, its comments, and what its names stand for outside of it."""

from __future__ import annotations

import ast
import builtins
import enum
import io
import linecache
import tokenize
from dataclasses import dataclass
from functools import lru_cache
from types import FunctionType, ModuleType
from typing import Any

from shaper_fmu.syntax import parse

Scope = ast.FunctionDef | ast.Lambda
UNKNOWN = object()
"""What depends on the run."""


@dataclass(frozen=True)
class Finding:
    """What is wrong, and where."""

    file: str
    line: int
    words: str

    def __str__(self) -> str:
        source = linecache.getline(self.file, self.line).strip()
        return f"{self.file}:{self.line}: {self.words}" + (f"\n    {source}" if source else "")


@dataclass(frozen=True)
class File:
    """A parsed file: its tree, and its comments by line; `own` are the lines that hold nothing else."""

    tree: ast.Module
    comments: dict[int, str]
    own: frozenset[int]


@lru_cache(maxsize=256)
def _parsed(text: str) -> File:
    comments: dict[int, str] = {}
    own = set()
    for token in tokenize.generate_tokens(io.StringIO(text).readline):
        if token.type == tokenize.COMMENT:
            comments[token.start[0]] = token.string.lstrip("# ").rstrip()
            if not token.line[: token.start[1]].strip():
                own.add(token.start[0])
    return File(parse(text), comments, frozenset(own))


def parsed_file(function: FunctionType) -> File | None:
    """The file of a function; None when it is not at hand."""
    name = function.__code__.co_filename
    linecache.checkcache(name)
    try:
        return _parsed("".join(linecache.getlines(name, function.__globals__)))
    except (SyntaxError, tokenize.TokenError):
        return None


@lru_cache(maxsize=4096)
def definition(function: FunctionType) -> Scope | None:
    """The syntax of a function in its file; None when the file is not at hand or does not tell one function."""
    code, file = function.__code__, parsed_file(function)
    found: list[Scope] = []
    for node in walked(file.tree) if file else ():
        if isinstance(node, ast.FunctionDef) and node.name == code.co_name:
            if code.co_firstlineno == min([node.lineno, *(d.lineno for d in node.decorator_list)]):
                found.append(node)
        elif isinstance(node, ast.Lambda) and code.co_name == "<lambda>" and node.lineno == code.co_firstlineno:
            found.append(node)
    return found[0] if len(found) == 1 else None


def outside_names(function: FunctionType) -> dict[str, Any]:
    """What the names of a function stand for that are not its own: closure, module, builtins."""
    closed = {}
    for name, cell in zip(function.__code__.co_freevars, function.__closure__ or (), strict=True):
        try:
            closed[name] = cell.cell_contents
        except ValueError:  # not yet bound
            continue
    return {**vars(builtins), **function.__globals__, **closed}


@lru_cache(maxsize=100_000)
def walked(node: ast.AST) -> tuple[ast.AST, ...]:
    """A piece of syntax and all that is inside."""
    return tuple(ast.walk(node))


@lru_cache(maxsize=4096)
def read_names(scope: Scope) -> frozenset[str]:
    """The names whose value is asked for in a function, or in functions inside it."""
    read = {n.id for n in walked(scope) if isinstance(n, ast.Name) and isinstance(n.ctx, ast.Load)}
    return frozenset(read | {n.target.id for n in walked(scope) if isinstance(n, ast.AugAssign) and isinstance(n.target, ast.Name)})


@lru_cache(maxsize=4096)
def own_names(scope: Scope) -> frozenset[str]:
    """The names that belong to a function: arguments, and all that it assigns; not those of functions inside it."""
    arguments = scope.args
    found = {a.arg for a in [*arguments.posonlyargs, *arguments.args, *arguments.kwonlyargs]}
    pending: list[ast.AST] = list(scope.body) if isinstance(scope.body, list) else [scope.body]
    while pending:
        node = pending.pop()
        if isinstance(node, ast.FunctionDef):
            found.add(node.name)
        elif not isinstance(node, ast.Lambda):
            if isinstance(node, ast.Name) and not isinstance(node.ctx, ast.Load):
                found.add(node.id)
            elif isinstance(node, ast.MatchAs) and node.name:
                found.add(node.name)
            pending += ast.iter_child_nodes(node)
    return frozenset(found)


def attribute(owner: Any, name: str) -> Any:
    """An attribute of a module, an enumeration, a member of one, or a named tuple; UNKNOWN of anything else."""
    if isinstance(owner, ModuleType | enum.EnumMeta | enum.Enum) or (
        isinstance(owner, tuple) and name in getattr(owner, "_fields", ())
    ):
        return getattr(owner, name, UNKNOWN)
    return UNKNOWN
