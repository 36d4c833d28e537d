"""Tables of measured values: CSV as instruments and spreadsheets write it, and Parquet."""

from __future__ import annotations

import csv
import re
from collections.abc import Mapping
from dataclasses import dataclass, field
from pathlib import Path

import numpy as np

from shaper_fmu.analysis.identification import Finding, IdentificationError
from shaper_fmu.errors import ShaperFmuError, nearest
from shaper_fmu.spreadsheets import plain_text

_COMMENT = re.compile(r"^\s*(?:#|%|//)\s*")
_UNIT = re.compile(r"^\s*[\[(]([^\])]*)[\])]\s*$")
_SEEN = 100
"""Lines in which quotes are looked for, before they are read quickly."""
_HEADER = re.compile(r"^\s*(?P<name>.*?)\s*(?:[\[(](?P<unit>[^\])]*)[\])])?\s*$")


@dataclass(frozen=True)
class Table:
    """Columns of numbers by name, each of shape (n,), their units, if the header has them, and what was assumed in reading them."""

    columns: Mapping[str, np.ndarray]
    units: Mapping[str, str] = field(default_factory=dict)
    notes: tuple[Finding, ...] = ()

    @property
    def names(self) -> list[str]:
        """Of the columns, in order."""
        return list(self.columns)

    def __getitem__(self, name: str) -> np.ndarray:
        """A column. Raises IdentificationError with the nearest name."""
        if name not in self.columns:
            raise IdentificationError(f"the table has no column {name!r}.{nearest(name, self.names)}")
        return self.columns[name]


def read_table(path: Path | str) -> Table:
    """The table in a .parquet file, or in a CSV file of any other name: separated by commas, semicolons, tabs or blanks.

    The header is the line before the numbers, be it a comment ("#time,accel_x") or not; a second one may hold the units in
    brackets. A unit may follow a name in brackets, and an apostrophe that guards spreadsheets against a formula is no part of it.
    Without a header columns are called column1, ..., and a note says so. With semicolons or tabs a decimal comma is understood.
    Raises IdentificationError with the line of what is not a number.
    """
    path = Path(path)
    if path.suffix.lower() == ".parquet":
        return _parquet(path)
    try:
        lines = path.read_text(encoding="utf-8-sig").splitlines()
    except (OSError, UnicodeDecodeError) as error:
        raise IdentificationError(f"{path}: {getattr(error, 'strerror', None) or error}") from None
    told = [(number, line.strip()) for number, line in enumerate(lines, 1) if line.strip(" ,;\t")]
    if not told:
        raise IdentificationError(f"{path}: the file is empty")
    comments = [_COMMENT.match(line) is not None for _, line in told]
    first = next((k for k, comment in enumerate(comments) if not comment), len(told))
    shown = told[first][1] if first < len(told) else told[-1][1]
    layout = _Layout.of(shown)
    head: list[str] = []
    notes: list[Finding] = []
    if first < len(told) and layout.is_numeric(shown):
        above = _COMMENT.sub("", told[first - 1][1]) if first else ""
        head = layout.cells(above) if above and len(layout.cells(above)) == len(layout.cells(shown)) else []
        if not head:
            head = [f"column{k + 1}" for k in range(len(layout.cells(shown)))]
            notes.append(Finding("no_header", f"{path.name} has no header: its columns are called {head[0]} to {head[-1]}"))
    else:
        head, first = layout.cells(_COMMENT.sub("", shown)), first + 1
        if first < len(told) and (units := layout.units(told[first][1], len(head))):
            head, first = [f"{name} [{unit}]" for name, unit in zip(head, units, strict=True)], first + 1
    body = [(number, line) for number, line in told[first:] if _COMMENT.match(line) is None]
    if not body:
        raise IdentificationError(f"{path}: there is no row of numbers")
    rows = _quickly([line for _, line in body], layout, len(head))
    if rows is None:  # slowly, so that the first fault is told with its line
        rows = np.array([layout.numbers(line, len(head), f"{path}: line {number}") for number, line in body])
    return _table([plain_text(cell) for cell in head], rows, str(path), tuple(notes))


def _quickly(lines: list[str], layout: _Layout, count: int) -> np.ndarray | None:
    """The numbers of plain lines, shape (n, count); None if there is anything else in them."""
    if layout.separator != "," or any('"' in line for line in lines[:_SEEN]):
        return None
    try:
        found = np.loadtxt(lines, delimiter=",", ndmin=2, comments=None)
    except ValueError:
        return None
    return found if found.shape == (len(lines), count) else None


@dataclass(frozen=True)
class _Layout:
    """How the lines of a file are separated; "" for blanks."""

    separator: str

    @classmethod
    def of(cls, line: str) -> _Layout:
        """That of a line."""
        found = max(";\t,", key=line.count)
        return cls(found if found in line or len(line.split()) < 2 else "")

    def cells(self, line: str) -> list[str]:
        """The texts of a line."""
        if not self.separator:
            return line.split()
        return [cell.strip() for cell in next(csv.reader([line], delimiter=self.separator))]

    def number(self, cell: str) -> float:
        """A cell's number. Raises ValueError."""
        return float(cell.replace(",", ".") if self.separator != "," else cell)

    def is_numeric(self, line: str) -> bool:
        """Whether a line holds nothing but numbers."""
        try:
            return bool([self.number(cell) for cell in self.cells(line)])
        except ValueError:
            return False

    def units(self, line: str, count: int) -> list[str]:
        """The units in a line that has nothing but bracketed ones; else none."""
        cells = [_UNIT.match(cell) for cell in self.cells(line)]
        return [match[1].strip() for match in cells if match] if len(cells) == count and all(cells) else []

    def numbers(self, line: str, count: int, where: str) -> list[float]:
        """The numbers of a line. Raises IdentificationError."""
        cells = self.cells(line)
        if len(cells) != count:
            raise IdentificationError(f"{where}: {len(cells)} values, where the header has {count}")
        found = []
        for cell in cells:
            try:
                found.append(self.number(cell))
            except ValueError:
                raise IdentificationError(f"{where}: {cell!r} is not a number") from None
        return found


def _parquet(path: Path) -> Table:
    try:
        from pyarrow import ArrowException, parquet
    except ImportError:
        raise ShaperFmuError("Parquet files need the package pyarrow: pip install 'shaper-fmu[parquet]'") from None
    try:
        found = parquet.read_table(path)
        values = np.column_stack([np.asarray(found[name].to_numpy(), float) for name in found.column_names])
    except (OSError, ArrowException, ValueError, TypeError) as error:
        raise IdentificationError(f"{path}: {error}") from None
    return _table(found.column_names, values, str(path))


def _table(header: list[str], values: np.ndarray, where: str, notes: tuple[Finding, ...] = ()) -> Table:
    names, units = [], {}
    for cell in header:
        match = _HEADER.match(cell)
        name = (match["name"] if match else cell) or f"column{len(names) + 1}"
        if name in names:
            raise IdentificationError(f"{where}: there are two columns {name!r}")
        names.append(name)
        if match and match["unit"]:
            units[name] = match["unit"].strip()
    return Table({name: values[:, j] for j, name in enumerate(names)}, units, notes)
