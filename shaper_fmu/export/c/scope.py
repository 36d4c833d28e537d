"""What the translation of one function works with: its names, its lines so far, and how it refuses."""

from __future__ import annotations

import ast
from collections.abc import Callable, Iterable, Iterator
from contextlib import contextmanager
from types import FunctionType
from typing import Any, NoReturn

from shaper_fmu.export.c.code import Code, literal
from shaper_fmu.export.c.kinds import BOOLEAN, INTEGER, NOTHING, REAL, RECORD, Array, Callee, Kind, Mismatch, Struct
from shaper_fmu.export.c.names import c_name
from shaper_fmu.export.c.ranges import EXACT, widest
from shaper_fmu.export.c.source import UNKNOWN, Scope, attribute, own_names, read_names
from shaper_fmu.export.c.unit import Function, Known, Refused, Unit, file_label
from shaper_fmu.export.c.writing import Body, Line


class FunctionScope:
    """One function while it is translated."""

    def __init__(self, unit: Unit, function: Function, home: FunctionType, scope: Scope, outside: dict[str, Any]):
        self.unit: Unit = unit
        self.function: Function = function
        self.home: FunctionType = home
        self.scope: Scope = scope
        self.outside: dict[str, Any] = outside
        self.own: frozenset[str] = own_names(scope)
        self.read: frozenset[str] = read_names(scope)
        self.lines: Body = []
        self.ordered: bool = True  # whether lines may be put before the statement at work
        self.temporaries: int = 0
        self.set_names: set[str] = set()
        """Variables that lines set, and that must be declared."""
        self.roots: dict[str, str] = {}
        """Local names of arrays and records: the parameter that each is reached by."""
        captured = [f"{name}.{one}" for name, kind in function.parameters if isinstance(kind, Callee) for one, _ in kind.captured]
        for name in [*dict(function.parameters), *sorted(self.own), *captured]:
            self.local(name)  # before any other name is made

    def refuse(self, node: ast.AST, words: str) -> NoReturn:
        raise Refused(self.home.__code__.co_filename, getattr(node, "lineno", self.scope.lineno), words)

    def where(self, node: ast.AST) -> str:
        """The place of a piece of source, as a string literal."""
        return literal(f"{file_label(self.home.__code__.co_filename)}:{getattr(node, 'lineno', self.scope.lineno)}")

    def fault(self) -> str:
        """The function's argument that takes faults."""
        self.unit.flag(self.function, "faults")
        return "fault"

    def say(self, text: str, sets: str = "", does: bool = False) -> None:
        self.lines.append(Line(text, sets, does=does))

    @contextmanager
    def inside(self, body: Body) -> Iterator[None]:
        """Lines go to another body for a while."""
        outer, self.lines = self.lines, body
        try:
            yield
        finally:
            self.lines = outer

    @contextmanager
    def unordered(self) -> Iterator[None]:
        """For operands that are evaluated only sometimes: no lines may be put before the statement."""
        outer, self.ordered = self.ordered, False
        try:
            yield
        finally:
            self.ordered = outer

    def names_value(self, node: ast.AST) -> Any:
        """What a name from outside, or an attribute of such, stands for; UNKNOWN if it depends on the run."""
        if isinstance(node, ast.Name) and node.id not in self.own:
            return self.outside.get(node.id, UNKNOWN)
        if isinstance(node, ast.Attribute):
            owner = self.names_value(node.value)
            return UNKNOWN if owner is UNKNOWN else attribute(owner, node.attr)
        return UNKNOWN

    # variables

    def variable(self, node: ast.Name) -> Code:
        """A local variable or an argument, read."""
        known = self.function.variables.get(node.id)
        if known is None or known.kind is None:
            self.refuse(node, f"{node.id} has no value yet")
        c = self.local(node.id)
        kind = known.kind
        memory = isinstance(kind, Array) or kind == RECORD
        captured = ()
        if isinstance(kind, Callee):  # what it captures was passed along with it, or is a variable here
            passed = self._is_parameter(node.id)
            captured = tuple(self.local(f"{node.id}.{name}" if passed else name) for name, _ in kind.captured)
        return Code(
            c,
            kind,
            known.range or widest(kind in (INTEGER, BOOLEAN)),
            whole=known.whole,
            root=self._root(node.id) if memory else "",
            captured=captured,
        )

    def _is_parameter(self, name: str) -> bool:
        return any(name == parameter for parameter, _ in self.function.parameters)

    def _root(self, name: str) -> str:
        return name if self._is_parameter(name) else self.roots.get(name, name)

    def local(self, name: str) -> str:
        """The name in C of a variable of the function, which is no other's."""
        known = self.function.locals
        if name not in known:
            c = c_name(name.replace(".", "_"))
            while c in known.values():
                c += "_"
            known[name] = c
        self.unit.mark(self.unit.locals, known[name])
        return known[name]

    def fresh(self, base: str) -> str:
        """A name in C for something that Python has no name for."""
        self.temporaries += 1
        c = f"{base}_{self.temporaries}"
        while c in self.function.locals.values():
            c += "_"
        self.unit.mark(self.unit.locals, c)
        return c

    def bind(self, node: ast.AST, name: str, code: Code) -> None:
        """Give a local variable a value."""
        if code.kind == NOTHING:
            self.refuse(node, f"{name} is set to nothing (None); set numbers")
        if isinstance(code.kind, Callee) and self._is_parameter(name):
            self.refuse(node, f"the argument {name} is a function and cannot be set again")
        known = self.function.variables.setdefault(name, Known())
        try:
            self.unit.learn(known, code)
        except Mismatch as error:
            self.refuse(node, f"{name} is {error}; give it values of one kind")
        assert known.kind is not None
        if isinstance(code.kind, Callee):
            return
        memory = isinstance(code.kind, Array) or code.kind == RECORD
        if memory and self.roots.setdefault(name, code.root) != code.root:
            self.refuse(node, f"{name} stands for parts of two records; give each a name")
        if memory and code.field:
            self.unit.mark(self.unit.stored, code.field)  # it may be written by its new name
        if name not in self.read:  # nobody asks for it; what it does besides is done
            if code.writes or "fault" in code.text:
                self.say(f"(void){code.at(1)};")
            return
        c = self.local(name)
        self.unit.use(known.kind)
        self.say(f"{c} = {self.as_kind(code, known.kind, node)};", c, code.writes)
        self.set_names.add(c)

    def temporary(self, code: Code, name: str = "value") -> Code:
        """The value kept in a variable of its own, at this place."""
        if isinstance(code.kind, Callee) or code.kind in (NOTHING, RECORD):
            return code
        c = self.fresh(name)
        self.unit.use(code.kind)
        self.say(f"{'' if isinstance(code.kind, Array) else 'const '}{code.kind.c}{c} = {code.text};", c, code.writes)
        return code._replace(text=c, level=0, reads=False, writes=False, narrow=False)

    def as_kind(self, code: Code, kind: Kind, node: ast.AST | None = None) -> str:
        """The text of a value as one of another kind that holds it."""
        if kind.c == REAL.c and code.is_integer and not code.range.within(-EXACT, EXACT):
            return f"exact_real({self.fault()}, {code.text}, {self.where(node or self.scope)})"
        if isinstance(kind, Struct):
            self.unit.use(kind)
            if isinstance(code.value, tuple):
                parts = [self.unit.constant(item) for item in code.value]
                return (
                    f"make_{kind.c.strip()}({', '.join(self.as_kind(p, k) for p, k in zip(parts, kind.items, strict=True) if p)})"
                )
            if code.kind != kind and isinstance(code.kind, Struct):
                held = code if code.text.isidentifier() else self.temporary(code, "pair")
                items = [Code(f"{held.text}.item{i}", of, widest(of == INTEGER)) for i, of in enumerate(code.kind.items)]
                parts = [self.as_kind(item, to, node) for item, to in zip(items, kind.items, strict=True)]
                return f"make_{kind.c.strip()}({', '.join(parts)})"
        return code.text

    def one_by_one(self, steps: Iterable[Callable[[], Code]]) -> list[Code]:
        """What steps find, one after the other: what the earlier ones read or do comes before the lines that a later one needs."""
        codes: list[Code] = []
        for step in steps:
            before = len(self.lines)
            code = step()
            if len(self.lines) > before and any(_depends(earlier) for earlier in codes):
                later = self.lines[before:]
                del self.lines[before:]
                codes = [self.temporary(earlier) if _depends(earlier) else earlier for earlier in codes]
                self.lines += later
            codes.append(code)
        return codes

    def in_order(self, node: ast.AST, codes: list[Code]) -> list[Code]:
        """Operands whose order of evaluation matters, in Python's order: C has none."""
        if not any(code.writes for code in codes) or sum(code.reads or code.writes for code in codes) < 2:
            return codes
        if not self.ordered:
            self.refuse(node, "a call that changes variables stands among other values here; write the call as a line of its own")
        return [self.temporary(code) if code.reads or code.writes else code for code in codes]


def _depends(code: Code) -> bool:
    """Whether it matters when a value is computed."""
    return (code.reads or code.writes) and not isinstance(code.kind, Array)
