"""The programs of the compiled loop: in which order values move and instances step.

FMI allows no output to be read between the setting of inputs and the step (FMI 2.0.4, section 4.2.4; FMI 3.0, section 4.2.1,
Step Mode): some FMUs' solvers are disturbed by it, others answer with what was. So outputs are read anew after a set only from
instances through which values *pass*: while a system is initialized these are all but FMI 1.0's slaves, in events those in event
mode, and at any time those that declare that they allow it (`Fmu.readable_after_set`). What other instances give is what their last
step left; slaves of FMI 1.0 get their inputs before they are initialized, too, as far as these are known then.

Discrete inputs of instances with event mode are set in it alone (FMI 3.0, Step Mode), so that a change of one is an event.
"""

from __future__ import annotations

from collections.abc import Callable, Collection, Mapping, Sequence
from typing import Any

from shaper_fmu.master import layout as of
from shaper_fmu.master.clockwork import Clockwork, last_causes
from shaper_fmu.master.guards import TABLES
from shaper_fmu.master.instance import Instance
from shaper_fmu.master.signals import Table
from shaper_fmu.master.structure import SystemStructure
from shaper_fmu.master.transfer_writer import Operation, TransferWriter
from shaper_fmu.master.wiring import Port

_STEPS = {1: of.STEP1, 2: of.STEP2, 3: of.STEP3}


