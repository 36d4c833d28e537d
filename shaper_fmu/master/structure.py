"""The structure of a system: named FMUs, their start values, and the sources of their inputs."""

from __future__ import annotations

import math
import re
from collections.abc import Collection, Mapping, Sequence
from pathlib import Path
from typing import Any

from fmpy.model_description import BaseUnit

from shaper_fmu.errors import ModelError, ShaperFmuError, nearest
from shaper_fmu.master.clocks import check_clock_connection, clock_problems, clocked_loop_problems, is_clocked
from shaper_fmu.master.description import InverseDisplayUnit
from shaper_fmu.master.description1 import is_negated
from shaper_fmu.master.fmu import Fmu, load_fmu
from shaper_fmu.master.once import once_problems
from shaper_fmu.master.signals import Interpolation, Signal, make_signal, typed_signal
from shaper_fmu.master.variables import TRANSFERABLE, items_of, kind_of, possible_values, shown_items
from shaper_fmu.master.wiring import Loop, Port, instance_order, signal_order
from shaper_fmu.units import BASE, conversion

_NAME = re.compile(r"[A-Za-z_][A-Za-z0-9_]*(\.[A-Za-z_][A-Za-z0-9_]*)*")
_SOURCES = ("output", "local", "calculatedParameter", "constant")
"""Causalities of variables that SSP lets feed inputs."""


