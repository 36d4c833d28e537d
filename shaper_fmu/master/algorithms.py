"""The algorithms that take a system from one communication point t to the next, t + h.

An input that is set at t holds over [t, t + h].

- "jacobi": every input is its source's output at t. Inputs that act on an output without delay (direct feedthrough, as
  the FMUs declare it) are set before that output is read, so that all values of a communication point belong together.
  Nothing is delayed: this is the algorithm for commands on their way through shapers to plants.
- "parallel": the same without that order: an input is what its source's output was at the end of the step before,
  whatever has been set since. Each instance with direct feedthrough delays by a step. Most other masters do this.
- "gauss_seidel": the instances step one after the other, in the order of their connections, and an input fed by an
  instance that has already stepped is that one's output at t + h.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass
from typing import Any, Literal

from fmpy.fmi1 import FMICallException

from shaper_fmu.errors import SimulationError
from shaper_fmu.master.instance import Instance, Moment, Transfer, moment
from shaper_fmu.master.signals import Signal
from shaper_fmu.master.system import System
from shaper_fmu.master.wiring import Port

Algorithm = Literal["jacobi", "parallel", "gauss_seidel"]


@dataclass(frozen=True)
class Exchange:
    """Inputs of one instance that are set together, their sources, and the outputs that follow them without delay."""

    instance: Instance
    names: list[str]
    sources: list[int | Signal]  # a place on the bus, or a signal from outside
    inputs: Transfer
    followers: Transfer | None

    def feed(self, t: float, bus: list[Any], at: Moment) -> None:
        """Set the inputs to the values of time t."""
        values = [bus[source] if isinstance(source, int) else source(t) for source in self.sources]
        if not all(map(math.isfinite, values)):
            name, value = next(pair for pair in zip(self.names, values, strict=True) if not math.isfinite(pair[1]))
            raise SimulationError(f"{self.instance.name}{moment(at)}: the value for input {name} is {value}")
        _checked(self.instance, at, self.inputs.set, values)


class Loop:
    """A system's instances, ready to step: the bus with the values of all outputs that are connected or recorded."""

    def __init__(self, system: System, instances: Mapping[str, Instance], recorded: Sequence[Port]):
        wanted = dict.fromkeys([*system.connections.values(), *recorded])
        self._places = {port: place for place, port in enumerate(wanted)}
        self._recorded = [self._places[port] for port in recorded]
        self.bus: list[Any] = [0.0] * len(self._places)
        self._system, self._instances = system, instances
        self.outputs = {name: self._reading(name, lambda port: True) for name in instances}
        self.exchanges = self._ordered_exchanges()
        self.whole = {name: self._exchange(name, self._inputs_of(name)) for name in system.instance_order()}

    def recorded(self) -> list[Any]:
        """The recorded variables' values."""
        return [self.bus[place] for place in self._recorded]

    def read(self, at: Moment) -> None:
        """Bring the outputs of all instances to the bus."""
        for name, transfer in self.outputs.items():
            _checked(self._instances[name], at, transfer.get, self.bus)

    def exchange(self, t: float, at: Moment = None) -> None:
        """Set all inputs to the values of time t, reading again what follows them without delay."""
        for exchange in self.exchanges:
            exchange.feed(t, self.bus, t if at is None else at)
            if exchange.followers is not None:
                _checked(exchange.instance, t if at is None else at, exchange.followers.get, self.bus)

    def _inputs_of(self, name: str) -> list[str]:
        fed = [*self._system.signals, *self._system.connections]
        return [variable for instance, variable in fed if instance == name]

    def _reading(self, name: str, chosen: Callable[[Port], bool]) -> Transfer:
        ports = [port for port in self._places if port[0] == name and chosen(port)]
        return self._instances[name].transfer([port[1] for port in ports], [self._places[port] for port in ports])

    def _exchange(self, name: str, inputs: Sequence[str]) -> Exchange:
        system, instance = self._system, self._instances[name]
        sources = [system.signals.get((name, v)) or self._places[system.connections[name, v]] for v in inputs]
        affected = set(inputs)

        def follows(port: Port) -> bool:
            causality = instance.fmu.variables[port[1]].causality
            followed = causality == "output" and not affected.isdisjoint(instance.fmu.inputs_of(port[1]))
            return followed or port[1] in affected

        followers = self._reading(name, follows)
        return Exchange(instance, list(inputs), sources, instance.transfer(inputs), followers if followers else None)

    def _ordered_exchanges(self) -> list[Exchange]:
        """Signals from outside first, then connections with causes before effects; neighbours of one instance together."""
        grouped: list[tuple[str, list[str]]] = []
        for name, variable in [*self._system.signals, *self._system.signal_order()[0]]:
            if not grouped or grouped[-1][0] != name:
                grouped.append((name, []))
            grouped[-1][1].append(variable)
        return [self._exchange(name, inputs) for name, inputs in grouped]


def _checked(instance: Instance, at: Moment, function: Callable[..., None], *arguments: Any) -> None:
    try:
        function(*arguments)
    except FMICallException as error:
        raise instance.failure(error, at) from None


def _step_all(loop: Loop, t: float, h: float) -> None:
    for exchange in loop.whole.values():
        exchange.instance.step(t, h)
    loop.read(t + h)


def _jacobi(loop: Loop, t: float, h: float) -> None:
    _step_all(loop, t, h)
    loop.exchange(t + h)


def _parallel(loop: Loop, t: float, h: float) -> None:
    for exchange in loop.whole.values():
        exchange.feed(t, loop.bus, t)
    _step_all(loop, t, h)


def _gauss_seidel(loop: Loop, t: float, h: float) -> None:
    for name, exchange in loop.whole.items():
        exchange.feed(t, loop.bus, t)
        exchange.instance.step(t, h)
        _checked(exchange.instance, t + h, loop.outputs[name].get, loop.bus)


ALGORITHMS: dict[str, Callable[[Loop, float, float], None]] = {
    "jacobi": _jacobi,
    "parallel": _parallel,
    "gauss_seidel": _gauss_seidel,
}
