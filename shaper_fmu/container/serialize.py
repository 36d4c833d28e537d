"""Writes a system as the file that a container's library reads: the loop's arrays, the instances, and the outer variables.

The order of everything is that in which runtime/file.c reads it.
"""

from __future__ import annotations

import bisect
import struct
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np

from shaper_fmu.container.fields import EXTRA_TYPES, FieldKind, fields_of, layout_digest
from shaper_fmu.container.outside import OuterVariable
from shaper_fmu.container.planned import PlannedInstance, Symbols, function_of, instance_of
from shaper_fmu.container.routes import write_variables
from shaper_fmu.container.words import Words
from shaper_fmu.master import layout as of
from shaper_fmu.master.clocks import is_clocked
from shaper_fmu.master.fmu import Fmu
from shaper_fmu.master.program import Program
from shaper_fmu.master.transfer_writer import TYPES
from shaper_fmu.records import numpy_type

_MARK = int.from_bytes(b"SHAPER01", "big")
_CONFIGURATION, _INSTANTIATED, _INITIALIZATION = range(3)


@dataclass(frozen=True)
class Identity:
    """What the library has to know about the FMU that it is in: its name, the token of its description, its longest inner step [s],
    0 for that of the host, and whether all FMUs inside can save and serialize their states."""

    name: str
    token: str
    step: float
    can_save_states: bool
    can_serialize: bool


def system_file(
    identity: Identity,
    program: Program,
    control: of.Control,
    folders: Mapping[str, str],
    variables: Sequence[OuterVariable],
) -> bytes:
    """The file's content. `folders`: of the instances' FMUs, below the resources; `control` at the start of a run."""
    words, symbols = Words(), _symbols_of(program)
    words.whole(_MARK, layout_digest())
    words.text(identity.name)
    words.text(identity.token)
    words.real(identity.step)
    words.whole(int(identity.can_save_states), int(identity.can_serialize))
    body = Words()
    for name in program.names:
        _write_instance(body, program, name, folders[name], symbols)
    _write_arrays(body, program)
    body.array(_record_words(np.frombuffer(bytes(control), of.CONTROL), of.CONTROL, lambda number: 0).ravel())
    cuts = list(dict.fromkeys(program.cut_places()))
    body.whole(len(cuts), *cuts)
    _write_labels(body, program, symbols)
    write_variables(body, program, variables, symbols)
    words.texts(symbols.names)  # which the body has made complete
    words.whole(len(program.names))
    content = words.content() + body.content()
    return content + struct.pack("<Q", checksum(content))


def checksum(content: bytes) -> int:
    """FNV-1a, word by word, and the high bits mixed with the low ones (see file.c)."""
    found = 0xCBF29CE484222325
    for (word,) in struct.iter_unpack("<Q", content):
        found = (found ^ word) * 0x100000001B3 % (1 << 64)
        found ^= found >> 32
    return found


def _symbols_of(program: Program) -> Symbols:
    first = next(iter(program.instances.values()))
    assert isinstance(first, PlannedInstance)
    return first.symbols


def _write_instance(words: Words, program: Program, name: str, folder: str, symbols: Symbols) -> None:
    instance = program.instances[name]
    fmu = instance.fmu
    capabilities = fmu.capabilities
    words.text(name)
    words.text(folder)
    words.text(str(capabilities.modelIdentifier))
    words.text(str((fmu.description.instantiationToken if fmu.version == 3 else fmu.description.guid) or ""))
    events_logged = any(category.name == "logEvents" for category in fmu.description.logCategories)
    words.whole(fmu.version, int(instance.event_mode), int(instance.returns_early), int(events_logged))
    values = program.system.start_values[name]
    clocked = {key: value for key, value in values.items() if is_clocked(fmu, key)}
    others = {key: value for key, value in values.items() if key not in clocked}
    rows = [
        row
        for phase, chosen in ((_CONFIGURATION, fmu.structure), (_INSTANTIATED, others), (_INITIALIZATION, clocked))
        for row in _settings(program, name, phase, chosen)
    ]
    words.whole(len(rows))
    for phase, symbol, kind, reference, numbers in rows:
        words.whole(phase, symbols.number(symbol), kind, reference, len(numbers))
        for number in numbers:
            words.number(kind, number)


