"""Reading and writing FMU and SSP archives. Archives from others are untrusted; ours are the same bytes each time."""

from __future__ import annotations

import os
import stat
import tempfile
import zipfile
from pathlib import Path, PurePosixPath

from shaper_fmu.errors import ArchiveError

MOST_ENTRIES = 5_000
MOST_BYTES = 1 << 30
_DATE = (1980, 1, 1, 0, 0, 0)


def write_archive(path: Path, files: dict[str, bytes]) -> Path:
    """Write a deflated zip of `files`, sorted and with fixed dates, replacing `path` only when it is complete."""
    path.parent.mkdir(parents=True, exist_ok=True)
    handle, draft = tempfile.mkstemp(dir=path.parent, prefix=f".{path.name}.")
    try:
        with os.fdopen(handle, "wb") as stream, zipfile.ZipFile(stream, "w", zipfile.ZIP_DEFLATED, compresslevel=9) as archive:
            for name, content in sorted(files.items()):
                entry = zipfile.ZipInfo(name, _DATE)
                entry.compress_type, entry.create_system, entry.external_attr = zipfile.ZIP_DEFLATED, 3, 0o644 << 16
                archive.writestr(entry, content)
        os.chmod(draft, 0o644)
        os.replace(draft, path)
    except BaseException:
        os.unlink(draft)
        raise
    return path


def read_archive(path: Path) -> dict[str, bytes]:
    """All files of an archive: name -> content. Raises ArchiveError for a missing, damaged or hostile archive."""
    try:
        with zipfile.ZipFile(path) as archive:
            entries = [entry for entry in archive.infolist() if not entry.is_dir()]
            _check_entries(path, entries)
            return {str(PurePosixPath(entry.filename)): archive.read(entry) for entry in entries}
    except FileNotFoundError:
        raise ArchiveError(f"{path}: no such file") from None
    except (OSError, zipfile.BadZipFile, EOFError, NotImplementedError, RuntimeError) as error:
        raise ArchiveError(f"{path}: not a readable archive: {error}") from error


def extract_archive(path: Path, folder: Path) -> Path:
    """Extract an archive under `folder`, creating nothing outside it; returns `folder`. Raises ArchiveError."""
    for name, content in read_archive(path).items():
        target = folder / name
        target.parent.mkdir(parents=True, exist_ok=True)
        target.write_bytes(content)
    return folder


def _check_entries(path: Path, entries: list[zipfile.ZipInfo]) -> None:
    if len(entries) > MOST_ENTRIES:
        raise ArchiveError(f"{path}: {len(entries)} entries, more than the {MOST_ENTRIES} that are accepted")
    size = sum(entry.file_size for entry in entries)
    if size > MOST_BYTES:
        raise ArchiveError(f"{path}: {size} bytes unpacked, more than the {MOST_BYTES} that are accepted")
    for entry in entries:
        name = PurePosixPath(entry.filename)
        if name.is_absolute() or ".." in name.parts or "\\" in entry.filename or ":" in entry.filename:
            raise ArchiveError(f"{path}: entry {entry.filename!r} would be written outside the target folder")
        if stat.S_ISLNK(entry.external_attr >> 16):
            raise ArchiveError(f"{path}: entry {entry.filename!r} is a symbolic link")
