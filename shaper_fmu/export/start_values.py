"""Components with other start values, for tools that cannot set them (libcosim and ecos set no enumerations).

Such a component is a subclass, written as a Python file into the cache: every exporter treats it as one of the user's own,
and the FMU's GUID follows from its source.
"""

from __future__ import annotations

import re
from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import Any

from shaper_fmu.component import Component, Variable
from shaper_fmu.errors import ComponentError, nearest
from shaper_fmu.export.cache import cached, digest
from shaper_fmu.export.description_parts import summary
from shaper_fmu.quantities import in_unit
from shaper_fmu.registry import load_components

_BOOLEANS = {"true": True, "false": False}

_SOURCE = '''\
"""A component with other start values, written by shaper-fmu."""

from {module} import {base}


class {name}({base}):
    """{summary}"""

{lines}
'''


def with_start_values(
    component: type[Component], values: Mapping[str, Any], name: str = "", without: Sequence[str] = (), note: str = ""
) -> type[Component]:
    """A component with other start values of parameters and inputs, without some outputs, and with another name.

    Args:
        component: the component to start from.
        values: by name ("profile", "natural_frequency[1]"): a value, its text, an item's name, or a sequence for an array.
        name: what it is called; default: the component's name and the values, as in MotionProfile_s_curve.
        without: outputs and other results that the FMU does not show, such as Booleans for clients that read numbers alone.
        note: a sentence before its description.

    Raises ComponentError for an unknown name, a wrong value, or a name that no FMU can have.
    """
    changed = component()
    for variable, value in values.items():
        changed.set(variable, _typed(component, variable, value))
    changed.check_values("parameter", "input")
    _check_left_out(component, without)
    start = ", ".join(f"{variable} = {_text(value)}" for variable, value in values.items())
    parts = [f"start values: {start}"] if start else []
    changes = "; ".join([*parts, f"without {', '.join(without)}"] if without else parts)
    name = name or re.sub(
        r"\W+", "_", "_".join([component.__name__, *map(_text, values.values()), *(["without", *without] if without else [])])
    ).strip("_")
    if not name.isidentifier() or not name.isascii() or name == component.__name__:
        raise ComponentError(f"{name!r} is not a name for {component.__name__} with other start values: letters, digits and _ only")
    found = [v for v in component.variables.values() if v.causality in ("parameter", "input")]
    other = [v for v in found if getattr(changed, v.name) != v.start]
    source = _SOURCE.format(
        module=component.__module__,
        base=component.__name__,
        name=name,
        summary=f"{note and f'{note}. '}{summary(component).rstrip('.')}; {changes}.".replace("\\", "\\\\"),
        lines="\n".join(
            [f"    {v.name} = {component.__name__}.variables[{v.name!r}].starting_at({_written(changed, v)})" for v in other]
            + [f"    {label} = {component.__name__}.variables[{label!r}].hidden()" for label in dict.fromkeys(without)]
            + _terminals(component, without)
        )
        or "    pass",
    )
    path = cached("start_values", f"{name}_{digest(source)}.py", source.encode)
    return next(found for found in load_components(Path(path)) if found.__name__ == name)


def _terminals(component: type[Component], without: Sequence[str]) -> list[str]:
    """The line for terminals without what is left out, if they have some of it."""
    kept = {name: {m: v for m, v in members.items() if v not in without} for name, members in component.terminals.items()}
    if kept == component.terminals:
        return []
    return [f"    terminals = { ({name: members for name, members in kept.items() if members})!r}"]


def _check_left_out(component: type[Component], names: Sequence[str]) -> None:
    known = [v.name for v in component.variables.values() if v.causality in ("output", "local", "calculatedParameter")]
    for name in names:
        if name not in known:
            raise ComponentError(f"{component.__name__} has no output {name!r} to leave out.{nearest(name, known)}")


def _typed(component: type[Component], name: str, value: Any) -> Any:
    """A value given as text, as on the command line, in the variable's type; items keep their names."""
    variable = component.variables.get(name.split("[")[0])
    if not isinstance(value, str) or variable is None or variable.kind not in (float, int, bool):
        return value
    if variable.kind is float:
        value = in_unit(value, variable.unit, f"{component.__name__}: {name}")
    try:
        return _BOOLEANS[value.lower()] if variable.kind is bool else variable.kind(value)
    except (KeyError, ValueError):
        raise ComponentError(f"{component.__name__}: {name} = {value!r} is not of type {variable.kind.__name__}") from None


def _text(value: Any) -> str:
    return str(getattr(value, "name", value))


def _written(changed: Component, variable: Variable[Any]) -> str:
    """The start value as Python source, with numbers only, since the file imports no types."""
    value = getattr(changed, variable.name)
    plain = [
        int(item) if isinstance(item, int) and not isinstance(item, bool) else item
        for item in (value if variable.size else [value])
    ]
    return repr(plain if variable.size else plain[0])
