"""Output paths of commands: they are made absolute at the start, since FMUs may change the working directory."""

from __future__ import annotations

from contextlib import suppress
from pathlib import Path

from shaper_fmu.cli.made import note_written, this_call
from shaper_fmu.console import out
from shaper_fmu.errors import ShaperFmuError

_start = Path()


def begin() -> None:
    """Paths are taken from the working directory as it is now."""
    global _start
    with suppress(OSError):  # it may have been deleted
        _start = Path.cwd()


def absolute(path: Path) -> Path:
    """The path as an absolute one."""
    return _start / path


def shown(path: Path) -> Path:
    """The path as the user calls it."""
    return path.relative_to(_start) if path.is_relative_to(_start) else path


def wrote(path: Path, more: str = "", verb: str = "wrote", call: list[str] | None = None) -> None:
    """Print that a file was written, and keep by which call, or by `call`. Raises ShaperFmuError if it does not exist."""
    if not path.is_file():
        raise ShaperFmuError(f"{path}: was written, but is not there any more: something else has moved or deleted it")
    note_written(path, call if call is not None else this_call())
    out.print(f"{verb} {shown(path)}{more}")
