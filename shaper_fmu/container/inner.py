"""What a variable of an FMU inside is outside: its type, causality, variability, initial and start values in FMI 2.0 or 3.0."""

from __future__ import annotations

import math
import re

from fmpy.model_description import ModelVariable

from shaper_fmu.container.declared import declared_of
from shaper_fmu.container.outside import OuterVariable, Value
from shaper_fmu.errors import ModelError
from shaper_fmu.master.fmu import STRUCTURAL, Fmu
from shaper_fmu.master.variables import items_of, kind_of, own_start

INTEGER_OF_2 = range(-(2**31), 2**31)
_TO_3 = {"Real": "Float64", "Integer": "Int32"}
_INDICES = re.compile(r"\[([\d,]+)\]$")
_INITIAL = {"parameter": ("exact",), "calculatedParameter": ("calculated", "approx"), STRUCTURAL: ("exact",)}
_ZERO: dict[str, Value] = {"real": 0.0, "integer": 0, "boolean": False, "string": "", "binary": b""}


def outer_type(variable: ModelVariable, fmi: int) -> str:
    """The type outside. Raises ModelError if this version of FMI has none for it, beginning with "is"."""
    kind = kind_of(variable)
    if kind == "clock":
        raise ModelError(["is a clock, which no container shows: the FMUs inside tick their clocks themselves"])
    if kind == "enumeration":
        _check_enumeration(variable, fmi)
        return "Enumeration"
    if kind == "binary" and fmi == 2:
        raise ModelError(["is of type Binary, which FMI 2.0 does not have: make a container of FMI 3.0"])
    if fmi == 3:
        return _TO_3.get(str(variable.type), str(variable.type))
    return {"real": "Real", "integer": "Integer", "boolean": "Boolean", "string": "String"}[kind]


def _check_enumeration(variable: ModelVariable, fmi: int) -> None:
    items = items_of(variable)
    if not items:
        raise ModelError(["is an enumeration of which its FMU declares no items, which FMI does not allow"])
    if fmi == 2 and not all(value in INTEGER_OF_2 for value in items.values()):
        raise ModelError(["is an enumeration with items beyond 32 bits, which FMI 2.0 does not have: make a container of FMI 3.0"])


def outer_variability(variable: ModelVariable, causality: str) -> str:
    """The inner variability, where it fits the causality outside and the type."""
    declared = str(variable.variability)
    real = kind_of(variable) == "real"
    if causality in ("parameter", "calculatedParameter"):
        return declared if declared in ("fixed", "tunable") else "fixed"
    if causality in ("input", "output") and declared in ("fixed", "tunable"):
        return "discrete"
    if causality == "input" and declared == "constant":
        return "continuous" if real else "discrete"
    return "discrete" if declared == "continuous" and not real else declared


def outer_initial(variable: ModelVariable, causality: str, variability: str) -> str | None:
    """The inner `initial`, where it fits the causality and variability outside; None for an input, which has none."""
    if causality == "input":
        return None
    if variability == "constant":
        return "exact"
    fixed = causality == "local" and variability in ("fixed", "tunable")
    allowed = ("calculated", "approx") if fixed else _INITIAL.get(causality, ("calculated", "exact", "approx"))
    return variable.initial if variable.initial in allowed else allowed[0]


def initial_of(outer: OuterVariable) -> str | None:
    """`initial` of a container's variable: what may be set before the initialization is "exact" or "approx"; None for an input."""
    found = outer_initial(outer.shown, outer.causality, outer.variability)
    return found if outer.starts or found is None else "calculated"


def inner_starts(fmu: Fmu, whole: ModelVariable, names: list[str]) -> list[Value | None]:
    """The FMU's own start values of a variable's elements; None where it has none. Raises ModelError for one that is no value."""
    kind = kind_of(whole)
    if kind in ("string", "binary"):
        every = fmu.elements_with(names[0])
        texts = dict(zip(every, _texts(fmu, whole, len(every), kind), strict=True))
        return [texts[name] for name in names]
    variables = (fmu.variables[name] for name in names)
    return [own_start(variable, fmu.name) if variable.start is not None else None for variable in variables]


def _texts(fmu: Fmu, variable: ModelVariable, count: int, kind: str) -> list[Value | None]:
    """The start values of a variable's elements, or of the array that an element is of."""
    name = str((variable.alias or variable).name)
    declared = declared_of(fmu).variable(name)
    texts = declared.starts or [
        declared.attributes[key] for key in ("start",) if key in declared.attributes
    ]  # Dymola's, in FMI 3.0
    texts = texts * count if len(texts) == 1 else texts
    try:
        values: list[Value | None] = [bytes.fromhex(text) if kind == "binary" else text for text in texts]
    except ValueError:
        raise ModelError([f"{fmu.name}: the start value of {name} is not made of hexadecimal digits"]) from None
    return [values[i] if i < len(values) else None for i in range(count)]


def zero(variable: ModelVariable) -> Value:
    """The start value of an input of which the FMU declares none: zero within its bounds, an enumeration's first item."""
    kind = kind_of(variable)
    if kind == "enumeration":
        return min(items_of(variable).values())
    if kind not in ("real", "integer"):
        return _ZERO[kind]
    low, high = (_bound(variable, side) for side in ("min", "max"))
    nearest = min(max(0.0, low), high)
    return nearest if kind == "real" else int(nearest)


def _bound(variable: ModelVariable, side: str) -> float:
    text = getattr(variable, side)
    if text is None and variable.declaredType is not None:
        text = getattr(variable.declaredType, side)
    return float(text) if text is not None else -math.inf if side == "min" else math.inf


def shape_by_names(names: list[str]) -> tuple[int, ...]:
    """The sizes of an array from the names of its elements."""
    found = _INDICES.search(names[-1])
    return tuple(int(index) for index in found[1].split(",")) if found is not None else ()
