"""Zip archives made byte by byte, so that they can lie: what no ordinary program writes."""

from __future__ import annotations

import struct
import zlib
from dataclasses import dataclass


@dataclass(frozen=True)
class Part:
    """An entry: its name, content and attributes; `told_size` and the like are what its headers claim instead of the truth.

    `mode` is the Unix mode, `own_...` what the entry's own header says differently from the central directory; `shared` is the
    number of the entry whose bytes it claims as its own.
    """

    name: str | bytes
    content: bytes = b""
    mode: int = 0o100644
    method: int = 8
    flags: int = 0
    told_size: int | None = None
    told_checksum: int | None = None
    own_size: int | None = None
    own_name: bytes | None = None
    shared: int | None = None


def hostile_zip(*parts: Part) -> bytes:
    """An archive of these entries."""
    body, directory, offsets = bytearray(), bytearray(), []
    for part in parts:
        name = part.name if isinstance(part.name, bytes) else part.name.encode()
        flags = part.flags | 0x800
        packed = deflated(part.content) if part.method == 8 else part.content
        size = len(part.content) if part.told_size is None else part.told_size
        checksum = zlib.crc32(part.content) if part.told_checksum is None else part.told_checksum
        offset = len(body) if part.shared is None else offsets[part.shared]
        offsets.append(offset)
        if part.shared is None:
            own_name = name if part.own_name is None else part.own_name
            own_size = size if part.own_size is None else part.own_size
            fields = (20, flags, part.method, 0, 33, checksum, len(packed), own_size, len(own_name), 0)
            body += struct.pack("<4s5H3L2H", b"PK\3\4", *fields) + own_name + packed
        fields = (20, flags, part.method, 0, 33, checksum, len(packed), size, len(name), 0, 0, 0, 0, part.mode << 16, offset)
        directory += struct.pack("<4s6H3L5H2L", b"PK\1\2", 0x0314, *fields) + name
    end = struct.pack("<4s4H2LH", b"PK\5\6", 0, 0, len(parts), len(parts), len(directory), len(body), 0)
    return bytes(body + directory) + end


def deflated(content: bytes) -> bytes:
    """Content as raw deflate."""
    packer = zlib.compressobj(9, zlib.DEFLATED, -zlib.MAX_WBITS)
    return packer.compress(content) + packer.flush()


def zeros(size: int) -> Part:
    """An entry that unpacks to as many zeros."""
    return Part("zeros", bytes(size))


PLAIN = Part("a.txt", b"all is well")

