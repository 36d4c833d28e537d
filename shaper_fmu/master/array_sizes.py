"""Checks the sizes of FMI 3.0's arrays before memory is allocated for them."""

from __future__ import annotations

import re

from lxml import etree

from shaper_fmu.errors import ArchiveError

MOST_ELEMENTS = 1_000_000
"""Elements of all arrays of an FMU together."""
_SIZE = re.compile(r"\s*\+?\d{1,20}\s*")


def check_dimensions(root: etree._Element, where: str) -> list[str]:
    """Raise ArchiveError, beginning with `where`, for an array whose sizes are none, or too large.

    Returns findings: arrays with other than one start value, or one for each element.
    """
    findings: list[str] = []
    arrays = [variable for variable in root.iterfind("ModelVariables/*") if variable.find("Dimension") is not None]
    sizes = {variable.get("valueReference"): variable for variable in root.iterfind("ModelVariables/*")} if arrays else {}
    total = 0
    for variable in arrays:
        what = f"{where}: array {variable.get('name')!r} (line {variable.sourceline})"
        texts = [_size(dimension, sizes, what) for dimension in variable.findall("Dimension")]
        for text in texts:
            if not _SIZE.fullmatch(text):
                raise ArchiveError(f"{what}: a dimension of {text!r} is not a size: it must be an integer from 0 on")
        elements = 1
        for text in texts:
            elements *= int(text)
        total += elements
        if total > MOST_ELEMENTS:
            shown = " x ".join(str(int(text)) for text in texts)
            raise ArchiveError(f"{what} has {shown} elements; an FMU can have {MOST_ELEMENTS} of arrays in all")
        starts = len((variable.get("start") or "").split())
        if starts not in (0, 1, elements):
            findings.append(f"{what} has {elements} elements but {starts} start values".removeprefix(f"{where}: "))
    return findings


def _size(dimension: etree._Element, variables: dict[str | None, etree._Element], what: str) -> str:
    """The text of a dimension's size: its own, or the start value of the structural parameter that it names."""
    start, reference = dimension.get("start"), dimension.get("valueReference")
    if start is not None:
        return start
    named = variables.get(reference)
    if named is None:
        raise ArchiveError(f"{what}: a dimension names valueReference {reference!r}, which no variable has")
    size = named.get("start")
    if size is None:
        raise ArchiveError(f"{what}: a dimension is {named.get('name')!r}, which has no start value")
    return size
