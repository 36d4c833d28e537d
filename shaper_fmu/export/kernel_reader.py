"""Reading one function of a kernel: its syntax, and what its names stand for."""

from __future__ import annotations

import ast
import builtins
import dis
import enum
import math
from collections.abc import Iterator
from types import BuiltinFunctionType, CodeType, FunctionType, ModuleType, NoneType
from typing import Any, Protocol

from shaper_fmu.component import Component
from shaper_fmu.errors import nearest
from shaper_fmu.export.kernel_words import BUILTINS, CONSTRUCTS, MATH, NO_TEXT

_COMPILED_MODULES = ("math", "builtins", "_operator")
_UNKNOWN = object()
Scope = ast.FunctionDef | ast.Lambda


class Check(Protocol):
    """What a reader tells its findings, and asks to check the functions that it meets."""

    component: type[Component]
    active: list[FunctionType]

    def function(self, function: FunctionType, records: frozenset[int]) -> None: ...

    def report(self, file: str, line: int, words: str) -> None: ...


def codes(code: CodeType) -> Iterator[CodeType]:
    """A function's code and that of the functions defined inside it."""
    yield code
    for constant in code.co_consts:
        if isinstance(constant, CodeType):
            yield from codes(constant)


def used_names(function: FunctionType) -> dict[str, Any]:
    """The globals and the closure's variables that a function reads: name -> value. Builtins are not among them."""
    read = [i.argval for code in codes(function.__code__) for i in dis.get_instructions(code) if i.opname == "LOAD_GLOBAL"]
    used = {name: function.__globals__[name] for name in read if name in function.__globals__}
    for name, cell in zip(function.__code__.co_freevars, function.__closure__ or (), strict=True):
        try:
            used[name] = cell.cell_contents
        except ValueError:  # not yet bound
            continue
    return used


