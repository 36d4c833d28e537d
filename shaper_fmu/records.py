"""Records that Python and C share: declared once, as the body of a C struct, and laid out by numpy as C does it."""

from __future__ import annotations

import ctypes
import re
from typing import Any, NamedTuple

import numpy as np

_FIELD = re.compile(r"(?P<type>\w[\w ]*?(?: \*+|\b))\s*(?P<name>\w+);\s*(?://\s*(?P<comment>.*))?$")
_NUMBERS = {"double": "f8", "int32_t": "i4", "uint32_t": "u4", "int64_t": "i8", "uint64_t": "u8", "size_t": "P"}
_CTYPES = {
    "f8": ctypes.c_double, "i4": ctypes.c_int32, "u4": ctypes.c_uint32, "i8": ctypes.c_int64, "u8": ctypes.c_uint64,
}  # fmt: skip


class Field(NamedTuple):
    """A field in C; a `Function` is a pointer to one, whatever its arguments are."""

    type: str
    name: str
    comment: str


class CStruct(NamedTuple):
    """What a record is in C."""

    name: str
    fields: tuple[Field, ...]


def record(name: str, body: str) -> np.dtype:
    """The record of this name in C; `body` has a line for each field: its type, its name, a semicolon, and a comment after //.

    Pointers are addresses in Python.
    """
    fields = []
    for line in filter(None, map(str.strip, body.splitlines())):
        found = _FIELD.fullmatch(line)
        if found is None:
            raise ValueError(f"{name}: {line!r} is no field")
        fields.append(Field(found["type"], found["name"], found["comment"] or ""))
    struct = CStruct(name, tuple(fields))
    kinds = [(field.name, numpy_type(field.type)) for field in fields]
    return np.dtype(kinds, align=True, metadata={"c": struct})  # pyright: ignore[reportCallIssue, reportArgumentType]


def numpy_type(c_type: str) -> np.dtype:
    """The type of the same size."""
    return np.dtype(np.uintp if c_type.endswith("*") or c_type == "Function" else _NUMBERS[c_type])


def c_struct(dtype: np.dtype) -> CStruct:
    """What a record is in C."""
    assert dtype.metadata is not None
    return dtype.metadata["c"]


def ctypes_fields(dtype: np.dtype) -> list[tuple[str, Any]]:
    """Fields of a `ctypes.Structure`: of single records, Python reads and writes them faster than those of an array."""
    return [(name, _CTYPES[np.dtype(kind[0]).str[1:]]) for name, kind in (dtype.fields or {}).items()]
