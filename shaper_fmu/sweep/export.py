"""Exports a sweep's runs as a table: CSV, Parquet, or an xarray.Dataset."""

from __future__ import annotations

import csv
from collections.abc import Callable, Iterator
from itertools import islice
from pathlib import Path
from typing import Any, TextIO

import numpy as np

from shaper_fmu.drafts import draft_of
from shaper_fmu.errors import ShaperFmuError, StudyError
from shaper_fmu.spreadsheets import safe_text
from shaper_fmu.sweep.runs import Run
from shaper_fmu.sweep.store import Store
from shaper_fmu.sweep.study import Study

_ROW_GROUP = 50_000
"""Rows of a Parquet file that are held in memory at a time."""

_TELL_AFTER = 5000

_KINDS = {float: "float64", bool: "bool", str: "string"}
Row = tuple[Any, ...]
Progress = Callable[[float, float], None]
"""Called now and then with the number of rows that are written, and of all."""


def column_kinds(study: Study) -> dict[str, type]:
    """The table's columns and what they hold, in order: run, case, start values, metrics, status, reason, seconds, attempts."""
    varied = {name: _kind_of(study, name) for name in study.vary}
    metrics = dict.fromkeys(study.metrics, float)
    return {"run": int, "case": str, **varied, **metrics, "status": str, "reason": str, "seconds": float, "attempts": int}


def _kind_of(study: Study, name: str) -> type:
    """The kind of a start value's column: numbers or truth values, or texts if there are any."""
    values = study.vary[name].values or []
    if any(isinstance(value, str) for value in values):
        return str
    return bool if values and all(isinstance(value, bool) for value in values) else float


def rows(store: Store, progress: Progress | None = None) -> Iterator[Row]:
    """A row for each run in the plan's order, one by one; None where a run has no such value."""
    total = sum(store.counts().values())
    study = store.study()
    kinds = [(name, _kind_of(study, name)) for name in study.vary]
    metrics = list(study.metrics)
    for count, run in enumerate(store.iterate()):
        if progress is not None and count % _TELL_AFTER == 0:
            progress(count, total)
        varied = (kind(run.varied[name]) for name, kind in kinds)
        found = (run.metrics.get(name) for name in metrics)
        yield (run.id, run.compared, *varied, *found, run.status, run.reason, run.seconds, run.attempts)
    if progress is not None:
        progress(total, total)


def write_csv(store: Store, path: Path | str, progress: Progress | None = None) -> int:
    """Write all runs as a CSV table, numbers with all their digits, and return how many; memory does not grow with them.

    Texts that a spreadsheet would take for formulas are behind an apostrophe (`shaper_fmu.spreadsheets.plain_text` removes it).
    """

    def write(draft: Path) -> int:
        count = 0
        with open(draft, "w", newline="", encoding="utf-8") as stream:
            writer = csv.writer(_Lines(stream), lineterminator="\r\n")
            writer.writerow(map(safe_text, column_kinds(store.study())))
            for row in rows(store, progress):
                writer.writerow([safe_text(cell) if isinstance(cell, str) else cell for cell in row])
                count += 1
        return count

    return _drafted(Path(path), write)


class _Lines:
    """Lines that end with a line feed alone, of a writer that quotes texts with any line break, as it does for both."""

    def __init__(self, stream: TextIO):
        self._stream = stream

    def write(self, line: str) -> int:
        return self._stream.write(line.removesuffix("\r\n") + "\n")


def write_parquet(store: Store, path: Path | str, progress: Progress | None = None) -> int:
    """Write all runs as a Parquet file, and return how many. Raises ShaperFmuError if the package pyarrow is missing."""
    try:
        import pyarrow
        from pyarrow import parquet
    except ImportError:
        raise ShaperFmuError("Parquet needs the package pyarrow: pip install 'shaper-fmu[parquet]'") from None
    kinds = column_kinds(store.study())
    schema = pyarrow.schema([(name, "int64" if kind is int else _KINDS[kind]) for name, kind in kinds.items()])

    def write(draft: Path) -> int:
        count, left = 0, rows(store, progress)
        with parquet.ParquetWriter(draft, schema) as writer:
            while group := list(islice(left, _ROW_GROUP)):
                columns = [
                    pyarrow.array(column, field.type) for column, field in zip(zip(*group, strict=True), schema, strict=True)
                ]
                writer.write_table(pyarrow.table(columns, schema=schema))
                count += len(group)
        return count

    return _drafted(Path(path), write)


WRITERS: dict[str, Callable[[Store, Path, Progress], int]] = {".csv": write_csv, ".parquet": write_parquet}
"""By the ending of the file's name."""


def _drafted(path: Path, write: Callable[[Path], int]) -> int:
    """Write a draft beside the file and rename it at the end, so that no reader sees half a table."""
    with draft_of(path) as draft:
        return write(draft)


def to_xarray(store: Store) -> Any:
    """The runs of a grid as an xarray.Dataset over the dimensions "case" and the start values' names.

    Its variables are the metrics (NaN where a run is not done), "status" and "seconds". Points that a refinement has added between
    those of the grid are left out. Raises StudyError for plans other than grids, ShaperFmuError if the package xarray is missing.
    """
    try:
        import xarray
    except ImportError:
        raise ShaperFmuError("to_xarray needs the package xarray: pip install 'shaper-fmu[xarray]'") from None
    study = store.study()
    if study.plan.kind != "grid":
        raise StudyError(f"{store.path}: to_xarray is for grids, and this plan is {study.plan.kind}; export it as a table instead")
    axes: dict[str, list[Any]] = {"case": list(study.compare), **{name: list(one.grid()) for name, one in study.vary.items()}}
    shape = tuple(len(values) for values in axes.values())
    arrays = {name: np.full(shape, np.nan) for name in study.metrics}
    arrays |= {"status": np.full(shape, "planned", "U7"), "seconds": np.full(shape, np.nan)}
    places = [{value: i for i, value in enumerate(values)} for values in axes.values()]
    for run in store.iterate():
        _fill(arrays, places, run)
    coordinates = {name: (name, _coordinate(values)) for name, values in axes.items()}
    variables = {name: (list(axes), array) for name, array in arrays.items()}
    return xarray.Dataset(variables, coords=coordinates, attrs={"study": study.name})


def _coordinate(values: list[Any]) -> np.ndarray:
    """The values of an axis; mixed ones stay as they are."""
    return np.array(values, None if len({type(value) for value in values}) == 1 else object)


def _fill(arrays: dict[str, np.ndarray], places: list[dict[Any, int]], run: Run) -> None:
    at = tuple(known.get(value, -1) for known, value in zip(places, (run.compared, *run.varied.values()), strict=True))
    if -1 in at:
        return
    for name, value in run.metrics.items():
        arrays[name][at] = value
    arrays["status"][at] = run.status
    if run.seconds is not None:
        arrays["seconds"][at] = run.seconds
