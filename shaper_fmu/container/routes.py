"""Writes the outer variables of a container, and the way from each to what it stands for inside.

Inputs, and outputs that are numbers or booleans, are on the loop's bus. All others are set and read by calls of the FMUs; there an
array of FMI 3.0 goes as a whole.
"""

from __future__ import annotations

from collections.abc import Sequence
from enum import IntEnum
from typing import Any

from shaper_fmu.container.outside import OuterVariable, Target
from shaper_fmu.container.planned import Symbols
from shaper_fmu.container.words import Words
from shaper_fmu.errors import ModelError
from shaper_fmu.master import layout as of
from shaper_fmu.master.instance import Instance
from shaper_fmu.master.program import Program
from shaper_fmu.master.transfer_writer import TYPES
from shaper_fmu.master.variables import TRANSFERABLE, kind_of
from shaper_fmu.master.wiring import Port

STRING, BINARY = 12, 13
"""Types of values that the loop does not move; the others have the numbers of layout_numbers.ValueType."""


_TYPES_OUTSIDE: dict[str, int] = {
    **{name: kind for version in (3, 2) for name, (_, kind) in TYPES[version].items()},
    "Enumeration": of.I8, "Boolean": of.BOOLEAN2, "String": STRING, "Binary": BINARY,
}  # fmt: skip
"""Types of outer variables; enumerations and booleans of FMI 2.0 and 3.0 are one here."""


class Settable(IntEnum):
    """When an outer variable may be set."""

    NEVER, BEFORE_START, ALWAYS, INPUT = range(4)


def is_on_bus(variable: OuterVariable, program: Program) -> bool:
    """Whether an outer variable's values are on the bus."""
    port = variable.elements[0][0].port
    kind = kind_of(program.instances[port[0]].fmu.variables[port[1]])
    return kind in TRANSFERABLE and variable.causality in ("input", "output")


def outer_outputs(variables: Sequence[OuterVariable], fmus: Any) -> list[Port]:
    """The ports whose values the loop has to bring to the bus for outer variables."""
    ports = [
        target.port
        for variable in variables
        if variable.causality == "output"
        for element in variable.elements
        for target in element
    ]
    return [port for port in dict.fromkeys(ports) if kind_of(fmus[port[0]].variables[port[1]]) in TRANSFERABLE]


def write_variables(words: Words, program: Program, variables: Sequence[OuterVariable], symbols: Symbols) -> None:
    """Write all outer variables, each at the place that is its reference, and before them what calls move inside as a whole."""
    wholes = _Wholes(program)
    body = Words()
    for variable in variables:
        _write_variable(body, program, variable, wholes)
    words.whole(len(wholes.rows))
    for name, reference, elements in wholes.rows:
        _write_whole(words, program, name, reference, elements, symbols)
    unused = variables[0].reference if variables else 0
    words.whole(unused + len(variables))
    for _ in range(unused):
        words.text("")
        words.whole(0, Settable.NEVER, 0, 0)
    words.append(body)


class _Wholes:
    """The arrays and scalars of the FMUs that calls move, each once."""

    def __init__(self, program: Program):
        self._program = program
        self._numbers: dict[tuple[str, int, tuple[str, ...]], int] = {}

    @property
    def rows(self) -> list[tuple[str, int, tuple[str, ...]]]:
        return list(self._numbers)

    def place(self, port: Port) -> tuple[int, int]:
        """The number of the array or scalar that an element belongs to, and its place there."""
        ((reference, elements),) = self._program.instances[port[0]].fmu.whole_variables([port[1]])
        key = (port[0], reference, tuple(elements))
        return self._numbers.setdefault(key, len(self._numbers)), elements.index(port[1])


def _type_inside(program: Program, port: Port) -> tuple[str, int]:
    fmu = program.instances[port[0]].fmu
    kind = str(fmu.variables[port[1]].type)
    return {"String": ("String", STRING), "Binary": ("Binary", BINARY)}.get(kind) or TYPES[fmu.version][kind]


def _write_whole(words: Words, program: Program, name: str, reference: int, elements: Sequence[str], symbols: Symbols) -> None:
    instance = program.instances[name]
    function, kind = _type_inside(program, (name, elements[0]))
    version = instance.fmu.version
    words.whole(program.names.index(name), version, kind, reference, len(elements))
    words.whole(*[symbols.number(f"fmi{version}{verb}{function}") for verb in ("Get", "Set")])
    tunable = instance.fmu.variables[elements[0]].variability == "tunable"
    words.whole(int(tunable and instance.event_mode))  # then it is set in event mode alone
    starts = _starts(instance, elements) if len(elements) > 1 and kind < STRING else []
    words.whole(int(bool(starts)))
    for value in starts:
        words.number(kind, value)


def _starts(instance: Instance, elements: Sequence[str]) -> list[float | int | bool]:
    """The start values of an array's elements, of which some may be set without the others; none for an array that is never set."""
    try:
        return [instance.start_value(element) for element in elements]
    except ModelError:
        return []


def _settable(variable: OuterVariable) -> Settable:
    if variable.causality == "input":
        return Settable.INPUT
    if variable.causality == "parameter":
        return Settable.ALWAYS if variable.variability == "tunable" else Settable.BEFORE_START
    return Settable.BEFORE_START if variable.starts and variable.variability != "constant" else Settable.NEVER


def _write_variable(words: Words, program: Program, variable: OuterVariable, wholes: _Wholes) -> None:
    kind = _TYPES_OUTSIDE[variable.type]
    on_bus = is_on_bus(variable, program)
    words.text(variable.name)
    words.whole(kind, _settable(variable), int(on_bus), len(variable.elements))
    for i, element in enumerate(variable.elements):
        start = variable.starts[i] if i < len(variable.starts) else 0.0
        words.real(float(start) if on_bus and variable.causality == "input" else 0.0)
        words.whole(len(element))
        for target in element:
            _write_target(words, program, variable, target, on_bus, wholes)
        _write_steered(words, program, element if on_bus and kind == of.F8 and variable.causality == "input" else ())


def _write_target(words: Words, program: Program, variable: OuterVariable, target: Target, on_bus: bool, wholes: _Wholes) -> None:
    if on_bus:
        is_input = variable.causality == "input"
        place = program.signal_place(target.port) if is_input else program.place(target.port)
        words.whole(place, 0)
        scaled = (1.0, 0.0, ()) if is_input else (target.gain, target.offset, target.mapping)
    else:
        words.whole(*wholes.place(target.port))
        scaled = (target.gain, target.offset, target.mapping)
    gain, offset, mapping = scaled
    words.real(gain, offset)
    words.whole(len(mapping))
    words.real(*[float(number) for pair in mapping for number in pair])


def steered(program: Program, element: Sequence[Target]) -> list[Target]:
    """What an input stands for inside that takes its time derivative."""
    return [target for target in element if program.instances[target.port[0]].takes_input_derivatives]


def _write_steered(words: Words, program: Program, element: Sequence[Target]) -> None:
    chosen = steered(program, element)
    words.whole(len(chosen))
    for target in chosen:
        name, variable = target.port
        words.whole(program.names.index(name), program.instances[name].fmu.variables[variable].valueReference)
        words.real(target.gain)
