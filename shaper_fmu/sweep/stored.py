"""Reads a sweep's store: its study, and the outcome of each run. `store.py` writes it."""

from __future__ import annotations

import itertools
import json
import sqlite3
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path
from typing import Any

import msgspec
import numpy as np

from shaper_fmu.errors import StudyError
from shaper_fmu.metrics.known import METRICS
from shaper_fmu.sweep.runs import Run, Task
from shaper_fmu.sweep.store_file import error_message
from shaper_fmu.sweep.study import Study

FORMAT = 3
_OWN = ("id", "compared", "status", "reason", "seconds", "attempts")
_PAGE = 10_000


class Stored:
    """What can be read of a store whose file is open."""

    path: Path
    _database: sqlite3.Connection
    _study: Study

    @contextmanager
    def _named_errors(self) -> Iterator[None]:
        """Turns SQLite's errors into StudyError with a message."""
        try:
            yield
        except sqlite3.Error as error:
            raise StudyError(f"{self.path}: {error_message(error)}") from None

    def _check_format(self) -> None:
        found = self._value("format")
        if found != str(FORMAT):
            which = f"format {found!r}" if found else "no format"
            raise StudyError(
                f"{self.path}: a store of another version of shaper-fmu ({which}, this version has {FORMAT}); "
                "use that version, or sweep again into another store"
            )

    def _value(self, key: str) -> str | None:
        row = self._database.execute("SELECT value FROM study WHERE key = ?", (key,)).fetchone()
        return row[0] if row else None

    def _stored_study(self) -> Study:
        text = self._value("study")
        if text is None:
            raise StudyError(f"{self.path}: this store holds no study")
        try:
            study = msgspec.json.decode(text, type=Study)
            _ = study.points
        except (msgspec.DecodeError, UnicodeDecodeError, StudyError) as error:
            strange = _unknown_kinds(text)
            if strange:
                message = f"its metrics of the kind {', '.join(strange)} are not known here; install the package that adds them"
                raise StudyError(f"{self.path}: {message}") from None
            raise StudyError(f"{self.path}: the store is damaged: its study cannot be read ({error})") from None
        study.folder = self._value("folder") or ""
        return study

    def study(self) -> Study:
        """The study as it was planned, with the folder where it was last run."""
        return self._study

    def provenance(self) -> dict[str, Any]:
        """Digests of the FMUs and the version that made the runs."""
        return json.loads(self._value("provenance") or "{}")

    def remarks(self) -> dict[str, str]:
        """The remarks on the sweep."""
        rows = self._rows("SELECT key, value FROM study WHERE key LIKE 'note %' ORDER BY key")
        return {key.removeprefix("note "): value for key, value in rows}

    def counts(self) -> dict[str, int]:
        """Number of runs by status."""
        counts: dict[str, int] = dict(self._rows("SELECT status, count(*) FROM run GROUP BY status ORDER BY status"))
        planned = self._total() - sum(counts.values())
        return {**counts, "planned": planned} if planned else counts

    def _total(self) -> int:
        return self._study.count + self.added()

    def added(self) -> int:
        """Number of runs that refinements have added to the plan."""
        return self._rows("SELECT count(*) FROM added")[0][0]

    def runs(self, status: str | None = None) -> list[Run]:
        """The runs in the plan's order, all or those of one status."""
        return list(self.iterate(status))

    def iterate(self, status: str | None = None) -> Iterator[Run]:
        """The same one by one, in flat memory."""
        ended = self._ended(status)
        if status in ("done", "failed"):
            yield from ended
            return
        run = next(ended, None) if status is None else None
        done = self._numbers_of_ended() if status is not None else None
        for task in self._tasks():
            if run is not None and run.id == task.id:
                yield run
                run = next(ended, None)
            elif done is None or not done[task.id]:
                yield Run(task.id, task.compared, dict(zip(self._study.vary, task.values, strict=True)), "planned", {}, None)

    def _ended(self, status: str | None) -> Iterator[Run]:
        """The runs of the table, page by page."""
        varied, metrics = list(self._study.vary), list(self._study.metrics)
        columns = ", ".join(f"run.{quoted(name)}" for name in [*_OWN, *column_names(self._study).values()])
        last, middle = -1, len(_OWN) + len(varied)
        while True:
            rows = self._rows(
                f"SELECT {columns} FROM run WHERE (? IS NULL OR status = ?) AND id > ? ORDER BY id LIMIT ?",
                status, status, last, _PAGE,
            )  # fmt: skip
            for row in rows:
                number, case, state, reason, seconds, attempts = row[: len(_OWN)]
                if case not in self._study.compare or state not in ("done", "failed"):
                    raise StudyError(f"{self.path}: the store is damaged: run {number} has the case {case!r}, status {state!r}")
                if state == "done" and not all(isinstance(value, float) for value in row[middle:]):
                    raise StudyError(f"{self.path}: the store is damaged: run {number} is done, and has {row[middle:]} for metrics")
                found = dict(zip(metrics, row[middle:], strict=True)) if state == "done" else {}
                values = dict(zip(varied, row[len(_OWN) : middle], strict=True))
                yield Run(number, case, values, state, found, reason, seconds, attempts)
            if len(rows) < _PAGE:
                return
            last = rows[-1][0]

    def _tasks(self) -> Iterator[Task]:
        """All runs of the plan in their order, those that have ended among them."""
        runs = itertools.chain.from_iterable(zip(itertools.repeat(case), self._study.points) for case in self._study.compare)
        for number, (case, values) in enumerate(runs):
            yield Task(number, case, values)
        for number, case, *values in self._rows("SELECT * FROM added ORDER BY id"):
            yield Task(number, case, tuple(values))

    def _numbers_of_ended(self) -> np.ndarray:
        """Whether each run of the plan has ended."""
        ended = np.zeros(self._total(), bool)
        with self._named_errors():
            for (number,) in self._database.execute("SELECT id FROM run"):
                if not 0 <= number < len(ended):
                    raise StudyError(f"{self.path}: the store is damaged: there is no run {number} in its study")
                ended[number] = True
        return ended

    def _rows(self, query: str, *values: object) -> list[Any]:
        with self._named_errors():
            return self._database.execute(query, values).fetchall()

    def plot(self, metric: str | None = None, axes: Any = None) -> Any:
        """Draw metrics of the runs that are done over the first varied value, by case; all metrics, or one.

        See `Results.plot` for axes, what is returned, and errors.
        """
        from shaper_fmu.notebook.plots import plot
        from shaper_fmu.sweep.shown import metric_figures

        return plot(metric_figures(self, metric), axes)

    def __repr__(self) -> str:
        from shaper_fmu.sweep.shown import counts_text, study_text

        try:
            counts = counts_text(self.counts())
        except StudyError:
            counts = "closed"
        return f"<Store {str(self.path)!r} of {self._study.name!r}: {study_text(self._study)}; {counts}>"

    def _repr_html_(self) -> str:
        from shaper_fmu.notebook.html import page
        from shaper_fmu.sweep.shown import cases_table, counts_text, study_facts, varied_table

        facts = {"file": str(self.path), "runs": counts_text(self.counts()), **study_facts(self._study), **self.remarks()}
        return page(f"Store of {self._study.name}", facts, [cases_table(self), varied_table(self._study)])


def _unknown_kinds(text: str) -> list[str]:
    """The kinds of metrics in a study that no installed package knows."""
    try:
        metrics = json.loads(text)["metrics"].values()
        return list(dict.fromkeys(metric["kind"] for metric in metrics if metric["kind"] not in METRICS))
    except (ValueError, KeyError, TypeError, AttributeError):
        return []


def column_names(study: Study) -> dict[str, str]:
    """The columns of start values and metrics: their names, with a number if SQLite would confuse them with earlier ones.

    SQLite does not distinguish upper and lower case: "peak" and "PEAK" are in columns "peak" and "PEAK 2".
    """
    used: set[str] = set(_OWN)
    found: dict[str, str] = {}
    for name in (*study.vary, *study.metrics):
        column, number = name, 2
        while column.lower() in used:
            column, number = f"{name} {number}", number + 1
        used.add(column.lower())
        found[name] = column
    return found


def quoted(name: str) -> str:
    escaped = name.replace('"', '""')
    return f'"{escaped}"'
