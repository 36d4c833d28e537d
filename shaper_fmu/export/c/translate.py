"""A component's kernels as C99; see docs/c.md."""

from __future__ import annotations

import ast
from functools import lru_cache
from typing import Any

from shaper_fmu.component import Component
from shaper_fmu.errors import BuildError
from shaper_fmu.export.c.assigned import check_assigned
from shaper_fmu.export.c.calls import Calls, parameters_of
from shaper_fmu.export.c.code import Code
from shaper_fmu.export.c.expressions import Expressions
from shaper_fmu.export.c.kinds import INTEGER, NOTHING, NUMBERS, REAL, RECORD, Array, Callee, Kind, Mismatch
from shaper_fmu.export.c.ranges import fits, widest
from shaper_fmu.export.c.scope import FunctionScope
from shaper_fmu.export.c.source import Finding, definition, outside_names, parsed_file, walked
from shaper_fmu.export.c.statements import Statements
from shaper_fmu.export.c.texts import unit_text
from shaper_fmu.export.c.unit import Function, Known, Refused, Unit, file_label
from shaper_fmu.export.c.writing import comment, declare, without_unused, wrapped, written

KERNELS: dict[str, tuple[str, ...]] = {"start": (), "step": ("t", "h")}
"""Names of the kernels, and the real arguments that each takes beside the record."""


@lru_cache(maxsize=64)
def translated(component: type[Component]) -> str:
    """The C file that defines kernel_start and kernel_step. Raises BuildError that names file, line and what is wrong."""
    unit = Unit(component)
    at, entries = "", []
    try:
        while unit.begin_pass():
            entries = []
            for at in KERNELS:
                entries.append(_entry(unit, at))
    except Refused as refused:
        finding = Finding(refused.file, refused.line, refused.words)
        raise BuildError(f"{component.__name__}.{at} does not compile:\n{finding}") from None
    return unit_text(unit, "\n\n".join(entries))


def _entry(unit: Unit, kernel: str) -> str:
    """The function that a host calls."""
    function = getattr(unit.component, kernel)
    codes = [Code("self", RECORD), *[Code(name, REAL) for name in KERNELS[kernel]]]
    state = _function(unit, Callee("", function), [code.kind for code in codes], codes)
    if state.result.kind not in (None, NOTHING, INTEGER, *NUMBERS) or state.result.kind == REAL:
        words = f"a kernel returns nothing, or a status number, not {state.result.kind}"
        raise Refused(function.__code__.co_filename, function.__code__.co_firstlineno, words)
    arguments = ["(Record *)record", *KERNELS[kernel], *(["fault"] if state.faults else [])]
    call = f"{state.name}({', '.join(arguments)})"
    lines = [] if state.faults else ["(void)fault;"]
    found = Code(call, state.result.kind or NOTHING, state.result.range or widest(True))
    if found.kind == NOTHING:
        lines += [f"{call};", "return 0;"]
    elif fits(found.range, 32):
        lines += [f"return (int){call};"]
    else:
        lines = [f'return (int)integer32(fault, {call}, "status", "{kernel}");']
    reals = "".join(f"double {name}, " for name in KERNELS[kernel])
    return "\n".join([f"int kernel_{kernel}(void *record, {reals}Fault *fault) {{", *[f"    {line}" for line in lines], "}"])


def _function(unit: Unit, callee: Callee, kinds: list[Kind], codes: list[Code]) -> Function:
    """The function for arguments of these kinds, translated in this pass."""
    key = (callee, tuple(kinds))
    names, _ = parameters_of(callee)
    names = [*[name for name, _ in callee.captured], *names]
    state = unit.functions.get(key)
    if state is None:
        wanted = "_".join([callee.name.strip("_"), *[k.name.strip("_") for k in kinds if isinstance(k, Callee)]])
        state = unit.functions[key] = Function(wanted, list(zip(names, kinds, strict=True)))
        unit.changed = True
    for (name, kind), code in zip(state.parameters, codes, strict=True):
        unit.learn(state.variables.setdefault(name, Known()), code._replace(kind=kind))
    if state.active:
        raise RecursionError
    if state.translated != unit.number and (unit.final or not state.is_settled(unit)):
        state.translated, state.active = unit.number, True
        state.known_before, state.told = state.knows(unit), {}
        try:
            _translate(unit, state, callee, key)
        finally:
            state.active = False
        unit.order.append(state)
    return state


def _translate(unit: Unit, state: Function, callee: Callee, key: Any) -> None:
    home: Any = callee.function or callee.home
    node = callee.node or definition(home)
    if node is None:
        code = home.__code__
        raise Refused(
            code.co_filename, code.co_firstlineno, f"the source of {home.__name__} is not at hand; write it as a def in a file"
        )
    outside = outside_names(home)
    scope = FunctionScope(unit, state, home, node, outside)
    scope.own |= {name for name, _ in callee.captured}
    if node.args.vararg or node.args.kwarg or node.args.kwonlyargs:
        scope.refuse(node, f"{callee.name}: write all arguments as ordinary ones")
    if unit.number == 1:
        check_assigned(node, scope.refuse)
    expressions = Expressions(scope, Calls(lambda target, codes, at: _call(unit, scope, target, codes, at)))
    statements = Statements(scope, expressions, parsed_file(home))
    body: list[ast.stmt] = node.body if isinstance(node, ast.FunctionDef) else [ast.copy_location(ast.Return(node.body), node.body)]
    statements.body(body)
    _finish(unit, scope, callee, key, statements)


