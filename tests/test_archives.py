"""Archives: the same bytes each time, nothing half-written, nothing hostile let in."""

from __future__ import annotations

import io
import stat
import zipfile

import pytest

from shaper_fmu import archives
from shaper_fmu.archives import extract_archive, read_archive, write_archive
from shaper_fmu.errors import ArchiveError


def zipped(*entries: tuple[str, bytes], link: bool = False) -> bytes:
    stream = io.BytesIO()
    with zipfile.ZipFile(stream, "w", zipfile.ZIP_DEFLATED) as archive:
        for name, content in entries:
            info = zipfile.ZipInfo(name)
            info.external_attr = ((stat.S_IFLNK if link else stat.S_IFREG) | 0o644) << 16
            info.compress_type = zipfile.ZIP_DEFLATED
            archive.writestr(info, content)
    return stream.getvalue()


def test_what_is_written_is_read_and_the_same_each_time(tmp_path):
    files = {"b/two.txt": b"2" * 1000, "one.txt": b"1"}
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


@pytest.mark.parametrize("name", ["../outside.txt", "/absolute.txt", "a/../../outside.txt", "..\\outside.txt", "C:/outside.txt"])
def test_paths_that_leave_the_folder_are_refused(name, tmp_path):
    target = tmp_path / "deep" / "target"
    with pytest.raises(ArchiveError, match="outside the target folder"):
        extract_archive(zipped((name, b"x")), "bad.fmu", target)
    assert list(tmp_path.rglob("*")) == []


def test_symbolic_links_are_refused():
    with pytest.raises(ArchiveError, match="is a symbolic link"):
        read_archive(zipped(("link", b"/etc/passwd"), link=True), "bad.fmu")


def test_too_many_entries_are_refused():
    content = zipped(*[(f"f{i}", b"") for i in range(archives.MOST_ENTRIES + 1)])
    with pytest.raises(ArchiveError, match="5001 entries"):
        read_archive(content, "bad.fmu")


def test_bombs_are_refused_before_they_are_unpacked(monkeypatch):
    monkeypatch.setattr(archives, "MOST_BYTES", 10_000_000)
    content = zipped(("bomb", bytes(20_000_000)))
    assert len(content) < 100_000
    with pytest.raises(ArchiveError, match="20000000 bytes unpacked"):
        read_archive(content, "bad.fmu")


@pytest.mark.parametrize("content", [b"", b"no zip at all", zipped(("a", b"x" * 1000))[:-30]])
def test_damaged_archives_are_refused(content):
    with pytest.raises(ArchiveError, match=r"bad.fmu: not a readable archive"):
        read_archive(content, "bad.fmu")


def test_a_damaged_entry_is_refused():
    content = bytearray(zipped(("a", bytes(range(256)) * 40)))
    content[60:70] = bytes(10)
    with pytest.raises(ArchiveError, match=r"bad.fmu: not a readable archive"):
        read_archive(bytes(content), "bad.fmu")
