"""Clocks of FMUs: which there are, what ticks with them, and which of a system can be run."""

from __future__ import annotations

import functools
from collections.abc import Collection, Mapping

from fmpy.model_description import ModelVariable

from shaper_fmu.errors import ModelError
from shaper_fmu.master.clock_descriptions import TRIGGERED, Clock, description_problems, is_clock, named_clocks, read_clocks
from shaper_fmu.master.fmu import Fmu
from shaper_fmu.master.wiring import Port
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
    """Whether a variable can be read and set while a clock ticks, alone."""
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
            problems.append(f"{name}: {named_clocks(ticking)} in event mode alone: leave out use_event_mode({name!r}, False)")
        problems += [
            f"clock {name}.{clock.name} ticks when another clock does, but nothing is connected to it: connect an output clock"
            for clock in clocks
            if clock.is_input and clock.variability == TRIGGERED and (name, clock.name) not in connections
        ]
    return problems


def check_clock_connection(fmus: Mapping[str, Fmu], source: Port, target: Port, known: Mapping[Port, Port]) -> None:
    """Raise ModelError if an output clock cannot have an input clock tick."""
    ends = [next(clock for clock in clocks_of(fmus[name]) if clock.name == variable) for name, variable in (source, target)]
    what = f"{'.'.join(source)} -> {'.'.join(target)}"
    if ends[0].causality != "output":
        raise ModelError([f"{what}: {'.'.join(source)} is no output clock"])
    if ends[1].variability != TRIGGERED:
        raise ModelError(
            [f"{what}: {'.'.join(target)} ticks at times of its own ({ends[1].variability}); only triggered ones can be fed"]
        )
    if target in known:
        raise ModelError([f"input {'.'.join(target)} is already driven by {'.'.join(known[target])}"])
