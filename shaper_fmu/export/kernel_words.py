"""The words for what a kernel may not use, each with what to do instead."""

from __future__ import annotations

import ast

NO_TEXT = "give kinds as members of an IntEnum, and a failure as a status number that `messages` explains"

_CONTAINER = "needs Python's memory; use an array of the component, State(size=...), or a tuple of numbers"
_EXCEPTION = "exceptions are Python's; return a status number, and explain it in the component's `messages`"

CONSTRUCTS: dict[type[ast.AST], str] = {
    ast.List: f"a list [...] {_CONTAINER}",
    ast.Dict: f"a dictionary {{...}} {_CONTAINER}",
    ast.Set: f"a set {{...}} {_CONTAINER}",
    ast.ListComp: f"a list comprehension {_CONTAINER}, filled in a loop",
    ast.DictComp: f"a dictionary comprehension {_CONTAINER}, filled in a loop",
    ast.SetComp: f"a set comprehension {_CONTAINER}, filled in a loop",
    ast.GeneratorExp: "a generator does not compile; write a loop",
    ast.Yield: "a generator (yield) does not compile; return numbers, or set variables of the record",
    ast.YieldFrom: "a generator (yield) does not compile; return numbers, or set variables of the record",
    ast.Await: "await does not compile; a kernel runs to its end at once",
    ast.JoinedStr: f"a kernel has no texts such as this f-string; {NO_TEXT}",
    ast.Try: f"a kernel has no try: {_EXCEPTION}",
    ast.TryStar: f"a kernel has no try: {_EXCEPTION}",
    ast.Raise: f"a kernel has no raise: {_EXCEPTION}",
    ast.Assert: f"a kernel has no assert: {_EXCEPTION}",
    ast.With: "with does not compile; a kernel has no files or other resources to open",
    ast.ClassDef: "a class inside a kernel does not compile; declare variables of the component",
    ast.AsyncFunctionDef: "async does not compile; a kernel runs to its end at once",
    ast.AsyncFor: "async does not compile; a kernel runs to its end at once",
    ast.AsyncWith: "async does not compile; a kernel runs to its end at once",
    ast.Import: "an import inside a kernel does not compile; write it at the top of the file",
    ast.ImportFrom: "an import inside a kernel does not compile; write it at the top of the file",
    ast.Delete: "del does not compile; leave the variable as it is",
    ast.NamedExpr: "an assignment inside an expression (:=) does not compile; write it as a line of its own",
    ast.MatchSequence: "match compares numbers alone; unpack the values and compare them with if",
    ast.MatchMapping: "match compares numbers alone; unpack the values and compare them with if",
    ast.MatchClass: "match compares numbers alone; unpack the values and compare them with if",
}
"""Syntax that is refused wherever it stands."""

_BY_TASK = {
    "a kernel cannot write or ask; show a value as an Output or Local": ("print", "input", "open", "breakpoint"),
    _CONTAINER: ("list", "dict", "set", "frozenset", "bytearray", "bytes", "memoryview", "sorted"),
    f"a kernel has no texts; {NO_TEXT}": ("str", "repr", "format", "ascii", "chr", "bin", "hex", "oct"),
    "a kernel cannot look up names while it runs; write the variable's name": (
        "setattr",
        "delattr",
        "vars",
        "dir",
        "globals",
        "locals",
        "eval",
        "exec",
        "compile",
    ),
    "a kernel cannot call methods; make it a function outside the class, with the record as argument": ("super",),
    "this needs Python's objects; a kernel has numbers, tuples of numbers and the record": ("id", "hash", "object", "callable"),
}

BUILTINS: dict[str, str] = {name: f"{name}: {words}" for words, names in _BY_TASK.items() for name in names}
"""Built-in functions that do not compile to code without Python."""

MATH: dict[str, str] = {
    "frexp": "use math.log2 and math.floor",
    "ldexp": "multiply by 2.0 ** n",
    "modf": "use math.trunc(x) and x - math.trunc(x)",
    "isclose": "write abs(a - b) <= tolerance",
    "dist": "use math.hypot of two differences",
    "fsum": "add in a loop",
    "prod": "multiply in a loop",
}
"""Functions of `math` that do not compile, and what to use instead."""
