"""The clocks of a system, laid out for the loop: what they are, who ticks with whom, and what is exchanged while they tick."""

from __future__ import annotations

from collections.abc import Mapping, Sequence

import numpy as np
from numpy.typing import NDArray

from shaper_fmu.master import layout as of
from shaper_fmu.master.clock_descriptions import PERIODIC, TRIGGERED, Clock
from shaper_fmu.master.clocks import clocks_of, clocks_that_tick
from shaper_fmu.master.fmu import Fmu
from shaper_fmu.master.instance import Instance
from shaper_fmu.master.transfer_writer import Operation
from shaper_fmu.master.wiring import Port

_KINDS = {"changing": of.CHANGING, "countdown": of.COUNTDOWN, **dict.fromkeys(PERIODIC, of.PERIODIC)}
_ASKED = {"fixed": of.ONCE, "calculated": of.ONCE, "tunable": of.ALWAYS, "changing": of.ALWAYS, "countdown": of.ALWAYS}


class Clockwork:
    """The clocks of instances that are used with event mode.

    Attributes:
        ports: the clocks by number.
        references: their value references.
    """

    def __init__(self, instances: Mapping[str, Instance], connections: Mapping[Port, Port]):
        self._instances, self._connections = instances, connections
        self._clocks: dict[Port, Clock] = {
            (name, clock.name): clock
            for name, instance in instances.items()
            if instance.event_mode
            for clock in clocks_of(instance.fmu)
        }
        self.ports: list[Port] = list(self._clocks)
        self._number_of = {port: number for number, port in enumerate(self.ports)}
        self._listed: list[int] = []  # numbers of clocks that belong to a guard or to another clock
        self._guards: list[tuple[int, int, int, int]] = []
        self.references: NDArray[np.uint32] = np.array([clock.reference for clock in self._clocks.values()] or [0], np.uint32)

    def clocks_of(self, port: Port) -> tuple[int, ...]:
        """The numbers of a variable's clocks; none if it is not clocked."""
        if not self._clocks:
            return ()
        ticking = [(port[0], clock) for clock in clocks_that_tick(self._instances[port[0]].fmu, port[1])]
        return tuple(self._number_of[clock] for clock in ticking if clock in self._number_of)

    def has_timed(self, name: str) -> bool:
        """Whether an instance has clocks that tick at times of their own."""
        return any(port[0] == name and clock.is_timed for port, clock in self._clocks.items())

    def guarded(self, clocks: Sequence[int], operations: list[Operation], once: bool = False) -> list[Operation]:
        """The operations, done while one of these clocks ticks; `once` for each tick, though more clocks tick because of it."""
        if not operations:
            return []
        self._guards.append((*self._list(clocks), len(operations), int(once)))
        return [(of.CLOCKED, len(self._guards) - 1), *operations]

    def _list(self, clocks: Sequence[int]) -> tuple[int, int]:
        self._listed += clocks
        return len(self._listed) - len(clocks), len(clocks)

    def rows(self, numbers: Mapping[str, int]) -> np.ndarray:
        """The clocks for the loop; `numbers` are the instances'."""
        rows = np.zeros(len(self._clocks), of.CLOCK)
        for i, (port, clock) in enumerate(self._clocks.items()):
            row, instance = rows[i], self._instances[port[0]]
            row["kind"] = of.TRIGGERING if not clock.is_input else _KINDS.get(clock.variability, of.TRIGGERED)
            row["instance"] = numbers[port[0]]
            told = clock.interval is not None and clock.variability in PERIODIC
            row["asked"] = 0 if told or clock.variability == TRIGGERED else _ASKED[clock.variability]
            row["fraction"] = clock.asks_fraction
            row["reference"] = self.references.ctypes.data + i * self.references.itemsize
            form = "Fraction" if clock.asks_fraction else "Decimal"
            names = ("SetClock", "GetClock", f"GetInterval{form}", f"GetShift{form}")
            for field, name in zip(("set", "get", "get_interval", "get_shift"), names, strict=True):
                row[field] = instance.address(f"fmi3{name}")
            if not clock.is_input:
                ticking = [self._number_of[target] for target, source in self._connections.items() if source == port]
                row["targets"], row["target_count"] = self._list(ticking)
                row["within"], row["within_count"] = self._list(self.clocks_of(port))
            row["interval"], row["shift"], row["resolution"] = clock.interval or np.nan, clock.shift, clock.resolution
            row["next"] = of.NO_EVENT
        return rows

    def guards(self) -> np.ndarray:
        """Of clocked transfers, for the loop."""
        return np.array(self._guards, of.CLOCK_GUARD)

    def listed(self) -> np.ndarray:
        """Numbers of clocks, for the loop."""
        return np.array(self._listed or [0], np.int32)

    def by_clocks(self, name: str, variables: Sequence[str]) -> dict[tuple[int, ...], list[str]]:
        """The clocked ones of an instance's variables, by their clocks."""
        found: dict[tuple[int, ...], list[str]] = {}
        for variable in variables:
            clocks = self.clocks_of((name, variable))
            if clocks:
                found.setdefault(clocks, []).append(variable)
        return found

    def unclocked(self, name: str, variables: Sequence[str]) -> list[str]:
        """Those of an instance's variables that are not clocked."""
        return [variable for variable in variables if not self.clocks_of((name, variable))]


def last_causes(fmu: Fmu, name: str, variables: Sequence[str], groups: Sequence[tuple[str, list[str]]]) -> dict[int, list[str]]:
    """When clocked variables can be read: those that follow after each group of inputs, -1 for those that follow none.

    Each is read once, after the last of the inputs that act on it: FMUs may compute at the first look.
    """
    found: dict[int, list[str]] = {}
    for variable in variables:
        causes = {variable} if fmu.variables[variable].causality == "input" else set(fmu.inputs_of(variable))
        places = [i for i, (instance, inputs) in enumerate(groups) if instance == name and not causes.isdisjoint(inputs)]
        found.setdefault(max(places, default=-1), []).append(variable)
    return found
