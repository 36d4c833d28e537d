"""Generates the source of a module from methods: their enumeration, and functions that dispatch to a kind's method.

The functions are chains of ifs, which run as plain Python, compile, and are packed into FMUs, as any other source:

    def unit_move(kind, s, duration, ramp, natural_frequency, damping_ratio):
        if kind == ProfileKind.cycloid:
            return cycloid_move(s, duration)
        ...

A method answers with a function, which is given those of the arguments that it names, or with a number.
"""

from __future__ import annotations

import linecache
from collections.abc import Iterable, Mapping, Sequence
from typing import Any

from shaper_fmu.methods.record import FIRST_FOREIGN, Found, Method, Question


def module_text(
    enumeration: str,
    reserved: Mapping[str, int],
    methods: Sequence[Found[Any]],
    questions: Sequence[Question],
    constants: Mapping[str, Any],
) -> str:
    """The module's source: imports, the enumeration, the methods' parameters, constants, a function for each question."""
    items = {**reserved, **{one.record.name: one.record.number for one in methods}}
    imports: list[str] = []
    functions = [_function(enumeration, question, methods, imports) for question in questions]
    own, further = _parameters(methods, imports)
    lines = [
        f'"""Made from the records of the methods of {enumeration}; see shaper_fmu/methods."""',
        "from enum import IntEnum",
        *dict.fromkeys(imports),
        f"class {enumeration}(IntEnum):",
        '    """The numbers are those of the FMU\'s enumeration and never change."""',
        *[f"    {name} = {number}" for name, number in sorted(items.items(), key=lambda item: item[1])],
        f"PARAMETERS = {own}",
        f"FURTHER_PARAMETERS = {further}",
        *[f"{name} = {value!r}" for name, value in constants.items()],
        *functions,
    ]
    return "\n".join(lines) + "\n"


def run_text(text: str, module: dict[str, Any]) -> None:
    """Run a text in a module, under a file name by which tracebacks, the check of kernels and the compiler find its lines."""
    file = f"<{module['__name__']}, made from its methods>"
    linecache.cache[file] = (len(text), None, text.splitlines(keepends=True), file)
    exec(compile(text, file, "exec"), module)


def _function(enumeration: str, question: Question, methods: Iterable[Found[Any]], imports: list[str]) -> str:
    lines = [f"def {question.name}({question.arguments}):", f'    """{question.summary}"""']
    for one in methods:
        answer = getattr(one.record, question.field)
        if answer is None:
            continue
        wanted = question.asked_of(one)
        expression = repr(answer) if wanted is None else _call(one, question, wanted, imports)
        if expression == question.otherwise:
            continue
        lines += [f"    if kind == {enumeration}.{one.record.name}:", f"        return {expression}"]
    return "\n".join([*lines, f"    return {question.otherwise}"])


def _call(one: Found[Any], question: Question, wanted: list[str], imports: list[str]) -> str:
    function, called = getattr(one.record, question.field), f"{one.record.name}_{question.field}"
    imports.append(f"from {function.__module__} import {function.__name__} as {called}")
    return f"{called}({', '.join(wanted)})"


def _parameters(methods: Iterable[Found[Method]], imports: list[str]) -> tuple[str, str]:
    """The parameters of shaper-fmu's own methods, and those that other packages add: they come last, and move no others."""
    known: set[str] = set()
    own: list[str] = []
    further: list[str] = []
    for one in methods:
        record = f"{one.record.name}_record"
        for name in one.record.parameters:
            if name not in known:
                known.add(name)
                imports.append(f"from {one.module} import {one.attribute} as {record}")
                (own if one.record.number < FIRST_FOREIGN else further).append(f'"{name}": {record}.parameters["{name}"]')
    return "{" + ", ".join(own) + "}", "{" + ", ".join(further) + "}"
