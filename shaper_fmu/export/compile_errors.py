"""What the compiler says about a kernel, in one sentence, with the line of the user's file that it is about."""

from __future__ import annotations

import os
import re
from collections import deque
from collections.abc import Iterable, Iterator
from types import FunctionType

from shaper_fmu.component import Component
from shaper_fmu.errors import BuildError
from shaper_fmu.export.kernel_source import Finding, reached_functions

_SHORTENED = [
    (r"Function\(<(?:function|built-in function|class|ufunc) '?([\w.]+)'?[^>]*>\)", r"\1"),
    (r"Module\(<module '([\w.]+)'[^>]*>\)", r"the module \1"),
    (r"Record\(.*?;\d+;(?:True|False)\)", "the record"),
    (r"nestedarray\(\w+, \((\d+),\)\)", r"array of \1"),
    (r"Literal\[\w+\]\((\S+?)\)", r"\1"),
    (r" for '\$[^']*'", ""),
    (r"'([A-Za-z_]\w*)\.\d+'", r"'\1'"),
    (r",? ?defined at .*", ""),
    (r",? ?operation: .*", ""),
    (r" found for signature:? *>>> ", " for "),
    (r"(Cannot cast .* to [^:]*): .*", r"\1"),
    (r"Unknown attribute '(\w+)' of type the module (\w+)", r"\2.\1 does not compile"),
    (r"Untyped global name ('\w+'): Cannot determine.*", r"\1 does not compile"),
    (r"\s+", " "),
]
_ADVICE = [
    ("unify return type", "return values of one type from every branch"),
    ("unify", "give the variable values of one type in every branch"),
    ("to int32", "a kernel returns nothing, or a status number"),
    ("Cannot cast", "the types do not fit; set numbers from numbers, and arrays element by element in a loop"),
    ("No implementation", "the types do not fit; a kernel computes with single numbers, arrays element by element in a loop"),
    ("untyped", "give the variable a number on every path"),
]
_PLACE = re.compile(r'File "([^"]+)", line (\d+)|(?:at|from) (\S+\.py) \((\d+)\)')


def explained(component: type[Component], kernel: str, error: Exception) -> BuildError:
    """The compiler's error as one that names file, line, the line's text and what is wrong."""
    text = re.sub(r"\x1b\[[0-9;]*m", "", str(error))
    if isinstance(error, KeyError):  # so the compiler says that a record has no such field
        text = f"the record has no variable {text}"
    innermost = re.split(r"Failed in \w+ mode pipeline \(step: [^)]*\)", text)[-1]
    where = _place(component, innermost) or _place(component, text) or _start_of(getattr(component, kernel))
    return _error(component, kernel, *where, _sentence(innermost) or type(error).__name__)


def explained_symbols(component: type[Component], kernel: str, symbols: list[str], text: str) -> BuildError:
    """The error for compiled code that still refers to Python's `symbols`; `text` is its LLVM IR with debug information."""
    where = _first_call(text, symbols, _files(component)) or _start_of(getattr(component, kernel))
    words = (
        f"this needs Python while it runs ({symbols[0]}): it makes, copies or converts an array, or calls Python; "
        "compute with single numbers, and with arrays element by element in a loop"
    )
    return _error(component, kernel, *where, words)


def _error(component: type[Component], kernel: str, file: str, line: int, words: str) -> BuildError:
    return BuildError(f"{component.__name__}.{kernel} does not compile:\n{Finding(file, line, words)}")


def _files(component: type[Component]) -> set[str]:
    return {function.__code__.co_filename for function in reached_functions(component)}


def _start_of(function: FunctionType) -> tuple[str, int]:
    return function.__code__.co_filename, function.__code__.co_firstlineno


def _place(component: type[Component], text: str) -> tuple[str, int] | None:
    """The first place in a file of the component's that a message names; the compiler gives paths from the current folder.

    Return statements that do not fit together are named in an order that changes with every process: there it is the uppermost.
    """
    files = {os.path.realpath(file): file for file in _files(component)}
    places = ((files.get(os.path.realpath(match[1] or match[3])), int(match[2] or match[4])) for match in _PLACE.finditer(text))
    ours = [(file, line) for file, line in places if file]
    return min(ours, default=None) if "unify return type" in text else next(iter(ours), None)


def _sentence(message: str) -> str:
    """The one sentence of a message that says what is wrong, without addresses and the compiler's own names."""
    lines = [line.strip() for line in message.splitlines() if line.strip()]
    if not lines:
        return ""
    sentence = lines[0]
    if sentence.endswith("signature:") and len(lines) > 1:
        sentence += " " + next((line for line in lines if line.startswith(">>>")), "")
    for pattern, words in _SHORTENED:
        sentence = re.sub(pattern, words, sentence)
    reason = re.findall(r"^\s*(?:TypingError|NumbaTypeError|TypeError|NumbaValueError): (.+)$", message, re.MULTILINE)
    reason = [r for r in reason if not r.startswith("Failed")]
    if reason and sentence.startswith("No implementation"):
        sentence += f" ({re.sub('Cannot bind.*TypeError: ', '', reason[0]).rstrip(chr(34) + '.')})"
    advice = next((advice for words, advice in _ADVICE if words in sentence), "")
    return sentence.strip().rstrip(".") + (f"; {advice}" if advice else "")


def _first_call(text: str, symbols: Iterable[str], files: set[str]) -> tuple[str, int] | None:
    """The place in `files` from which one of the symbols is called, directly or through the compiler's own functions."""
    nodes = dict(re.findall(r"^(!\d+) = (?:distinct )?(![^\n]*)", text, re.MULTILINE))
    callers: dict[str, list[tuple[str, str]]] = {}
    for caller, called, location in _calls(text):
        callers.setdefault(called, []).append((caller, location))
    pending, seen = deque(symbols), set(symbols)
    while pending:
        for caller, location in callers.get(pending.popleft(), []):
            for file, line in _inlined(nodes, location):
                if file in files:
                    return file, line
            if caller not in seen:
                seen.add(caller)
                pending.append(caller)
    return None


def _calls(text: str) -> Iterator[tuple[str, str, str]]:
    """Caller, called function and number of the debug location of every call that has one."""
    caller = ""
    for line in text.splitlines():
        if line.startswith("define"):
            caller = re.split(r'@"?', line, maxsplit=1)[1].split("(")[0].rstrip('"')
        match = re.search(r'(?:call|invoke) [^@]*@"?([^\s"(]+)"?\(.*!dbg (!\d+)', line)
        if match:
            yield caller, match[1], match[2]


def _inlined(nodes: dict[str, str], location: str | None) -> Iterator[tuple[str, int]]:
    """File and line of a debug location, then of the call that was replaced by its function's body, and so on."""
    while location:
        text = nodes.get(location, "")
        scope, line = re.search(r"scope: (!\d+)", text), re.search(r"line: (\d+)", text)
        file = re.search(r"file: (!\d+)", nodes.get(scope[1], "")) if scope else None
        names = re.search(r'filename: "(.*?)", directory: "(.*?)"', nodes.get(file[1], "")) if file else None
        if names and line:
            yield os.path.join(names[2], names[1]), int(line[1])
        outer = re.search(r"inlinedAt: (!\d+)", text)
        location = outer[1] if outer else None
