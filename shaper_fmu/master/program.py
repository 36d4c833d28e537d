"""From a system and its live instances to the arrays of the compiled loop."""

from __future__ import annotations

from collections.abc import Callable, Collection, Iterable, Mapping, Sequence
from typing import Any

import numpy as np
from fmpy.model_description import ModelVariable

from shaper_fmu.master import layout as of
from shaper_fmu.master.fmu import Fmu, kind_of
from shaper_fmu.master.guards import TABLES, causes_of_inputs
from shaper_fmu.master.instance import Instance
from shaper_fmu.master.linear_inputs import LinearInputs, lay_out, linear_inputs
from shaper_fmu.master.metrics import Metric, metric_rows, metric_variables
from shaper_fmu.master.signals import Table
from shaper_fmu.master.system import System
from shaper_fmu.master.transfer_writer import Operation, TransferWriter
from shaper_fmu.master.wiring import Port


class Program:
    """A system with live instances, laid out for the loop with one algorithm.

    Attributes:
        layout: the arrays.
        address: of their addresses, for the compiled loop.
        signals: places on the bus of signals that are Python functions, and the functions.
        labels: for each transfer, the instance, the FMI function and the names of the elements.
        names: the instances by number.
        linear_inputs: the inputs that are linear over each step.
        loops: the loops of direct feedthrough, each cut at its first input.
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
        starts: Collection[Port] = (),
    ):
        self.system, self.instances, self.connections = system, instances, connections
        self.names = list(instances)
        self._algorithm = algorithm
        self._starts = starts
        self._order, self.loops = system.signal_order()
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
        self._writer = TransferWriter(instances, {name: i for i, name in enumerate(self.names)}, system.scalings, system.mappings)
        self.signals = [
            (self._places[("signal", *port)], signal) for port, signal in system.signals.items() if not isinstance(signal, Table)
        ]
        self._linear = self._lay_out_linear_inputs()
        announcing = {port[0] for port in self._event_ports} | {name for name in self.names if instances[name].event_mode}
        self._causes = causes_of_inputs(system, connections, announcing) if exact else {}
        self._guards: list[tuple[int, ...]] = []
        self._cause_codes: list[int] = []
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

    def start_places(self) -> list[int]:
        """Where the start values that a batch sets are on the bus, in their order."""
        return [self._places["start", *port] for port in self._starts]

    def place(self, port: Port) -> int:
        """Where the value of an output that is connected, recorded or measured is on the bus."""
        return self._places[port]

    def reads_locals(self) -> bool:
        """Whether there are variables that are no outputs, of which no FMU declares what they follow."""
        ports = [key for key in self._places if len(key) == 2]
        return any(self.instances[name].fmu.variables[variable].causality == "local" for name, variable in ports)

    def has_unfed_elements(self) -> bool:
        """Whether elements of arrays are set with others although nothing feeds them: they have to be asked for."""
        return bool(self._unfed)

    def _starting(self, name: str) -> list[Operation]:
        """Transfers that set an instance's start values."""
        variables = [port[1] for port in self._starts if port[0] == name]

        def place(variable: str) -> int:
            return self._places.setdefault(("start", name, variable), len(self._places))

        return self._writer.transfer("Set", name, variables, place) if variables else []

    def cut_places(self) -> list[int]:
        """Where the sources of the cut inputs are on the bus."""
        return [self._places[self.connections[loop[0]]] for loop in self.loops]

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
            exchange += self._guarded(name, writer.transfer("Set", name, inputs, self._source_place(name)))
            exchange += self._reading(name, self._follows(name, set(inputs)))
        guarded_sets = [o for name, operations in sets.items() for o in self._guarded(name, operations)]
        before = [(of.TABLES_BEFORE, 0)] if self._has_tables() else []
        hold = [(of.HOLD, 0)] if linear else []
        before += hold
        slopes = [operation for operations in linear.values() for operation in operations]
        jump = [*before, *guarded_sets, *slopes, *steps, *read_all]
        if self._algorithm == "jacobi":
            step = jump = [*hold, *slopes, *steps, *read_all]
        elif self._algorithm == "parallel":
            step = jump
        else:  # what an instance gives at an event belongs to the next step of the others
            step = list(before)
            for name in system.instance_order():
                step += [*sets.get(name, []), *linear.get(name, []), step_of[name], *reads[name]]
        start = [operation for name in self.names for operation in self._starting(name)]
        return {"start": start, "step": step, "jump": jump, "exchange": exchange, "read": read_all}

    def _guarded(self, name: str, operations: list[Operation]) -> list[Operation]:
        """The operations that set an instance's inputs, behind a guard where it makes something of every change of them."""
        if name not in self._causes:
            return operations
        self._guards.append((len(self._cause_codes), len(self._causes[name]), len(operations), 0, 1))
        for cause in self._causes[name]:
            port = next((port for port in self._event_ports if port[0] == cause), None)
            instance = -1 - self._writer.numbers.get(cause, 0)
            self._cause_codes.append(of.JUMPS if cause == TABLES else self._places[port] if port else instance)
        return [(of.GUARDED, len(self._guards) - 1), *operations]

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
        for name, variable in [*self.system.signals, *self._order]:
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
        mappings = np.array([pair for mapping in writer.mappings for pair in mapping.items()] or [(0, 0)], float)
        mapped = 0
        for i, (place, scaling, pairs) in enumerate(zip(writer.places, writer.scalings, writer.mappings, strict=True)):
            elements[i] = (bus.ctypes.data + 8 * place, *scaling, mappings.ctypes.data + 16 * mapped, len(pairs))
            mapped += len(pairs)
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
            metrics=metric_rows(self._metrics, lambda name: self._places[self.system.split(name)]),
            step_program=np.array(programs["step"], np.int32).reshape(-1, 2),
            exchange_program=np.array(programs["exchange"], np.int32).reshape(-1, 2),
            read_program=np.array(programs["read"], np.int32).reshape(-1, 2),
            slopes=self._linear.slopes,
            slopes_of=self._linear.slopes_of,
            jump_program=np.array(programs["jump"], np.int32).reshape(-1, 2),
            guards=np.array(self._guards, of.GUARD),
            causes=np.array(self._cause_codes or [0], np.int32),
            start_program=np.array(programs["start"], np.int32).reshape(-1, 2),
            mappings=mappings.ravel(),
        )


def _event_ports(system: System) -> list[Port]:
    """The outputs that announce events: those called next_event_time, and those that the user named."""
    found = [(name, "next_event_time") for name, fmu in system.fmus.items() if _announces(fmu)]
    return [*found, *[port for port in system.event_outputs if port not in found]]


def _announces(fmu: Fmu) -> bool:
    variable: ModelVariable | None = fmu.variables.get("next_event_time")
    return variable is not None and variable.causality == "output"
