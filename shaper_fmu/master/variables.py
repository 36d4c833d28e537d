"""The variables of FMUs: the types of their values, and the elements of FMI 3.0's arrays."""

from __future__ import annotations

import copy
import math
from collections.abc import Mapping
from typing import Any

import numpy as np
from fmpy.model_description import Dimension, ModelVariable, Unit

from shaper_fmu.errors import ComponentError, ModelError, nearest
from shaper_fmu.master.array_sizes import MOST_ELEMENTS
from shaper_fmu.quantities import Defined, in_unit
from shaper_fmu.units import BASE

_TYPES: dict[str, type] = {"Real": float, "Integer": int, "Enumeration": int, "Boolean": bool, "Float64": float, "Float32": float}
_RANGES = {"Integer": (-(2**31), 2**31), "Enumeration": (-(2**31), 2**31)}
for _bits in (8, 16, 32, 64):
    _TYPES |= {f"Int{_bits}": int, f"UInt{_bits}": int}
    _RANGES |= {f"Int{_bits}": (-(2 ** (_bits - 1)), 2 ** (_bits - 1)), f"UInt{_bits}": (0, 2**_bits)}
TRANSFERABLE = ("real", "integer", "boolean", "enumeration")
"""The results of `kind_of` for variables that a master exchanges; texts, binaries and clocks are not exchanged."""
_MOST_SHOWN = 20
MOST_VALUES = 4096
_BOOLEANS = {"true": True, "false": False, "1": True, "0": False}


def element_variables(variable: ModelVariable, sizes: Mapping[str, float | int | bool] | None = None) -> list[ModelVariable]:
    """The variable itself, or a copy per element of an array with that element's start value, None if there is none.

    `sizes` are values of structural parameters by name; of an array that they resize, one start value counts for all elements,
    while several ones were for its old size. Raises ModelError for too many elements.
    """
    if not variable.dimensions:
        return [variable]
    shape = [_extent(dimension, sizes or {}) for dimension in variable.dimensions]
    if math.prod(shape) > MOST_ELEMENTS:
        raise ModelError([f"{variable.name} would have {' x '.join(map(str, shape))} elements, more than {MOST_ELEMENTS}"])
    starts = str(variable.start).split() if variable.start is not None else []
    if len(starts) > 1 and shape != [_extent(dimension, {}) for dimension in variable.dimensions]:
        starts = []
    elements = []
    for i, index in enumerate(np.ndindex(*shape)):
        element = copy.copy(variable)
        element.name = f"{variable.name}[{','.join(str(k + 1) for k in index)}]"
        element.start = starts[0] if len(starts) == 1 else starts[i] if i < len(starts) else None
        elements.append(element)
    return elements


def _extent(dimension: Dimension, sizes: Mapping[str, float | int | bool]) -> int:
    if dimension.start is not None:
        return int(dimension.start)
    if dimension.variable is None:
        return 1
    name = str(dimension.variable.name)
    size = int(sizes[name]) if name in sizes else int(str(dimension.variable.start))
    if size < 0:
        raise ModelError([f"{name} = {size} is not a size of an array: it must not be negative"])
    return size


def kind_of(variable: ModelVariable) -> str:
    """The kind of a variable's values: real, integer, boolean, enumeration, or its type in small letters."""
    if variable.type in ("Enumeration", "Boolean"):
        return str(variable.type).lower()
    kind = _TYPES.get(str(variable.type))
    return "real" if kind is float else "integer" if kind is int else str(variable.type).lower()


def items_of(variable: ModelVariable) -> dict[str, int]:
    """The items of an enumeration by name; empty if none are declared."""
    declared = variable.declaredType if variable.type == "Enumeration" else None
    return {str(item.name): int(str(item.value)) for item in declared.items} if declared is not None else {}


def possible_values(variable: ModelVariable) -> set[int]:
    """All values that an enumeration, boolean or integer can have; empty if they are unknown or too many."""
    items = items_of(variable)
    if items or kind_of(variable) == "boolean":
        return set(items.values()) or {0, 1}
    if kind_of(variable) != "integer" or variable.min is None or variable.max is None:
        return set()
    low, high = int(str(variable.min)), int(str(variable.max))
    return set(range(low, high + 1)) if high - low < MOST_VALUES else set()


def typed_value(variable: ModelVariable, value: Any, where: str) -> float | int | bool:
    """`value`, which may be text, in the variable's type; of an enumeration an item, by name or number. Raises ModelError."""
    return _typed(variable, value, where, items_of(variable))


def in_own_unit(text: str, unit: str, definition: Unit | None, where: str) -> str | float:
    """A number with a unit in the variable's unit, which its FMU may define; other texts unchanged. Raises ModelError."""
    base = definition.baseUnit if definition is not None else None
    defined = None
    if base is not None:
        exponents = {symbol: int(getattr(base, symbol) or 0) for symbol in BASE}
        defined = Defined(exponents, float(base.factor or 1.0), float(base.offset or 0.0))
    try:
        return in_unit(text, unit, where, defined)
    except ComponentError as error:
        raise ModelError([str(error)]) from None


def own_start(variable: ModelVariable, where: str) -> float | int | bool:
    """The FMU's start value, unchanged: it need not be an item of its enumeration. Raises ModelError."""
    if variable.start is None:
        raise ModelError([f"{where}: {variable.name} has no start value, so give it one"])
    return _typed(variable, variable.start, where, {})


def _typed(variable: ModelVariable, value: Any, where: str, items: Mapping[str, int]) -> float | int | bool:
    if items and isinstance(value, str) and value in items:
        return items[value]
    if items and isinstance(value, str) and not value.strip().lstrip("+-").isdigit():
        raise ModelError([f"{where}: {value!r} is not a value of {variable.name}.{nearest(value, items)}"])
    kind = _TYPES.get(str(variable.type))
    if kind is None:
        raise ModelError([f"{where}: {variable.name} is of type {variable.type}, which cannot be set"])
    try:
        typed = _converted(variable, value, kind)
    except (ValueError, TypeError, KeyError, OverflowError):
        raise ModelError([f"{where}: {variable.name} = {value!r} is not of type {variable.type}"]) from None
    if items and typed not in items.values():
        raise ModelError([f"{where}: {variable.name} = {value} is not an item of the enumeration: {shown_items(items)}"])
    return typed


def shown_items(items: Mapping[str, int]) -> str:
    """The first items of an enumeration with their numbers."""
    shown = [f"{name} ({number})" for name, number in list(items.items())[:_MOST_SHOWN]]
    return ", ".join(shown) + (", ..." if len(items) > len(shown) else "")


def _converted(variable: ModelVariable, value: Any, kind: type) -> float | int | bool:
    """The value in the variable's type. Raises ValueError and others if it has another type."""
    if kind is bool and isinstance(value, str):
        return _BOOLEANS[value.lower()]
    if kind is not float and not isinstance(value, int) and float(value) != int(value):
        raise ValueError
    if kind is bool and int(value) not in (0, 1):
        raise ValueError
    low, high = _RANGES.get(str(variable.type), (-math.inf, math.inf))
    if kind is int and not low <= int(value) < high:
        raise ValueError
    return kind(value)
