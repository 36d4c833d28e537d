"""The header fields.h of a container's C sources: the fields of the loop's records, by which a system is read from its file.

In the file every field has eight bytes, whatever it has in memory: one file serves all platforms.
"""

from __future__ import annotations

from enum import IntEnum

import numpy as np

from shaper_fmu.export.cache import digest
from shaper_fmu.master import layout as of
from shaper_fmu.master.loop_header import loop_header
from shaper_fmu.records import c_struct


class FieldKind(IntEnum):
    """What a field holds. HANDLE: an instance; FUNCTION: of its library; POINTER: into one of the file's arrays."""

    I4, I8, F8, SIZE, HANDLE, FUNCTION, POINTER = range(7)


_KINDS = {
    "int32_t": FieldKind.I4, "uint32_t": FieldKind.I4, "int64_t": FieldKind.I8, "uint64_t": FieldKind.I8, "double": FieldKind.F8,
    "size_t": FieldKind.SIZE, "Function": FieldKind.FUNCTION,
}  # fmt: skip


def kind_of_field(c_type: str, name: str) -> FieldKind:
    """What a field of this type and name in C holds."""
    if c_type.endswith("*"):
        return FieldKind.HANDLE if name == "handle" else FieldKind.POINTER
    return _KINDS[c_type]


def fields_of(kind: np.dtype | str) -> list[tuple[str, FieldKind]]:
    """The fields of an array's elements, which are records or numbers; those have one field."""
    if isinstance(kind, str):
        return [("", _KINDS[kind])]
    return [(field.name, kind_of_field(field.type, field.name)) for field in c_struct(kind).fields]


def layout_digest() -> int:
    """A number for the layout: a library reads the files that were written for its own."""
    return int(digest(loop_header())[:15], 16)


def fields_header() -> str:
    """The header's text."""
    kinds = {name: kind for kind in of.ELEMENTS.values() for name in [kind if isinstance(kind, str) else c_struct(kind).name]}
    parts = [
        "/* Written by shaper_fmu/container/fields.py from the declarations in shaper_fmu/master/layout*.py: change those. */\n",
        '#ifndef FIELDS_H\n#define FIELDS_H\n\n#include "layout.h"\n',
        f"#define LAYOUT_DIGEST {layout_digest():#x}u\n".replace("u\n", "ull\n"),
        "enum { " + ", ".join(f"FIELD_{kind.name}" for kind in FieldKind) + " };\n",
        "typedef struct {\n    size_t offset;\n    int kind;\n} Field;\n",
        "typedef struct {\n    size_t size;\n    int fields;\n    const Field *field;\n} RecordKind;\n",
        *[_record_fields(name, kind) for name, kind in kinds.items()],
        "static const RecordKind ARRAYS[] = { /* of System, in its order */\n"
        + "".join(f"    {_row(kind)},\n" for kind in of.ELEMENTS.values())
        + "};\n",
        "enum { EXTRA_DOUBLES, EXTRA_NUMBERS, EXTRA_REFERENCES };\n",
        "static const RecordKind EXTRAS[] = {\n" + "".join(f"    {_row(kind)},\n" for kind in EXTRA_TYPES) + "};\n",
        "static const Field CONTROL_FIELDS[] = {\n"
        + ",\n".join(_rows("Control", of.CONTROL))
        + "\n};\n\nstatic const RecordKind CONTROL_KIND = {sizeof(Control), "
        + f"{len(c_struct(of.CONTROL).fields)}, CONTROL_FIELDS}};\n",
        "#endif\n",
    ]
    return "\n".join(parts)


EXTRA_TYPES = ("double", "int32_t", "uint32_t")
"""Of arrays that records point into, beside those of the layout."""


def _record_fields(name: str, kind: np.dtype | str) -> str:
    rows = _rows(name, kind)
    return f"static const Field {name}_fields[] = {{\n" + ",\n".join(rows) + "\n};\n"


def _rows(name: str, kind: np.dtype | str) -> list[str]:
    return [f"    {{{f'offsetof({name}, {field})' if field else 0}, FIELD_{found.name}}}" for field, found in fields_of(kind)]


def _row(kind: np.dtype | str) -> str:
    name = kind if isinstance(kind, str) else c_struct(kind).name
    return f"{{sizeof({name}), {len(fields_of(kind))}, {name}_fields}}"