class SystemStructure:
    """FMUs, their start values, and the sources of their inputs; `System` adds simulation and export.

    Wrong names, types and units raise ModelError where they are given; `check` reports what is missing in the whole.
    """

    def __init__(self, name: str = "system"):
        self.name = name
        self.fmus: dict[str, Fmu] = {}
        self.start_values: dict[str, dict[str, float | int | bool]] = {}
        self.connections: dict[Port, Port] = {}  # input -> output
        self.scalings: dict[Port, tuple[float, float]] = {}  # input -> gain, offset, where they are not 1 and 0
        self.mappings: dict[Port, dict[int, int]] = {}  # input -> what values of its output become, where they do not stay
        self.clock_connections: dict[Port, Port] = {}  # triggered input clock -> output clock
        self.signals: dict[Port, Signal] = {}
        self.event_outputs: list[Port] = []
        self.without_event_mode: set[str] = set()
        self.readable: dict[str, bool] = {}  # the user's settings, see read_after_set

    def announce(self, output: str) -> None:
        """Declare that "instance.output" is the time [s] of the instance's next event; outputs called next_event_time are known."""
        self.event_outputs.append(self._port(output, "output"))

    def use_event_mode(self, name: str, use: bool) -> None:
        """Whether an FMI 3.0 instance is used with event mode, if it has one (default: yes). Some FMUs misbehave in it."""
        self.split(f"{name}.")
        (self.without_event_mode.discard if use else self.without_event_mode.add)(name)

    def read_after_set(self, name: str, allow: bool = True) -> None:
        """Whether an instance's outputs may be read between setting its inputs and the step (default: as its FMU declares).

        FMI forbids it (FMI 2.0.4, section 4.2.4), since some solvers are disturbed by it. Allow it only where you know that the
        outputs follow the inputs at once and nothing else changes: then values pass through the instance without delay.
        """
        self.split(f"{name}.")
        self.readable[name] = allow

    def readable_after_set(self, name: str) -> bool:
        """Whether an instance's outputs may be read between the setting of its inputs and the step."""
        return self.readable.get(name, self.fmus[name].readable_after_set)

    def follows_at_start(self, name: str) -> bool:
        """Whether an instance's outputs may be read after its inputs were set at the start (see `Fmu.follows_at_start`)."""
        return self.fmus[name].follows_at_start or self.readable_after_set(name)

    def add(
        self,
        name: str,
        fmu: Fmu | Path | str,
        start: Mapping[str, Any] | None = None,
        /,
        *,
        interface: Any = None,  # an Interface; of any type, since values may be given by keyword from a mapping
        **values: Any,
    ) -> None:
        """Add an instance of an FMU, given by its path or loaded, with start values of parameters and inputs.

        Values are given by keyword, or in the mapping `start` for names like "natural_frequency[2]"; a sequence sets
        the first elements of an array; an item of an enumeration may be given by its name. The sizes of FMI 3.0's arrays follow
        structural parameters. Instances of nested systems have names with dots, like "slide.valve". `interface`:
        "model_exchange" uses an FMU that offers it with the master's solver, "co_simulation" with its own (the default, where
        it has one).
        """
        if not _NAME.fullmatch(name):
            message = "letters, digits and _ only, not beginning with a digit (and dots between the names of nested systems)"
            raise ModelError([f"{name!r} is not a name for an instance: {message}"])
        if name in self.fmus:
            raise ModelError([f"there is already an instance {name!r}"])
        loaded = (fmu if isinstance(fmu, Fmu) else load_fmu(fmu)).with_interface(interface)
        loaded, rest = _structured(name, loaded, {**(start or {}), **values})
        self.start_values[name] = _prefixed(name, loaded, rest)
        self.fmus[name] = loaded

    def set(self, name: str, value: Any) -> None:
        """Change a start value: "instance.variable", for example "crane.initial_rope_length"."""
        self.check_settable(name)
        instance, variable = self.split(name)
        fmu, rest = _structured(instance, self.fmus[instance], {variable: value})
        if fmu is not self.fmus[instance]:
            self._check_kept(name, instance, fmu)
            self.fmus[instance] = fmu
        self.start_values[instance].update(_prefixed(instance, fmu, rest))

    def _check_kept(self, name: str, instance: str, fmu: Fmu) -> None:
        """Raise ModelError if connected, driven or set elements of an instance do not exist with other sizes of arrays."""
        used = [port for pair in self.connections.items() for port in pair] + [*self.signals, *self.event_outputs]
        used += [(instance, variable) for variable in self.start_values[instance]]
        lost = [variable for owner, variable in used if owner == instance and variable not in fmu.variables]
        if lost:
            raise ModelError([f"{name}: {instance}.{lost[0]}, which is in use, would not exist; set the sizes first"])

    def connect(self, source: str, target: str, gain: float = 1.0, offset: float = 0.0) -> None:
        """Connect an output to an input, both as "instance.variable": input = gain * output + offset, in the output's unit.

        Units of one kind are converted (degrees to radians, for example); others are refused. An array of FMI 3.0 is
        connected as a whole by its name. Booleans go to booleans and numbers to numbers; a real goes to no integer. A triggered
        input clock ticks when the output clock does that is connected to it.
        """
        pairs = self._elements(source, target)
        if self._connect_clocks(*pairs[0]):
            return
        if not (math.isfinite(gain) and math.isfinite(offset)):
            raise ModelError([f"{source} -> {target}: gain {gain} and offset {offset} must be finite numbers"])
        for source_port, target_port in pairs:
            self._check_free(target_port)
            self._check_types(source_port, target_port, gain != 1.0 or offset != 0.0)
            factor, shift = self._conversion(source_port, target_port)
            self.connections[target_port] = source_port
            if (factor * gain, factor * offset + shift) != (1.0, 0.0):
                self.scalings[target_port] = (factor * gain, factor * offset + shift)

    def connect_raw(
        self, source: str, target: str, gain: float = 1.0, offset: float = 0.0, *, mapping: Mapping[int, int] | None = None
    ) -> None:
        """Connect as `connect` does, but without unit conversion: input = gain * output + offset.

        The source may be a local variable or a calculated parameter, too, and an integer and an enumeration may be connected.
        `mapping` is for booleans (0 and 1), integers and enumerations: what their values become; all others stay as they are.
        """
        pairs = self._elements(source, target, _SOURCES)
        if self._connect_clocks(*pairs[0]):
            return
        for source_port, target_port in pairs:
            self._check_free(target_port)
            kinds = {self._kind(source_port), self._kind(target_port)}
            if not kinds <= {"integer", "enumeration"}:
                self._check_types(source_port, target_port, (gain, offset) != (1.0, 0.0))
            if mapping and is_negated(self.fmus[target_port[0]].variables[target_port[1]]):
                raise ModelError([f"{source} -> {target}: {target} is a negated alias, which takes no mapping of values"])
            if mapping and self._kind(target_port) == "real":
                raise ModelError([f"{source} -> {target}: a mapping of values is not for real numbers"])
            if self._kind(target_port) == "enumeration":
                self._check_items(source_port, target_port, mapping or {})
            self.connections[target_port] = source_port
            if (gain, offset) != (1.0, 0.0):
                self.scalings[target_port] = (gain, offset)
            if mapping:
                self.mappings[target_port] = dict(mapping)

    def _connect_clocks(self, source: Port, target: Port) -> bool:
        """Connect two clocks; False if these are none."""
        if self._kind(source) != "clock" or self._kind(target) != "clock":
            return False
        check_clock_connection(self.fmus, source, target, self.clock_connections)
        self.clock_connections[target] = source
        return True

    def _elements(self, source: str, target: str, sources: tuple[str, ...] = ("output",)) -> list[tuple[Port, Port]]:
        """The ports to connect: one pair, or one for each element of two arrays."""
        ends = []
        for name, causalities in ((source, sources), (target, ("input",))):
            instance, variable = self.split(name)
            elements = self.fmus[instance].elements_of(variable)
            if elements == [variable]:
                self._port(name, *causalities)  # raises if it has another causality
            ends.append([self._port(f"{instance}.{element}", *causalities) for element in elements])
        if len(ends[0]) != len(ends[1]):
            raise ModelError([f"{source} has {len(ends[0])} elements but {target} has {len(ends[1])}; they cannot be connected"])
        return list(zip(*ends, strict=True))

    def _kind(self, port: Port) -> str:
        return kind_of(self.fmus[port[0]].variables[port[1]])

    def _check_types(self, source: Port, target: Port, scaled: bool) -> None:
        kinds = [self._kind(source), self._kind(target)]
        fits = kinds[0] == kinds[1] or kinds == ["integer", "real"]
        if not fits or kinds[0] not in TRANSFERABLE:
            output, input_ = (self.fmus[p[0]].variables[p[1]].type for p in (source, target))
            raise ModelError(
                [f"{'.'.join(source)} is of type {output} but {'.'.join(target)} of type {input_}; they cannot be connected"]
            )
        if kinds == ["enumeration", "enumeration"]:
            self._check_items(source, target, {})
        if scaled and kinds[1] != "real":
            raise ModelError([f"{'.'.join(source)} -> {'.'.join(target)}: only real inputs can be given a gain or an offset"])

    def _check_items(self, source: Port, target: Port, mapping: Mapping[int, int]) -> None:
        """Raise ModelError if the source can have, or a mapping gives, a number that is not an item of the target's enumeration."""
        one, other = (self.fmus[port[0]].variables[port[1]] for port in (source, target))
        values, items = possible_values(one), items_of(other)
        given = {*mapping.values(), *(mapping.get(value, value) for value in values)}
        wrong = sorted(given - set(items.values())) if items else []
        if wrong:
            message = (
                f"{'.'.join(source)} -> {'.'.join(target)}: {wrong[0]} is not an item of the enumeration: {shown_items(items)}"
            )
            raise ModelError([f"{message}; a mapping of values is needed"])

    def drive(self, target: str, source: Any, interpolation: Interpolation = "hold") -> None:
        """Feed an input from outside: a function of time, a number, or a table (see `make_signal`)."""
        port = self._port(target, "input")
        self._check_free(port)
        variable = self.fmus[port[0]].variables[port[1]]
        self.signals[port] = typed_signal(variable, make_signal(source, interpolation, target), target)

    def check(self) -> list[str]:
        """The problems of the system as a whole, as messages; empty if it can run."""
        problems = once_problems(self.fmus) if self.fmus else ["the system has no FMU"]
        problems += clock_problems(self.fmus, self.clock_connections, self.without_event_mode)
        problems += clocked_loop_problems(self.fmus, self.connections)
        for loop in self.signal_order()[1]:
            source = self.connections[loop[0]]
            if self._kind(source) != "real":
                path = " -> ".join(f"{instance}.{variable}" for instance, variable in loop)
                problems.append(f"a loop acts on itself without delay: {path}; only loops of real numbers can be solved")
        return problems

    def signal_order(self, passing: Collection[str] | None = None) -> tuple[list[Port], list[Loop]]:
        """Connected inputs in the order in which values propagate at initialization, and the algebraic loops.

        With `passing`: where values pass without delay through these instances alone; else through all that allow it at the start.
        """

        order, loops, _ = self._spread(passing)
        return order, loops

    def sampled_inputs(self, passing: Collection[str] | None = None) -> set[Port]:
        """Clocked inputs in loops: they get what their sources, which are not clocked, were before the tick."""
        return self._spread(passing)[2]

    def _spread(self, passing: Collection[str] | None) -> tuple[list[Port], list[Loop], set[Port]]:
        def inputs_of(port: Port) -> list[Port]:
            if not (port[0] in passing if passing is not None else self.follows_at_start(port[0])):
                return []
            fixed = self.fmus[port[0]].variables[port[1]].causality in ("calculatedParameter", "constant")
            return [] if fixed else [(port[0], name) for name in self.fmus[port[0]].inputs_of(port[1])]

        def clocked(port: Port) -> bool:
            return is_clocked(self.fmus[port[0]], port[1])

        sampled: set[Port] = set()
        return *signal_order(self.connections, inputs_of, clocked, sampled), sampled

    def instance_order(self) -> list[str]:
        """The instances, sources before targets."""

        def feedthrough(port: Port) -> bool:
            """Whether a connected output of the same instance follows this input without delay."""
            used = [source[1] for source in self.connections.values() if source[0] == port[0]]
            return any(port[1] in self.fmus[port[0]].inputs_of(output) for output in used)

        return instance_order(list(self.fmus), self.connections, feedthrough)

    def ports(self, names: Sequence[str] | None) -> list[Port]:
        """Variables by "instance.variable"; if `names` is None, all outputs that are numbers or booleans.

        Raises ModelError for each unknown one.
        """
        if names is None:
            outputs = [(i, v) for i, fmu in self.fmus.items() for v in fmu.variables.values() if v.causality == "output"]
            return [(i, str(v.name)) for i, v in outputs if kind_of(v) in TRANSFERABLE]
        return [self._port(name) for name in ([names] if isinstance(names, str) else names)]

    def check_settable(self, name: str) -> None:
        """Raise ModelError if "instance.variable" is an input that something feeds, so that a start value has no effect."""
        instance, variable = self.split(name)
        array = variable.split("[")[0]
        for fed in [*self.connections, *self.signals]:
            if fed[0] == instance and fed[1] in (variable, array):
                source = ".".join(self.connections[fed]) if fed in self.connections else "a signal"
                raise ModelError([f"{name} is fed by {source}; setting it would have no effect"])

    def unit(self, port: Port) -> str:
        """The unit of a variable, "" if it has none."""
        return self.fmus[port[0]].unit_of(port[1]) or ""

    def display_unit(self, port: Port) -> tuple[str, float]:
        """The unit in which people want to see a variable, and the factor to it from its own.

        It is the variable's own unit where a factor does not do: for a display unit with an offset (degC), or of a reciprocal.
        """
        fmu, unit = self.fmus[port[0]], self.unit(port)
        shown, definition = fmu.display_unit_of(port[1]), fmu.unit_definition(unit)
        for display in definition.displayUnits if definition is not None else []:
            factor_alone = not isinstance(display, InverseDisplayUnit) and float(display.offset) == 0.0
            if display.name == shown and factor_alone and 0.0 < abs(float(display.factor)) < math.inf:
                return str(display.name), float(display.factor)
        return unit, 1.0

    def split(self, name: str) -> Port:
        """Instance and variable of "instance.variable", both of which may have dots. Raises ModelError for an unknown instance."""
        instance, _, variable = name.partition(".")
        if name in self.fmus:
            first = next(iter(self.fmus[name].variables), "variable")
            raise ModelError([f"{name!r} is an instance: name one of its variables, as in '{name}.{first}'"])
        if instance in self.fmus and "." not in variable:
            return instance, variable
        places = [i for i, character in enumerate(name) if character == "." and name[:i] in self.fmus]
        if not places:
            raise ModelError([f"{name!r}: there is no instance {instance!r}.{nearest(instance, self.fmus)}"])
        exact = [i for i in places if self.fmus[name[:i]].elements_of(name[i + 1 :])[0] in self.fmus[name[:i]].variables]
        place = (exact or places)[-1]
        return name[:place], name[place + 1 :]

    def _port(self, name: str, *causalities: str) -> Port:
        instance, variable = self.split(name)
        try:
            self.fmus[instance].variable(variable, *causalities)
        except ModelError as error:
            raise ModelError([f"{name}: {problem}" for problem in error.problems]) from None
        return instance, variable

    def _check_free(self, port: Port) -> None:
        if port in self.connections or port in self.signals:
            other = ".".join(self.connections[port]) if port in self.connections else "a signal"
            raise ModelError([f"input {'.'.join(port)} is already driven by {other}"])
        fmu = self.fmus[port[0]]
        same = [other for other in [*self.connections, *self.signals] if fmu.version == 1 and other[0] == port[0]]
        for _, other in same:
            one, two = fmu.variables[port[1]], fmu.variables[other]
            if (one.valueReference, kind_of(one)) == (two.valueReference, kind_of(two)):
                raise ModelError([f"input {'.'.join(port)} is an alias of {other}, which is driven already"])

    def _conversion(self, source: Port, target: Port) -> tuple[float, float]:
        """Factor and offset from the source's unit to the target's. Raises ModelError for units of different kinds."""
        (fmu, name), (other, other_name) = ((self.fmus[p[0]], p[1]) for p in (source, target))
        unit, other_unit = fmu.unit_of(name), other.unit_of(other_name)
        if not unit or not other_unit or unit == other_unit:
            return 1.0, 0.0
        definitions = fmu.unit_definition(unit), other.unit_definition(other_unit)
        bases = [d.baseUnit for d in definitions if d is not None and d.baseUnit is not None]
        if len(bases) < 2 or _exponents(bases[0]) != _exponents(bases[1]):
            message = f"{'.'.join(source)} is in {unit} but {'.'.join(target)} in {other_unit}; they cannot be connected"
            ends = [(fmu, unit, definitions[0]), (other, other_unit, definitions[1])]
            open_ = [one for f, one, d in ends if f.version == 1 and (d is None or d.baseUnit is None)]
            hint = f": FMI 1.0 does not tell what {open_[0]} is. If you know, use connect_raw with a gain" if open_ else ""
            raise ModelError([message + hint])
        return conversion(bases[0], bases[1])


def _exponents(unit: BaseUnit) -> tuple[int, ...]:
    return tuple(int(getattr(unit, symbol) or 0) for symbol in BASE)


def _structured(name: str, fmu: Fmu, values: Mapping[str, Any]) -> tuple[Fmu, dict[str, Any]]:
    try:
        return fmu.split_structure(values)
    except ModelError as error:
        raise ModelError([f"{name}: {problem}" for problem in error.problems]) from None


def _prefixed(name: str, fmu: Fmu, values: dict[str, Any]) -> dict[str, float | int | bool]:
    try:
        return fmu.start_values(values)
    except ModelError as error:
        raise ModelError([f"{name}: {problem}" for problem in error.problems]) from None
    except ShaperFmuError as error:
        raise ModelError([f"{name}: {error}"]) from error