class Reader(ast.NodeVisitor):
    """Reads the syntax of one function, whose arguments numbered `records` are the record."""

    def __init__(self, check: Check, function: FunctionType, scope: Scope, records: frozenset[int]):
        self.check: Check = check
        self.function: FunctionType = function
        self.scope: Scope = scope
        self.used: dict[str, Any] = used_names(function)
        nodes = list(ast.walk(scope))
        declared = {name for node in nodes if isinstance(node, ast.Global) for name in node.names}
        stored = {node.id for node in nodes if isinstance(node, ast.Name) and not isinstance(node.ctx, ast.Load)}
        stored |= {node.name for node in nodes if isinstance(node, ast.MatchAs | ast.MatchStar) and node.name}
        parameters = [node.arg for node in nodes if isinstance(node, ast.arg)]
        inner = {node.name for node in nodes if isinstance(node, ast.FunctionDef | ast.ClassDef) and node is not scope}
        imported = {
            (a.asname or a.name).split(".")[0] for n in nodes if isinstance(n, ast.Import | ast.ImportFrom) for a in n.names
        }
        handled = {node.name for node in nodes if isinstance(node, ast.ExceptHandler) and node.name}
        self.local: set[str] = (stored | set(parameters) | inner | imported | handled) - declared
        own = [argument.arg for argument in [*scope.args.posonlyargs, *scope.args.args]]
        once = [name for name in own if parameters.count(name) == 1 and name not in stored]
        self.records: set[str] = {name for i, name in enumerate(own) if i in records and name in once}

    def read(self) -> None:
        self._arguments(self.scope)
        body = self.scope.body
        for node in body if isinstance(body, list) else [body]:
            self.visit(node)

    def _refuse(self, node: ast.AST, words: str) -> None:
        self.check.report(self.function.__code__.co_filename, getattr(node, "lineno", self.scope.lineno), words)

    def _arguments(self, scope: Scope) -> None:
        if scope.args.kwarg or scope.args.kwonlyargs:
            named = scope.args.kwarg or scope.args.kwonlyargs[0]
            self._refuse(named, f"the argument {named.arg} can be given by its name alone; write it as an ordinary argument")

    def visit(self, node: ast.AST) -> None:
        words = CONSTRUCTS.get(type(node))
        if words and not isinstance(getattr(node, "ctx", None), ast.Store):
            self._refuse(node, words)  # and not what is inside: one finding is enough
        else:
            super().visit(node)

    def visit_FunctionDef(self, node: ast.FunctionDef) -> None:
        self._arguments(node)
        for inner in [*node.decorator_list, *node.args.defaults, *node.body]:
            self.visit(inner)

    def visit_Lambda(self, node: ast.Lambda) -> None:
        self._arguments(node)
        for inner in [*node.args.defaults, node.body]:
            self.visit(inner)

    def visit_AnnAssign(self, node: ast.AnnAssign) -> None:  # the annotation itself is not run
        for inner in (node.target, node.value):
            if inner is not None:
                self.visit(inner)

    def visit_Expr(self, node: ast.Expr) -> None:
        if not (isinstance(node.value, ast.Constant) and isinstance(node.value.value, str)):  # a docstring
            self.visit(node.value)

    def visit_Constant(self, node: ast.Constant) -> None:
        if isinstance(node.value, str):
            self._refuse(node, f"a kernel has no texts such as {node.value!r}; {NO_TEXT}")

    def visit_Global(self, node: ast.Global) -> None:
        assigned = {n.id for n in ast.walk(self.scope) if isinstance(n, ast.Name) and not isinstance(n.ctx, ast.Load)}
        for name in sorted(assigned.intersection(node.names)):
            self._refuse(node, f"{name} is a variable of the module, which a kernel cannot set; make it a State of the component")

    def visit_Starred(self, node: ast.Starred) -> None:
        if isinstance(node.ctx, ast.Store):
            self._refuse(node, "a starred name collects values in a list; give every value a name")
        else:
            self.generic_visit(node)

    def visit_For(self, node: ast.For) -> None:
        self.visit(node.target)
        self._visit_display(node.iter)
        for inner in [*node.body, *node.orelse]:
            self.visit(inner)

    def visit_Compare(self, node: ast.Compare) -> None:
        self.visit(node.left)
        for operator, right in zip(node.ops, node.comparators, strict=True):
            if isinstance(operator, ast.In | ast.NotIn):
                self._visit_display(right)
            else:
                self.visit(right)

    def _visit_display(self, node: ast.expr) -> None:
        """Python itself makes a tuple of a list display that a `for` or an `in` runs over."""
        if isinstance(node, ast.List):
            for element in node.elts:
                self.visit(element)
        else:
            self.visit(node)

    def visit_Call(self, node: ast.Call) -> None:
        arguments = [*node.args, *(keyword.value for keyword in node.keywords)]
        target = self._value(node.func)
        if any(keyword.arg is None for keyword in node.keywords):
            self._refuse(node, "a call cannot take its arguments from a dictionary (**); write them out")
        elif isinstance(node.func, ast.Name) and isinstance(target, FunctionType):
            self._reach(node, target, self._records_given(node, target))
        elif isinstance(node.func, ast.Name) and target is _UNKNOWN and node.func.id not in self.local and node.func.id in BUILTINS:
            return self._refuse(node, BUILTINS[node.func.id])
        elif isinstance(node.func, ast.Name) and isinstance(target, enum.EnumMeta):
            self._refuse(node, f"{node.func.id}(...) makes a member of Python's; the number itself can be compared with a member")
        elif isinstance(node.func, ast.Attribute) and self._is_record(node.func.value):
            self._attribute(node.func, called=True)
        elif isinstance(node.func, ast.Attribute) and isinstance(self._value(node.func.value), ModuleType):
            self._module_function(node.func, target)
        else:
            self.visit(node.func)
        for argument in arguments:
            self.visit(argument)

    def visit_Attribute(self, node: ast.Attribute) -> None:
        owner = node.value
        if self._is_record(owner):
            self._attribute(node, called=False)
        elif isinstance(owner, ast.Attribute) and self._is_record(owner.value) and self._is_scalar(owner.attr):
            if node.attr not in ("real", "imag"):
                self._refuse(node, f"{ast.unparse(owner)} is a number and has no {node.attr!r}; compare it with numbers or members")
        elif isinstance(self._value(owner), ModuleType):
            self._constant(node, f"{ast.unparse(node)}", self._value(node))
        else:
            self.visit(owner)

    def visit_Name(self, node: ast.Name) -> None:
        if node.id in self.local:
            return
        value = self._value(node)
        if value is _UNKNOWN and not hasattr(builtins, node.id):
            if node.id not in self.function.__code__.co_freevars:
                self._refuse(node, f"there is no {node.id!r}.{nearest(node.id, [*self.local, *self.used])}")
        elif node.id not in self.used:
            if node.id in BUILTINS:
                self._refuse(node, BUILTINS[node.id])
        elif isinstance(value, FunctionType):
            self._reach(node, value, frozenset())
        else:
            self._constant(node, node.id, value)

    def _value(self, node: ast.AST) -> Any:
        """What a name, or an attribute of a module, stands for; _UNKNOWN if it depends on the run."""
        if isinstance(node, ast.Name) and node.id not in self.local:
            return self.used.get(node.id, _UNKNOWN)
        if isinstance(node, ast.Attribute) and isinstance(module := self._value(node.value), ModuleType):
            return getattr(module, node.attr, _UNKNOWN)
        return _UNKNOWN

    def _is_record(self, node: ast.AST) -> bool:
        return isinstance(node, ast.Name) and node.id in self.records

    def _is_scalar(self, name: str) -> bool:
        variable = self.check.component.variables.get(name)
        return variable is not None and variable.size is None

    def _records_given(self, node: ast.Call, target: FunctionType) -> frozenset[int]:
        """Numbers of the arguments of `target` that are the record in this call."""
        names = target.__code__.co_varnames[: target.__code__.co_argcount]
        at = {i for i, argument in enumerate(node.args) if self._is_record(argument)}
        at |= {names.index(k.arg) for k in node.keywords if k.arg in names and self._is_record(k.value)}
        return frozenset() if any(isinstance(argument, ast.Starred) for argument in node.args) else frozenset(at)

    def _reach(self, node: ast.AST, target: FunctionType, records: frozenset[int]) -> None:
        if target in self.check.active:
            self._refuse(node, f"{target.__name__} is called while it runs (recursion), which does not compile; write a loop")
        else:
            self.check.function(target, records)

    def _attribute(self, node: ast.Attribute, called: bool) -> None:
        component, name = self.check.component, node.attr
        if name in component.variables:
            return
        shown = ast.unparse(node)
        value = getattr(component, name, _UNKNOWN)
        if isinstance(value, FunctionType) or (called and value is not _UNKNOWN):
            words = f"{shown} is a method; make it a function {name}(m, ...) outside the class, and call it with the record as m"
        elif value is _UNKNOWN:
            words = (
                f"{shown} is not declared.{nearest(name, component.variables)} Declare it as a variable of the class, or as a State"
            )
        else:
            words = f"{shown} belongs to the class, not to the record; make it a constant of the module or a Parameter"
        self._refuse(node, words)

    def _module_function(self, node: ast.Attribute, target: Any) -> None:
        module = ast.unparse(node.value)
        if isinstance(target, FunctionType):
            self._refuse(node, f"write 'from {target.__module__} import {target.__name__}', and call {target.__name__}")
        elif self._value(node.value) is not math:
            self._refuse(node, f"a kernel cannot call {ast.unparse(node)}; it may call functions of math, and plain functions")
        elif target is _UNKNOWN:
            self._refuse(node, f"{module} has no function {node.attr!r}.{nearest(node.attr, vars(math))}")
        elif node.attr in MATH:
            self._refuse(node, f"{ast.unparse(node)} does not compile; {MATH[node.attr]}")

    def _constant(self, node: ast.AST, name: str, value: Any) -> None:
        """Refuse a value from outside the function that compiled code cannot hold."""
        kind = type(value).__name__
        if isinstance(value, str):
            self._refuse(node, f"{name} is a text, and a kernel has none; {NO_TEXT}")
        elif isinstance(value, BuiltinFunctionType) and value.__module__ not in _COMPILED_MODULES:
            self._refuse(
                node, f"{name} is a function of {value.__module__} without Python source; kernels call math and plain functions"
            )
        elif isinstance(value, list | dict | set | frozenset):
            self._refuse(
                node,
                f"{name} is of type {kind}, which needs Python; use a tuple of numbers, or an array of the component (size=...)",
            )
        elif type(value).__module__.split(".")[0] == "numpy":
            words = "a value of numpy, which computes otherwise than Python; make it a float, or a tuple of its tolist()"
            self._refuse(node, f"{name} is {words}")
        elif isinstance(value, type) and not _is_compiled_class(value):
            self._refuse(node, f"{name} is a class; a kernel reads module constants, members of an IntEnum and the record")
        elif not _is_compiled(value):
            self._refuse(node, f"{name} is of type {kind}; a kernel reads numbers, tuples of numbers and members of an IntEnum")


def _is_compiled_class(value: type) -> bool:
    named_tuple = issubclass(value, tuple) and hasattr(value, "_fields")
    return named_tuple or issubclass(value, enum.Enum) or value.__module__ == "builtins"


def _is_compiled(value: Any) -> bool:
    """Whether the compiler knows values of this type at all."""
    if isinstance(value, int | float) and not isinstance(value, enum.Enum):
        return type(value) in (bool, int, float)  # and none that computes in its own way
    known = (complex, bytes, tuple, type, enum.Enum, ModuleType, BuiltinFunctionType, NoneType)
    return value is _UNKNOWN or isinstance(value, known)
