"""The store of a sweep: one SQLite file with the study, the outcome of each run, and the provenance.

Table "run" has a row for each run that was done or has failed: its case, the varied values (columns of their names), status,
metrics (columns of their names), reason, seconds and how often it was tried. What is planned follows from the study, and from
table "added" for the runs of refinements. One process writes; a lock beside the file keeps a second one out.
"""

from __future__ import annotations

import itertools
import json
import os
import sqlite3
import tempfile
from collections.abc import Iterable, Iterator, Sequence
from contextlib import contextmanager, suppress
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import msgspec
import numpy as np

from shaper_fmu.errors import StudyError
from shaper_fmu.metrics.known import METRICS
from shaper_fmu.sweep.plan import Value
from shaper_fmu.sweep.store_file import StoreLock, error_message, open_to_read
from shaper_fmu.sweep.study import Study

FORMAT = 3
_OWN = ("id", "compared", "status", "reason", "seconds", "attempts")
_PAGE = 10_000


class Task(msgspec.Struct, frozen=True, gc=False):
    """A run to be done: its number, the case, and the varied values in the study's order."""

    id: int
    compared: str
    values: tuple[Value, ...]
    attempts: int = 0


class Outcome(msgspec.Struct, frozen=True, gc=False):
    """The outcome of a run: metrics in the study's order if it is done, otherwise the reason.

    `seconds` is how long it took; short runs that were done together share their time evenly.
    """

    id: int
    metrics: tuple[float, ...] | None
    reason: str | None
    seconds: float
    attempts: int = 1


@dataclass(frozen=True)
class Run:
    """One run as the store has it."""

    id: int
    compared: str
    varied: dict[str, Any]
    status: str
    metrics: dict[str, float]
    reason: str | None
    seconds: float | None = None
    attempts: int = 0


