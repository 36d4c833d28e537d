"""Keeps the runs of a plant in a file, so that a tuning that was interrupted goes on without measuring them again.

A tuning decides by what it measures alone. Where the first runs are those of a file, bit for bit, it takes the same decisions, and
goes on with the first run that is not there: the result is that of a tuning that was never interrupted.
"""

from __future__ import annotations

import hashlib
import io
import sqlite3
from collections.abc import Callable, ItemsView, Iterator, Mapping
from contextlib import contextmanager
from pathlib import Path
from typing import Any, Protocol

import numpy as np

from shaper_fmu.errors import ArgumentError
from shaper_fmu.master.results import Results
from shaper_fmu.master.signals import Table
from shaper_fmu.master.structure import SystemStructure

FILE = "experiment.sqlite"
"""Its name in the folder of a tuning."""
_MOST_VALUES = 2_000_000
"""Of a run that is kept: 16 MB."""
_TABLES = """
    create table facts (name text primary key, value text not null);
    create table runs (key text primary key, content blob not null);
"""


class Memory:
    """The runs of one tuning that may be asked for again, as far as they are not too many."""

    def __init__(self) -> None:
        self._runs: dict[str, tuple[np.ndarray, ...]] = {}
        self._room = _MOST_VALUES

    def found(self, key: str) -> tuple[np.ndarray, ...] | None:
        """The arrays that were kept under a key; None for none."""
        return self._runs.get(key)

    def items(self) -> ItemsView[str, tuple[np.ndarray, ...]]:
        """Keys and arrays."""
        return self._runs.items()

    def keep(self, key: str, *arrays: np.ndarray) -> None:
        """Keep arrays under a key, if there is room."""
        size = sum(one.size for one in arrays)
        if size <= self._room:
            self._room -= size
            self._runs[key] = arrays


class RunsBeside(Protocol):
    """Where runs of a plant are kept, and those that are there are taken from."""

    path: Path

    def found(self, key: str) -> tuple[np.ndarray, ...] | None:
        """The arrays that were kept under a key; None for none."""
        ...

    def keep(self, key: str, *arrays: np.ndarray) -> None:
        """Keep arrays under a key."""
        ...

    def close(self) -> None:
        """Close it."""
        ...


class RunsToRead:
    """The runs in a file that another process may be writing."""

    def __init__(self, path: Path):
        self._path = path
        with _told(path):
            self._connection = sqlite3.connect(f"{path.resolve().as_uri()}?mode=ro", uri=True, isolation_level=None)

    def found(self, key: str) -> tuple[np.ndarray, ...] | None:
        """The arrays that were kept under a key; None for none."""
        with _told(self._path):
            return _found(self._connection, key)

    def close(self) -> None:
        """Close the file."""
        self._connection.close()


def _found(connection: sqlite3.Connection, key: str) -> tuple[np.ndarray, ...] | None:
    row = connection.execute("select content from runs where key = ?", (key,)).fetchone()
    if row is None:
        return None
    with np.load(io.BytesIO(row[0]), allow_pickle=False) as stored:
        return tuple(stored[name] for name in stored.files)