def _call(unit: Unit, scope: FunctionScope, target: Callee, codes: list[Code], at: ast.AST) -> Code:
    """A call of a function of a kernel's kind."""
    for code in codes:
        if code.kind == NOTHING:
            scope.refuse(at, f"{target.name} is given nothing (None); give it numbers")
    try:
        called = _function(unit, target, [code.kind for code in codes], codes)
    except RecursionError:
        scope.refuse(at, f"{target.name} is called while it runs (recursion), which does not compile; write a loop")
    except Mismatch as error:
        scope.refuse(at, f"{target.name} is given {error}")
    scope.function.told.setdefault(id(called), (called, called.tells()))
    arguments = []
    for (name, kind), code in zip(called.parameters, codes, strict=True):
        if isinstance(kind, Callee):
            arguments += code.captured
            continue
        arguments.append(scope.as_kind(code, kind))
        if name in called.written:
            if code.root:
                unit.mark(scope.function.written, code.root)
            if code.field:
                unit.mark(unit.stored, code.field)
            if isinstance(kind, Array) and kind.constant:
                scope.refuse(at, f"{target.name} changes {name}, which is a constant here")
    for flag in ("writes", "reads"):
        if getattr(called, flag):
            unit.flag(scope.function, flag)
    if called.faults:
        arguments.append(scope.fault())
    kind = called.result.kind or NOTHING
    found = called.result.range or widest(kind == INTEGER)
    return Code(f"{called.name}({', '.join(arguments)})", kind, found, reads=True, writes=called.writes, whole=called.result.whole)


def _finish(unit: Unit, scope: FunctionScope, callee: Callee, key: Any, statements: Statements) -> None:
    """The function's text: head, declarations, body."""
    state = scope.function
    state.name = unit.names.given(_wanted(callee, state), key, unit.locals)
    result = state.result.kind or NOTHING
    if result != NOTHING and _falls_through(scope):
        is_kernel = callee.function in (getattr(unit.component, kernel) for kernel in KERNELS)
        if not is_kernel:
            scope.refuse(
                scope.scope, f"{callee.name} returns {result} on one path and nothing on another; return a number at its end, too"
            )
        scope.say("return 0;")
    if not unit.final:
        return
    without_unused(scope.lines)
    for name, known in state.variables.items():
        c = scope.local(name)
        if c in scope.set_names and known.kind is not None and name not in dict(state.parameters):
            declare(scope.lines, c, known.kind.c, _zero(known.kind))
    arguments, unused = _arguments(state, scope)
    head = f"static {result.c}{state.name}({', '.join(arguments) or 'void'}) {{"
    where = file_label(scope.home.__code__.co_filename)
    doc = ast.get_docstring(scope.scope) if isinstance(scope.scope, ast.FunctionDef) else None
    note = comment(f"{doc} ({where}, line {scope.scope.lineno})" if doc else f"{where}, line {scope.scope.lineno}")
    state.text = "\n".join([*note, *wrapped(head), *[f"    (void){name};" for name in unused], *written(scope.lines), "}"])


def _wanted(callee: Callee, state: Function) -> str:
    functions = [kind.name.strip("_") for _, kind in state.parameters if isinstance(kind, Callee)]
    return "_".join([callee.name.strip("_") or "function", *functions])


def _zero(kind: Kind) -> str:
    return (
        "0.0"
        if kind == REAL
        else "false"
        if kind.c == "bool "
        else "0"
        if kind in NUMBERS or isinstance(kind, Array) or kind == RECORD
        else "{0}"
    )


def _arguments(state: Function, scope: FunctionScope) -> tuple[list[str], list[str]]:
    """The arguments as they are declared, and the names of those that are not used."""
    said: list[str] = []
    names: list[str] = []
    for name, kind in state.parameters:
        c = scope.local(name)
        if isinstance(kind, Callee):
            for captured, captured_kind in kind.captured:
                names.append(scope.local(f"{name}.{captured}"))
                said.append(f"{_passed(captured_kind, True)}{names[-1]}")
            continue
        said.append(f"{_passed(state.variables[name].kind if kind in NUMBERS else kind, name in state.written)}{c}")
        names.append(c)
    if state.faults:
        said.append("Fault *fault")
    used = set().union(*[item.names for item in scope.lines]) if scope.lines else set()
    return said, [name for name in names if name not in used]


def _passed(kind: Kind | None, is_written: bool) -> str:
    assert kind is not None
    memory = kind == RECORD or (isinstance(kind, Array) and not kind.constant)
    return f"const {kind.c}" if memory and not is_written else kind.c


def _falls_through(scope: FunctionScope) -> bool:
    """Whether the end of the function can be reached."""
    return not isinstance(scope.scope, ast.Lambda) and not _ends(scope.scope.body)


def _ends(body: list[ast.stmt]) -> bool:
    last = body[-1]
    if isinstance(last, ast.Return):
        return True
    if isinstance(last, ast.If):
        return bool(last.orelse) and _ends(last.body) and _ends(last.orelse)
    if isinstance(last, ast.While):
        forever = isinstance(last.test, ast.Constant) and bool(last.test.value)
        return forever and not any(isinstance(n, ast.Break) for n in walked(last))
    if isinstance(last, ast.Match):
        whole = any(c.guard is None and isinstance(c.pattern, ast.MatchAs) and c.pattern.pattern is None for c in last.cases)
        return whole and all(_ends(c.body) for c in last.cases)
    return False
