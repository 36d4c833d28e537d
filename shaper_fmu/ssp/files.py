"""The files of an archive: resolves the file that a source names, and validates its content by the standard's schemas."""

from __future__ import annotations

import posixpath
import re
from collections.abc import Callable, Mapping
from pathlib import Path
from typing import TypeVar
from urllib.parse import unquote

from shaper_fmu.archives import read_archive
from shaper_fmu.errors import ArchiveError, ModelError, nearest
from shaper_fmu.ssp.findings import Findings, Key, Weight
from shaper_fmu.ssp.meaning import Scope
from shaper_fmu.ssp.read_parts import PartlyRead
from shaper_fmu.ssp.schemas import schema_problems

T = TypeVar("T")
Reader = Callable[[bytes, str], T]
"""A function of read.py."""
_SCHEME = re.compile(r"([A-Za-z][A-Za-z0-9+.-]*):")
_PROBLEM = re.compile(r"(.*?), line (\d+): (.*)", re.DOTALL)


class Files:
    """The files of an archive, and of archives in it under their paths; findings go to `findings`.

    `seen` are the files that were read, and `unreadable` those that are no XML.
    """

    def __init__(self, content: Mapping[str, bytes], findings: Findings):
        self.content: dict[str, bytes] = dict(content)
        self.findings = findings
        self.seen: dict[str, object] = {}
        self.unreadable: set[str] = set()

    def find(self, source: str, base: str, report: Callable[[str], object]) -> str | None:
        """The archive's file that a source names, relative to the file `base`; None, with a finding, if it is wrong."""
        try:
            found = path_of(source, base)
        except ArchiveError as error:
            report(str(error))
            return None
        if found in self.content:
            return found
        report(f"{source!r} is missing in the archive.{nearest(found, self.content) if found else ''}")
        return None

    def read(self, path: str, read: Reader[T], content: bytes | None = None) -> T | None:
        """A file's document, as far as it can be read; None, with a finding, if it cannot. `content` if it is elsewhere."""
        if path not in self.seen:
            self.seen[path] = self._validated(self.content[path] if content is None else content, path, read)
        return self.seen[path]  # pyright: ignore[reportReturnType]

    def document(
        self,
        scope: Scope,
        line: int,
        what: str,
        source: str | None,
        inline: T | None,
        parts: str,
        read: Reader[T],
        lacking: Weight,
    ) -> T | None:
        """The document that a source names, or the one inline; None, with a finding, if there is neither (`lacking`: if both are
        missing).
        """
        if source is not None and inline is not None:
            scope.report(line, f"{what} has both a source and {parts} inline", Weight.NOTE)
        if source is None:
            if inline is None:
                scope.report(line, f"{what} has neither a source nor {parts} inline", lacking)
            return inline
        path = self.find(source, scope.file, lambda message: scope.report(line, f"{what}: {message}"))
        return self.read(path, read) if path is not None else None

    def unpack(self, archive: str) -> None:
        """Put the files of an archive in the archive under its path."""
        try:
            inner = read_archive(self.content[archive], archive)
        except ArchiveError as error:
            self.findings.report(archive, 0, _bare(str(error), archive), Weight.LOAD)
            return
        self.content.update({f"{archive}/{name}": content for name, content in inner.items()})

    def _validated(self, content: bytes, path: str, read: Reader[T]) -> T | None:
        """The findings of the schema, and those of the reader in lines without findings of the schema. Where the reader has
        findings, meaning is lost.
        """
        try:
            invalid = [_split(problem, path) for problem in schema_problems(content, path)]
        except ArchiveError as error:
            self.findings.report(path, 0, _bare(str(error), path), Weight.LOAD)
            self.unreadable.add(path)
            return None
        document, problems = None, []
        try:
            document = read(content, path)
        except ModelError as error:
            document = error.rest if isinstance(error, PartlyRead) else None
            problems = [_split(problem, path) for problem in error.problems]
        lost = {(file, line) for file, line, _ in problems}
        lines = {(file, line) for file, line, _ in invalid}
        for file, line, message in [*invalid, *(one for one in problems if one[:2] not in lines)]:
            self.findings.report(file, line, message, Weight.LOAD if (file, line) in lost else Weight.DEVIATION)
        self.findings.lost |= lost
        return document  # pyright: ignore[reportReturnType]


def _split(problem: str, file: str) -> Key:
    """File, line and message of "file, line N: message"."""
    match = _PROBLEM.match(problem)
    return (match[1], int(match[2]), match[3]) if match else (file, 0, _bare(problem, file))


def _bare(message: str, file: str) -> str:
    return " ".join(message.removeprefix(f"{file}: ").split())


def path_of(source: str, base: str) -> str:
    """The path in an archive that a source names, relative to a file; "" for none. Raises ArchiveError if it leads elsewhere."""
    path = unquote(source.partition("#")[0])
    if _SCHEME.match(source) or source.startswith("//"):
        raise ArchiveError(f"source {source!r} lies outside the archive; only paths in the archive are read")
    found = posixpath.normpath(posixpath.join(posixpath.dirname(base), path))
    if path.startswith("/") or found == ".." or found.startswith("../") or "\\" in path:
        raise ArchiveError(f"source {source!r} leads out of the archive; a path relative to the description is needed")
    return found if path else ""


def file_inside(folder: Path, source: str) -> bytes | None:
    """The content of a file in an FMU's folder; None if there is none."""
    found = (folder / posixpath.normpath(unquote(source.partition("#")[0]))).resolve()
    return found.read_bytes() if found.is_relative_to(folder) and found.is_file() else None
