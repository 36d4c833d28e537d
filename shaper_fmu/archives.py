"""Reading and writing FMU and SSP archives. Archives from others are untrusted; ours are the same bytes each time."""

from __future__ import annotations

import io
import os
import stat
import tempfile
import zipfile
import zlib
from pathlib import Path, PurePosixPath

from shaper_fmu.errors import ArchiveError

MOST_ENTRIES = 5_000
MOST_BYTES = 1 << 30
_DATE = (1980, 1, 1, 0, 0, 0)


def write_archive(path: Path, files: dict[str, bytes]) -> Path:
    """Write a deflated zip of `files`, sorted and with fixed dates, replacing `path` only when it is complete."""
    stream = io.BytesIO()
    with zipfile.ZipFile(stream, "w", zipfile.ZIP_DEFLATED, compresslevel=9) as archive:
        for name, content in sorted(files.items()):
            entry = zipfile.ZipInfo(name, _DATE)
            entry.compress_type, entry.create_system, entry.external_attr = zipfile.ZIP_DEFLATED, 3, 0o644 << 16
            archive.writestr(entry, content)
    return write_file(path, stream.getvalue())


def write_file(path: Path, content: bytes) -> Path:
    """Write a file, replacing `path` only when it is complete."""
    path.parent.mkdir(parents=True, exist_ok=True)
    handle, draft = tempfile.mkstemp(dir=path.parent, prefix=f".{path.name}.")
    try:
        with os.fdopen(handle, "wb") as stream:
            stream.write(content)
        os.chmod(draft, 0o644)
        os.replace(draft, path)
    except BaseException:
        os.unlink(draft)
        raise
    return path


def read_archive(content: bytes, name: str) -> dict[str, bytes]:
    """All files of an archive: name -> content. Raises ArchiveError, which calls it `name`, if it is damaged or hostile."""
    try:
        with zipfile.ZipFile(io.BytesIO(content)) as archive:
            entries = [entry for entry in archive.infolist() if not entry.is_dir()]
            _check_entries(name, entries)
            return {str(PurePosixPath(entry.filename)): archive.read(entry) for entry in entries}
    except (OSError, zipfile.BadZipFile, zlib.error, EOFError, NotImplementedError, RuntimeError) as error:
        raise ArchiveError(f"{name}: not a readable archive: {error}") from error


def read_file(path: Path) -> bytes:
    """The content of a file. Raises ArchiveError if it cannot be read."""
    try:
        return path.read_bytes()
    except OSError as error:
        raise ArchiveError(f"{path}: {error.strerror or error}") from None


def extract_archive(content: bytes, name: str, folder: Path) -> None:
    """Extract an archive under `folder`, writing nothing outside it. Raises ArchiveError."""
    for entry, data in read_archive(content, name).items():
        target = folder / entry
        target.parent.mkdir(parents=True, exist_ok=True)
        target.write_bytes(data)


def _check_entries(archive: str, entries: list[zipfile.ZipInfo]) -> None:
    if len(entries) > MOST_ENTRIES:
        raise ArchiveError(f"{archive}: {len(entries)} entries, more than the {MOST_ENTRIES} that are accepted")
    size = sum(entry.file_size for entry in entries)
    if size > MOST_BYTES:
        raise ArchiveError(f"{archive}: {size} bytes unpacked, more than the {MOST_BYTES} that are accepted")
    for entry in entries:
        name = PurePosixPath(entry.filename)
        if name.is_absolute() or ".." in name.parts or "\\" in entry.filename or ":" in entry.filename:
            raise ArchiveError(f"{archive}: entry {entry.filename!r} would be written outside the target folder")
        if stat.S_ISLNK(entry.external_attr >> 16):
            raise ArchiveError(f"{archive}: entry {entry.filename!r} is a symbolic link")
