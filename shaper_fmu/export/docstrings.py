"""What a docstring tells: its paragraphs and lists, and what a list says about the items of an enumeration."""

from __future__ import annotations

import enum
import inspect
import re


def docstring_blocks(text: str) -> list[tuple[str, list[str]]]:
    """A docstring as paragraphs ("text", one line), lists ("list", a line for each item) and indented lines ("display").

    An item begins with "- " and goes on in lines that are indented. A list need not be set off by empty lines.
    """
    blocks: list[tuple[str, list[str]]] = []
    previous = ""
    for line in text.splitlines():
        stripped = line.strip()
        kind, lines = blocks[-1] if blocks and previous else ("", [])
        if not stripped:
            pass
        elif line.startswith("- "):
            if kind == "list":
                lines.append(stripped[2:])
            else:
                blocks.append(("list", [stripped[2:]]))
        elif kind == "list" and line.startswith(" "):
            lines[-1] += f" {stripped}"
        elif line.startswith("    "):
            if kind == "display":
                lines.append(line[4:])
            else:
                blocks.append(("display", [line[4:]]))
        elif kind == "text":
            lines[0] += f" {stripped}"
        else:
            blocks.append(("text", [stripped]))
        previous = stripped
    return blocks


def item_descriptions(kind: type[enum.IntEnum], *others: type) -> dict[str, str]:
    """What lists say about items of an enumeration, "- zv: zero vibration;", in its docstring or those of other classes."""
    found: dict[str, str] = {}
    for one in (kind, *others):
        for block, lines in docstring_blocks(inspect.getdoc(one) or ""):
            for line in lines if block == "list" else []:
                match = re.match(r"`?(\w+)`?: (.+)$", line)
                if match and match[1] in kind.__members__:
                    found.setdefault(match[1], match[2].rstrip(";. "))
    return found
