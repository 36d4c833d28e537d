"""A function's body in C: lines and blocks, and where its variables are declared."""

from __future__ import annotations

import re
import textwrap
from dataclasses import dataclass, field

WIDTH = 110


@dataclass
class Line:
    """A statement; `sets` is the variable that it gives a value, if it does nothing else."""

    text: str
    sets: str = ""
    comment: str = ""
    does: bool = False  # more than to set it: its value is that of a call which changes memory

    @property
    def names(self) -> set[str]:
        return _names(self.text)


@dataclass
class Block:
    """Statements in braces after an opening such as `if (...) {`; `joins` where that follows the brace that ends the one before."""

    opening: str
    body: Body = field(default_factory=list)
    joins: bool = False
    comment: str = ""

    @property
    def names(self) -> set[str]:
        return _names(self.opening).union(*[item.names for item in self.body])


Body = list[Line | Block]


def _names(text: str) -> set[str]:
    """The variables that a text of C mentions: no members, no words of string literals."""
    return set(re.findall(r"(?<![\w.>])[A-Za-z_]\w*", re.sub(r'"(\\.|[^"\\])*"', '""', text)))


def without_unused(body: Body) -> None:
    """Remove what sets variables that nobody reads; what such an expression does besides is done."""
    while True:
        read = _read_names(body)
        if not _remove_setting(body, read):
            return


def _read_names(body: Body) -> set[str]:
    found: set[str] = set()
    for item in body:
        if isinstance(item, Block):
            found |= _names(item.opening) | _read_names(item.body)
        else:
            value = item.text.split(" = ", 1)[-1]
            kept = item.does or _may_fault(value)
            found |= item.names if not item.sets else _names(value) - (set() if kept else {item.sets})
    return found


def _may_fault(value: str) -> bool:
    """Whether an expression does something besides: it tells a fault, or calls what does."""
    return re.search(r"\bfault\b", value) is not None


def _remove_setting(body: Body, read: set[str]) -> bool:
    """Whether a line was removed that sets a variable which is not read."""
    changed = False
    for i in reversed(range(len(body))):
        item = body[i]
        if isinstance(item, Block):
            changed |= _remove_setting(item.body, read)
        elif item.sets and item.sets not in read:
            value = item.text.split(" = ", 1)[1]
            body[i : i + 1] = [Line(f"(void)({value[:-1]});", comment=item.comment)] if item.does or _may_fault(value) else []
            changed = True
    return changed


def declare(body: Body, name: str, kind: str, zero: str) -> None:
    """Declare a variable in the innermost block that holds all its uses, where it gets its first value if that is in there."""
    at = [i for i, item in enumerate(body) if name in item.names]
    if not at:
        return
    first = body[at[0]]
    if isinstance(first, Line) and first.sets == name and name not in _names(first.text.split("=", 1)[1]):
        first.text = f"{kind}{first.text}"
        return
    found = [item for i in at if isinstance(item := body[i], Block) and name not in _names(item.opening)]
    if len(found) == len(at) and all(isinstance(item, Block) and item.joins for item in body[at[0] + 1 : at[-1] + 1]):
        for block in found:  # branches, of which one alone is run
            declare(block.body, name, kind, zero)
        return
    before = at[0]
    while isinstance(item := body[before], Block) and item.joins:
        before -= 1
    body.insert(before, Line(f"{kind}{name} = {zero};"))


def written(body: Body, level: int = 1) -> list[str]:
    """The lines of a body."""
    lines: list[str] = []
    for i, item in enumerate(body):
        if item.comment:
            lines += comment(item.comment, level)
        if isinstance(item, Line):
            lines += wrapped(item.text, level)
            continue
        opening = wrapped(item.opening, level)
        if item.joins:
            opening[0] = "    " * level + "} " + opening[0].lstrip()
        lines += opening
        lines += written(item.body, level + 1)
        following = body[i + 1] if i + 1 < len(body) else None
        if not (isinstance(following, Block) and following.joins):
            lines.append("    " * level + "}")
    return lines


def inside_comment(text: str) -> str:
    """A text that neither ends a comment nor begins another one."""
    return text.replace("*/", "* /").replace("/*", "/ *")


def comment(text: str, level: int = 0) -> list[str]:
    """A comment, wrapped."""
    safe = inside_comment(text)
    begin = "    " * level
    paragraphs = [textwrap.wrap(p, WIDTH - len(begin) - 3) or [""] for p in textwrap.dedent(safe).strip().split("\n\n")]
    lines = [line for p in paragraphs for line in [*p, ""]][:-1]
    lines = [f"{begin}{'/* ' if i == 0 else '   '}{line}".rstrip() for i, line in enumerate(lines)]
    lines[-1] += " */"
    return lines


def wrapped(text: str, level: int = 0) -> list[str]:
    """A line, on several ones if it is long."""
    begin = "    " * level
    if len(begin) + len(text) <= WIDTH:
        return [begin + text]
    kept = re.sub(r'"(\\.|[^"\\])*"', lambda m: m[0].replace(" ", "\0"), text)
    lines = textwrap.wrap(
        kept, WIDTH, initial_indent=begin, subsequent_indent=begin + "    ", break_long_words=False, break_on_hyphens=False
    )
    return [line.replace("\0", " ") for line in lines]
