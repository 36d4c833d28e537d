"""The file of a store: its lock, opening it for reading on any medium, and messages for SQLite's errors."""

from __future__ import annotations

import os
import shutil
import sqlite3
import sys
import tempfile
from contextlib import suppress
from pathlib import Path

from shaper_fmu.errors import StudyError

_KEPT = "what was entered before is kept"
_MESSAGES = {  # by the beginning of SQLite's name for the error
    "SQLITE_FULL": f"the disk is full; {_KEPT}: make room, and start the sweep again",
    "SQLITE_IOERR": f"the file cannot be read or written ({{}}); {_KEPT}: see that the disk has room and is whole, and start again",
    "SQLITE_CORRUPT": "the store is damaged ({}); use a copy, or sweep again into another store",
    "SQLITE_NOTADB": "not a sweep's store: {}",
    "SQLITE_READONLY": "the store cannot be written here: the medium or the file is read-only",
    "SQLITE_CANTOPEN": "the store cannot be opened, or its folder cannot be written",
    "SQLITE_PERM": "the store cannot be opened: no permission",
    "SQLITE_BUSY": "another program keeps the store locked; end it, and start the sweep again",
    "SQLITE_LOCKED": "another program keeps the store locked; end it, and start the sweep again",
    "SQLITE_NOMEM": "there is not enough memory to work with the store",
}


def error_message(error: sqlite3.Error) -> str:
    """The meaning of SQLite's error for the store, and a remedy."""
    name = getattr(error, "sqlite_errorname", None) or ""
    message = next((message for start, message in _MESSAGES.items() if name.startswith(start)), "the store is damaged, or none: {}")
    return message.format(error)


class StoreLock:
    """Keeps a second sweep out: a file beside the store, locked by the system, which frees it when a process is killed."""

    def __init__(self, store: Path):
        """Raises StudyError if another sweep has it, or if there can be none."""
        self._path = Path(f"{store.resolve()}.lock")  # one for all links to a store
        try:
            while True:
                self._file = os.open(self._path, os.O_RDWR | os.O_CREAT, 0o644)
                try:
                    _lock(self._file)
                except OSError:
                    os.close(self._file)
                    raise
                if self._is_there():
                    return
                os.close(self._file)  # of a sweep that has just ended, and has taken its file away
        except (BlockingIOError, PermissionError) as error:
            if isinstance(error, PermissionError) and not self._path.is_file():
                raise StudyError(f"{store}: cannot be written: {error.strerror}") from None
            raise StudyError(f"{store}: another sweep is writing to this store; wait for it, or give another --store") from None
        except OSError as error:
            raise StudyError(f"{store}: cannot be written: {error.strerror or error}") from None

    def _is_there(self) -> bool:
        try:
            return os.path.samestat(os.fstat(self._file), os.stat(self._path))
        except FileNotFoundError:
            return False

    def release(self) -> None:
        """Free the lock, and take the file away. Those that wait for it see that it is gone, and make another one."""
        if sys.platform == "win32":  # where open files stay
            os.close(self._file)
            with suppress(OSError):
                self._path.unlink()
        else:
            with suppress(OSError):
                self._path.unlink()
            os.close(self._file)


def _lock(file: int) -> None:
    if sys.platform == "win32":
        import msvcrt

        msvcrt.locking(file, msvcrt.LK_NBLCK, 1)
    else:
        import fcntl

        fcntl.flock(file, fcntl.LOCK_EX | fcntl.LOCK_NB)


def open_to_read(path: Path) -> tuple[sqlite3.Connection, tempfile.TemporaryDirectory[str] | None]:
    """A read-only connection; and the folder of a copy, if the store of a killed sweep is on a read-only medium.

    Such a store has its newest rows in a log, which SQLite reads with the help of a file that it cannot make there.
    """
    try:
        return _connected(path), None
    except sqlite3.OperationalError as error:
        if not error.sqlite_errorname.startswith(("SQLITE_CANTOPEN", "SQLITE_READONLY")):
            raise
    folder = tempfile.TemporaryDirectory(prefix="shaper-fmu-store-")
    try:
        for ending in ("", "-wal"):
            with suppress(FileNotFoundError):
                shutil.copyfile(f"{path}{ending}", Path(folder.name) / f"store{ending}")
        return _connected(Path(folder.name) / "store"), folder
    except BaseException:
        folder.cleanup()
        raise


def _connected(path: Path) -> sqlite3.Connection:
    database = sqlite3.connect(f"{path.resolve().as_uri()}?mode=ro", uri=True)
    try:
        database.execute("SELECT count(*) FROM sqlite_master").fetchone()
    except BaseException:
        database.close()
        raise
    return database
