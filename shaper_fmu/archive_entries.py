"""Checks the entries of an archive before anything is unpacked, and unpacks one entry.

The archive is read by its central directory alone, as every tool should. What is refused: more entries or bytes than are
bearable, compression beyond all that models need (zip bombs), entries that share bytes or whose two headers disagree, names
that lead out of the folder or mean another file on another system, links and devices, encryption.
"""

from __future__ import annotations

import io
import stat
import struct
import unicodedata
import zipfile
import zlib
from dataclasses import dataclass
from itertools import pairwise

from shaper_fmu.errors import ArchiveError

MOST_ENTRIES = 10_000
MOST_BYTES = 1 << 30
MOST_RATIO = 250
"""How many times its packed size an archive may unpack to. Deflate gives at most 1032; models and tables give 2 to 50."""
_SMALL = 10_000_000
"""Bytes unpacked, below which no ratio is too large."""
_LONGEST_NAME = 1_000
_RESERVED = {"con", "prn", "aux", "nul", "conin$", "conout$"} | {f"{port}{i}" for port in ("com", "lpt") for i in "0123456789¹²³"}
_LOCAL = struct.Struct("<4s5H3L2H")
_METHODS = {zipfile.ZIP_STORED: "store", zipfile.ZIP_DEFLATED: "deflate"}


@dataclass(frozen=True)
class ArchiveEntry:
    """A file or folder of an archive: its name, unpacked size [bytes] and checksum, and where its packed bytes lie."""

    name: str
    is_folder: bool
    size: int
    checksum: int
    deflated: bool
    begin: int
    end: int

    def unpacked(self, content: bytes, archive: str) -> bytes:
        """The entry's content, never more bytes than declared. Raises ArchiveError."""
        packed = content[self.begin : self.end]
        try:
            inflate = zlib.decompressobj(-zlib.MAX_WBITS)
            data = inflate.decompress(packed, self.size + 1) if self.deflated else packed
            complete = not self.deflated or inflate.eof or len(data) > self.size
        except zlib.error as error:
            raise ArchiveError(f"{archive}: not a readable archive: entry {self.name!r}: {error}") from None
        if len(data) > self.size:
            raise ArchiveError(f"{archive}: entry {self.name!r} unpacks to more than the {self.size} bytes that it declares")
        if len(data) < self.size or not complete or zlib.crc32(data) != self.checksum:
            raise ArchiveError(f"{archive}: not a readable archive: entry {self.name!r} is damaged")
        return data


def archive_entries(content: bytes, archive: str) -> list[ArchiveEntry]:
    """The entries of an archive called `archive`, in its order. Raises ArchiveError if it is damaged or hostile."""
    try:
        _check_count(content, archive)
        with zipfile.ZipFile(io.BytesIO(content)) as opened:
            infos = opened.infolist()
            end = opened.start_dir
    except (OSError, zipfile.BadZipFile, EOFError, NotImplementedError, RuntimeError, ValueError, struct.error) as error:
        raise ArchiveError(f"{archive}: not a readable archive: {error}") from None
    _check_sizes(archive, infos, len(content))
    infos = _without_copies([info for info in infos if not _means_nothing(info)])
    for info in infos:
        _check_name(archive, info)
        _check_kind(archive, info)
    _check_apart(archive, infos)
    entries = [_entry(content, archive, info) for info in infos]
    _check_overlap(archive, infos, entries, end)
    return entries


def _check_count(content: bytes, archive: str) -> None:
    """Count the entries before objects are made of them, by their signatures in the central directory."""
    end = content.rfind(b"PK\5\6", max(0, len(content) - 65_557))
    size = struct.unpack_from("<L", content, end + 12)[0] if 0 <= end <= len(content) - 22 else 0
    begin = 0 if size == 0xFFFFFFFF else max(0, end - size - 76)  # 76: what precedes it in a zip of 64 bits
    count = content.count(b"PK\1\2", begin, max(end, 0))
    if count > MOST_ENTRIES:
        raise ArchiveError(f"{archive}: {count} entries, more than the {MOST_ENTRIES} that are accepted")


def _check_sizes(archive: str, infos: list[zipfile.ZipInfo], packed: int) -> None:
    if len(infos) > MOST_ENTRIES:
        raise ArchiveError(f"{archive}: {len(infos)} entries, more than the {MOST_ENTRIES} that are accepted")
    size = sum(info.file_size for info in infos)
    if size > MOST_BYTES:
        raise ArchiveError(f"{archive}: {size} bytes unpacked, more than the {MOST_BYTES} that are accepted")
    if size > max(_SMALL, MOST_RATIO * packed):
        raise ArchiveError(f"{archive}: {size} bytes unpacked from {packed}, more than {MOST_RATIO} times: a zip bomb")


def _check_name(archive: str, info: zipfile.ZipInfo) -> None:
    name = info.orig_filename  # as it is in the file; zipfile cuts it at a NUL
    if name.startswith(("/", "\\")) or ":" in name or ".." in _parts(name):
        raise ArchiveError(f"{archive}: entry {name!r} would be written outside the target folder")
    if any(unicodedata.category(letter) in ("Cc", "Cs") for letter in name):
        raise ArchiveError(f"{archive}: entry {name!r} has a control character in its name")
    if len(name.encode("utf-8", "replace")) > _LONGEST_NAME:
        raise ArchiveError(f"{archive}: entry {name[:40]!r}... has a name of more than {_LONGEST_NAME} bytes")
    if not _plain(info) and not _is_folder(info):
        raise ArchiveError(f"{archive}: entry {name!r} has a name that no file can have")
    for part in _plain(info).split("/"):
        if len(part.encode("utf-8", "replace")) > 255:
            raise ArchiveError(f"{archive}: entry {name!r} has a name that no file can have")
        if not part.rstrip(". ") or part.split(".")[0].rstrip().casefold() in _RESERVED:
            raise ArchiveError(f"{archive}: entry {name!r} has a name that means something else on Windows")


