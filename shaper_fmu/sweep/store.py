"""The store of a sweep: one SQLite file with the study, the outcome of each run, and the provenance.

Table "run" has a row for each run that was done or has failed: its case, the varied values (columns of their names), status,
metrics (columns of their names), reason, seconds and how often it was tried. What is planned follows from the study, and from
table "added" for the runs of refinements. One process writes; a lock beside the file keeps a second one out.
"""

from __future__ import annotations

import json
import os
import sqlite3
import tempfile
from collections.abc import Iterable, Iterator, Sequence
from contextlib import suppress
from pathlib import Path
from typing import Any

from shaper_fmu.errors import StudyError
from shaper_fmu.sweep.plan import Value
from shaper_fmu.sweep.runs import Outcome, Task
from shaper_fmu.sweep.store_file import StoreLock, open_to_read
from shaper_fmu.sweep.stored import FORMAT, Stored, column_names, quoted
from shaper_fmu.sweep.study import Study


class Store(Stored):
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
        varied = "".join(f", {quoted(names[name])}" for name in study.vary)
        metrics = "".join(f", {quoted(names[name])} REAL" for name in study.metrics)
        self._database.execute(
            f"CREATE TABLE run (id INTEGER PRIMARY KEY, compared TEXT NOT NULL{varied}, status TEXT NOT NULL{metrics}, "
            "reason TEXT, seconds REAL, attempts INTEGER NOT NULL)"
        )
        self._database.execute(f"CREATE TABLE added (id INTEGER PRIMARY KEY, compared TEXT NOT NULL{varied})")

    def remark(self, key: str, value: str) -> None:
        """Enter something that a reader should know; see `remarks`."""
        with self._named_errors(), self._database:
            self._database.execute("INSERT OR REPLACE INTO study VALUES (?, ?)", (f"note {key}", value))

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
