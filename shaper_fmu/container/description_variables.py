"""What the descriptions of FMI 2.0 and 3.0 say alike of a container's variables."""

from __future__ import annotations

from collections.abc import Sequence

from shaper_fmu.container.definitions import REALS, real_text
from shaper_fmu.container.inner import initial_of
from shaper_fmu.container.outside import OuterVariable, Value

_IDENTITY = (1.0, 0.0, ())


def common_attributes(variable: OuterVariable) -> dict[str, str]:
    """Name, value reference, description, causality, variability and, for all but inputs, `initial`."""
    attributes = {"name": variable.name, "valueReference": str(variable.reference)}
    if variable.shown.description:
        attributes["description"] = variable.shown.description
    attributes |= {"causality": variable.causality, "variability": variable.variability}
    initial = initial_of(variable)
    return attributes if initial is None else {**attributes, "initial": initial}


def start_texts(variable: OuterVariable) -> list[str]:
    """The start values as XML shows them."""
    return [_text(value, variable.type) for value in variable.starts]


def _text(value: Value, type_: str) -> str:
    if isinstance(value, bytes):
        return value.hex()
    if type_ in REALS:
        return real_text(float(value))
    if type_ == "Boolean":
        return "true" if value else "false"
    return str(value) if type_ == "String" else str(int(value))


def states_of(outer: Sequence[OuterVariable]) -> dict[int, OuterVariable]:
    """The references of variables that are derivatives of others which are shown, too, and these."""
    shown = {(variable.elements[0][0].port[0], str(variable.shown.name)): variable for variable in outer if _is_plain(variable)}
    found = {}
    for (instance, name), variable in shown.items():
        of = variable.shown.derivative
        if of is not None and variable.type in REALS:
            base = len(name) if not variable.shown.dimensions or not name.endswith("]") else name.rindex("[")
            state = shown.get((instance, f"{of.name}{name[base:]}"))
            if state is not None and state.type == variable.type:
                found[variable.reference] = state
    return found


def _is_plain(variable: OuterVariable) -> bool:
    """Whether all its values are those inside."""
    targets = [target for element in variable.elements for target in element]
    return bool(targets) and all((target.gain, target.offset, target.mapping) == _IDENTITY for target in targets)


def initial_unknowns(outer: Sequence[OuterVariable]) -> list[OuterVariable]:
    """The outputs and calculated parameters that are calculated at the start."""
    return [v for v in outer if v.causality in ("output", "calculatedParameter") and initial_of(v) in ("calculated", "approx")]
