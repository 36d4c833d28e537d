"""Reads and writes FMU and SSP archives. Foreign archives are untrusted; ours have the same bytes each time."""

from __future__ import annotations

import contextlib
import io
import os
import shutil
import stat
import tempfile
import zipfile
from collections import Counter
from pathlib import Path, PurePosixPath

from shaper_fmu.archive_entries import MOST_BYTES, archive_entries
from shaper_fmu.errors import ArchiveError

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


def read_file(path: Path) -> bytes:
    """The content of a file. Raises ArchiveError if it cannot be read, is not a plain file (a pipe never ends), or too large."""
    try:
        found = path.stat()
        if not stat.S_ISREG(found.st_mode):
            raise ArchiveError(f"{path}: not a file but {'a folder' if path.is_dir() else 'a device or pipe'}")
        if found.st_size > MOST_BYTES:
            raise ArchiveError(f"{path}: {found.st_size} bytes, more than the {MOST_BYTES} that are accepted")
        return path.read_bytes()
    except OSError as error:
        raise ArchiveError(f"{path}: {error.strerror or error}") from None


def read_archive(content: bytes, name: str) -> dict[str, bytes]:
    """All files of an archive: name -> content. Raises ArchiveError, which calls it `name`, if it is damaged or hostile.

    The archive's own declarations are checked before anything is unpacked: see `archive_entries`. In a system's archive, the
    FMUs and systems in it count too, by their declared unpacked sizes. Each is checked as a whole when it is read itself.
    """
    entries = archive_entries(content, name)
    files = {entry.name: entry.unpacked(content, name) for entry in entries if not entry.is_folder}
    if any(PurePosixPath(entry).suffix == ".ssd" for entry in files):
        _check_nested(files, name)
    return files


def archive_findings(content: bytes, name: str) -> list[str]:
    """Deviations from the standard in an archive that is read all the same. Raises ArchiveError if it is not read."""
    archive_entries(content, name)
    with zipfile.ZipFile(io.BytesIO(content)) as archive:
        names = Counter(info.orig_filename for info in archive.infolist() if not info.is_dir())
    backslashes = [f"the entry {entry!r} has a backslash, read as /" for entry in names if "\\" in entry]
    return backslashes + [
        f"the entry {entry!r} is there {count} times, always the same" for entry, count in names.items() if count > 1
    ]


def extract_archive(content: bytes, name: str, folder: Path) -> None:
    """Extract an archive under `folder`, writing nothing outside it. Raises ArchiveError; then nothing of it stays."""
    files = read_archive(content, name)
    existed = folder.exists()
    written: list[Path] = []
    try:
        for entry, data in files.items():
            target = folder / entry
            target.parent.mkdir(parents=True, exist_ok=True)
            target.touch(exist_ok=False)
            written.append(target)
            target.write_bytes(data)
    except BaseException as error:
        _remove(folder, written, existed)
        if isinstance(error, OSError):
            raise ArchiveError(f"{name}: cannot be unpacked into {folder}: {error.strerror or error}") from error
        raise


def _remove(folder: Path, written: list[Path], existed: bool) -> None:
    """Remove what was extracted: the folder itself if it is new, otherwise the files and the folders that are empty then."""
    if not existed:
        shutil.rmtree(folder, ignore_errors=True)
        return
    for target in written:
        with contextlib.suppress(OSError):  # a folder was in the way, or another file is in a folder
            target.unlink(missing_ok=True)
            for parent in target.relative_to(folder).parents[:-1]:
                (folder / parent).rmdir()


def _check_nested(files: dict[str, bytes], name: str) -> None:
    """Check a system's archive by the declarations of its archives: total size unpacked, and nested systems."""
    size = 0
    for inner, content in files.items():
        suffix = PurePosixPath(inner).suffix.lower()
        if suffix not in (".fmu", ".ssp"):
            continue
        try:
            entries = archive_entries(content, f"{name}/{inner}")
        except ArchiveError:  # reported by its user, who knows its place in the system
            continue
        size += sum(entry.size for entry in entries)
        if size > MOST_BYTES:
            raise ArchiveError(f"{name}: the archives in it unpack to more than the {MOST_BYTES} bytes that are accepted")
        if suffix == ".ssp" and any(PurePosixPath(entry.name).suffix.lower() == ".ssp" for entry in entries):
            raise ArchiveError(f"{name}/{inner}: holds a system's archive again; they may be nested once")