class Store:
    """A sweep's results. Use it in a with statement; entries are committed at once."""

    def __init__(self, path: Path | str, study: Study | None = None, provenance: dict[str, Any] | None = None):
        """Open the store; with a study, to write: it is entered unless it is there.

        Raises StudyError if the file is no store, holds another study or runs of other FMUs, or if another sweep writes to it.
        """
        self.path: Path = Path(path)
        self._lock: StoreLock | None = None
        self._copy: tempfile.TemporaryDirectory[str] | None = None
        self._given: dict[int, Task] = {}  # tasks whose outcomes are awaited
        if self.path.is_dir():
            raise StudyError(f"{path}: a folder, not a store")
        if study is None and not self.path.is_file():
            raise StudyError(f"{path}: no such store; run 'shaper-fmu sweep' first")
        is_new = not self.path.exists()
        if study is not None:
            self._lock = StoreLock(self.path)
        try:
            self._open(study, provenance or {})
        except BaseException:
            if is_new and self._lock is not None:  # half a store is none
                for ending in ("", "-wal", "-shm", "-journal"):
                    Path(f"{self.path}{ending}").unlink(missing_ok=True)
            self._release()
            raise

    def __enter__(self) -> Store:
        return self

    def __exit__(self, *error: object) -> None:
        if self._lock is not None:
            with suppress(sqlite3.Error):  # a reader may be there, or no room: then the log stays beside the store
                self._database.execute("PRAGMA journal_mode=DELETE")  # so that it can be read where nothing can be written
        self._database.close()
        self._release()

    def _release(self) -> None:
        if self._lock is not None:
            self._lock.release()
            self._lock = None
        if self._copy is not None:
            self._copy.cleanup()
            self._copy = None

    @contextmanager
    def _named_errors(self) -> Iterator[None]:
        """Turns SQLite's errors into StudyError with a message."""
        try:
            yield
        except sqlite3.Error as error:
            raise StudyError(f"{self.path}: {error_message(error)}") from None

    def _open(self, study: Study | None, provenance: dict[str, Any]) -> None:
        with self._named_errors():
            if study is None:
                self._database, self._copy = open_to_read(self.path)
            else:
                self._database = sqlite3.connect(f"{self.path.resolve().as_uri()}?mode=rwc", uri=True)
        try:
            with self._named_errors():
                tables = {name for (name,) in self._database.execute("SELECT name FROM sqlite_master WHERE type = 'table'")}
                if tables and not {"study", "run", "added"} <= tables:
                    raise StudyError(f"{self.path}: a database, but not a sweep's store")
                if not tables and study is None:
                    raise StudyError(f"{self.path}: this store holds no study")
                if tables:
                    self._check_format()
                if study is not None:
                    self._database.execute("PRAGMA journal_mode=WAL")
                    self._database.execute(
                        "PRAGMA synchronous=NORMAL"
                    )  # a killed process loses nothing; a power cut the last seconds
                    self._enter_study(study, provenance)
                self._study = self._stored_study() if study is None else study  # whose points may be there already
                self._file = os.stat(self.path)
        except BaseException:
            self._database.close()
            raise

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

    def _enter_study(self, study: Study, provenance: dict[str, Any]) -> None:
        """Enter the study, or check that the stored one is the same."""
        entries = {"study": study.as_json(), "provenance": json.dumps(provenance, sort_keys=True)}
        differs = {"study": "another study", "provenance": "other FMUs or another version of shaper-fmu"}
        with self._database:
            self._database.execute("BEGIN IMMEDIATE")
            self._database.execute("CREATE TABLE IF NOT EXISTS study (key TEXT PRIMARY KEY, value TEXT NOT NULL)")
            if self._value("study") is None:
                self._create(study)
                self._database.executemany("INSERT INTO study VALUES (?, ?)", {"format": str(FORMAT), **entries}.items())
            else:
                for key, text in entries.items():
                    if self._value(key) != text:
                        raise StudyError(f"{self.path}: holds runs of {differs[key]}; give another --store, or delete this one")
            folder = str(Path(study.folder).resolve())
            self._database.execute("INSERT OR REPLACE INTO study VALUES ('folder', ?)", (folder,))

    def _create(self, study: Study) -> None:
        names = column_names(study)
        varied = "".join(f", {_quoted(names[name])}" for name in study.vary)
        metrics = "".join(f", {_quoted(names[name])} REAL" for name in study.metrics)
        self._database.execute(
            f"CREATE TABLE run (id INTEGER PRIMARY KEY, compared TEXT NOT NULL{varied}, status TEXT NOT NULL{metrics}, "
            "reason TEXT, seconds REAL, attempts INTEGER NOT NULL)"
        )
        self._database.execute(f"CREATE TABLE added (id INTEGER PRIMARY KEY, compared TEXT NOT NULL{varied})")

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

    def remark(self, key: str, value: str) -> None:
        """Enter something that a reader should know; see `remarks`."""
        with self._named_errors(), self._database:
            self._database.execute("INSERT OR REPLACE INTO study VALUES (?, ?)", (f"note {key}", value))

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
        columns = ", ".join(f"run.{_quoted(name)}" for name in [*_OWN, *column_names(self._study).values()])
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

    def planned(self) -> Iterator[Task]:
        """The runs that are to be done, in the plan's order."""
        ended = self._numbers_of_ended()
        for task in self._tasks():
            if not ended[task.id]:
                self._given[task.id] = task
                yield task

    def enter(self, outcomes: Sequence[Outcome]) -> None:
        """Enter the outcomes of runs, all of them or none. The first outcome of a run is final."""
        self._see_file()
        rows = []
        for one in outcomes:
            task = self._given.pop(one.id, None) or self._task(one.id)
            metrics = one.metrics or (None,) * len(self._study.metrics)
            status = "failed" if one.metrics is None else "done"
            rows.append((one.id, task.compared, *task.values, status, *metrics, one.reason, one.seconds, one.attempts))
        with self._named_errors(), self._database:
            self._insert("run", rows)

    def _see_file(self) -> None:
        """Raise StudyError if the file was removed: entries would be lost with it."""
        with suppress(FileNotFoundError):
            if os.path.samestat(os.stat(self.path), self._file):
                return
        raise StudyError(f"{self.path}: the store was deleted, moved or replaced while the sweep was writing to it")

    def _task(self, number: int) -> Task:
        if number < self._study.count:
            return Task(number, *self._study.run(number))
        _, case, *values = self._rows("SELECT * FROM added WHERE id = ?", number)[0]
        return Task(number, case, tuple(values))

    def add(self, points: Iterable[tuple[str, tuple[Value, ...]]]) -> int:
        """Plan more runs, after all others; their number."""
        first = self._total()
        rows = [(first + i, case, *values) for i, (case, values) in enumerate(points)]
        with self._named_errors(), self._database:
            self._insert("added", rows)
        return len(rows)

    def _insert(self, table: str, rows: list[tuple[Any, ...]]) -> None:
        if rows:
            self._database.executemany(f"INSERT OR IGNORE INTO {table} VALUES ({', '.join('?' * len(rows[0]))})", rows)

    def retry_failed(self) -> int:
        """Plan the failed runs again; their number."""
        with self._named_errors(), self._database:
            return self._database.execute("DELETE FROM run WHERE status = 'failed'").rowcount

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


def _quoted(name: str) -> str:
    escaped = name.replace('"', '""')
    return f'"{escaped}"'
