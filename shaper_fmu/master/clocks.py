"""Clocks of FMI 3.0: what a model description tells of them, and which of them this master can run.

Time-based input clocks tick at times that the FMU tells: periodic ones (constant, fixed, calculated, tunable) at
start + shift + k * interval, aperiodic ones (changing, countdown) an interval after the last tick, or after the event at which
the FMU tells the interval. Triggered ones are output clocks, which the FMU itself makes tick, and input clocks that are
connected to them. All of that happens in event mode (FMI 3.0, section 2.2.8), so that an FMU with clocks needs it.
"""

from __future__ import annotations

import functools
import math
from collections.abc import Iterable, Mapping
from dataclasses import dataclass
from typing import TYPE_CHECKING

from fmpy.model_description import ModelDescription, ModelVariable
from lxml import etree

from shaper_fmu.errors import ModelError
from shaper_fmu.master.wiring import Port
from shaper_fmu.xml_files import parse_xml

if TYPE_CHECKING:
    from shaper_fmu.master.fmu import Fmu
    from shaper_fmu.master.system import System

PERIODIC = ("constant", "fixed", "calculated", "tunable")
APERIODIC = ("changing", "countdown")
TRIGGERED = "triggered"
_WHOLE = ("intervalCounter", "shiftCounter", "resolution")


@dataclass(frozen=True)
class Clock:
    """A clock of a model description.

    Attributes:
        variability: "constant", "fixed", "calculated", "tunable", "changing", "countdown" or "triggered".
        interval, shift: of a periodic clock, in units of 1 / `resolution` seconds; None where the FMU has to be asked for them.
        asks_fraction: whether the FMU tells intervals as fractions.
        problem: why it cannot be run, in words; "" if it can.
    """

    name: str
    reference: int
    causality: str
    variability: str
    interval: float | None = None
    shift: float = 0.0
    resolution: float = 1.0
    asks_fraction: bool = False
    problem: str = ""

    @property
    def is_input(self) -> bool:
        """Whether the master makes it tick."""
        return self.causality == "input"

    @property
    def is_timed(self) -> bool:
        """Whether it ticks at times that the FMU tells."""
        return self.is_input and self.variability != TRIGGERED


def is_clock(variable: ModelVariable) -> bool:
    """Whether a variable is a clock."""
    return variable.type == "Clock"


@functools.lru_cache(maxsize=256)
def clocks_of(fmu: Fmu) -> tuple[Clock, ...]:
    """The FMU's clocks, in their order."""
    if not any(is_clock(variable) for variable in fmu.description.modelVariables):
        return ()
    return read_clocks(parse_xml((fmu.folder / "modelDescription.xml").read_bytes(), f"{fmu.name}: modelDescription.xml"))


def read_clocks(description: etree._Element) -> tuple[Clock, ...]:
    """The clocks of a model description, whose root this is. FMPy does not read their intervals."""
    return tuple(_clock(element) for element in description.iterfind("ModelVariables/Clock"))


def clocks_that_tick(fmu: Fmu, variable: str) -> list[str]:
    """The names of the clocks of a clocked variable, which can be read and set while one of them ticks; none of any other."""
    return [str(clock.name) for clock in fmu.variables[variable].clocks or [] if isinstance(clock, ModelVariable)]


def is_clocked(fmu: Fmu, variable: str) -> bool:
    """Whether a variable can be read and set while a clock ticks, alone."""
    return bool(clocks_that_tick(fmu, variable))


def _clock(element: etree._Element) -> Clock:
    name, causality = str(element.get("name")), str(element.get("causality", "local"))
    variability = str(element.get("intervalVariability", ""))
    reference = int(element.get("valueReference", "0"))
    try:
        timing = _timing(element, variability)
        problem = _problem(causality, variability, *timing)
    except ValueError as error:
        timing, problem = (None, 0.0, 1.0), str(error)
    fraction = element.get("supportsFraction") in ("true", "1")
    return Clock(name, reference, causality, variability, *timing, fraction, problem)


