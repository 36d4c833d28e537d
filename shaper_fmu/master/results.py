"""The results of a run: the recorded variables over time."""

from __future__ import annotations

import csv
from collections.abc import ItemsView, Iterable, Iterator, KeysView, Mapping
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any

import numpy as np

from shaper_fmu.archives import write_file
from shaper_fmu.drafts import draft_of
from shaper_fmu.errors import ModelError, ShaperFmuError, nearest
from shaper_fmu.spreadsheets import safe_text


@dataclass(frozen=True, repr=False)
class Results:
    """Recorded variables of a run: results["plant.position"], `for name in results`, `results.items()`, `results.plot()`.

    Attributes:
        time: communication points [s], shape (n,).
        values: "instance.variable" -> values at those points, each of shape (n,).
        units: "instance.variable" -> unit, "" if it has none.
        display_units: "instance.variable" -> the unit for people, and its factor: shown = value * factor.
        notes: what a number may rest on: how events were treated, where not exactly, inputs that nothing fed, and the like.
        metrics: the metrics that were asked for, by name.
        stepping_time: wall time of the steps alone [s]; 0 for a run in a process of its own.
    """

    time: np.ndarray
    values: Mapping[str, np.ndarray]
    units: Mapping[str, str] = field(default_factory=dict)
    display_units: Mapping[str, tuple[str, float]] = field(default_factory=dict)
    notes: tuple[str, ...] = ()
    metrics: Mapping[str, float] = field(default_factory=dict)
    stepping_time: float = field(default=0.0, compare=False)

    def __getitem__(self, name: str) -> np.ndarray:
        """The values of "instance.variable"; "time" for the time. Raises ModelError with the nearest name."""
        if name == "time":
            return self.time
        if not isinstance(name, str):
            raise ModelError([f"results[{name!r:.40}]: a name is needed, such as results[{next(iter(self.values), 'time')!r}]"])
        if name not in self.values:
            raise ModelError([f"{name!r} was not recorded.{nearest(name, self.values)}"])
        return self.values[name]

    def __iter__(self) -> Iterator[str]:
        return iter(self.values)

    def __len__(self) -> int:
        return len(self.values)

    def __bool__(self) -> bool:
        return True  # a run that has recorded nothing is a run, too

    def __contains__(self, name: object) -> bool:
        return name in self.values

    def keys(self) -> KeysView[str]:
        """The names of the recorded variables, "instance.variable"; the time is none of them."""
        return self.values.keys()

    def items(self) -> ItemsView[str, np.ndarray]:
        """Names and values."""
        return self.values.items()

    def display(self, name: str) -> tuple[np.ndarray, str]:
        """The values in the unit in which people want to see them, and that unit."""
        unit, factor = self.display_units.get(name, (self.units.get(name, ""), 1.0))
        return self[name] * factor, unit

    def to_csv(self, path: Path | str) -> None:
        """Write a CSV table with a header of names and every value to its last digit."""
        path = Path(path)
        with draft_of(path) as draft, open(draft, "w", newline="", encoding="utf-8") as stream:
            writer = csv.writer(stream, lineterminator="\n")
            writer.writerow(["time", *map(safe_text, self.values)])
            writer.writerows(
                zip(*[[repr(x) for x in column.tolist()] for column in (self.time, *self.values.values())], strict=True)
            )

    def to_parquet(self, path: Path | str) -> None:
        """Write a Parquet table of 64-bit numbers, with each column's unit in its metadata. Needs the package pyarrow."""
        try:
            import pyarrow
            from pyarrow import parquet
        except ImportError:
            raise ShaperFmuError("to_parquet needs the package pyarrow: pip install 'shaper-fmu[parquet]'") from None
        units = {"time": "s", **{name: self.units.get(name, "") for name in self.values}}
        schema = pyarrow.schema([pyarrow.field(name, pyarrow.float64(), metadata={"unit": unit}) for name, unit in units.items()])
        stream = pyarrow.BufferOutputStream()
        parquet.write_table(pyarrow.table([self.time, *self.values.values()], schema=schema), stream)
        write_file(Path(path), stream.getvalue().to_pybytes())

    def plot(self, names: Iterable[str] | str | None = None, axes: Any = None) -> Any:
        """Draw variables over time, one picture per unit, in the units for people; without names all that change.

        `axes`: of matplotlib, one for each picture; new ones by default. Returns them: one, or an array. Raises ModelError for an
        unknown name, ArgumentError where nothing is to be seen, ShaperFmuError without the package matplotlib.
        """
        from shaper_fmu.master.time_figures import time_figures
        from shaper_fmu.notebook.plots import plot

        return plot(time_figures({"": self}, names), axes)

    def to_pandas(self) -> Any:
        """A pandas.DataFrame over the index "time" [s], with units in its `attrs["units"]`. Needs the package pandas."""
        try:
            import pandas
        except ImportError:
            raise ShaperFmuError("to_pandas needs the package pandas: pip install 'shaper-fmu[pandas]'") from None
        frame = pandas.DataFrame(dict(self.values), index=pandas.Index(self.time, name="time"))
        frame.attrs["units"] = {"time": "s", **{name: self.units.get(name, "") for name in self.values}}
        return frame

    def to_xarray(self) -> Any:
        """An xarray.Dataset over the coordinate "time", with units as attributes. Needs the package xarray."""
        try:
            import xarray
        except ImportError:
            raise ShaperFmuError("to_xarray needs the package xarray: pip install 'shaper-fmu[xarray]'") from None
        variables = {name: ("time", column, {"units": self.units.get(name, "")}) for name, column in self.values.items()}
        return xarray.Dataset(variables, coords={"time": ("time", self.time, {"units": "s"})})

    def __repr__(self) -> str:
        from shaper_fmu.notebook.texts import counted, listed

        span = f"{counted(len(self.time), 'point')} from {self.time[0]:g} to {self.time[-1]:g} s" if len(self.time) else "no points"
        return f"<Results: {span}; {listed(list(self.values)) or 'no variables'}>"

    def _repr_html_(self) -> str:
        from shaper_fmu.master.time_figures import number_text
        from shaper_fmu.notebook.html import page
        from shaper_fmu.page.blocks import Table

        rows = []
        for name in self.values if len(self.time) else ():
            column, unit = self.display(name)
            rows.append([name, *(number_text(v) for v in (column[0], column[-1], column.min(), column.max())), unit])
        facts = {
            "time": f"{self.time[0]:g} to {self.time[-1]:g} s, {len(self.time)} points" if len(self.time) else "no points",
            **{f"metric {name}": f"{value:.6g}" for name, value in self.metrics.items()},
            "notes": "; ".join(self.notes),
        }
        return page("Results", facts, [Table("", ["variable", "first", "last", "least", "greatest", "unit"], rows)])
