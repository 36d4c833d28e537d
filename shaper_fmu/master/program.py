"""From a system and its live instances to the arrays of the compiled loop."""

from __future__ import annotations

from collections.abc import Collection, Iterable, Mapping, Sequence
from typing import Any

import numpy as np

from shaper_fmu.master import layout as of
from shaper_fmu.master.clockwork import Clockwork
from shaper_fmu.master.description1 import own_scaling
from shaper_fmu.master.fmu import event_output
from shaper_fmu.master.guards import causes_of_inputs
from shaper_fmu.master.instance import Instance
from shaper_fmu.master.layout import Layout
from shaper_fmu.master.linear_inputs import LinearInputs, lay_out, linear_inputs
from shaper_fmu.master.metrics import metric_rows, metric_variables
from shaper_fmu.master.model_exchange import SOLVING, Parts, Solving
from shaper_fmu.master.operations import Operations
from shaper_fmu.master.signals import Signal, Table
from shaper_fmu.master.structure import SystemStructure
from shaper_fmu.master.transfer_writer import Operation, TransferWriter
from shaper_fmu.master.variables import items_of, kind_of
from shaper_fmu.master.wiring import Loop, Port
from shaper_fmu.metrics.metric import Metric


class Program:
    """A system with live instances, laid out for the loop with one algorithm.

    Attributes:
        layout: the arrays.
        address: of their addresses, for the loop.
        signals: places on the bus of signals that are Python functions, and the functions.
        labels: for each transfer, the instance, the FMI function and the names of the elements.
        names: the instances by number.
        linear_inputs: the inputs that are linear over each step.
        clocks: the clocks of FMI 3.0 of its instances.
        loops: the loops of direct feedthrough, each cut at its first input.
        sources: for each transfer, where its elements are on the bus.
    """

    def __init__(
        self,
        system: SystemStructure,
        instances: Mapping[str, Instance],
        recorded: Sequence[Port],
        algorithm: str,
        connections: Mapping[Port, Port],
        metrics: Mapping[str, Metric],
        exact: bool,
        linear: bool,
        starts: Collection[Port] = (),
        solving: Solving = SOLVING,
    ):
        self.system: SystemStructure = system
        self.instances: Mapping[str, Instance] = instances
        self.connections: Mapping[Port, Port] = connections
        self.names: list[str] = list(instances)
        self._algorithm = algorithm
        self._starts = starts
        self._asked: tuple[float, list[float]] | None = None  # what the functions have given last, each asked once for a time
        self.loops: list[Loop] = system.signal_order()[1]
        self.clocks: Clockwork = Clockwork(instances, system.clock_connections)
        self._metrics = metrics
        self._event_ports = _event_ports(system) if exact else []
        ports: Iterable[Port] = [*connections.values(), *recorded, *system.ports(metric_variables(metrics)), *self._event_ports]
        self._places: dict[Any, int] = {port: i for i, port in enumerate(dict.fromkeys(ports))}
        functions = {port: signal for port, signal in system.signals.items() if not isinstance(signal, Table)}
        for port in [*(port for port in system.signals if port not in functions), *functions]:
            self._places[("signal", *port)] = len(self._places)
        self.signals: list[tuple[int, Signal]] = [(self._places[("signal", *port)], signal) for port, signal in functions.items()]
        for port in functions:
            self._places[("signal at the end", *port)] = len(self._places)
        monolithic = solving.coupling == "monolithic"
        self.linear_inputs: list[Port] = linear_inputs(instances, connections, monolithic) if linear else []
        for port in self.linear_inputs:
            self._places[("held", *port)] = len(self._places)  # of each input its own, though several may have one source
        numbers = {name: i for i, name in enumerate(self.names)}
        self._writer = TransferWriter(instances, numbers, system.scalings, system.mappings, _items_of_inputs(system))
        self._linear = self._lay_out_linear_inputs()
        announcing = {port[0] for port in self._event_ports} | {name for name in self.names if instances[name].event_mode}
        causes = causes_of_inputs(system, connections, announcing) if exact else {}
        for name in [name for name in causes if self.clocks.has_timed(name)]:
            del causes[name]  # what its clocks sample is wanted as it is then
        self._operations = Operations(
            system, instances, connections, self._writer, self._places, causes, self._event_ports, self.clocks
        )
        programs = self._operations.programs(algorithm, self.linear_inputs, self._linear.calls, starts, monolithic)
        parts = [name for name in self.names if instances[name].fmu.exchanges_model]
        self._cut_between_parts = self._cut_sources(parts) if monolithic else []
        self.parts: Parts = Parts(instances, solving, bool(programs["coupled"]), bool(self._cut_between_parts))
        self.labels: list[tuple[str, str, list[str]]] = self._writer.labels
        self.layout: Layout = self._layout(programs, recorded)
        self._addresses = of.addresses_of(self.layout)
        self.address: int = self._addresses.ctypes.data

    def _cut_sources(self, names: Collection[str]) -> list[int]:
        """Where the sources of cut inputs are on the bus, of loops between these instances."""
        cut = [loop[0] for loop in self.loops if all(port[0] in names for port in loop)]
        return list(dict.fromkeys(self._places[self.connections[port]] for port in cut))

    def _input_queries(self) -> np.ndarray:
        """What asks parts for their inputs, with room for what they have answered last."""
        numbers = self._operations.queries
        rows = np.zeros(len(numbers), of.INPUT_QUERY)
        sizes = [len(self.labels[number][2]) * of.SIZES[self._writer.transfers[number][3]] for number in numbers]
        self._known = np.zeros(sum(-(-size // 8) for size in sizes) + 1)
        place = self._known.ctypes.data
        for row, number, size in zip(rows, numbers, sizes, strict=True):
            row["transfer"], row["bytes"], row["known"] = number, size, place
            place += -(-size // 8) * 8
        return rows

    def beside(self) -> list[np.ndarray]:
        """The arrays that the layout's records point into, beside the layout's own."""
        return [*self._linear.memory, self.clocks.references]

    def solved(self) -> list[np.ndarray]:
        """What the solver of FMUs of model exchange keeps from one step for the next, but for what it makes anew."""
        return [self._known, *self.parts.kept()]

    def reset(self) -> None:
        """Bring what the loop changes back to the state before a run, whose start values have been set."""
        self.layout.tables["cursor"] = self.layout.tables["first"]
        self.layout.instances["next_event"] = of.NO_EVENT
        self.layout.bus[:] = 0.0
        self.parts.reset()
        self.layout.loop_memory[:] = 0.0
        self._asked = None
        self.layout.metrics["time"] = np.nan
        self.layout.slopes["previous_time"] = self.layout.slopes["held_time"] = np.nan
        for place, (name, variable) in self._operations.unfed.items():
            self.layout.bus[place] = float(self.instances[name].start_value(variable))

    def note_initialization(self) -> None:
        """Take what models of FMI 1.0 have told when they were initialized."""
        for row, instance in zip(self.layout.instances, self.instances.values(), strict=True):
            info = instance.event_info
            if info is not None:
                row["settled"] = info.converged and row["informed"]
                row["next_event"] = info.event_time if info.event_defined else of.NO_EVENT

    def ask_functions(self, t: float, end: float | None = None) -> None:
        """Put the values that Python functions give at t on the bus, and those at the `end` of a step that begins there."""
        if not self.signals:
            return
        asked = self._asked if self._asked is not None and self._asked[0] == t else (t, [signal(t) for _, signal in self.signals])
        first = self.signals[0][0]
        self.layout.bus[first : first + len(self.signals)] = asked[1]
        if end is not None:
            asked = (end, [signal(end) for _, signal in self.signals])
            self.layout.bus[first + len(self.signals) : first + 2 * len(self.signals)] = asked[1]
        self._asked = asked

    def start_places(self) -> list[int]:
        """Where the start values that a batch sets are on the bus, in their order."""
        return [self._places["start", *port] for port in self._starts]

    def place(self, port: Port) -> int:
        """Where the value of an output that is connected, recorded or measured is on the bus."""
        return self._places[port]

    def signal_place(self, port: Port) -> int:
        """Where the value of an input that is given from outside is on the bus."""
        return self._places[("signal", *port)]

    def reads_locals(self) -> bool:
        """Whether there are variables that are no outputs, of which no FMU declares what they follow, and that may be read anew."""
        ports = [key for key in self._places if len(key) == 2 and self.system.readable_after_set(key[0])]
        return any(self.instances[name].fmu.variables[variable].causality == "local" for name, variable in ports)

    def has_unfed_elements(self) -> bool:
        """Whether elements of arrays are set with others although nothing feeds them: they have to be asked for."""
        return bool(self._operations.unfed)

    def cut_places(self) -> list[int]:
        """Where the sources of the cut inputs are on the bus."""
        return [self._places[self.connections[loop[0]]] for loop in self.loops]

    def continuous_places(self) -> np.ndarray:
        """Places on the bus of real outputs, but for announced times of events."""
        events = _event_ports(self.system)
        ports = [key for key in self._places if len(key) == 2 and key not in events]
        reals = [port for port in ports if kind_of(self.system.fmus[port[0]].variables[port[1]]) == "real"]
        return np.array([self._places[port] for port in reals], np.int64)

    def _lay_out_linear_inputs(self) -> LinearInputs:
        order = self.system.instance_order()

        def places(port: Port) -> tuple[int, int]:
            source = self.connections[port]
            return self._places[source], self._places["held", *port]

        def known(port: Port) -> bool:
            before = order.index(self.connections[port][0]) < order.index(port[0])
            return self._algorithm == "gauss_seidel" and before

        def gain(port: Port) -> float:
            sign, _ = own_scaling(self.instances[port[0]].fmu.variables[port[1]])
            return sign * self.system.scalings.get(port, (1.0, 0.0))[0]

        return lay_out(self.linear_inputs, self.instances, places, gain, known)

    def _layout(self, programs: dict[str, list[Operation]], recorded: Sequence[Port]) -> of.Layout:
        writer = self._writer
        instances = np.zeros(len(self.names), of.INSTANCE)
        memory = np.zeros(writer.size // 8 + 1)
        references = np.array(writer.references or [0], np.uint32)
        transfers = np.array(writer.transfers, of.TRANSFER)
        transfers["values"] += np.uint64(memory.ctypes.data)
        transfers["references"] = transfers["references"] * 4 + np.uint64(references.ctypes.data)
        bus, elements = np.zeros(max(1, len(self._places))), np.zeros(max(1, len(writer.places)), of.ELEMENT)
        transfers["elements"] = transfers["elements"] * of.ELEMENT.itemsize + np.uint64(elements.ctypes.data)
        mappings = np.array([pair for mapping, _ in writer.mappings for pair in mapping.items()] or [(0, 0)], float)
        mapped = 0
        for i, (place, scaling, (pairs, closed)) in enumerate(zip(writer.places, writer.scalings, writer.mappings, strict=True)):
            elements[i] = (bus.ctypes.data + 8 * place, *scaling, mappings.ctypes.data + 16 * mapped, len(pairs), closed)
            mapped += len(pairs)
        self.sources: list[list[int]] = writer.grouped
        for i, instance in enumerate(self.instances.values()):
            tolerance = instance.fmu.default_tolerance or 0.0
            informed = instance.name in self._operations.informed
            instances[i] = (*instance.entry_points(), tolerance, of.NO_EVENT, instance.initialized, informed, 0)
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
            **{f"{name}_program": np.array(program, of.OPERATION) for name, program in programs.items()},
            slopes=self._linear.slopes,
            slopes_of=self._linear.slopes_of,
            watched=np.array([(*found, np.nan, 0.0) for found in self._operations.watched()], of.WATCHED),
            guards=np.array(self._operations.guards, of.GUARD),
            causes=np.array(self._operations.cause_codes or [0], np.int32),
            mappings=mappings.ravel(),
            clocks=self.clocks.rows(writer.numbers),
            clock_guards=self.clocks.guards(),
            clock_numbers=self.clocks.listed(),
            parts=self.parts.rows,
            solvers=self.parts.solvers,
            input_queries=self._input_queries(),
            cut_places=np.array(self._cut_between_parts, np.int32),
            loop_memory=np.zeros(len(self._cut_between_parts) * (len(self._cut_between_parts) + 4) + 1),
        )


def _items_of_inputs(system: SystemStructure) -> dict[Port, dict[int, int]]:
    """For connected enumerations what each number becomes: an item. An integer may give any number, and so may a faulty FMU."""
    found: dict[Port, dict[int, int]] = {}
    for name, variable in system.connections:
        items = items_of(system.fmus[name].variables[variable]).values()
        if items:
            found[name, variable] = {**{number: number for number in items}, **system.mappings.get((name, variable), {})}
    return found


def _event_ports(system: SystemStructure) -> list[Port]:
    """The outputs that announce events: those called next_event_time, and those that the user named."""
    found = [(name, output) for name, fmu in system.fmus.items() if (output := event_output(fmu))]
    return [*found, *[port for port in system.event_outputs if port not in found]]
