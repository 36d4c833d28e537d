"""The table of a component's declaration, as C: all that the generic FMI layers know about it (see component.h)."""

from __future__ import annotations

import enum
import hashlib
from typing import Any

from shaper_fmu.component import Component, Variable
from shaper_fmu.export.c.code import literal
from shaper_fmu.export.c.unit import field_name
from shaper_fmu.export.model_description import visible_variables

_CAUSALITIES = {
    "input": "INPUT",
    "output": "OUTPUT",
    "parameter": "PARAMETER",
    "calculatedParameter": "CALCULATED",
    "local": "LOCAL",
    "state": "HIDDEN",
}
_SLOPE = "SLOPE"
_NOTHING = {"uint16_t": "0", "Scalar": "{0, 0, 0, REAL, 0}", "NumberedText": '{0, ""}'}
"""The element of an array that has none: C has no empty arrays."""


def component_table(component: type[Component], token: str) -> str:
    """C source that defines `const Component component`, for a library that answers to this GUID or token."""
    variables = list(component.variables.values())
    index = {variable.name: i for i, variable in enumerate(variables)}
    slopes = {v.slope for v in variables if v.slope}
    visible = [index[v.name] for v in visible_variables(component)]
    offsets = {v.name: f"(int)offsetof(Record, {field_name(component, v.name)})" for v in variables}
    inputs = {i for i, v in enumerate(variables) if v.causality == "input"}
    free = {i for i in inputs if variables[i].kind is float and variables[i].min is None and variables[i].max is None}
    free_inputs = _scalars(variables, sorted(free), offsets)
    results = _scalars(variables, _real(variables, "output", "local"), offsets)
    calculated = _scalars(variables, _real(variables, "calculatedParameter"), offsets)
    arrays = {
        "variables": ("Variable", [_variable(v, index, offsets, v.name in slopes) for v in variables]),
        "inputs": ("Scalar", [*free_inputs, *_scalars(variables, sorted(inputs - free), offsets)]),
        "results": ("Scalar", [*results, *calculated]),
        "visible": ("uint16_t", ["0", *map(str, visible)]),  # FMI 3.0: no value reference is 0
        "scalars": ("Scalar", _scalars(variables, visible, offsets)),
        "states": ("Scalar", _scalars(variables, [index[name] for name in component.continuous_states or ()], offsets)),
        "messages": ("NumberedText", [f"{{{status}, {literal(text)}}}" for status, text in sorted(component.messages.items())]),
    }
    announced = [str(offsets.get(name, -1)) for name in ("next_event_time", "next_kink_time")]
    fields = [
        literal(component.__name__), literal(token), f"UINT64_C({layout_digest(component)})", "(int)sizeof(Record)",
        offsets["left_limits"], *announced, str(int(component.sampled)), str(int(component.continuous_states is not None)),
    ]  # fmt: skip
    counts = {name: str(len(rows)) for name, (_, rows) in arrays.items()}
    counts["inputs"] += f", {len(free_inputs)}"
    counts["results"] = f"{len(results)}, {len(calculated)}"
    fields += [f"{counts[name]}, {name}" for name in arrays]
    return "\n".join([
        '#include "component.h"',
        '#include "record.h"',
        *_item_tables(variables),
        *[_array(kind, name, rows) for name, (kind, rows) in arrays.items()],
        "INTERNAL const Component component = {" + ",\n    ".join(fields) + "};",
        "",
    ])  # fmt: skip


def layout_digest(component: type[Component]) -> int:
    """A number of 64 bits that stands for the component's name and its record's layout."""
    layout = [(v.name, v.code, v.size) for v in component.variables.values()]
    return int.from_bytes(hashlib.sha256(repr((component.__name__, layout)).encode()).digest()[:8], "big")


def _real(variables: list[Variable[Any]], *causalities: str) -> list[int]:
    return [i for i, v in enumerate(variables) if v.kind is float and v.causality in causalities]


def _scalars(variables: list[Variable[Any]], chosen: list[int], offsets: dict[str, str]) -> list[str]:
    rows = []
    for i in chosen:
        variable, kind = variables[i], _kind(variables[i])
        unchecked = int(variable.causality == "input" and kind in ("REAL", "BOOLEAN"))
        first, size = offsets[variable.name], 8 if kind == "REAL" else 4
        rows += [f"{{{i}, {e}, {first} + {e * size}, {kind}, {unchecked}}}" for e in range(variable.size or 1)]
    return rows


def _differ(starts: tuple[Any, ...] | list[Any]) -> bool:
    return len({_double(value) for value in starts}) > 1


def _kind(variable: Variable[Any]) -> str:
    return (
        "ENUMERATION"
        if issubclass(variable.kind, enum.IntEnum)
        else {float: "REAL", int: "INTEGER", bool: "BOOLEAN"}[variable.kind]
    )


def _array(kind: str, name: str, rows: list[str]) -> str:
    return f"static const {kind} {name}[] = {{\n    " + ",\n    ".join(rows or [_NOTHING[kind]]) + "};"


def _item_tables(variables: list[Variable[Any]]) -> list[str]:
    """Items of the enumerations, and start values where the elements of an array differ."""
    tables = []
    for variable in variables:
        if issubclass(variable.kind, enum.IntEnum):
            rows = [f"{{{item.value}, {literal(item.name)}}}" for item in variable.kind]
            tables.append(_array("NumberedText", f"items_{variable.name}", rows))
        if _differ(variable.starts):
            tables.append(_array("double", f"starts_{variable.name}", [_double(value) for value in variable.starts]))
    return tables


def _variable(variable: Variable[Any], index: dict[str, int], offsets: dict[str, str], is_slope: bool) -> str:
    items = list(variable.kind) if issubclass(variable.kind, enum.IntEnum) else []
    causality = _SLOPE if is_slope else _CAUSALITIES[variable.causality]
    bounds = [_bound(variable, side, value) for side, value in (("min", variable.min), ("max", variable.max))]
    fields = [
        literal(variable.name), literal(variable.unit), _kind(variable), causality, str(int(variable.tunable)),
        str(variable.size or 0), offsets[variable.name], _double(variable.starts[0]),
        f"starts_{variable.name}" if _differ(variable.starts) else "0", *bounds,
        _double(variable.min or 0.0), _double(variable.max or 0.0),
        *([str(len(items)), f"items_{variable.name}"] if items else ["0", "0"]),
        str(index[variable.derivative] if variable.derivative else -1), *_nominal(variable, index),
        str(index[variable.slope] if variable.slope else -1),
    ]  # fmt: skip
    return "{" + ", ".join(fields) + "}"


def _nominal(variable: Variable[Any], index: dict[str, int]) -> list[str]:
    if isinstance(variable.nominal, str):
        return [_double(1.0), str(index[variable.nominal])]
    return [_double(1.0 if variable.nominal is None else variable.nominal), "-1"]


def _bound(variable: Variable[Any], side: str, value: float | None) -> str:
    if value is None:
        return "UNBOUNDED"
    return "EXCLUSIVE" if variable.exclusive in (True, side) else "INCLUSIVE"


def _double(value: float) -> str:
    return repr(float(value))  # which is read back exactly; C++ has no hexadecimal ones before C++17
