"""Reading the kernels' source before they are compiled: what a kernel may not use, named by file, line and words.

Two kinds of things are refused: what cannot be compiled to code without Python (containers, texts, files), and what would
compile but behave otherwise than in Python (exceptions, texts that are compared with numbers, functions of other modules
than `math`). What depends on the types of values is left to the compiler.
"""

from __future__ import annotations

from dataclasses import dataclass, field
from types import FunctionType

from shaper_fmu.component import Component
from shaper_fmu.errors import BuildError
from shaper_fmu.export.c.source import Finding, definition
from shaper_fmu.export.kernel_reader import Reader, used_names

_KERNELS = ("start", "step")
_MOST_FINDINGS = 10


def check_kernels(component: type[Component]) -> None:
    """Raise BuildError that lists what the kernels, and the plain functions that they reach, may not use."""
    check = _Check(component)
    for kernel in _KERNELS:
        function = getattr(component, kernel)
        if not isinstance(function, FunctionType):
            kind = type(function).__name__
            raise BuildError(
                f"{component.__name__}.{kernel} is of type {kind}; write it as a plain method, 'def {kernel}(self, ...)'"
            )
        check.function(function, frozenset({0}))
    found = list(dict.fromkeys(check.findings))
    if found:
        more = len(found) - _MOST_FINDINGS
        shown = [str(finding) for finding in found[:_MOST_FINDINGS]] + ([f"... and {more} more"] if more > 0 else [])
        raise BuildError(f"{' and '.join(check.faulty)} does not compile:\n" + "\n".join(shown))


def reached_functions(component: type[Component]) -> list[FunctionType]:
    """The kernels and all plain functions that they use, directly or through others."""
    reached: dict[FunctionType, None] = {}
    pending = [getattr(component, kernel) for kernel in _KERNELS]
    while pending:
        function = pending.pop()
        if function not in reached:
            reached[function] = None
            pending += [value for value in used_names(function).values() if isinstance(value, FunctionType)]
    return list(reached)


@dataclass
class _Check:
    """The walk over functions: each once for every choice of arguments that are the record."""

    component: type[Component]
    findings: list[Finding] = field(default_factory=list)
    faulty: dict[str, None] = field(default_factory=dict)  # the kernels, for the heading
    done: set[tuple[FunctionType, frozenset[int]]] = field(default_factory=set)
    active: list[FunctionType] = field(default_factory=list)  # those being called, to see recursion

    def function(self, function: FunctionType, records: frozenset[int]) -> None:
        """Check a function whose arguments numbered `records` are the record, and all it calls."""
        if (function, records) in self.done:
            return
        self.done.add((function, records))
        self.active.append(function)
        scope = definition(function)
        if scope is not None:
            Reader(self, function, scope, records).read()
        self.active.pop()

    def report(self, file: str, line: int, words: str) -> None:
        self.findings.append(Finding(file, line, words))
        self.faulty[f"{self.component.__name__}.{self.active[0].__name__}"] = None