class Operations:
    """Makes the programs of a system with live instances.

    `places` of values on the bus grow by those of elements that nothing feeds or asks for. `causes` of the guards: see guards.py.

    Attributes:
        unfed: places of array elements that are set with others, but that nothing feeds.
        informed: instances of FMI 1.0 whose initialization knows all inputs.
        guards, cause_codes: rows of the loop's arrays of these names.
    """

    def __init__(
        self,
        system: SystemStructure,
        instances: Mapping[str, Instance],
        connections: Mapping[Port, Port],
        writer: TransferWriter,
        places: dict[Any, int],
        causes: Mapping[str, list[str]],
        event_ports: Collection[Port],
        clocks: Clockwork,
    ):
        self._system, self._instances, self._connections, self._writer = system, instances, connections, writer
        self._places, self._causes, self._event_ports = places, causes, event_ports
        self._clocks = clocks
        self._readable = {name for name in instances if system.readable_after_set(name)}
        self._parts = [name for name in instances if instances[name].fmu.exchanges_model]
        self.unfed: dict[int, Port] = {}
        self.informed: set[str] = set()
        self.guards: list[tuple[int, ...]] = []
        self.cause_codes: list[int] = []

    def programs(
        self,
        algorithm: str,
        linear_inputs: Collection[Port],
        slope_calls: Mapping[str, int],
        starts: Collection[Port],
        monolithic: bool,
    ) -> dict[str, list[Operation]]:
        """The programs by the names that layout.py has for them.

        `monolithic`: FMUs of model exchange act on each other in every evaluation of their solver.
        """
        names = list(self._instances)
        in_event_mode = {name for name in names if self._instances[name].event_mode}
        reads = {name: self._read_after_step(name) for name in names}
        exchange = self._exchange(self._readable)
        alike = in_event_mode <= self._readable and not self.watched()
        event = exchange if alike else self._exchange(self._readable | in_event_mode, between=False)
        starting = [name for name in names if self._system.follows_at_start(name)]
        initial = exchange if alike and self._readable >= set(names) else self._exchange(starting, final=True, between=False)
        event_read = [operation for name in names if name in self._readable | in_event_mode for operation in reads[name]]
        step, jump = self._steps(algorithm, reads, linear_inputs, slope_calls)
        coupled = self._coupled(between=True) if monolithic else []
        coupled_event = self._coupled(between=False) if monolithic else []
        self.queries: list[int] = [number for name in self._parts for number in self._queries(name, monolithic)]
        return {
            "start": [operation for name in names for operation in self._starting(name, starts, False)],
            "step": step,
            "jump": jump,
            "exchange": exchange,
            "read": [operation for operations in reads.values() for operation in operations],
            "early": self._early(reads),
            "initial": initial,
            "final": exchange if self._readable >= set(names) else self._exchange(self._readable, final=True),
            "event": event,
            "event_read": event_read,
            "resume": self._resuming(sorted(in_event_mode - self._readable), exchange if algorithm == "jacobi" else step),
            "clock": [o for name in names for o in [*self._starting(name, starts, True), *self._clocked_reads(name)]],
            "coupled_read": self._coupled_reads() if coupled_event else [],
            "coupled": coupled,
            "coupled_event": coupled_event,
            "tick": self._ticking_exchange(self._readable | in_event_mode) if self._clocks.ports else [],
        }

    def watched(self) -> list[tuple[int, int]]:
        """Where the sources of inputs are on the bus whose changes are events, and whose they are; clocked ones wait for clocks."""
        fed = [port for port in [*self._system.signals, *self._connections] if not self._clocks.clocks_of(port)]
        ports = [port for port in fed if not self._is_set_between(port[0], port[1])]
        numbers = list(self._instances)
        return [(self._source_place(port[0])(port[1]), numbers.index(port[0])) for port in ports]

    def _is_set_between(self, name: str, variable: str) -> bool:
        """Whether an input is set between steps, too, not in event mode alone."""
        instance = self._instances[name]
        return not instance.event_mode or instance.fmu.variables[variable].variability == "continuous"

    def _resuming(self, names: Collection[str], program: Sequence[Operation]) -> list[Operation]:
        """Set continuous inputs again between event mode and the step, by the transfers with which `program` sets them.

        Dymola 2023x hands its solver what is set in Step Mode alone, and takes a value for known that was set in event mode. So it
        gets the value from before the event, which FMUs have borne already, and then the new one.
        """
        operations: list[Operation] = []
        for name in names:
            numbers = [n for code, n in program if code == of.SET and self._writer.labels[n][0] == name]
            sets = [(of.SET, number) for number in dict.fromkeys(numbers)]
            again = [(of.AGAIN, number) for _, number in sets]
            operations += self._guarded(name, [*again, *sets]) if sets else []
        return operations

    def _steps(
        self,
        algorithm: str,
        reads: Mapping[str, list[Operation]],
        linear_inputs: Collection[Port],
        slope_calls: Mapping[str, int],
    ) -> tuple[list[Operation], list[Operation]]:
        """The programs of a step, and of one that ends at an announced event."""
        early = {name for name in self._instances if self._instances[name].returns_early}
        order = sorted(self._instances, key=lambda name: name not in early)  # the first to step may end the step for all
        step_of = {name: self._step_of(name) for name in order}
        stepping = [operation for operations in step_of.values() for operation in operations]
        read_all = [operation for operations in reads.values() for operation in operations]
        slopes_of = {name: [(of.SLOPES, i)] for name, i in slope_calls.items()}
        slopes = [operation for operations in slopes_of.values() for operation in operations]
        hold = [(of.HOLD, 0)] if slopes else []
        if algorithm == "jacobi":
            step: list[Operation] = [*hold, *slopes, *stepping, *read_all]
            return step, step
        between = {name: [v for v in self._inputs_of(name) if self._is_set_between(name, v)] for name in self._instances}
        sets = {name: self._setting(name, between[name], linear_inputs) for name in self._system.instance_order() if between[name]}
        guarded = [operation for name, operations in sets.items() for operation in self._guarded(name, operations)]
        before: list[Operation] = [*([(of.TABLES_BEFORE, 0)] if self._has_tables() else []), *hold]
        jump = [*before, *guarded, *slopes, *stepping, *read_all]
        if algorithm == "parallel":
            return jump, jump
        step = list(before)  # what an instance gives at an event belongs to the next step of the others, so not in `jump`
        for names in self._in_turn():
            step += [operation for name in names for operation in [*sets.get(name, []), *slopes_of.get(name, [])]]
            step += [operation for name in names for operation in step_of[name]]
            step += [operation for name in names for operation in reads[name]]
        return step, jump

    def _step_of(self, name: str) -> list[Operation]:
        """The step of an instance; the first part's is that of all."""
        if name in self._parts:
            return [(of.SOLVE, 0)] if name == self._parts[0] else []
        return [(_STEPS[self._instances[name].fmu.version], self._writer.numbers[name])]

    def _in_turn(self) -> list[list[str]]:
        """Who steps together, one after the other: each instance by itself, but all parts together, where the first one is."""
        order = self._system.instance_order()
        first = next((name for name in order if name in self._parts), None)
        alone = [name for name in order if name not in self._parts or name == first]
        return [[one for one in order if one in self._parts] if name == first else [name] for name in alone]

    def _coupled(self, between: bool) -> list[Operation]:
        """Values between parts, causes before effects; `between` events, inputs that are set in event mode alone do not move."""
        wanted, moves = self._coupled_sources(), []
        for name, all_inputs in self._ordered_inputs(self._parts):
            inputs = [v for v in all_inputs if self._is_coupled((name, v)) and (not between or self._is_set_between(name, v))]
            if inputs:
                follows = self._follows(name, set(inputs))
                moves += self._setting(name, inputs)
                moves += self._got(name, [variable for variable in wanted[name] if follows(variable)])
        return moves

    def _coupled_reads(self) -> list[Operation]:
        """Read what parts give to parts."""
        return [operation for name, variables in self._coupled_sources().items() for operation in self._got(name, variables)]

    def _coupled_sources(self) -> dict[str, list[str]]:
        sources = dict.fromkeys(source for target, source in self._connections.items() if self._is_coupled(target))
        return {name: [variable for owner, variable in sources if owner == name] for name in self._parts}

    def _is_coupled(self, target: Port) -> bool:
        """Whether a connected input and its source belong to parts."""
        source = self._connections.get(target)
        return target[0] in self._parts and source is not None and source[0] in self._parts

    def _queries(self, name: str, monolithic: bool) -> list[int]:
        """Transfers that ask a part for its inputs from outside."""
        fed = [variable for variable in self._inputs_of(name) if not (monolithic and self._is_coupled((name, variable)))]

        def place(variable: str) -> int:
            return self._places.setdefault(("query", name, variable), len(self._places))

        return [number for _, number in self._writer.transfer("Get", name, fed, place)]

    def _exchange(self, passing: Collection[str], final: bool = False, between: bool = True) -> list[Operation]:
        """Set inputs, causes before effects, where values pass through the instances `passing` without delay.

        With `final` the others' inputs are only noted, so that what they give may still be asked for. `between` steps not all
        inputs are set, at other times they are.
        """
        operations: list[Operation] = [(of.TABLES_NOW, 0)] if self._has_tables() else []
        for name, all_inputs in self._ordered_inputs(passing):
            inputs = [variable for variable in all_inputs if not between or self._is_set_between(name, variable)]
            operations += self._exchange_of(name, self._clocks.unclocked(name, inputs), passing, final)
        return operations

    def _early(self, reads: Mapping[str, list[Operation]]) -> list[Operation]:
        """Set the inputs of FMI 1.0's instances before they are initialized, by what is known then: signals, and what others give.

        The others are in initialization mode.
        """
        others = [name for name in self._instances if self._instances[name].fmu.has_initialization_mode]
        if len(others) == len(self._instances):
            return []
        self.informed = set(self._instances)
        operations = [operation for name in others for operation in reads[name]]
        operations += [(of.TABLES_NOW, 0)] if self._has_tables() else []
        for name, inputs in self._ordered_inputs(others):
            ports = [(name, variable) for variable in inputs]
            known = [p[1] for p in ports if p in self._system.signals or self._connections[p][0] in others]
            if name in others:
                operations += self._exchange_of(name, self._clocks.unclocked(name, known), others)
                continue
            settable = [v for v in known if self._instances[name].fmu.variables[v].start is not None]  # by the standard
            if settable != inputs:
                self.informed.discard(name)
            operations += self._writer.transfer("Set", name, settable, self._source_place(name)) if settable else []
        return operations

    def _exchange_of(self, name: str, inputs: list[str], passing: Collection[str], final: bool = False) -> list[Operation]:
        if not inputs:
            return []
        operations = self._guarded(name, self._setting(name, inputs, calling=not final or name in passing))
        return operations + (self._reading(name, self._follows(name, set(inputs))) if name in passing else [])

    def _ticking_exchange(self, passing: Collection[str]) -> list[Operation]:
        """The exchange at events where clocks tick: clocked variables move while one of their clocks does."""
        operations: list[Operation] = [(of.TABLES_NOW, 0)] if self._has_tables() else []
        groups = self._ordered_inputs(passing)
        sampled = self._system.sampled_inputs(passing)
        clocked = {name: last_causes(self._instances[name].fmu, name, self._clocked(name), groups) for name in self._instances}
        for name, found in clocked.items():
            operations += self._ticking_reads(name, found.get(-1, []))
        for i, (name, inputs) in enumerate(groups):
            operations += self._exchange_of(name, self._clocks.unclocked(name, inputs), passing)
            for once in (True, False):
                alike = [variable for variable in inputs if ((name, variable) in sampled) == once]
                for clocks, chosen in self._clocks.by_clocks(name, alike).items():
                    sets = [*self._setting(name, chosen), *self._reading(name, self._follows(name, set(chosen)))]
                    operations += self._clocks.guarded(clocks, sets, once)
            operations += self._ticking_reads(name, clocked[name].get(i, []))
        return operations

    def _clocked(self, name: str) -> list[str]:
        """The instance's clocked variables that are asked for; inputs that are fed are noted as they are set."""
        fed = () if name in self._readable else self._inputs_of(name, clocked=True)
        return [variable for variable in self._used(name) if self._clocks.clocks_of((name, variable)) and variable not in fed]

    def _ticking_reads(self, name: str, variables: list[str]) -> list[Operation]:
        """Read clocked variables, each while one of its clocks ticks."""
        by_clocks = self._clocks.by_clocks(name, variables)
        return [o for clocks, chosen in by_clocks.items() for o in self._clocks.guarded(clocks, self._got(name, chosen))]

    def _clocked_reads(self, name: str) -> list[Operation]:
        """Read clocked variables in initialization mode, whatever ticks."""
        return self._got(name, self._clocked(name))

    def _has_tables(self) -> bool:
        return any(isinstance(signal, Table) for signal in self._system.signals.values())

    def _inputs_of(self, name: str, clocked: bool = False) -> list[str]:
        """The fed inputs of an instance, `clocked` ones or all others."""
        fed = [variable for instance, variable in [*self._system.signals, *self._connections] if instance == name]
        return [variable for variable in fed if bool(self._clocks.clocks_of((name, variable))) == clocked]

    def _setting(self, name: str, inputs: list[str], held: Collection[Port] = (), calling: bool = True) -> list[Operation]:
        """Set inputs; those that are recorded are noted as they are set, where the FMU must not be asked for them."""
        operations = self._writer.transfer("Set", name, inputs, self._source_place(name, held), calling)
        if name not in self._readable:
            operations += self._writer.kept(operations, lambda variable: self._places.get((name, variable)))
        return operations

    def _source_place(self, name: str, held: Collection[Port] = ()) -> Callable[[str], int]:
        """Where the source of an input element is on the bus; elements that nothing feeds keep their start value.

        Those in `held` get the value that their source had at the beginning of the step.
        """

        def place(variable: str) -> int:
            port = (name, variable)
            if port in held:
                return self._places["held", *port]
            if port in self._connections:
                return self._places[self._connections[port]]
            if port in self._system.signals:
                return self._places[("signal", *port)]
            key = ("constant", *port)
            if key not in self._places:
                self._places[key] = len(self._places)
                self.unfed[self._places[key]] = port
            return self._places[key]

        return place

    def _read_after_step(self, name: str) -> list[Operation]:
        """Read what an instance gives; its inputs are known where it must not be asked for them at other times."""
        known = set() if name in self._readable else set(self._inputs_of(name))
        return self._reading(name, lambda variable: variable not in known)

    def _reading(self, name: str, chosen: Callable[[str], bool]) -> list[Operation]:
        """Transfers that bring the instance's variables to their places, but for clocked ones."""
        return self._got(name, [variable for variable in self._clocks.unclocked(name, self._used(name)) if chosen(variable)])

    def _used(self, name: str) -> list[str]:
        """The instance's variables that have a place."""
        return [port[1] for port in self._places if len(port) == 2 and port[0] == name]

    def _got(self, name: str, variables: list[str]) -> list[Operation]:
        def place(variable: str) -> int:
            if (name, variable) in self._places:
                return self._places[name, variable]
            return self._places.setdefault(("spare", name, variable), len(self._places))

        return self._writer.transfer("Get", name, variables, place) if variables else []

    def _starting(self, name: str, starts: Collection[Port], clocked: bool) -> list[Operation]:
        """Transfers that set an instance's start values, of `clocked` variables or of all others."""
        variables = [port[1] for port in starts if port[0] == name and bool(self._clocks.clocks_of(port)) == clocked]

        def place(variable: str) -> int:
            return self._places.setdefault(("start", name, variable), len(self._places))

        return self._writer.transfer("Set", name, variables, place) if variables else []

    def _guarded(self, name: str, operations: list[Operation]) -> list[Operation]:
        """The operations that set an instance's inputs, behind a guard where it makes something of every change of them."""
        if name not in self._causes:
            return operations
        self.guards.append((len(self.cause_codes), len(self._causes[name]), len(operations), 0, 1))
        for cause in self._causes[name]:
            port = next((port for port in self._event_ports if port[0] == cause), None)
            instance = -1 - self._writer.numbers.get(cause, 0)
            self.cause_codes.append(of.JUMPS if cause == TABLES else self._places[port] if port else instance)
        return [(of.GUARDED, len(self.guards) - 1), *operations]

    def _follows(self, name: str, inputs: set[str]) -> Callable[[str], bool]:
        fmu = self._instances[name].fmu

        def follows(variable: str) -> bool:
            followed = fmu.variables[variable].causality == "output" and not inputs.isdisjoint(fmu.inputs_of(variable))
            return followed or (variable in inputs and name in self._readable)

        return follows

    def _ordered_inputs(self, passing: Collection[str]) -> list[tuple[str, list[str]]]:
        """Signals from outside first, then connections with causes before effects; neighbours of one instance together."""
        grouped: list[tuple[str, list[str]]] = []
        for name, variable in [*self._system.signals, *self._system.signal_order(passing)[0]]:
            if not grouped or grouped[-1][0] != name:
                grouped.append((name, []))
            grouped[-1][1].append(variable)
        return grouped
