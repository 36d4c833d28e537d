"""The facts about one variable of a model description."""

from __future__ import annotations

import math

from fmpy.model_description import ModelVariable

from shaper_fmu.info.facts import Value, VariableInfo
from shaper_fmu.master.variables import items_of, kind_of


def variable_info(variable: ModelVariable) -> VariableInfo:
    """The facts about a variable; an array is one."""
    declared = variable.declaredType
    return VariableInfo(
        name=str(variable.name),
        causality=str(variable.causality or "local"),
        variability=str(variable.variability or ""),
        type=str(variable.type),
        unit=variable.unit or (declared.unit if declared is not None else None) or "",
        start=_start(variable),
        minimum=_number(variable.min if variable.min is not None or declared is None else declared.min),
        maximum=_number(variable.max if variable.max is not None or declared is None else declared.max),
        description=variable.description or (declared.description if declared is not None else None) or "",
        dimensions=[
            str(one.variable.name) if one.variable is not None else int(one.start or 1) for one in variable.dimensions or []
        ],
        items=items_of(variable),
    )


def shape_of(variable: ModelVariable) -> list[int]:
    """The sizes of an array, at the start values of the structural parameters that give them; empty for a scalar."""
    return [int(str(one.variable.start)) if one.variable is not None else int(one.start or 1) for one in variable.dimensions or []]


def _start(variable: ModelVariable) -> Value | list[Value] | None:
    if variable.start is None:
        return None
    texts = str(variable.start)
    if not variable.dimensions or variable.type in ("String", "Binary"):
        return _value(kind_of(variable), texts)
    return [_value(kind_of(variable), text) for text in texts.split()]


def _value(kind: str, text: str) -> Value:
    """The value in its type, or the text if it is none."""
    word = text.strip()
    if kind == "boolean" and word.lower() in ("true", "1", "false", "0"):
        return word.lower() in ("true", "1")
    if kind in ("integer", "enumeration") and word.lstrip("+-").isascii() and word.lstrip("+-").isdigit() and len(word) < 20:
        return int(word)
    if kind == "real":
        number = _number(word)
        return text if number is None else number
    return text


def _number(text: str | None) -> float | None:
    """The finite number in a text."""
    try:
        number = float(text) if text is not None else math.nan
    except ValueError:
        return None
    return number if math.isfinite(number) else None
