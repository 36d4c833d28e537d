"""From a system and its live instances to the arrays of the compiled loop."""

from __future__ import annotations

from collections.abc import Callable, Collection, Iterable, Mapping, Sequence
from dataclasses import dataclass, field
from typing import Any

import numpy as np
from fmpy.model_description import ModelVariable

from shaper_fmu.errors import ModelError
from shaper_fmu.master import layout as of
from shaper_fmu.master.fmu import Fmu, kind_of
from shaper_fmu.master.instance import Instance
from shaper_fmu.master.linear_inputs import LinearInputs, lay_out, linear_inputs
from shaper_fmu.master.metrics import Metric, metric_rows, metric_variables
from shaper_fmu.master.signals import Table
from shaper_fmu.master.system import System
from shaper_fmu.master.wiring import Port

_FMI2 = {
    "Real": ("Real", of.F8),
    "Integer": ("Integer", of.I4),
    "Enumeration": ("Integer", of.I4),
    "Boolean": ("Boolean", of.BOOLEAN2),
}
_FMI3 = {
    "Float64": ("Float64", of.F8), "Float32": ("Float32", of.F4), "Int8": ("Int8", of.I1), "UInt8": ("UInt8", of.U1),
    "Int16": ("Int16", of.I2), "UInt16": ("UInt16", of.U2), "Int32": ("Int32", of.I4), "UInt32": ("UInt32", of.U4),
    "Int64": ("Int64", of.I8), "UInt64": ("UInt64", of.U8), "Enumeration": ("Int64", of.I8), "Boolean": ("Boolean", of.BOOLEAN3),
}  # fmt: skip

Operation = tuple[int, int]


