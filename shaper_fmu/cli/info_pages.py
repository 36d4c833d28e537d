"""Prints the facts about FMUs and systems for people: as lines, tables and a tree."""

from __future__ import annotations

import textwrap
from collections.abc import Iterator, Mapping, Sequence

from shaper_fmu.cli.info_commands import Answer
from shaper_fmu.cli.info_words import capabilities, count, experiment, fmu_line, plain, size, value
from shaper_fmu.console import out, show
from shaper_fmu.info.facts import ConnectionInfo, ElementInfo, FmuInfo, SetInfo, SspInfo, VariableInfo
from shaper_fmu.page.blocks import Table

_FIRST = 20
_FIRST_VALUES = 5
_OTHERS = {"calculatedParameter": "calculated parameter"}


def show_fmu(fmu: FmuInfo, commands: Sequence[Answer], everything: bool) -> None:
    """Print the page of an FMU."""
    _facts(fmu.name, fmu.description, _fmu_facts(fmu))
    for what, variables in (("input", fmu.inputs), ("output", fmu.outputs), ("parameter", fmu.parameters)):
        _show_variables(what, variables, everything)
    out.print()
    _show_commands(commands)


def show_system(system: SspInfo, commands: Sequence[Answer], everything: bool) -> None:
    """Print the page of a system."""
    _facts(system.name, system.description, _system_facts(system))
    out.print()
    for line in _tree(system.system, system.fmus, "", "", everything):
        out.print(line)
    for one in system.parameter_sets:
        out.print(_wrapped("parameter set ", f"{plain(one.source)}: {_values_text(one, everything)}"))
    out.print()
    _show_commands(commands)


def _facts(name: str, description: str, facts: Mapping[str, str]) -> None:
    out.print(_wrapped("", f"{plain(name)}: {plain(description)}" if description else plain(name)))
    width = max(map(len, facts)) + 2
    for label, text in facts.items():
        if text:
            out.print(_wrapped(f"{label:{width}}", text))


def _fmu_facts(fmu: FmuInfo) -> dict[str, str]:
    kinds = {interface.kind: capabilities(interface.capabilities) or "no capabilities declared" for interface in fmu.interfaces}
    binaries = [f"{plain(one.name)}{' (this machine)' if one.is_this else ''}" for one in fmu.libraries]
    sources = [f"source code ({count(fmu.sources, 'file')})"] if fmu.sources else []
    states = [count(fmu.continuous_states, "continuous state"), count(fmu.event_indicators, "event indicator")]
    others = [count(number, _OTHERS.get(causality, f"{plain(causality)} variable")) for causality, number in fmu.others.items()]
    return {
        "file": f"{plain(fmu.file)}, {size(fmu.size)}",
        "FMI": f"{plain(fmu.fmi_version)}, {', '.join(fmu.kinds) or 'of no kind'}{' only' if len(fmu.kinds) == 1 else ''}",
        "made by": " ".join(filter(None, (plain(fmu.tool) or "not declared", plain(fmu.generated)))),
        "version": plain(fmu.version),
        "author": plain(fmu.author),
        "licence": plain(fmu.licence),
        **kinds,
        "platforms": ", ".join(binaries + sources) or "none: it has neither libraries nor source code",
        "states": ", ".join(states),
        "experiment": experiment(fmu.experiment),
        "besides": ", ".join(others),
    }


def _show_variables(what: str, variables: Sequence[VariableInfo], everything: bool) -> None:
    out.print()
    if not variables:
        out.print(f"no {what}s")
        return
    shown = variables if everything else variables[:_FIRST]
    rows = [[plain(v.name), _type(v), plain(v.unit), value(v), plain(v.description)] for v in shown]
    head = [what, "type", "unit", "start", "description"]
    filled = [i for i in range(len(head)) if i < 2 or any(row[i] for row in rows)]
    show(Table(count(len(variables), what), [head[i] for i in filled], [[row[i] for i in filled] for row in rows], True))
    for one in shown:
        if one.items:
            items = [f"{plain(name)} = {number}" for name, number in one.items.items()]
            out.print(_wrapped(f"{plain(one.name)}: ", _first(items, _FIRST, everything), "    "))
    if len(variables) > len(shown):
        out.print(f"... and {len(variables) - len(shown)} more {what}s; --all shows all")


def _type(variable: VariableInfo) -> str:
    shape = "".join(f"[{plain(str(one))}]" for one in variable.dimensions)
    tunable = ", tunable" if variable.causality == "parameter" and variable.variability == "tunable" else ""
    structural = ", structural" if variable.causality == "structuralParameter" else ""
    return f"{plain(variable.type)}{shape}{tunable}{structural}"


