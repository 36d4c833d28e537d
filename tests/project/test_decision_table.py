"""docs/which_shaper.md: what its first table promises is in its second one, which a sweep of examples/08_which_shaper.py prints."""

from __future__ import annotations

import re
from pathlib import Path

PAGE = (Path(__file__).parents[2] / "docs" / "which_shaper.md").read_text(encoding="utf-8")


def test_the_bands_that_are_promised_are_those_of_the_sweep():
    rows = re.findall(r"^\| `(\w+)` \|(.*)\|$", PAGE, re.MULTILINE)
    widths = {kind: int(re.search(r"±(\d+) %", cells.split("|")[-1])[1]) for kind, cells in rows}  # pyright: ignore[reportOptionalSubscript]
    promised = re.findall(r"^\| [^|]*within (?:\d+ to )?(\d+) %[^|]*\| ([^|]*)\|", PAGE, re.MULTILINE)
    found = {kind: int(share) for share, kinds in promised for kind in re.findall(r"`(\w+)`", kinds)}
    assert found == {"zv": 3, "mzv": 5, "zvd": 14, "ei": 20, "two_hump_ei": 30, "zvdd": 30}
    assert {kind: share for kind, share in found.items() if share > widths[kind]} == {"zvdd": 30}  # "25 to 30": 25 for zvdd
    assert widths["zvdd"] == 25


def test_the_delays_that_are_promised_are_those_of_the_sweep():
    words = {"half a period": 0.5, "three quarters of a period": 0.75, "one period": 1.0, "one and a half periods": 1.5}
    delays = {kind: float(cells.split("|")[0]) for kind, cells in re.findall(r"^\| `(\w+)` \|(.*)\|$", PAGE, re.MULTILINE)}
    promised = [(kinds, said.strip()) for kinds, said in re.findall(r"^\|[^|]*\| (`[^|:]*): ([^|]*)\|", PAGE, re.MULTILINE)]
    assert len(promised) >= 5
    for kinds, said in promised:
        for kind in re.findall(r"`(\w+)`", kinds):
            assert delays[kind] == words[said], kind
