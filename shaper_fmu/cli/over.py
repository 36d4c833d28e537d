"""`shaper-fmu run --over FILE`: earlier runs of the same system or FMU over this one, from the tables that `--output` wrote."""

from __future__ import annotations

import csv
from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import TYPE_CHECKING

import numpy as np
import typer

from shaper_fmu.cli.arguments import input_file, wrong_usage
from shaper_fmu.console import err
from shaper_fmu.errors import ShaperFmuError
from shaper_fmu.spreadsheets import plain_text

if TYPE_CHECKING:
    from shaper_fmu.master.results import Results

OPTION = "--over"
HELP = "An earlier run's table (.csv or .parquet of --output), as FILE or NAME=FILE, drawn over this run; may be repeated."
THIS = "this run"

Table = dict[str, np.ndarray]


def read_earlier(given: Sequence[str]) -> dict[str, Table]:
    """The tables by name: "time" and the variables. Raises BadParameter for a file that is none of `run`, or a name given twice."""
    found: dict[str, Table] = {}
    for text in given:
        name, equals, file = text.partition("=")
        path = Path(file if equals else text)
        name = name if equals else path.stem
        if name in found or name == THIS:
            raise typer.BadParameter(f"{name} is the name of another run; write NAME={path}", param_hint=OPTION)
        try:
            input_file(".csv", ".parquet")(path)
        except typer.BadParameter as error:
            raise typer.BadParameter(error.message, param_hint=OPTION) from None
        with wrong_usage(OPTION):
            found[name] = _read(path)
    return found


def _read(path: Path) -> Table:
    if path.suffix.lower() == ".parquet":
        from shaper_fmu.tune.identify.measured_table import read_table

        columns = dict(read_table(path).columns)
    else:
        columns = _read_csv(path)
    if next(iter(columns), "") != "time" or len(columns) < 2 or not len(columns["time"]):
        raise ShaperFmuError(
            f"{path}: its first column is not the time, or nothing follows it; give a table that `run --output` wrote"
        )
    return columns


def _read_csv(path: Path) -> Table:
    try:
        with open(path, newline="", encoding="utf-8-sig") as stream:
            head, *rows = list(csv.reader(stream)) or [[]]
        numbers = np.array(rows, dtype=float).reshape(len(rows), len(head))
    except (OSError, ValueError) as error:
        raise ShaperFmuError(f"{path}: no table of numbers under one line of names: {error}") from None
    return {plain_text(name): column for name, column in zip(head, numbers.T, strict=True)}


def laid_over(results: Results, earlier: Mapping[str, Table]) -> dict[str, Results]:
    """This run and the earlier ones by name, in this run's units; what an earlier run has besides is left out, and told."""
    from shaper_fmu.master.results import Results

    runs = {THIS: results}
    for name, table in earlier.items():
        common = {variable: table[variable] for variable in results.values if variable in table}
        others = [variable for variable in table if variable not in results.values and variable != "time"]
        lacks = [variable for variable in results.values if variable not in table]
        if not common:
            raise typer.BadParameter(f"{name} has no variable of this run: {', '.join(others[:5])}", param_hint=OPTION)
        for words, left in (("has besides", others), ("does not have", lacks)):
            if left:
                err.print(f"note: {name} {words} {', '.join(left[:5])}{', ...' if len(left) > 5 else ''}")
        runs[name] = Results(table["time"], common, results.units, results.display_units)
    return runs