def _means_nothing(info: zipfile.ZipInfo) -> bool:
    """Whether an entry is the archive's own folder ("./"), or one of those that macOS adds to archives."""
    parts = [part for part in _parts(info.orig_filename) if part not in ("", ".")]
    own = not parts and info.orig_filename.startswith(".") and _is_folder(info)
    return own or (bool(parts) and (parts[0] == "__MACOSX" or parts[-1] == ".DS_Store"))


def _without_copies(infos: list[zipfile.ZipInfo]) -> list[zipfile.ZipInfo]:
    """The entries without repetitions of the same name and content, compared by size and checksum."""
    first = {(info.orig_filename, info.file_size, info.CRC): info for info in reversed(infos) if not _is_folder(info)}
    return [info for info in infos if first.get((info.orig_filename, info.file_size, info.CRC), info) is info]


def _check_kind(archive: str, info: zipfile.ZipInfo) -> None:
    kind = stat.S_IFMT(info.external_attr >> 16)
    if kind == stat.S_IFLNK:
        raise ArchiveError(f"{archive}: entry {info.filename!r} is a symbolic link")
    if kind not in (0, stat.S_IFREG, stat.S_IFDIR):
        raise ArchiveError(f"{archive}: entry {info.filename!r} is neither a file nor a folder but a device, pipe or socket")
    if info.flag_bits & 0b10_0000_0100_0001:
        raise ArchiveError(f"{archive}: entry {info.filename!r} is encrypted")
    if info.compress_type not in _METHODS:
        known = " and ".join(_METHODS.values())
        raise ArchiveError(f"{archive}: entry {info.filename!r} is packed by method {info.compress_type}; {known} are read")


def _check_apart(archive: str, infos: list[zipfile.ZipInfo]) -> None:
    """Check that every file has its own name, also without regard to capitals or accents, and that no file is a folder."""
    files: dict[str, str] = {}
    for name in (_plain(info) for info in infos if not _is_folder(info)):
        other = files.setdefault(_folded(name), name)
        if other is not name:
            message = "is there twice" if other == name else f"and entry {other!r} are one file on some systems"
            raise ArchiveError(f"{archive}: entry {name!r} {message}")
    for info in infos:
        parts = _folded(_plain(info)).split("/")
        for depth in range(1, len(parts) + _is_folder(info)):
            if "/".join(parts[:depth]) in files:
                raise ArchiveError(f"{archive}: entry {info.filename!r} is in a folder that is a file of the archive as well")


def _is_folder(info: zipfile.ZipInfo) -> bool:
    return info.filename.endswith(("/", "\\"))


def _parts(name: str) -> list[str]:
    """The parts of a name. Some tools on Windows write a backslash between them; no file system there has one in a name."""
    return name.replace("\\", "/").split("/")


def _plain(info: zipfile.ZipInfo) -> str:
    """The name without parts that mean nothing ("./a//b" is "a/b"); "" for the folder itself."""
    return "/".join(part for part in _parts(info.filename) if part not in ("", "."))


def _folded(name: str) -> str:
    """The name by which file systems find it that know no capitals or accents, or drop dots and blanks at the end."""
    return "/".join(part.rstrip(". ") for part in unicodedata.normalize("NFC", name).casefold().split("/"))


def _entry(content: bytes, archive: str, info: zipfile.ZipInfo) -> ArchiveEntry:
    """The entry; its own header before its bytes must agree with the central directory."""
    message = f"{archive}: not a readable archive: entry {info.filename!r}"
    try:
        signature, _, flags, method, _, _, _, packed, size, name, extra = _LOCAL.unpack_from(content, info.header_offset)
    except (struct.error, ValueError):
        raise ArchiveError(f"{message} lies outside the file") from None
    begin = info.header_offset + _LOCAL.size + name + extra
    if signature != b"PK\3\4" or begin + info.compress_size > len(content):
        raise ArchiveError(f"{message} lies outside the file")
    own_name = content[begin - name - extra : begin - extra].decode("utf-8" if info.flag_bits & 0x800 else "cp437", "replace")
    sizes = [] if flags & 0b1000 else [(size, info.file_size), (packed, info.compress_size)]  # else they follow the data
    differs = any(own not in (declared, 0xFFFFFFFF) for own, declared in sizes)
    if differs or own_name != info.orig_filename or method != info.compress_type or (flags ^ info.flag_bits) & 1:
        raise ArchiveError(f"{message} is described in two ways that disagree")
    deflated = info.compress_type == zipfile.ZIP_DEFLATED
    return ArchiveEntry(_plain(info), _is_folder(info), info.file_size, info.CRC, deflated, begin, begin + info.compress_size)


def _check_overlap(archive: str, infos: list[zipfile.ZipInfo], entries: list[ArchiveEntry], end: int) -> None:
    places = sorted((info.header_offset, entry.end, entry.name) for info, entry in zip(infos, entries, strict=True))
    for (_, previous_end, name), (begin, _, other) in pairwise([*places, (end, end, "its directory")]):
        if begin < previous_end:
            raise ArchiveError(f"{archive}: entries {name!r} and {other!r} share bytes: a zip bomb")
