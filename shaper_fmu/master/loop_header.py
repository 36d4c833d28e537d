"""The header layout.h of the loop's C sources, written from what layout.py and the modules beside it declare."""

from __future__ import annotations

from enum import IntEnum

import numpy as np

from shaper_fmu.master import layout as of
from shaper_fmu.metrics.metric import GATHERED, Gathering
from shaper_fmu.records import CStruct, c_struct

RECORDS = (
    of.INSTANCE, of.ELEMENT, of.TRANSFER, of.OPERATION, of.TABLE, of.SLOPE, of.SLOPES_OF, of.CLOCK, of.CLOCK_GUARD, of.GUARD,
    of.WATCHED, GATHERED, of.PART, of.SOLVER, of.INPUT_QUERY, of.CONTROL, of.RUNS,
)  # fmt: skip
ENUMS: dict[str, type[IntEnum]] = {
    "CLOCK": of.ClockKind, "ASKED": of.Asked, "TYPE": of.ValueType, "OP": of.Code, "FAULT": of.Fault, "ANSWER": of.Answer,
    "CALLED": of.Called, "GATHER": Gathering,
}  # fmt: skip
"""By how the names of their items begin in C."""


def loop_header() -> str:
    """The header's text."""
    parts = [
        "/* Written by shaper_fmu/master/loop_header.py from the declarations in shaper_fmu/master/layout*.py: change those. */\n",
        "#ifndef LAYOUT_H\n#define LAYOUT_H\n\n#include <stddef.h>\n#include <stdint.h>\n",
        "typedef void (*Function)(void); /* of FMI: called as what it is, see fmi.h */\n",
        f"#define NO_EVENT {of.NO_EVENT!r}\n#define JUMPS ({of.JUMPS})\n",
        *[_enum(prefix, items) for prefix, items in ENUMS.items()],
        *[_struct(c_struct(kind)) for kind in RECORDS],
        *[f"typedef struct {{\n    {_c_name(kind)} *at;\n    size_t count;\n}} {name};\n" for name, kind in _arrays().items()],
        _system(),
        _checks(),
        "#endif\n",
    ]
    return "\n".join(parts)


def _enum(prefix: str, items: type[IntEnum]) -> str:
    rows = [f"    {prefix}_{item.name} = {item.value}" for item in items]
    return "enum {\n" + ",\n".join(rows) + "\n};\n"


def _struct(struct: CStruct) -> str:
    rows = []
    for field in struct.fields:
        row = f"    {field.type}{'' if field.type.endswith('*') else ' '}{field.name};"
        rows.append(f"{row:36}/* {field.comment} */" if field.comment else row)
    return f"typedef struct {struct.name} {{\n" + "\n".join(rows) + f"\n}} {struct.name};\n"


def _c_name(kind: np.dtype | str) -> str:
    return kind if isinstance(kind, str) else c_struct(kind).name


def _array_name(kind: np.dtype | str) -> str:
    """The type of an array of these."""
    return {"double": "Doubles", "int32_t": "Numbers", "uint32_t": "References", "InputQuery": "InputQueries"}.get(
        _c_name(kind)
    ) or f"{_c_name(kind)}s"


def _arrays() -> dict[str, np.dtype | str]:
    return {_array_name(kind): kind for kind in of.ELEMENTS.values()}


def _system() -> str:
    rows = [f"    {_array_name(kind)} {name};" for name, kind in of.ELEMENTS.items()]
    return "typedef struct {\n" + "\n".join(rows) + "\n} System;\n"


def _checks() -> str:
    """That the compiler lays the records out as numpy does; where addresses are shorter, there is no Python that shares them."""
    checks = []
    for kind in RECORDS:
        name = c_struct(kind).name
        checks.append(f"LAID_OUT({name}_size, sizeof({name}) == {kind.itemsize});")
        for field, (_, offset, *_) in (kind.fields or {}).items():
            checks.append(f"LAID_OUT({name}_{field}, offsetof({name}, {field}) == {offset});")
    checks.append(f"LAID_OUT(System_size, sizeof(System) == {2 * np.uintp().itemsize * len(of.ELEMENTS)});")
    checked = "\n".join(checks)
    return (
        f"#if UINTPTR_MAX == {(1 << 8 * np.uintp().itemsize) - 1:#x}u\n"
        "#define LAID_OUT(what, is_true) typedef char what##_is_as_in_python[(is_true) ? 1 : -1]\n"
        f"{checked}\n#undef LAID_OUT\n#endif\n"
    )