class KeptRuns:
    """The runs in a file, which is made with the first one.

    Args:
        path: of the file; its folder is made where it is missing.
        facts: what the runs rest on, by name, in words: files, inputs, ranges, the version.
        resume: whether to go on from what is in the file; else that is deleted, with the first run.

    Attributes:
        path: of the file.
        resumed: runs that were there at the beginning; 0 if they are to be deleted.
        replaced: runs that are deleted.

    With `resume` ArgumentError is raised where there is no such file, where facts differ, naming each with its value then and now,
    and where the file is none of this kind or is being written by another tuning.
    """

    def __init__(self, path: Path | str, facts: Mapping[str, str], *, resume: bool = False):
        self.path: Path = Path(path)
        self._facts = dict(facts)
        self._connection: sqlite3.Connection | None = None
        self.resumed: int = 0
        self.replaced: int = 0
        if resume:
            if not self.path.is_file():
                raise ArgumentError(f"{self.path}: there is no such file to resume from; leave --resume (resume) out to begin anew")
            self._connection = self._opened()
            self._check()
            self.resumed = self._count()
        elif self.path.is_file():
            try:
                self._connection = self._opened()
                self.replaced = self._count()
            except ArgumentError:
                self.replaced = 0
            self.close()

    def found(self, key: str) -> tuple[np.ndarray, ...] | None:
        """The arrays that were kept under a key; None for none."""
        if self._connection is None:
            return None
        with _told(self.path):
            return _found(self._connection, key)

    def keep(self, key: str, *arrays: np.ndarray) -> None:
        """Keep arrays under a key; a run that is too large is left out, and will be measured again."""
        if sum(one.size for one in arrays) > _MOST_VALUES:
            return
        content = io.BytesIO()
        np.savez_compressed(content, *arrays)
        with _told(self.path):
            if self._connection is None:
                self._connection = self._begun()
            self._connection.execute("insert or replace into runs values (?, ?)", (key, content.getvalue()))

    def close(self) -> None:
        """Close the file."""
        if self._connection is not None:
            self._connection.close()
        self._connection = None

    def _opened(self) -> sqlite3.Connection:
        connection = sqlite3.connect(self.path, isolation_level=None)  # each row is written when it is known
        try:
            with _told(self.path):
                # the end of the process loses nothing, that of the machine may
                connection.execute("pragma synchronous = off")
        except ArgumentError:
            connection.close()
            raise
        return connection

    def _begun(self) -> sqlite3.Connection:
        self.path.parent.mkdir(parents=True, exist_ok=True)
        self.path.unlink(missing_ok=True)
        connection = self._opened()
        connection.executescript(f"begin; {_TABLES}")
        connection.executemany("insert into facts values (?, ?)", self._facts.items())
        connection.execute("commit")
        return connection

    def _check(self) -> None:
        assert self._connection is not None
        with _told(self.path, self.close):
            then = dict(self._connection.execute("select name, value from facts").fetchall())
        names = [name for name in {**then, **self._facts} if then.get(name) != self._facts.get(name)]
        if names:
            parts = [f"{name}: then {then.get(name, 'none')}, now {self._facts.get(name, 'none')}" for name in names]
            self.close()
            raise ArgumentError(
                f"{self.path} is of another tuning, and cannot be resumed: {'; '.join(parts)}. Give what was given then, or begin "
                "anew without --resume (resume)"
            )

    def _count(self) -> int:
        assert self._connection is not None
        with _told(self.path, self.close):
            return int(self._connection.execute("select count(*) from runs").fetchone()[0])


@contextmanager
def _told(path: Path, close: Callable[[], None] = lambda: None) -> Iterator[None]:
    """Tells an error of SQLite as one of this file, which is closed."""
    try:
        yield
    except sqlite3.Error as error:
        close()
        raise ArgumentError(f"{path} cannot be used for the runs of a tuning: {error}") from error


def run_key(system: SystemStructure, *details: Any) -> str:
    """A text that two runs share if they are the same: of the system with all its values and tables, and of the details.

    "" for a system with an input from a Python function, which is not known by its values.
    """
    signals = []
    for port, one in system.signals.items():
        if not isinstance(one, Table):
            return ""
        signals.append((port, one.times.tobytes(), one.values.tobytes(), one.linear))
    parts = [wiring_of(system), sorted(signals), _plain(details)]
    return hashlib.sha256(repr(parts).encode()).hexdigest()


def wiring_of(system: SystemStructure) -> str:
    """All of a system but its external signals, as a text."""
    fmus = {name: (one.digest, one.interface, sorted(one.structure.items())) for name, one in system.fmus.items()}
    parts = [
        fmus, {name: sorted(_plain(values).items()) for name, values in system.start_values.items()}, system.connections,
        system.scalings, system.mappings, system.clock_connections, sorted(system.readable.items()),
    ]  # fmt: skip
    return repr([*parts, list(system.event_outputs), sorted(system.without_event_mode)])


def _plain(value: Any) -> Any:
    """The same with floats of Python, which are written to the last bit."""
    if isinstance(value, Mapping):
        return {name: _plain(one) for name, one in value.items()}
    if isinstance(value, list | tuple):
        return [_plain(one) for one in value]
    return value.item() if isinstance(value, np.generic) else value


def to_arrays(results: Results, names: list[str]) -> tuple[np.ndarray, np.ndarray]:
    """Times (n,) and the values of these names (n, m) of a run."""
    return results.time, np.column_stack([results[name] for name in names])


def from_arrays(arrays: tuple[np.ndarray, ...], names: list[str]) -> Results:
    """The run of `to_arrays`."""
    time, values = arrays
    return Results(time, {name: np.ascontiguousarray(values[:, k]) for k, name in enumerate(names)})
