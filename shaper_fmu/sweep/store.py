"""The store of a sweep: one SQLite file with the plan, what became of each run, and where the numbers come from."""

from __future__ import annotations

import json
import sqlite3
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import msgspec

from shaper_fmu.errors import StudyError
from shaper_fmu.sweep.study import Study

_SCHEMA = """
CREATE TABLE IF NOT EXISTS study (key TEXT PRIMARY KEY, value TEXT NOT NULL);
CREATE TABLE IF NOT EXISTS run (
    id INTEGER PRIMARY KEY,
    compared TEXT NOT NULL,
    varied TEXT NOT NULL,
    status TEXT NOT NULL DEFAULT 'planned' CHECK (status IN ('planned', 'done', 'failed')),
    metrics TEXT,
    reason TEXT,
    seconds REAL
);
"""


@dataclass(frozen=True)
class Run:
    """One run: its place in the plan, the compared case, the varied start values, and what became of it."""

    id: int
    compared: str
    varied: dict[str, float]
    status: str
    metrics: dict[str, float]
    reason: str | None


class Store:
    """A sweep's results. Use it in a with statement; every finished run is committed at once."""

    def __init__(self, path: Path | str, study: Study | None = None, provenance: dict[str, Any] | None = None):
        """Open the store; with a study, plan its runs unless they are there.

        Raises StudyError if the file is no store, or holds another study or runs of other FMUs.
        """
        self.path = Path(path)
        if study is None and not self.path.is_file():
            raise StudyError(f"{path}: no such store; run 'shaper-fmu sweep' first")
        try:
            mode = "ro" if study is None else "rwc"
            self._database = sqlite3.connect(f"{self.path.resolve().as_uri()}?mode={mode}", uri=True)
        except sqlite3.DatabaseError as error:
            raise StudyError(f"{path}: cannot be opened: {error}") from None
        try:
            tables = {name for (name,) in self._database.execute("SELECT name FROM sqlite_master WHERE type = 'table'")}
            if tables and "study" not in tables:
                raise StudyError(f"{path}: a database, but not a sweep's store")
            if study is not None:
                self._database.execute("PRAGMA journal_mode=WAL")
                self._database.executescript(_SCHEMA)
            elif not tables:
                raise StudyError(f"{path}: this store holds no study")
            if study is not None:
                self._plan(study, provenance or {})
            elif not self._value("study"):
                raise StudyError(f"{path}: this store holds no study")
        except sqlite3.DatabaseError as error:
            self._database.close()
            raise StudyError(f"{path}: not a sweep's store: {error}") from None
        except BaseException:
            self._database.close()
            raise

    def __enter__(self) -> Store:
        return self

    def __exit__(self, *error: object) -> None:
        self._database.close()

    def _value(self, key: str) -> str | None:
        row = self._database.execute("SELECT value FROM study WHERE key = ?", (key,)).fetchone()
        return row[0] if row else None

    def _plan(self, study: Study, provenance: dict[str, Any]) -> None:
        entries = {"study": study.as_json(), "provenance": json.dumps(provenance, sort_keys=True)}
        differs = {"study": "another study", "provenance": "other FMUs or another version of shaper-fmu"}
        if self._value("study") is not None:
            for key, text in entries.items():
                if self._value(key) != text:
                    raise StudyError(f"{self.path}: holds runs of {differs[key]}; give another --store, or delete this one")
        else:
            with self._database:
                self._database.executemany("INSERT INTO study VALUES (?, ?)", entries.items())
                rows = ((i, case, json.dumps(varied)) for i, (case, varied) in enumerate(study.plan()))
                self._database.executemany("INSERT INTO run (id, compared, varied) VALUES (?, ?, ?)", rows)
        with self._database:
            self._database.execute("INSERT OR REPLACE INTO study VALUES ('folder', ?)", (str(Path(study.folder).resolve()),))

    def study(self) -> Study:
        """The study as it was planned, with the folder where it was last run."""
        study = msgspec.json.decode(self._value("study") or "", type=Study)
        study.folder = self._value("folder") or ""
        return study

    def provenance(self) -> dict[str, Any]:
        """Digests of the FMUs and the version that made the runs."""
        return json.loads(self._value("provenance") or "{}")

    def runs(self, status: str | None = None) -> list[Run]:
        """The runs in the plan's order, all or those of one status."""
        rows = self._database.execute(
            "SELECT id, compared, varied, status, metrics, reason FROM run WHERE ? IS NULL OR status = ? ORDER BY id",
            (status, status),
        )
        return [Run(i, c, json.loads(v), s, json.loads(m or "{}"), r) for i, c, v, s, m, r in rows]

    def counts(self) -> dict[str, int]:
        """Number of runs by status."""
        return dict(self._database.execute("SELECT status, count(*) FROM run GROUP BY status").fetchall())

    def finish(self, run: int, metrics: dict[str, float], seconds: float) -> None:
        """Enter the metrics of a completed run."""
        self._update(run, "done", json.dumps(metrics), None, seconds)

    def fail(self, run: int, reason: str, seconds: float) -> None:
        """Enter why a run failed."""
        self._update(run, "failed", None, reason, seconds)

    def _update(self, run: int, *values: Any) -> None:
        with self._database:
            self._database.execute("UPDATE run SET status = ?, metrics = ?, reason = ?, seconds = ? WHERE id = ?", (*values, run))
