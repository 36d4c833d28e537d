"""The file that a container's library reads: a row of words of eight bytes, the lowest byte first, whatever the platform."""

from __future__ import annotations

import struct
from collections.abc import Iterable

import numpy as np

from shaper_fmu.master import layout as of


class Words:
    """A file in the making."""

    def __init__(self) -> None:
        self._parts: list[bytes] = []

    def whole(self, *values: int) -> None:
        """Add whole numbers, of 64 bits with or without a sign."""
        self._parts += [struct.pack("<Q", value % (1 << 64)) for value in values]

    def real(self, *values: float) -> None:
        """Add real numbers."""
        self._parts += [struct.pack("<d", value) for value in values]

    def number(self, kind: int, value: float | int | bool) -> None:
        """Add a value of this type of the loop's."""
        if kind in (of.F8, of.F4):
            self.real(float(value))
        else:
            self.whole(int(value))

    def data(self, content: bytes) -> None:
        """Add bytes: their number, and the bytes with one that is 0 after them."""
        self.whole(len(content))
        self._parts.append(content + bytes(8 - len(content) % 8))

    def text(self, text: str) -> None:
        """Add a text."""
        self.data(text.encode())

    def texts(self, texts: Iterable[str]) -> None:
        """Add texts: their number, and each."""
        chosen = list(texts)
        self.whole(len(chosen))
        for text in chosen:
            self.text(text)

    def array(self, words: np.ndarray) -> None:
        """Add an array of 64-bit numbers."""
        self._parts.append(np.ascontiguousarray(words).astype("<u8").tobytes())

    def append(self, other: Words) -> None:
        """Add another file's content."""
        self._parts += other._parts

    def content(self) -> bytes:
        """The file's content."""
        return b"".join(self._parts)
