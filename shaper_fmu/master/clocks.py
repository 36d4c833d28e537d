"""The clocks of a system's FMUs: their connections, and which of them can be run."""

from __future__ import annotations

import functools
import math
from collections.abc import Collection, Mapping
from fractions import Fraction

from fmpy.model_description import ModelVariable

from shaper_fmu.errors import ModelError
from shaper_fmu.master.clock_descriptions import TRIGGERED, Clock, description_problems, is_clock, named_clocks, read_clocks
from shaper_fmu.master.fmu import Fmu
from shaper_fmu.master.wiring import Port, signal_order
from shaper_fmu.xml_files import parse_xml


@functools.lru_cache(maxsize=256)
def clocks_of(fmu: Fmu) -> tuple[Clock, ...]:
    """The FMU's clocks, in their order."""
    if not any(is_clock(variable) for variable in fmu.description.modelVariables):
        return ()
    return read_clocks(parse_xml((fmu.folder / "modelDescription.xml").read_bytes(), f"{fmu.name}: modelDescription.xml"))


def clocks_that_tick(fmu: Fmu, variable: str) -> list[str]:
    """The names of the clocks of a clocked variable, which can be read and set while one of them ticks; none of any other."""
    return [str(clock.name) for clock in fmu.variables[variable].clocks or [] if isinstance(clock, ModelVariable)]


def is_clocked(fmu: Fmu, variable: str) -> bool:
    """Whether a variable can be read and set only while a clock ticks."""
    return bool(clocks_that_tick(fmu, variable))


def has_clocks(fmu: Fmu) -> bool:
    """Whether it has clocks, so that it has to be used with event mode."""
    return bool(clocks_of(fmu))


def clock_problems(fmus: Mapping[str, Fmu], connections: Mapping[Port, Port], without_event_mode: Collection[str]) -> list[str]:
    """Why clocks of a system cannot be run, by their names; empty if they can."""
    problems: list[str] = []
    for name, fmu in fmus.items():
        clocks = clocks_of(fmu)
        problems += [f"{name}: {problem}" for problem in description_problems(clocks, True, fmu.has_event_mode)]
        ticking = [clock.name for clock in clocks if clock.causality != "local"]
        if ticking and fmu.has_event_mode and name in without_event_mode:
            problems.append(f"{name}: {named_clocks(ticking)} only in event mode: leave out use_event_mode({name!r}, False)")
        problems += [
            f"clock {name}.{clock.name} ticks when another clock does, but nothing is connected to it: connect an output clock"
            for clock in clocks
            if clock.is_input and clock.variability == TRIGGERED and (name, clock.name) not in connections
        ]
    return problems


def clocked_loop_problems(fmus: Mapping[str, Fmu], connections: Mapping[Port, Port]) -> list[str]:
    """Messages for loops of clocked variables that act on themselves without delay when their clocks tick together.

    An unclocked variable in a loop is sampled as it was before the tick; here nothing was before.
    """

    def together(one: Port, other: Port) -> bool:
        pairs = [(a, b) for a in _clocks_by(fmus, one) for b in _clocks_by(fmus, other)]
        return any(a == b or may_tick_together(a[1], b[1]) for a, b in pairs)

    def inputs_of(port: Port) -> list[Port]:
        inputs = [(port[0], name) for name in fmus[port[0]].inputs_of(port[1])]
        return [one for one in inputs if together(one, port)]

    clocked = {target: source for target, source in connections.items() if together(target, source)}
    return [
        "a loop of clocked variables acts on itself without delay where their clocks tick together: "
        f"{' -> '.join(map('.'.join, loop))}; give one a clock that never ticks with the others, or break it with "
        "an FMU that is not clocked"
        for loop in signal_order(clocked, inputs_of)[1]
    ]


def _clocks_by(fmus: Mapping[str, Fmu], port: Port) -> list[tuple[str, Clock]]:
    """A variable's clocks, each with its instance."""
    names = clocks_that_tick(fmus[port[0]], port[1])
    return [(port[0], clock) for clock in clocks_of(fmus[port[0]]) if clock.name in names]


def may_tick_together(one: Clock, other: Clock) -> bool:
    """Whether two clocks may tick at one time: constant ones have such a time or not, of others it is not known beforehand.

    Ticks shift + k * interval of both meet where the shifts differ by a multiple of the intervals' greatest common divisor.
    """
    told = [clock.variability == "constant" and clock.interval is not None and clock.interval > 0.0 for clock in (one, other)]
    if not all(told):
        return True
    intervals = [_exact(clock.interval or 1.0, clock) for clock in (one, other)]
    away = _exact(one.shift, one) - _exact(other.shift, other)
    denominator = math.lcm(intervals[0].denominator, intervals[1].denominator)
    divisor = Fraction(math.gcd(*(int(interval * denominator) for interval in intervals)), denominator)
    return (away / divisor).denominator == 1


def _exact(number: float, clock: Clock) -> Fraction:
    """A decimal number, or a fraction of the clock's resolution, without rounding [s]."""
    return Fraction(repr(number)) / Fraction(repr(clock.resolution))


def check_clock_connection(fmus: Mapping[str, Fmu], source: Port, target: Port, known: Mapping[Port, Port]) -> None:
    """Raise ModelError if an output clock cannot have an input clock tick."""
    ends = [next(clock for clock in clocks_of(fmus[name]) if clock.name == variable) for name, variable in (source, target)]
    what = f"{'.'.join(source)} -> {'.'.join(target)}"
    if ends[0].causality != "output":
        raise ModelError([f"{what}: {'.'.join(source)} is not an output clock"])
    if ends[1].variability != TRIGGERED:
        raise ModelError(
            [f"{what}: {'.'.join(target)} ticks at its own times ({ends[1].variability}); only triggered clocks can be connected"]
        )
    if target in known:
        raise ModelError([f"input {'.'.join(target)} is already driven by {'.'.join(known[target])}"])
