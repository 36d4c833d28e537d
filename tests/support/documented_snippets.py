"""What the documentation's pages tell their reader to type: commands, and Python with what it prints."""

from __future__ import annotations

import re
import shlex
from dataclasses import dataclass
from pathlib import Path

ROOT = Path(__file__).parents[2]


@dataclass(frozen=True)
class Snippet:
    """A command as its words, or Python; for Python the block right behind it, which is what it prints."""

    words: tuple[str, ...] = ()
    python: str = ""
    printed: str = ""


def snippets(page: str, without: tuple[str, ...] = ()) -> list[Snippet]:
    """Those of a page of the repository in their order, but for the sections under the headings `without`.

    Commands are the indented lines that begin with `shaper-fmu`; words behind several blanks or "#" explain them.
    """
    text = (ROOT / page).read_text(encoding="utf-8")
    kept = [part for part in re.split(r"^(?=#+ )", text, flags=re.MULTILINE) if part.partition("\n")[0].lstrip("# ") not in without]
    found = []
    for python, printed, command in _BLOCKS.findall("".join(kept)):
        line = re.sub(r"\s*\\\n\s*", " ", command)
        words = tuple(shlex.split(re.split(r" {3,}|\s#", line)[0]))
        found.append(Snippet(python=python, printed=printed) if python else Snippet(words=words))
    return found


_BLOCKS = re.compile(
    r"^```python\n(.*?)^```\n(?:\n((?: {4}[^\n]*\n)+))?|^ {4}(shaper-fmu (?:[^\n]*\\\n)*[^\n]*)", re.MULTILINE | re.DOTALL
)