@dataclass
class _Writer:
    """Arrays that grow while a layout is made."""

    instances: Mapping[str, Instance]
    numbers: dict[str, int]
    scaled: Mapping[Port, tuple[float, float]]
    transfers: list[tuple[Any, ...]] = field(default_factory=list)
    labels: list[tuple[str, str, list[str]]] = field(default_factory=list)  # instance, function and elements of each transfer
    references: list[int] = field(default_factory=list)
    places: list[int] = field(default_factory=list)
    grouped: list[list[int]] = field(default_factory=list)  # the places of each transfer
    scalings: list[tuple[float, float]] = field(default_factory=list)  # of the elements, as they are set
    size: int = 0

    def transfer(self, verb: str, name: str, variables: Sequence[str], place: Callable[[str], int]) -> list[Operation]:
        """Transfers of these variables (scalars by name), one for each type; `place` tells where an element is on the bus."""
        instance = self.instances[name]
        fmu, types = instance.fmu, _FMI3 if instance.fmu.version == 3 else _FMI2
        groups: dict[tuple[str, int], list[str]] = {}
        for variable in variables:
            kind = str(fmu.variables[variable].type)
            if kind not in types:
                raise ModelError([f"{name}.{variable} is of type {kind}; only numbers and booleans can be transferred"])
            groups.setdefault(types[kind], []).append(variable)
        return [self._group(verb, name, function, kind, chosen, place) for (function, kind), chosen in groups.items()]

    def _group(self, verb: str, name: str, function: str, kind: int, chosen: list[str], place: Callable[[str], int]) -> Operation:
        instance = self.instances[name]
        wholes = instance.fmu.whole_variables(chosen)
        elements = [element for _, group in wholes for element in group]
        full_name = f"fmi{instance.fmu.version}{verb}{function}"
        self.size = -(-self.size // 8) * 8
        counts = len(self.references), len(wholes), len(self.places), len(elements)
        handle, version = instance.entry_points()[:2]
        row = (instance.address(full_name), handle, version, kind, *counts, self.size)
        self.transfers.append(row)
        self.labels.append((name, full_name, elements))
        self.references += [reference for reference, _ in wholes]
        self.grouped.append([place(element) for element in elements])
        self.places += self.grouped[-1]
        self.scalings += [self.scaled.get((name, element), (1.0, 0.0)) for element in elements]
        self.size += of.SIZES[kind] * len(elements)
        straight = version == 2 and kind == of.F8
        code = (of.SET2 if straight else of.SET) if verb == "Set" else (of.GET2 if straight else of.GET)
        return code, len(self.transfers) - 1


class Program:
    """A system with live instances, laid out for the loop with one algorithm.

    Attributes:
        layout: the arrays.
        address: of their addresses, for the compiled loop.
        signals: places on the bus of signals that are Python functions, and the functions.
        labels: for each transfer, the instance, the FMI function and the names of the elements.
        names: the instances by number.
        linear_inputs: the inputs that are linear over each step.
        sources: for each transfer, where its elements are on the bus.
    """

    def __init__(
        self,
        system: System,
        instances: Mapping[str, Instance],
        recorded: Sequence[Port],
        algorithm: str,
        connections: Mapping[Port, Port],
        metrics: Mapping[str, Metric],
        exact: bool,
        linear: bool,
    ):
        self.system, self.instances, self.connections = system, instances, connections
        self.names = list(instances)
        self._algorithm = algorithm
        self._metrics = metrics
        self._event_ports = _event_ports(system) if exact else []
        ports: Iterable[Port] = [*connections.values(), *recorded, *system.ports(metric_variables(metrics)), *self._event_ports]
        self._places: dict[Any, int] = {port: i for i, port in enumerate(dict.fromkeys(ports))}
        self._unfed: dict[int, Port] = {}  # array elements that are set with others, but that nothing feeds
        for port in system.signals:
            self._places[("signal", *port)] = len(self._places)
        self.linear_inputs = linear_inputs(instances, connections) if linear else []
        for port in self.linear_inputs:
            self._places[("held", *connections[port])] = len(self._places)
        self._writer = _Writer(instances, {name: i for i, name in enumerate(self.names)}, system.scalings)
        self.signals = [
            (self._places[("signal", *port)], signal) for port, signal in system.signals.items() if not isinstance(signal, Table)
        ]
        self._linear = self._lay_out_linear_inputs()
        programs = self._programs()
        self.labels = self._writer.labels
        self.layout = self._layout(programs, recorded)
        self._addresses = of.addresses_of(self.layout)
        self.address = self._addresses.ctypes.data

    def reset(self) -> None:
        """Bring what the loop changes back to the state before a run, whose start values have been set."""
        self.layout.tables["cursor"] = self.layout.tables["first"]
        self.layout.instances["next_event"] = of.NO_EVENT
        self.layout.bus[:] = 0.0
        self.layout.metrics["time"] = np.nan
        self.layout.slopes["previous_time"] = self.layout.slopes["held_time"] = np.nan
        for place, (name, variable) in self._unfed.items():
            self.layout.bus[place] = float(self.instances[name].start_value(variable))

    def continuous_places(self) -> np.ndarray:
        """Places on the bus of real outputs, but for announced times of events."""
        events = _event_ports(self.system)
        ports = [key for key in self._places if len(key) == 2 and key not in events]
        reals = [port for port in ports if kind_of(self.system.fmus[port[0]].variables[port[1]]) == "real"]
        return np.array([self._places[port] for port in reals], np.int64)

    def _has_tables(self) -> bool:
        return any(isinstance(signal, Table) for signal in self.system.signals.values())

    def _inputs_of(self, name: str) -> list[str]:
        return [variable for instance, variable in [*self.system.signals, *self.connections] if instance == name]

    def _source_place(self, name: str, held: Collection[Port] = ()) -> Callable[[str], int]:
        """Where the source of an input element is on the bus; elements that nothing feeds keep their start value.

        Those in `held` get the value that their source had at the beginning of the step.
        """

        def place(variable: str) -> int:
            port = (name, variable)
            if port in held:
                return self._places["held", *self.connections[port]]
            if port in self.connections:
                return self._places[self.connections[port]]
            if port in self.system.signals:
                return self._places[("signal", *port)]
            key = ("constant", *port)
            if key not in self._places:
                self._places[key] = len(self._places)
                self._unfed[self._places[key]] = port
            return self._places[key]

        return place

    def _reading(self, name: str, chosen: Callable[[str], bool]) -> list[Operation]:
        """Transfers that bring the instance's variables to their places."""
        variables = [port[1] for port in self._places if len(port) == 2 and port[0] == name and chosen(port[1])]

        def place(variable: str) -> int:
            if (name, variable) in self._places:
                return self._places[name, variable]
            return self._places.setdefault(("spare", name, variable), len(self._places))

        return self._writer.transfer("Get", name, variables, place) if variables else []

    def _programs(self) -> dict[str, list[Operation]]:
        writer, system = self._writer, self.system
        early = {name for name in self.names if self.instances[name].returns_early}
        order = sorted(self.names, key=lambda name: name not in early)  # the first to step may end the step for all
        step_of = {name: (of.STEP2 if self.instances[name].fmu.version == 2 else of.STEP3, writer.numbers[name]) for name in order}
        steps = list(step_of.values())
        reads = {name: self._reading(name, lambda variable: True) for name in self.names}
        read_all = [operation for operations in reads.values() for operation in operations]
        linear = {name: [(of.SLOPES, i)] for name, i in self._linear.calls.items()}
        sets = {
            name: writer.transfer("Set", name, self._inputs_of(name), self._source_place(name, self.linear_inputs))
            for name in system.instance_order()
            if self._inputs_of(name)
        }
        exchange: list[Operation] = [(of.TABLES_NOW, 0)] if self._has_tables() else []
        for name, inputs in self._ordered_inputs():
            exchange += writer.transfer("Set", name, inputs, self._source_place(name))
            exchange += self._reading(name, self._follows(name, set(inputs)))
        before = [(of.TABLES_BEFORE, 0)] if self._has_tables() else []
        hold = [(of.HOLD, 0)] if linear else []
        before += hold
        slopes = [operation for operations in linear.values() for operation in operations]
        if self._algorithm == "jacobi":
            step = [*hold, *slopes, *steps, *read_all]
        elif self._algorithm == "parallel":
            step = [*before, *[o for operations in sets.values() for o in operations], *slopes, *steps, *read_all]
        else:
            step = list(before)
            for name in system.instance_order():
                step += [*sets.get(name, []), *linear.get(name, []), step_of[name], *reads[name]]
        return {"step": step, "exchange": exchange, "read": read_all}

    def _lay_out_linear_inputs(self) -> LinearInputs:
        order = self.system.instance_order()

        def places(port: Port) -> tuple[int, int]:
            source = self.connections[port]
            return self._places[source], self._places["held", *source]

        def known(port: Port) -> bool:
            before = order.index(self.connections[port][0]) < order.index(port[0])
            return self._algorithm == "gauss_seidel" and before

        return lay_out(
            self.linear_inputs, self.instances, places, lambda port: self.system.scalings.get(port, (1.0, 0.0))[0], known
        )

    def _follows(self, name: str, inputs: set[str]) -> Callable[[str], bool]:
        fmu = self.instances[name].fmu

        def follows(variable: str) -> bool:
            followed = fmu.variables[variable].causality == "output" and not inputs.isdisjoint(fmu.inputs_of(variable))
            return followed or variable in inputs

        return follows

    def _ordered_inputs(self) -> list[tuple[str, list[str]]]:
        """Signals from outside first, then connections with causes before effects; neighbours of one instance together."""
        grouped: list[tuple[str, list[str]]] = []
        for name, variable in [*self.system.signals, *self.system.signal_order()[0]]:
            if not grouped or grouped[-1][0] != name:
                grouped.append((name, []))
            grouped[-1][1].append(variable)
        return grouped

    def _layout(self, programs: dict[str, list[Operation]], recorded: Sequence[Port]) -> of.Layout:
        writer = self._writer
        instances = np.zeros(len(self.names), of.INSTANCE)
        answers = -(-writer.size // 8) * 8
        memory = np.zeros((answers + 64 * len(instances)) // 8 + 1)
        references = np.array(writer.references or [0], np.uint32)
        transfers = np.array(writer.transfers, of.TRANSFER)
        transfers["values"] += np.uint64(memory.ctypes.data)
        transfers["references"] = transfers["references"] * 4 + np.uint64(references.ctypes.data)
        bus, elements = np.zeros(max(1, len(self._places))), np.zeros(max(1, len(writer.places)), of.ELEMENT)
        transfers["elements"] = transfers["elements"] * of.ELEMENT.itemsize + np.uint64(elements.ctypes.data)
        for element, place, (gain, shift) in zip(elements, writer.places, writer.scalings, strict=False):
            element["bus"], element["gain"], element["shift"] = bus.ctypes.data + 8 * place, gain, shift
        self.sources = writer.grouped
        for i, instance in enumerate(self.instances.values()):
            instances[i] = (*instance.entry_points(), memory.ctypes.data + answers + 64 * i, of.NO_EVENT)
        tables = [
            (self._places[("signal", *port)], signal) for port, signal in self.system.signals.items() if isinstance(signal, Table)
        ]
        rows, first = np.zeros(len(tables), of.TABLE), 0
        for i, (place, table) in enumerate(tables):
            rows[i] = (place, table.linear, first, len(table.times), first)
            first += len(table.times)
        joined = [np.concatenate([getattr(table, part) for _, table in tables] or [np.empty(0)]) for part in ("times", "values")]
        return of.Layout(
            instances=instances,
            transfers=transfers,
            elements=elements,
            references=references,
            memory=memory,
            bus=bus,
            tables=rows,
            table_times=joined[0],
            table_values=joined[1],
            jumps=np.unique(np.concatenate([table.jumps() for _, table in tables] or [np.empty(0)])),
            event_places=np.array([self._places[port] for port in self._event_ports], np.int32),
            recorded=np.array([self._places[port] for port in recorded], np.int32),
            metrics=metric_rows(self._metrics, self._places),
            step_program=np.array(programs["step"], np.int32).reshape(-1, 2),
            exchange_program=np.array(programs["exchange"], np.int32).reshape(-1, 2),
            read_program=np.array(programs["read"], np.int32).reshape(-1, 2),
            slopes=self._linear.slopes,
            slopes_of=self._linear.slopes_of,
        )


def _event_ports(system: System) -> list[Port]:
    """The outputs that announce events: those called next_event_time, and those that the user named."""
    found = [(name, "next_event_time") for name, fmu in system.fmus.items() if _announces(fmu)]
    return [*found, *[port for port in system.event_outputs if port not in found]]


def _announces(fmu: Fmu) -> bool:
    variable: ModelVariable | None = fmu.variables.get("next_event_time")
    return variable is not None and variable.causality == "output"
