"""The words in which `shaper-fmu info` tells facts; texts of foreign files become safe to print."""

from __future__ import annotations

from collections.abc import Mapping

from shaper_fmu.info.facts import Experiment, FmuInfo, Value, VariableInfo

_LONGEST = 200
_UNITS = ("bytes", "kB", "MB", "GB")


def plain(text: str) -> str:
    """A text in one line; characters that would move the cursor, turn the direction or not be seen are written as their codes.

    Of a long text only the beginning is kept.
    """
    one_line = " ".join(text.split())
    shown = one_line[:_LONGEST]
    safe = "".join(one if one.isprintable() else one.encode("unicode_escape", "replace").decode() for one in shown)
    return f"{safe}... ({len(one_line)} characters)" if len(one_line) > _LONGEST else safe


def count(number: int, what: str) -> str:
    """A number of things: "1 input", "2 inputs"."""
    return f"{number} {what}{'' if number == 1 else 's'}"


def size(number: float) -> str:
    """A size in bytes, with three digits."""
    for unit in _UNITS[:-1]:
        if number < 999.5:
            return f"{number:.3g} {unit}"
        number /= 1000.0
    return f"{number:.3g} {_UNITS[-1]}"


def capabilities(declared: Mapping[str, bool | float | str]) -> str:
    """Capabilities by the standard's names, numbers with their value."""
    return ", ".join(plain(name) if found is True else f"{plain(name)}={_value(found)}" for name, found in declared.items())


def experiment(one: Experiment) -> str:
    """A default experiment; "" if nothing is declared."""
    parts = []
    if one.stop is not None:
        parts.append(f"{one.start or 0.0:g} to {one.stop:g} s")
    if one.step is not None:
        parts.append(f"steps of {one.step:g} s")
    if one.tolerance is not None:
        parts.append(f"tolerance {one.tolerance:g}")
    if one.algorithm:
        parts.append(f"algorithm {one.algorithm} (annotation of {one.tool})")
    return ", ".join(parts)


def fmu_line(fmu: FmuInfo) -> str:
    """An FMU in one line."""
    kinds = ", ".join(fmu.kinds) or "of no kind"
    numbers = [
        count(len(found), what) for found, what in ((fmu.inputs, "input"), (fmu.outputs, "output"), (fmu.parameters, "parameter"))
    ]
    states = count(fmu.continuous_states, "continuous state")
    only = " only" if len(fmu.kinds) == 1 else ""
    return f"FMI {plain(fmu.fmi_version)}, {kinds}{only}; {', '.join([*numbers, states])}; {size(fmu.size)}"


def value(variable: VariableInfo) -> str:
    """A variable's start value; of an enumeration the item's name."""
    if variable.start is None:
        return ""
    if isinstance(variable.start, list):
        return plain(" ".join(_value(one, variable.items) for one in variable.start[:100]))
    return _value(variable.start, variable.items)


def _value(one: Value, items: Mapping[str, int] | None = None) -> str:
    for name, number in (items or {}).items():
        if number == one:
            return plain(name)
    if isinstance(one, bool):
        return str(one).lower()
    return f"{one:.15g}" if isinstance(one, float) else plain(str(one))
