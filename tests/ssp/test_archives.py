"""Archives: the same bytes each time, nothing half-written."""

from __future__ import annotations

import os
import zipfile

import pytest

from shaper_fmu.archives import extract_archive, read_archive, read_file, write_archive
from shaper_fmu.errors import ArchiveError


def test_what_is_written_is_read_and_the_same_each_time(tmp_path):
    files = {"b/two.txt": b"2" * 1000, "one.txt": b"1", "none.txt": b"", "a/é.txt": b"3"}
    one = write_archive(tmp_path / "one.zip", files)
    other = write_archive(tmp_path / "other.zip", dict(reversed(files.items())))
    assert one.read_bytes() == other.read_bytes()
    assert read_archive(one.read_bytes(), "one") == files


def test_a_failed_write_keeps_the_old_file_and_leaves_no_draft(tmp_path):
    path = write_archive(tmp_path / "kept.zip", {"a": b"old"})
    with pytest.raises(TypeError):
        write_archive(path, {"a": b"new", "b": 5})  # pyright: ignore[reportArgumentType]
    assert read_archive(path.read_bytes(), "kept") == {"a": b"old"}
    assert list(tmp_path.iterdir()) == [path]


def test_archives_of_other_writers_are_read(tmp_path):
    """Python's writer to a pipe: sizes behind the data; folders, one of them twice; "./" before a name; a comment; bytes before."""

    class Pipe:
        """A file that cannot go back."""

        def __init__(self):
            self.content = b"bytes before"

        def write(self, data: bytes) -> int:
            self.content += data
            return len(data)

        def flush(self) -> None:
            """Nothing waits."""

    pipe = Pipe()
    with zipfile.ZipFile(pipe, "w") as archive:  # pyright: ignore[reportArgumentType, reportCallIssue]
        archive.mkdir("folder")
        archive.writestr("folder/stored.txt", b"stored")
        with pytest.warns(UserWarning, match="Duplicate name"):
            archive.mkdir("folder")
        archive.writestr("./deflated.txt", b"deflated" * 100, zipfile.ZIP_DEFLATED)
        with archive.open("large", "w", force_zip64=True) as entry:
            entry.write(b"large")
        archive.comment = b"a comment"
    expected = {"folder/stored.txt": b"stored", "deflated.txt": b"deflated" * 100, "large": b"large"}
    assert read_archive(pipe.content, "piped.zip") == expected
    extract_archive(pipe.content, "piped.zip", tmp_path / "target")
    assert {p.relative_to(tmp_path / "target").as_posix() for p in tmp_path.rglob("*.txt")} == {"folder/stored.txt", "deflated.txt"}


def test_what_cannot_be_extracted_leaves_nothing_behind(tmp_path):
    """A folder stands where a file has to go: the files before it, and the folders made for them, are taken back."""
    content = write_archive(tmp_path / "x.zip", {"a/b/first": b"1", "a/kept/second": b"2", "z": b"3"}).read_bytes()
    target = tmp_path / "target"
    (target / "z").mkdir(parents=True)
    (target / "a" / "kept").mkdir(parents=True)
    (target / "a" / "kept" / "mine").write_text("mine")
    with pytest.raises(ArchiveError, match=r"x\.zip: cannot be unpacked into .*: File exists"):
        extract_archive(content, "x.zip", target)
    assert sorted(p.relative_to(target).as_posix() for p in target.rglob("*")) == ["a", "a/kept", "a/kept/mine", "z"]


def test_only_plain_files_are_read(tmp_path, monkeypatch):
    os.mkfifo(tmp_path / "pipe.fmu")
    with pytest.raises(ArchiveError, match="not a file but a device or pipe"):
        read_file(tmp_path / "pipe.fmu")
    with pytest.raises(ArchiveError, match="not a file but a folder"):
        read_file(tmp_path)
    with pytest.raises(ArchiveError, match=r"none\.fmu: No such file"):
        read_file(tmp_path / "none.fmu")
    with (tmp_path / "large.fmu").open("wb") as file:
        file.truncate((1 << 30) + 1)  # no disk is used
    with pytest.raises(ArchiveError, match="1073741825 bytes, more than the 1073741824 that are accepted"):
        read_file(tmp_path / "large.fmu")
