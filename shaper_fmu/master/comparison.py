"""Runs beside each other: the same variables of several results."""

from __future__ import annotations

from collections.abc import Iterable, Mapping
from dataclasses import dataclass
from typing import Any

from shaper_fmu.errors import ArgumentError, ShaperFmuError
from shaper_fmu.master.results import Results


@dataclass(frozen=True, repr=False)
class Comparison:
    """Runs by name, see `compare`."""

    runs: Mapping[str, Results]

    def plot(self, names: Iterable[str] | str | None = None, axes: Any = None) -> Any:
        """Draw variables of all runs over each other, one picture per unit; without names all that change in any run.

        See `Results.plot` for axes, what is returned, and errors.
        """
        from shaper_fmu.master.time_figures import time_figures
        from shaper_fmu.notebook.plots import plot

        return plot(time_figures(self.runs, names), axes)

    def to_pandas(self) -> Any:
        """A pandas.DataFrame with the columns (run, variable) over the time [s]: NaN at times that a run does not have.

        Needs the package pandas. Raises ArgumentError for a run with events, which has times twice.
        """
        try:
            import pandas
        except ImportError:
            raise ShaperFmuError("to_pandas needs the package pandas: pip install 'shaper-fmu[pandas]'") from None
        frames = {}
        for name, results in self.runs.items():
            frames[name] = results.to_pandas()
            if not frames[name].index.is_unique:
                message = "times are there twice, before and after a jump; take results.to_pandas() of each run"
                raise ArgumentError(f"{name}: {message}")
        return pandas.concat(frames, axis=1)

    def __repr__(self) -> str:
        from shaper_fmu.notebook.texts import listed

        return f"<Comparison of {listed([repr(name) for name in self.runs])}>"

    def _repr_html_(self) -> str:
        from shaper_fmu.master.time_figures import number_text
        from shaper_fmu.notebook.html import page
        from shaper_fmu.page.blocks import Table

        rows = []
        for name in dict.fromkeys(name for results in self.runs.values() for name in results.values):
            for run, results in self.runs.items():
                if name in results.values and len(results.time):
                    column, unit = results.display(name)
                    rows.append([name, run, *(number_text(v) for v in (column[-1], column.min(), column.max())), unit])
        metrics = list(dict.fromkeys(name for results in self.runs.values() for name in results.metrics))
        found = [[run, *(f"{r.metrics[m]:.6g}" if m in r.metrics else "" for m in metrics)] for run, r in self.runs.items()]
        tables = [Table("Metrics", ["run", *metrics], found)] if metrics else []
        head = ["variable", "run", "at the end", "least", "greatest", "unit"]
        return page(f"Comparison of {len(self.runs)} runs", {}, [*tables, Table("", head, rows)])


def compare(runs: Mapping[str, Results]) -> Comparison:
    """Results beside each other, to be plotted over each other: compare({"unshaped": a, "ZV": b}).plot("plant.position").

    Raises ArgumentError unless it is a mapping of names to results.
    """
    if not isinstance(runs, Mapping) or not runs:
        raise ArgumentError(f'compare({runs!r:.60}): runs by name are needed, such as {{"unshaped": a, "ZV": b}}')
    for name, one in runs.items():
        if not isinstance(one, Results):
            raise ArgumentError(f"compare: {name!r} is no Results but {one!r:.60}; give what System.simulate has returned")
    return Comparison(dict(runs))
