"""Runs a function block of structured text: the statements that shaper_fmu/machines/structured_text.py uses, turned into Python.

Written from IEC 61131-3, not from the writer: LREAL_TO_DINT rounds halves to even, arrays are checked, an unknown word is an error.
"""

from __future__ import annotations

import re

_WORDS = {
    "NOT": "not",
    "AND": "and",
    "OR": "or",
    "TRUE": "True",
    "FALSE": "False",
    "LREAL_TO_DINT": "round",
    "DINT_TO_LREAL": "float",
}
_TYPES = {"LREAL": 0.0, "DINT": 0, "BOOL": False}


class Array(list[float]):
    """An array whose indexes are checked."""

    def __getitem__(self, i):
        assert 0 <= i < len(self), f"index {i} of {len(self)}"
        return super().__getitem__(i)

    def __setitem__(self, i, value):
        assert 0 <= i < len(self), f"index {i} of {len(self)}"
        super().__setitem__(i, value)


class FunctionBlock:
    """A function block: `block(command=1.0, cycle=0.01)` is a cycle, which returns its variables."""

    def __init__(self, text: str):
        text = re.sub(r"\(\*.*?\*\)", "", text, flags=re.DOTALL)
        parts = re.fullmatch(r"\s*FUNCTION_BLOCK \w+\s(.*END_VAR)(.*)END_FUNCTION_BLOCK\s*", text, re.DOTALL)
        assert parts is not None
        header, body = parts.groups()
        self.values = {}
        for name, kind, start in re.findall(r"(\w+) : ([^;:]+?)(?: := ([^;]+))?;", header):
            self.values[name] = _start(kind, start)
        self.code = compile("\n".join(_statements(body, self.values)), "structured text", "exec")

    def __call__(self, **inputs: float) -> dict[str, float]:
        self.values.update(inputs)
        exec(self.code, {"__builtins__": {"round": round, "float": float, "range": range}}, self.values)
        return self.values


def _start(kind: str, start: str):
    array = re.fullmatch(r"ARRAY\[0\.\.(\d+)\] OF (\w+)", kind)
    if array is None:
        return _TYPES[kind]
    size, start_values = int(array[1]) + 1, [float(x) for x in start.strip("[]").split(",")] if start else []
    assert not start or len(start_values) == size
    return Array(start_values or [_TYPES[array[2]]] * size)


def _statements(body: str, known: dict) -> list[str]:
    lines, depth = [], 0
    for statement in re.findall(r"\s*(ELSIF .*?THEN|IF .*?THEN|ELSE\b|FOR .*? DO|END_IF;|END_FOR;|[^;]+;)", body, re.DOTALL):
        text = " ".join(statement.split())
        if text in ("END_IF;", "END_FOR;"):
            depth -= 1
            continue
        if m := re.fullmatch(r"FOR (\w+) := (\S+) TO (\S+) DO", text):
            lines.append("    " * depth + f"for {m[1]} in range({m[2]}, {m[3]} + 1):")
            depth += 1
        elif m := re.fullmatch(r"(IF|ELSIF) (.*) THEN", text):
            at = depth if m[1] == "IF" else depth - 1
            lines.append("    " * at + f"{'if' if m[1] == 'IF' else 'elif'} {_expression(m[2], known)}:")
            depth = at + 1
        elif text == "ELSE":
            lines.append("    " * (depth - 1) + "else:")
        else:
            target, value = text.rstrip(";").split(":=")
            lines.append("    " * depth + f"{_expression(target, known)} = {_expression(value, known)}")
    assert depth == 0
    return lines


def _expression(text: str, known: dict) -> str:
    text = text.strip().replace("<>", "!=")
    for word in re.findall(r"\b[A-Za-z_]\w*", text):
        assert word in known or word in _WORDS or re.fullmatch(r"E\d+", word), word
    return re.sub(r"\b[A-Z_]+\b", lambda m: _WORDS.get(m[0], m[0]), text)
