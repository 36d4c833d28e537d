"""Checks the shared libraries of an FMU before one is loaded: a truncated file would end the process by a bus error.

The headers of ELF (Linux), PE (Windows) and Mach-O (macOS) tell which bytes of the file are mapped into memory, ELF's where its
list of sections ends, too. A file that ends before is damaged.
"""

from __future__ import annotations

import struct
from collections.abc import Iterable, Iterator

_ELF, _FAT = b"\x7fELF", (b"\xca\xfe\xba\xbe", b"\xca\xfe\xba\xbf")
_MACH = {b"\xfe\xed\xfa\xce": ">", b"\xfe\xed\xfa\xcf": ">", b"\xce\xfa\xed\xfe": "<", b"\xcf\xfa\xed\xfe": "<"}
_LOAD, _SEGMENT, _SEGMENT_64 = 1, 0x1, 0x19
_MOST_COMMANDS = 10_000


def library_problem(name: str, content: bytes) -> str | None:
    """Why a shared library cannot be loaded without harm: it ends too early. None if it seems whole, or is no library."""
    try:
        end = max(_ends(content), default=0)
    except struct.error:  # within the headers themselves
        return f"{name} is damaged: its {len(content)} bytes end within its headers"
    if end > len(content):
        return f"{name} is cut off: it has {len(content)} bytes, but {end} by its headers"
    return None


def library_problems(files: Iterable[tuple[str, bytes]]) -> list[str]:
    """Problems of all libraries among files, in the order of their names."""
    found = (library_problem(name, content) for name, content in sorted(files))
    return [problem for problem in found if problem is not None]


def _ends(content: bytes) -> Iterator[int]:
    """The file positions at which the required parts end."""
    if content[:4] == _ELF:
        yield from _elf_ends(content)
    elif content[:2] == b"MZ":
        yield from _pe_ends(content)
    elif content[:4] in _MACH:
        yield from _mach_ends(content, 0)
    elif content[:4] in _FAT:
        yield from _fat_ends(content)


def _elf_ends(content: bytes) -> Iterator[int]:
    wide, order = content[4:5] == b"\2", ">" if content[5:6] == b"\2" else "<"
    offset = struct.unpack_from(f"{order}Q" if wide else f"{order}L", content, 32 if wide else 28)[0]
    size, count = struct.unpack_from(f"{order}2H", content, 54 if wide else 42)
    for i in range(count):
        at = offset + i * size
        if wide:
            kind, _, begin, _, _, length = struct.unpack_from(f"{order}2L4Q", content, at)
        else:
            kind, begin, _, _, length = struct.unpack_from(f"{order}5L", content, at)
        if kind == _LOAD:
            yield begin + length
    sections = struct.unpack_from(f"{order}Q" if wide else f"{order}L", content, 40 if wide else 32)[0]
    size, count = struct.unpack_from(f"{order}2H", content, 58 if wide else 46)
    yield sections + size * count if sections else 0  # not mapped, but at the end of every file that is whole


def _pe_ends(content: bytes) -> Iterator[int]:
    header = struct.unpack_from("<L", content, 60)[0]
    if content[header : header + 4] != b"PE\0\0":
        if header + 4 > len(content):
            raise struct.error
        return
    sections, _, _, _, optional = struct.unpack_from("<H3LH", content, header + 6)
    for i in range(sections):
        length, begin = struct.unpack_from("<2L", content, header + 24 + optional + 40 * i + 16)
        yield begin + length if begin else 0


def _mach_ends(content: bytes, base: int) -> Iterator[int]:
    order, wide = _MACH[content[base : base + 4]], content[base : base + 4] in (b"\xfe\xed\xfa\xcf", b"\xcf\xfa\xed\xfe")
    count = struct.unpack_from(f"{order}L", content, base + 16)[0]
    at = base + (32 if wide else 28)
    for _ in range(min(count, _MOST_COMMANDS)):
        kind, length = struct.unpack_from(f"{order}2L", content, at)
        if kind in (_SEGMENT, _SEGMENT_64):
            form, place = (f"{order}2Q", at + 40) if kind == _SEGMENT_64 else (f"{order}2L", at + 32)
            yield base + sum(struct.unpack_from(form, content, place))
        at += max(length, 8)


def _fat_ends(content: bytes) -> Iterator[int]:
    """The parts of a library for several processors, and their mapped ranges."""
    wide = content[:4] == b"\xca\xfe\xba\xbf"
    for i in range(min(struct.unpack_from(">L", content, 4)[0], _MOST_COMMANDS)):
        begin, length = struct.unpack_from(">2Q" if wide else ">2L", content, 8 + i * (32 if wide else 20) + 8)
        yield begin + length
        if content[begin : begin + 4] in _MACH:
            yield from _mach_ends(content, begin)
