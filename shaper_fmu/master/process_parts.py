"""The parts of a process that an FMU may change and that are restored; each is a class that keeps the state it finds.

`restore` undoes differences, and returns whether there were any; `close` releases the kept state.
"""

from __future__ import annotations

import locale
import os
import sys
from contextlib import suppress
from typing import Any, Protocol

import numpy as np

try:
    import fcntl
except ImportError:  # on Windows
    fcntl = None

from shaper_fmu.master.arithmetic import arithmetic_mode, set_arithmetic_mode, standard_arithmetic


class Part(Protocol):
    """One of them. `label` names it."""

    label: str

    def restore(self) -> bool: ...

    def close(self) -> None: ...


class _Plain:
    """A part whose state can be compared, and set again."""

    label = ""

    def __init__(self) -> None:
        self._kept = self._read()

    def _read(self) -> Any:
        raise NotImplementedError

    def _write(self, state: Any) -> None:
        raise NotImplementedError

    def restore(self) -> bool:
        """Set the state again if it is another one."""
        if self._read() == self._kept:
            return False
        with suppress(OSError, ValueError):
            self._write(self._kept)
        return True

    def close(self) -> None:
        """Nothing is held."""


class Directory:
    """The working directory, held open where the system can: it may have been moved, or lie in a folder that is closed to us."""

    label = "the working directory"

    def __init__(self) -> None:
        self._place: int | str = -1
        with suppress(OSError):
            self._place = os.open(".", os.O_PATH) if hasattr(os, "O_PATH") else os.getcwd()
            self._identity = _identity(self._place)

    def restore(self) -> bool:
        """Go back."""
        with suppress(OSError):
            if self._place == -1 or _identity(".") == self._identity:
                return False
        with suppress(OSError):
            os.chdir(self._place)
        return True

    def close(self) -> None:
        """Let go of it."""
        if isinstance(self._place, int):
            with suppress(OSError):
                os.close(self._place)


def _identity(path: str | int) -> tuple[int, int]:
    found = os.stat(path)
    return found.st_dev, found.st_ino


class Streams:
    """Standard input, output and error: the files 0, 1 and 2, with their modes, and Python's objects for them."""

    label = "the standard streams"
    _NAMES = ("stdin", "stdout", "stderr")

    def __init__(self) -> None:
        self._objects = [getattr(sys, name) for name in self._NAMES]
        self._open = [stream is not None and not stream.closed for stream in self._objects]
        self._files: list[tuple[tuple[int, int], int, int | None] | None] = []
        for file in range(3):
            self._files.append(None)
            with suppress(OSError):  # it may be closed
                self._files[file] = _identity(file), os.dup(file), _mode(file)

    def restore(self) -> bool:
        """Connect them again, and open Python's objects again if they were closed."""
        changed = [self._restore_file(file, kept) for file, kept in enumerate(self._files) if kept is not None]
        for file, (name, stream, was_open) in enumerate(zip(self._NAMES, self._objects, self._open, strict=True)):
            if getattr(sys, name) is not stream:
                setattr(sys, name, stream)
                changed.append(True)
            if was_open and stream.closed:
                setattr(sys, name, open(file, "w" if file else "r", closefd=False))  # noqa: SIM115
                changed.append(True)
        return any(changed)

    def _restore_file(self, file: int, kept: tuple[tuple[int, int], int, int | None]) -> bool:
        identity, copy, mode = kept
        with suppress(OSError):
            if _identity(file) == identity and _mode(file) == mode:
                return False
        with suppress(OSError):
            os.dup2(copy, file, inheritable=True)
            if fcntl is not None and mode is not None:
                fcntl.fcntl(file, fcntl.F_SETFL, mode)
        return True

    def close(self) -> None:
        """Let go of the copies."""
        for kept in self._files:
            if kept is not None:
                with suppress(OSError):
                    os.close(kept[1])


def _mode(file: int) -> int | None:
    """The mode of an open file, such as non-blocking; None where there is no such thing."""
    return None if fcntl is None else fcntl.fcntl(file, fcntl.F_GETFL)


class Locale(_Plain):
    """How C writes and reads numbers and texts."""

    label = "the locale"

    def _read(self) -> str:
        with suppress(locale.Error):
            return locale.setlocale(locale.LC_ALL, None)
        return ""

    def _write(self, state: str) -> None:
        with suppress(locale.Error):
            locale.setlocale(locale.LC_ALL, state)


class Umask(_Plain):
    """The file mode creation mask."""

    label = "the rights of new files (umask)"

    def _read(self) -> int:
        mask = os.umask(0o077)
        os.umask(mask)
        return mask

    def _write(self, state: int) -> None:
        os.umask(state)


class NumpyErrors(_Plain):
    """numpy's treatment of floating-point errors."""

    label = "numpy's treatment of errors"

    def _read(self) -> dict[str, Any]:
        return dict(np.geterr())

    def _write(self, state: dict[str, Any]) -> None:
        np.seterr(**state)


class Processors(_Plain):
    """The processors that this thread may use."""

    label = "the processors that may be used"

    def _read(self) -> Any:
        return os.sched_getaffinity(0) if sys.platform == "linux" else None

    def _write(self, state: Any) -> None:
        if sys.platform == "linux":
            os.sched_setaffinity(0, state)


class Arithmetic:
    """The floating-point mode of this thread's processor; FMUs run in the standard mode, whatever the caller's is."""

    label = "the arithmetic"

    def __init__(self) -> None:
        self._kept = arithmetic_mode()
        set_arithmetic_mode(standard_arithmetic())

    def restore(self) -> bool:
        """Set the standard mode. This is not reported, as in the compiled loop."""
        set_arithmetic_mode(standard_arithmetic())
        return False

    def close(self) -> None:
        """Set the caller's mode."""
        set_arithmetic_mode(self._kept)