HOSTILE: dict[str, tuple[bytes, str]] = {
    "parent folder": (hostile_zip(PLAIN, Part("../outside.txt")), "'../outside.txt' would be written outside the target folder"),
    "parent in the middle": (hostile_zip(PLAIN, Part("a/../../outside.txt")), "outside the target folder"),
    "parent's folder": (hostile_zip(PLAIN, Part("../outside/", mode=0o40755)), "outside the target folder"),
    "absolute path": (hostile_zip(PLAIN, Part("/outside.txt")), "outside the target folder"),
    "drive letter": (hostile_zip(PLAIN, Part("C:/outside.txt")), "outside the target folder"),
    "drive without a slash": (hostile_zip(PLAIN, Part("C:outside.txt")), "outside the target folder"),
    "backslashes": (hostile_zip(PLAIN, Part("..\\outside.txt")), "outside the target folder"),
    "network path": (hostile_zip(PLAIN, Part("\\\\host\\share\\outside.txt")), "outside the target folder"),
    "NUL in a name": (hostile_zip(PLAIN, Part("model.xml\0.txt")), "has a control character in its name"),
    "line break in a name": (hostile_zip(PLAIN, Part("a\nb")), "has a control character in its name"),
    "Windows device": (hostile_zip(PLAIN, Part("resources/NUL.txt")), "'resources/NUL.txt' has a name that means something else"),
    "Windows port": (hostile_zip(PLAIN, Part("com1")), "'com1' has a name that means something else on Windows"),
    "dot at the end": (hostile_zip(PLAIN, Part("a.txt.")), "'a.txt.' and entry 'a.txt' are one file on some systems"),
    "blank at the end": (hostile_zip(PLAIN, Part("a.txt ")), "'a.txt ' and entry 'a.txt' are one file on some systems"),
    "parent with a blank": (hostile_zip(PLAIN, Part(".. /outside.txt")), "has a name that means something else on Windows"),
    "nameless": (hostile_zip(PLAIN, Part("")), "has a name that no file can have"),
    "longer name than files have": (hostile_zip(PLAIN, Part("x" * 300)), "has a name that no file can have"),
    "very long path": (hostile_zip(PLAIN, Part("x/" * 600 + "y")), "has a name of more than 1000 bytes"),
    "symbolic link": (hostile_zip(PLAIN, Part("link", b"/etc/passwd", mode=0o120777)), "'link' is a symbolic link"),
    "link, then a file through it": (
        hostile_zip(Part("out", b"..", mode=0o120777), Part("out/outside.txt", b"x")),
        "'out' is a symbolic link",
    ),
    "device": (hostile_zip(PLAIN, Part("tty", mode=0o020666)), "'tty' is neither a file nor a folder but a device"),
    "named pipe": (hostile_zip(PLAIN, Part("pipe", mode=0o010666)), "'pipe' is neither a file nor a folder but a device, pipe"),
    "twice": (hostile_zip(PLAIN, Part("a.txt", b"another")), "'a.txt' is there twice"),
    "twice, by another spelling": (hostile_zip(PLAIN, Part("./a.txt", b"another")), "'a.txt' is there twice"),
    "capitals": (hostile_zip(PLAIN, Part("A.txt")), "'A.txt' and entry 'a.txt' are one file on some systems"),
    "accents": (hostile_zip(Part("\u00e9"), Part("e\u0301")), "are one file on some systems"),
    "file as a folder": (hostile_zip(PLAIN, Part("a.txt/b")), "'a.txt/b' is in a folder that is a file of the archive as well"),
    "folder as a file": (hostile_zip(PLAIN, Part("A.TXT/", mode=0o40755)), "is in a folder that is a file of the archive as well"),
    "encrypted": (hostile_zip(PLAIN, Part("secret", b"x", flags=1)), "'secret' is encrypted"),
    "strongly encrypted": (hostile_zip(PLAIN, Part("secret", b"x", flags=0x41)), "'secret' is encrypted"),
    "another packing method": (hostile_zip(PLAIN, Part("a.lzma", b"x", method=14)), "'a.lzma' is packed by method 14"),
    "too many entries": (hostile_zip(*[Part(f"f{i}") for i in range(10_001)]), "10001 entries, more than the 10000 that are"),
    "zip bomb": (hostile_zip(zeros(20_000_000)), r"20000000 bytes unpacked from \d+, more than 250 times: a zip bomb"),
    "bomb larger than all": (hostile_zip(Part("a", told_size=1 << 31)), "2147483648 bytes unpacked, more than the 1073741824"),
    "bomb of shared bytes": (
        hostile_zip(Part("a", b"x" * 100), Part("b", b"x" * 100, own_name=b"b"), Part("a2", b"x" * 100, shared=1, own_name=b"b")),
        "not a readable archive: entry 'a2' is described in two ways",
    ),
    "more than it tells": (hostile_zip(Part("a", bytes(5_000_000), told_size=10)), "'a' unpacks to more than the 10 bytes that"),
    "less than it tells": (hostile_zip(Part("a", b"x" * 10, told_size=20)), "entry 'a' is damaged"),
    "wrong checksum": (hostile_zip(Part("a", b"x", told_checksum=1)), "not a readable archive: entry 'a' is damaged"),
    "headers of two sizes": (hostile_zip(Part("a", b"x" * 9, own_size=8)), "entry 'a' is described in two ways that disagree"),
    "headers of two names": (hostile_zip(Part("a", b"x", own_name=b"b")), "entry 'a' is described in two ways that disagree"),
    "no archive": (b"no zip at all", "not a readable archive"),
    "empty": (b"", "not a readable archive"),
    "cut at the end": (hostile_zip(Part("a", b"x" * 1000))[:-30], "not a readable archive"),
    "cut at the beginning": (hostile_zip(Part("a", bytes(range(256)) * 4))[300:], "not a readable archive"),
}
"""What archives can do: name -> the archive, and the words that refuse it (a regular expression)."""


def overlapping() -> bytes:
    """A bomb of overlapping entries: the second entry's header and bytes lie inside the first one's, which are stored."""
    inner = bytes(hostile_zip(Part("inner", b"y" * 50, method=0)))
    outer = hostile_zip(Part("outer", inner, method=0))
    begin = outer.index(inner)
    at = outer.index(b"PK\1\2", begin + len(inner))
    central = bytearray(inner[inner.index(b"PK\1\2") : inner.index(b"PK\5\6")])
    struct.pack_into("<L", central, 42, begin)
    end = outer.index(b"PK\5\6", at)
    directory = outer[at:end] + central
    return outer[:at] + directory + struct.pack("<4s4H2LH", b"PK\5\6", 0, 0, 2, 2, len(directory), at, 0)


HOSTILE["overlapping entries"] = (overlapping(), "entries 'outer' and 'inner' share bytes: a zip bomb")


def damaged() -> bytes:
    """An archive with some bytes overwritten in the middle of an entry's packed content."""
    content = bytearray(hostile_zip(Part("a", bytes(range(256)) * 40)))
    content[60:70] = bytes(10)
    return bytes(content)


HOSTILE["overwritten bytes"] = (damaged(), "not a readable archive: entry 'a'")
