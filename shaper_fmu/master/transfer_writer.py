"""The transfers of a program: which values one call of an FMI function moves, and where they are on the bus."""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, field
from typing import Any

from shaper_fmu.errors import ModelError
from shaper_fmu.master import layout as of
from shaper_fmu.master.description1 import own_scaling
from shaper_fmu.master.functions import standard_name
from shaper_fmu.master.instance import Instance
from shaper_fmu.master.wiring import Port

_FMI2 = {
    "Real": ("Real", of.F8),
    "Integer": ("Integer", of.I4),
    "Enumeration": ("Integer", of.I4),
    "Boolean": ("Boolean", of.BOOLEAN2),
}
_FMI1 = {**_FMI2, "Boolean": ("Boolean", of.BOOLEAN3)}  # both are one byte
_FMI3 = {
    "Float64": ("Float64", of.F8), "Float32": ("Float32", of.F4), "Int8": ("Int8", of.I1), "UInt8": ("UInt8", of.U1),
    "Int16": ("Int16", of.I2), "UInt16": ("UInt16", of.U2), "Int32": ("Int32", of.I4), "UInt32": ("UInt32", of.U4),
    "Int64": ("Int64", of.I8), "UInt64": ("UInt64", of.U8), "Enumeration": ("Int64", of.I8), "Boolean": ("Boolean", of.BOOLEAN3),
}  # fmt: skip
TYPES: Mapping[int, Mapping[str, tuple[str, int]]] = {1: _FMI1, 2: _FMI2, 3: _FMI3}
"""By version of FMI and type of a variable: how the functions that move it end, and the type of its values in memory."""

Operation = tuple[int, int]


@dataclass
class TransferWriter:
    """Arrays that grow while a layout is made."""

    instances: Mapping[str, Instance]
    numbers: dict[str, int]
    scaled: Mapping[Port, tuple[float, float]]
    mapped: Mapping[Port, Mapping[int, int]]
    closed: Mapping[Port, Mapping[int, int]]  # the same, of inputs that take no other values
    transfers: list[tuple[Any, ...]] = field(default_factory=list)
    labels: list[tuple[str, str, list[str]]] = field(default_factory=list)  # instance, function and elements of each transfer
    references: list[int] = field(default_factory=list)
    places: list[int] = field(default_factory=list)
    grouped: list[list[int]] = field(default_factory=list)  # the places of each transfer
    scalings: list[tuple[float, float]] = field(default_factory=list)  # of the elements, as they are set
    mappings: list[tuple[Mapping[int, int], bool]] = field(default_factory=list)  # of the elements, and whether they are closed
    size: int = 0
    _sparing: dict[tuple[object, ...], Operation] = field(default_factory=dict)  # sets of FMI 1.0's models, each once

    def transfer(
        self, verb: str, name: str, variables: Sequence[str], place: Callable[[str], int], calling: bool = True
    ) -> list[Operation]:
        """Transfers of these variables (scalars by name), one for each type; `place` tells where an element is on the bus.

        Without `calling` the values come as far as the transfer's memory (see `kept`), but not to the FMU. A model of FMI 1.0 is
        told values that differ alone: AMESim's take none between the end of a step, or their initialization, and the event.
        """
        instance = self.instances[name]
        fmu, types = instance.fmu, TYPES[instance.fmu.version]
        groups: dict[tuple[str, int], list[str]] = {}
        for variable in variables:
            kind = str(fmu.variables[variable].type)
            if kind not in types:
                raise ModelError([f"{name}.{variable} is of type {kind}; only numbers and booleans can be transferred"])
            groups.setdefault(types[kind], []).append(variable)
        return [self._group(verb, name, function, kind, chosen, place, calling) for (function, kind), chosen in groups.items()]

    def _group(
        self, verb: str, name: str, function: str, kind: int, chosen: list[str], place: Callable[[str], int], calling: bool
    ) -> Operation:
        instance = self.instances[name]
        version = instance.fmu.version
        wholes = instance.fmu.whole_variables(chosen)
        elements = [element for _, group in wholes for element in group]
        full_name = standard_name(f"fmi{instance.fmu.version}{verb}{function}")
        places = [place(element) for element in elements]
        sparing = version == 1 and instance.fmu.exchanges_model and verb == "Set" and calling
        key = (full_name, name, *elements, *places)
        if sparing and key in self._sparing:
            return self._sparing[key]
        self.size = -(-self.size // 8) * 8
        counts = len(self.references), len(wholes), len(self.places), len(elements)
        address = instance.address(full_name) if calling else 0
        if calling and not address:
            raise ModelError([f"{name}: the library of {instance.fmu.name} lacks the function {full_name}"])
        row = (address, instance.handle, version, kind, *counts, sparing, 0, self.size)
        self.transfers.append(row)
        self.labels.append((name, full_name, elements))
        self.references += [reference for reference, _ in wholes]
        self.grouped.append(places)
        self.places += places
        self.scalings += [self._scaling((name, element), verb == "Set") for element in elements]
        self.mappings += [self._mapping((name, element)) for element in elements]
        self.size += of.SIZES[kind] * len(elements)
        negated = verb == "Get" and any(scaling != (1.0, 0.0) for scaling in self.scalings[-len(elements) :])
        straight = version < 3 and kind == of.F8 and calling and not negated and not sparing
        code = (of.SET2 if straight else of.SET) if verb == "Set" else (of.GET2 if straight else of.GET)
        operation = code, len(self.transfers) - 1
        if sparing:
            self._sparing[key] = operation
        return operation

    def _scaling(self, port: Port, setting: bool) -> tuple[float, float]:
        """What an element's value is multiplied by, and what is added to it, on its way between the bus and the FMU."""
        sign, shift = own_scaling(self.instances[port[0]].fmu.variables[port[1]])
        gain, offset = self.scaled.get(port, (1.0, 0.0)) if setting else (1.0, 0.0)
        return (gain, offset) if sign == 1.0 else (sign * gain, sign * offset + shift)

    def _mapping(self, port: Port) -> tuple[Mapping[int, int], bool]:
        return (self.closed[port], True) if port in self.closed else (self.mapped.get(port, {}), False)

    def kept(self, sets: Sequence[Operation], place: Callable[[str], int | None]) -> list[Operation]:
        """Operations that bring what these transfers have set to the bus, without a call; `place` tells where, None for nowhere."""
        operations: list[Operation] = []
        for _, number in sets:
            name, _, elements = self.labels[number]
            kind, values = self.transfers[number][3], self.transfers[number][-1]
            for i, element in enumerate(elements):
                where = place(element)
                if where is not None:
                    self.transfers.append((0, 0, 0, kind, 0, 0, len(self.places), 1, 0, 0, values + of.SIZES[kind] * i))
                    self.labels.append((name, "", [element]))
                    self.grouped.append([where])
                    self.places.append(where)
                    self.scalings.append(self._scaling((name, element), False))
                    self.mappings.append(({}, False))
                    operations.append((of.KEEP, len(self.transfers) - 1))
        return operations