def _show_commands(commands: Sequence[Answer]) -> None:
    rows = [[one.command, one.takes, plain(one.reason)] for one in commands]
    show(Table("Which commands take it", ["command", "takes it", "why not, or with what"], rows, left_aligned=True))


def _system_facts(system: SspInfo) -> dict[str, str]:
    others = [plain(name) for name in system.variants if name != system.variant]
    variants = f"{plain(system.variant)}{'; others: ' if others else ''}{', '.join(others)}"
    return {
        "file": f"{plain(system.file)}, {size(system.size)}",
        "SSP": plain(system.version),
        "made by": " ".join(filter(None, (plain(system.tool) or "not declared", plain(system.generated)))),
        "variant": variants,
        "FMUs": count(len(system.fmus), "file"),
        "experiment": experiment(system.experiment),
    }


def _tree(element: ElementInfo, fmus: Mapping[str, FmuInfo], first: str, rest: str, everything: bool) -> Iterator[str]:
    """The lines of an element and all in it; `first` is before its first line, `rest` before the others."""
    yield _wrapped(first, _heading(element), rest)
    inner = rest + ("│   " if element.elements else "    ")
    for text in _details(element, fmus, everything):
        yield _wrapped(inner, text, inner + "  ")
    shown = element.elements if everything else element.elements[:_FIRST]
    left = len(element.elements) - len(shown)
    for i, one in enumerate(shown):
        last = i == len(shown) - 1 and not left
        yield from _tree(one, fmus, f"{rest}{'└──' if last else '├──'} ", f"{rest}{'    ' if last else '│   '}", everything)
    if left:
        yield f"{rest}└── ... and {left} more elements; --all shows all"


def _heading(element: ElementInfo) -> str:
    name = plain(element.name) or "(no name)"
    if element.kind == "system":
        return f"{name} (system{f' of {plain(element.source)}' if element.source else ''})"
    if element.kind == "signal dictionary":
        return f"{name} (signal dictionary {plain(element.source)})"
    return f"{name}: {plain(element.source) or 'no source'}"


def _details(element: ElementInfo, fmus: Mapping[str, FmuInfo], everything: bool) -> Iterator[str]:
    """What belongs to an element itself: its FMU or connectors, its values, its connections."""
    if element.description:
        yield plain(element.description)
    if element.fmu:
        asked = f"; used as {plain(element.implementation)}" if element.implementation != "any" else ""
        yield fmu_line(fmus[element.fmu]) + asked
    if element.problem:
        yield f"no FMU: {plain(element.problem)}"
    if element.kind != "component" and element.connectors:
        yield from _connectors(element, everything)
    for one in element.values:
        prefix = f" (prefix {plain(one.prefix)})" if one.prefix else ""
        yield f"values {plain(one.source) or 'inline'}{prefix}: {_values_text(one, everything)}"
    shown = element.connections if everything else element.connections[:_FIRST]
    for connection in shown:
        yield _connection(connection)
    if len(element.connections) > len(shown):
        yield f"... and {len(element.connections) - len(shown)} more connections; --all shows all"


def _connectors(element: ElementInfo, everything: bool) -> Iterator[str]:
    kinds: dict[str, list[str]] = {}
    for one in element.connectors:
        kinds.setdefault(one.kind, []).append(f"{plain(one.name)}{f' [{plain(one.unit)}]' if one.unit else ''}")
    for kind, names in kinds.items():
        yield f"{plain(kind)}: {_first(names, _FIRST, everything)}"


def _values_text(one: SetInfo, everything: bool) -> str:
    if one.values is None:
        return "cannot be read"
    texts = [f"{plain(name)} = {plain(text)}" for name, text in one.values.items()]
    return _first(texts, _FIRST_VALUES, everything) or "empty"


def _first(texts: Sequence[str], most: int, everything: bool) -> str:
    shown = texts if everything else texts[:most]
    return ", ".join(shown) + (f" and {len(texts) - len(shown)} more" if len(texts) > len(shown) else "")


def _connection(one: ConnectionInfo) -> str:
    ends = [
        f"{plain(name)}{f' [{plain(unit)}]' if unit else ''}"
        for name, unit in ((one.source, one.source_unit), (one.target, one.target_unit))
    ]
    change = f" ({plain(one.change)})" if one.change else ""
    return f"{(' -> ' if one.laid else ' - ').join(ends)}{change}{'' if one.laid else ': no connection; check tells why'}"


def _wrapped(first: str, text: str, rest: str | None = None) -> str:
    """A text behind `first`, broken between words on a terminal, the other lines behind `rest` or as many spaces."""
    following = " " * len(first) if rest is None else rest
    room = out.width - max(len(first), len(following))
    if not out.breaks_lines or room < 20:
        return first + text
    lines = textwrap.wrap(text, room, break_long_words=False, break_on_hyphens=False) or [""]
    return first + f"\n{following}".join(lines)
