"""The counts of verdicts that docs/reproduce.md and README.md state, by the names on the command line."""

from __future__ import annotations

import re
from collections.abc import Sequence
from pathlib import Path

from shaper_fmu.reproduce.claims import Claim

ROOT = Path(__file__).parents[2]
VERDICTS = ("reproduced", "reproduced (labels exchanged)", "not reproduced", "not decidable")


def assert_documented(key: str, claims: Sequence[Claim]) -> None:
    """The documentation's row of a paper counts its statements by verdict; README's, those that hold of all."""
    found = [claim.verdict for claim in claims]
    assert len({claim.statement for claim in claims}) == len(claims), "one row for each statement"
    counts = [found.count(verdict) for verdict in VERDICTS]
    row = row_of(ROOT / "docs" / "reproduce.md", key, 5)
    assert [int(cell) for cell in row] == [len(claims), *counts]
    if key != "unknown-parameters":  # which is no paper of its own
        (cell,) = row_of(ROOT / "README.md", key, 2)[:1]
        exchanged = f", {counts[1]} with its labels exchanged" if counts[1] else ""
        assert cell == f"{counts[0] + counts[1]} of {len(claims)}{exchanged}"


def row_of(page: Path, key: str, last: int) -> list[str]:
    """The last cells of the first row of a page's tables that begins with `key` in backquotes."""
    line = next(line for line in page.read_text().splitlines() if re.match(rf"\| `{key}` \|", line))
    return [cell.strip() for cell in line.strip("|").split("|")][-last:]
