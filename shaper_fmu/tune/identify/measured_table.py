"""Tables of measured values: CSV as instruments and spreadsheets write it, and Parquet."""

from __future__ import annotations

import csv
import re
from collections.abc import Mapping
from dataclasses import dataclass, field
from pathlib import Path

import numpy as np

from shaper_fmu.analysis.identification import IdentificationError
from shaper_fmu.errors import ShaperFmuError, nearest
from shaper_fmu.spreadsheets import plain_text

_HEADER = re.compile(r"^\s*(?P<name>.*?)\s*(?:[\[(](?P<unit>[^\])]*)[\])])?\s*$")


@dataclass(frozen=True)
class Table:
    """Columns of numbers by name, each of shape (n,), and their units, if the header has them."""

    columns: Mapping[str, np.ndarray]
    units: Mapping[str, str] = field(default_factory=dict)

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
    """The table in a .parquet file, or in a CSV file of any other name: separated by commas, semicolons or tabs.

    The first line is the header; a unit may follow a name in brackets, and an apostrophe that guards spreadsheets against a
    formula is no part of it. With semicolons or tabs a decimal comma is understood.
    Raises IdentificationError with the line of what is not a number.
    """
    path = Path(path)
    if path.suffix.lower() == ".parquet":
        return _parquet(path)
    try:
        lines = path.read_text(encoding="utf-8-sig").splitlines()
    except (OSError, UnicodeDecodeError) as error:
        raise IdentificationError(f"{path}: {getattr(error, 'strerror', None) or error}") from None
    lines = [line if line.strip(" ,;\t") else "" for line in lines]
    if not any(lines):
        raise IdentificationError(f"{path}: the file is empty")
    first = next(i for i, line in enumerate(lines) if line)
    separator = max(";\t,", key=lines[first].count)
    comma = separator != ","
    header = [plain_text(cell) for cell in next(csv.reader([lines[first]], delimiter=separator))]
    rows = []
    for number, line in enumerate(lines[first + 1 :], first + 2):
        if line:
            rows.append(_numbers(line, separator, comma, len(header), f"{path}: line {number}"))
    if not rows:
        raise IdentificationError(f"{path}: there is no row of numbers")
    return _table(header, np.array(rows), str(path))


def _numbers(line: str, separator: str, comma: bool, count: int, where: str) -> list[float]:
    cells = next(csv.reader([line], delimiter=separator))
    if len(cells) != count:
        raise IdentificationError(f"{where}: {len(cells)} values, where the header has {count}")
    found = []
    for cell in cells:
        try:
            found.append(float(cell.strip().replace(",", ".") if comma else cell))
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


def _table(header: list[str], values: np.ndarray, where: str) -> Table:
    names, units = [], {}
    for cell in header:
        match = _HEADER.match(cell)
        name = (match["name"] if match else cell) or f"column{len(names) + 1}"
        if name in names:
            raise IdentificationError(f"{where}: there are two columns {name!r}")
        names.append(name)
        if match and match["unit"]:
            units[name] = match["unit"].strip()
    return Table({name: values[:, j] for j, name in enumerate(names)}, units)
