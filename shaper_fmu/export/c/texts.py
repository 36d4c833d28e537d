"""The text of a translation unit, and of a component's record."""

from __future__ import annotations

import re
import textwrap

from shaper_fmu.component import Component
from shaper_fmu.export.c.kinds import Struct
from shaper_fmu.export.c.unit import Unit, field_name
from shaper_fmu.export.c.writing import comment, inside_comment


def struct_text(kind: Struct, is_made: bool) -> str:
    """The definition of a struct, and the function that makes one if it is used."""
    name = kind.c.strip()
    members = " ".join(f"{item.c}item{i};" for i, item in enumerate(kind.items))
    arguments = ", ".join(f"{item.c}item{i}" for i, item in enumerate(kind.items))
    sets = " ".join(f"made.item{i} = item{i};" for i in range(len(kind.items)))
    make = [f"static inline {name} make_{name}({arguments}) {{", f"    {name} made;", f"    {sets}", "    return made;", "}"]
    return "\n".join([f"typedef struct {{ {members} }} {name};", *(["", *make] if is_made else [])])


def record_text(component: type[Component]) -> str:
    """The struct of the record: real numbers as doubles, all others with 32 bits, in the order of their declaration."""
    lines = []
    for v in component.variables.values():
        size = f"[{v.size}]" if v.size else ""
        unit = f" [{v.unit}]" if v.unit else ""
        said = inside_comment(f"{v.causality}: {v.description}{unit}") if v.causality != "state" else "state"
        lines.append(f"    {'double' if v.code == 'd' else 'int32_t'} {field_name(component, v.name)}{size}; /* {said} */")
    return "typedef struct {\n" + "\n".join(lines) + "\n} Record;"


def unit_text(unit: Unit, entries: str) -> str:
    """The whole file."""
    component = unit.component
    head = comment(f"The kernels of {component.__name__}, translated from Python; do not change them here.")
    parts = ["\n".join([*head, "", '#include "kernel.h"', '#include "record.h"'])]
    functions = [function.text for function in unit.order]
    parts += [struct_text(kind, f"make_{kind.c.strip()}(" in "".join(functions)) for kind in unit.structs.values()]
    named = set(re.findall(r"[A-Za-z_]\w*", "\n".join(functions)))  # a table whose length alone is asked for is not
    used = [text for c, text in unit.constants.items() if named & ({c} | _items(text))]
    if used:
        parts.append("\n".join("\n".join(_folded(text)) for text in used))
    parts += functions
    return "\n\n".join([*parts, entries]) + "\n"


def _items(text: str) -> set[str]:
    """The names of an enumeration's items."""
    return set(re.findall(r"\w+(?= = )", text)) if text.startswith("enum") else set()


def _folded(text: str) -> list[str]:
    return textwrap.wrap(text, 110, subsequent_indent="    ", break_long_words=False, break_on_hyphens=False)