def _timing(element: etree._Element, variability: str) -> tuple[float | None, float, float]:
    """Interval, shift and resolution; as a fraction, where it is told. Raises ValueError for what is no number."""
    if variability not in PERIODIC:
        return None, 0.0, 1.0
    counter, shift, resolution = (_number(element, name) for name in _WHOLE)
    if counter is not None and resolution is not None:
        return counter, shift or 0.0, resolution
    return _number(element, "intervalDecimal"), _number(element, "shiftDecimal") or 0.0, 1.0


def _number(element: etree._Element, name: str) -> float | None:
    text = element.get(name)
    if text is None:
        return None
    try:
        value = float(text)
    except ValueError:
        value = math.nan
    if not math.isfinite(value) or (name in _WHOLE and value != int(value)):
        raise ValueError(f"{name} = {text!r} is no {'whole ' if name in _WHOLE else ''}number")
    return value


def _problem(causality: str, variability: str, interval: float | None, shift: float, resolution: float) -> str:
    if variability not in (*PERIODIC, *APERIODIC, TRIGGERED):
        return f"intervalVariability = {variability!r} is none of {', '.join((*PERIODIC, *APERIODIC, TRIGGERED))}"
    if causality not in ("input", "output", "local"):
        return f"it is of causality {causality!r}; clocks are inputs, outputs or local"
    if causality != "input" and variability != TRIGGERED:
        return f"it is of causality {causality}, and only inputs can be {variability}"
    if variability == "constant" and interval is None:
        return "it is constant, but neither intervalDecimal nor intervalCounter and resolution tell its interval"
    if interval is not None and not interval > 0.0:
        return f"its interval {interval:g} must be above 0"
    if not shift >= 0.0:
        return f"its shift {shift:g} must not be below 0"
    return "" if resolution > 0.0 else f"its resolution {resolution:g} must be above 0"


def fmu_clock_problems(description: ModelDescription, content: bytes, name: str) -> list[str]:
    """What of an FMU's clocks, and of Scheduled Execution, this master cannot run; `content` is of modelDescription.xml."""
    if description.coSimulation is None and description.scheduledExecution is not None:
        return ["it has Scheduled Execution alone, which this master does not run: co-simulation with event mode runs clocks"]
    if not any(is_clock(variable) for variable in description.modelVariables):
        return []
    event_mode = bool(getattr(description.coSimulation, "hasEventMode", False))
    clocks = read_clocks(parse_xml(content.lstrip(), f"{name}: modelDescription.xml"))
    return description_problems(clocks, description.coSimulation is not None, event_mode)


def description_problems(clocks: Iterable[Clock], co_simulation: bool, event_mode: bool) -> list[str]:
    """What is wrong with the clocks of an FMU by itself."""
    clocks = list(clocks)
    problems = [f"clock {clock.name}: {clock.problem}" for clock in clocks if clock.problem]
    ticking = [clock.name for clock in clocks if clock.causality != "local"]
    if ticking and co_simulation and not event_mode:
        problems.append(
            f"{_named(ticking)} in event mode alone, but co-simulation has none (hasEventMode is not true), so that this master "
            "refuses to run it"
        )
    return problems


def system_problems(system: System) -> list[str]:
    """Why clocks of a system cannot be run, by their names; empty if they can."""
    problems: list[str] = []
    for name, fmu in system.fmus.items():
        clocks = clocks_of(fmu)
        problems += [f"{name}: {problem}" for problem in description_problems(clocks, True, fmu.has_event_mode)]
        ticking = [clock.name for clock in clocks if clock.causality != "local"]
        if ticking and fmu.has_event_mode and name in system.without_event_mode:
            problems.append(f"{name}: {_named(ticking)} in event mode alone: leave out use_event_mode({name!r}, False)")
        problems += [
            f"clock {name}.{clock.name} ticks when another clock does, but nothing is connected to it: connect an output clock"
            for clock in clocks
            if clock.is_input and clock.variability == TRIGGERED and (name, clock.name) not in system.clock_connections
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


def _named(clocks: list[str]) -> str:
    shown = ", ".join(clocks[:5]) + (" ..." if len(clocks) > 5 else "")
    return f"clock {shown} ticks" if len(clocks) == 1 else f"clocks {shown} tick"


def has_clocks(fmu: Fmu) -> bool:
    """Whether it has clocks, so that it has to be used with event mode."""
    return bool(clocks_of(fmu))