def _settings(program: Program, name: str, phase: int, values: Mapping[str, Any]) -> list[tuple[int, str, int, int, list[Any]]]:
    """What is set before the initialization: the phase, the function, the type of the values, the value reference, the values."""
    instance = program.instances[name]
    fmu: Fmu = instance.fmu
    rows = []
    for reference, elements in fmu.whole_variables(values):
        function, kind = TYPES[fmu.version][str(fmu.variables[elements[0]].type)]
        numbers = [values[element] if element in values else instance.start_value(element) for element in elements]
        rows.append((phase, f"fmi{fmu.version}Set{function}", kind, reference, numbers))
    return rows


class _Arrays:
    """The arrays that records point into."""

    def __init__(self, program: Program):
        self.extras = program.beside()
        arrays = [*program.layout, *self.extras]
        kinds = [*of.ELEMENTS.values(), *[None] * len(self.extras)]
        self._known = sorted(
            (array.ctypes.data, array.nbytes, number, array.itemsize if isinstance(kind, np.dtype) else 1)
            for number, (array, kind) in enumerate(zip(arrays, kinds, strict=True))
            if array.nbytes
        )
        self._begins = [begin for begin, *_ in self._known]

    def word(self, address: int) -> int:
        """A pointer in the file: 0, or the array's number + 1, and the place there, of a record or a byte."""
        if address == 0:
            return 0
        begin, size, number, unit = self._known[bisect.bisect_right(self._begins, address) - 1]
        offset = address - begin
        assert 0 <= offset <= size, "a pointer to nothing that is known"
        return (number + 1) << 40 | offset // unit


def _write_arrays(words: Words, program: Program) -> None:
    arrays = _Arrays(program)
    words.whole(len(arrays.extras))
    for array in arrays.extras:
        kind = next(i for i, name in enumerate(EXTRA_TYPES) if numpy_type(name) == array.dtype)
        words.whole(kind, array.size)
    for array in program.layout:
        words.whole(len(array))
    for array, kind in [*zip(program.layout, of.ELEMENTS.values(), strict=True)]:
        words.array(_record_words(array, kind, arrays.word).ravel())
    for array in arrays.extras:
        words.array(_number_words(array))


def _record_words(array: np.ndarray, kind: np.dtype | str, pointer: Any) -> np.ndarray:
    """Records as words, shape (records, fields); numbers as records of one field."""
    if isinstance(kind, str):
        return _number_words(array)[:, None]
    words = np.zeros((len(array), len(fields_of(kind))), np.uint64)
    for i, (name, field) in enumerate(fields_of(kind)):
        column = array[name]
        if field == FieldKind.POINTER:
            words[:, i] = [pointer(int(value)) for value in column]
        elif field == FieldKind.FUNCTION:
            words[:, i] = [_function_word(int(value)) for value in column]
        elif field == FieldKind.HANDLE:
            words[:, i] = [_instance_word(int(value)) for value in column]
        else:
            words[:, i] = _number_words(column)
    return words


def _function_word(number: int) -> int:
    """0, or the instance and the function."""
    found = function_of(number)
    return 0 if found is None else (found[0] + 1) << 32 | found[1]


def _instance_word(number: int) -> int:
    """0, or the instance's number + 1."""
    found = instance_of(number)
    return 0 if found is None else found + 1


def _number_words(array: np.ndarray) -> np.ndarray:
    if array.dtype.kind == "f":
        return array.astype(np.float64).view(np.uint64)
    return array.astype(np.int64 if array.dtype.kind == "i" else np.uint64).view(np.uint64)


def _write_labels(words: Words, program: Program, symbols: Symbols) -> None:
    """For messages: whose each transfer is, what it calls, and the names of its elements; and the clocks' names."""
    for name, function, elements in program.labels:
        words.whole(program.names.index(name), symbols.number(function))
        words.texts(elements)
    words.texts(".".join(port) for port in program.clocks.ports)
