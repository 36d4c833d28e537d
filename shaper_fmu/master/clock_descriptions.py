"""Clocks of FMI 3.0 in a model description, and which of them this master can run.

Time-based input clocks tick at times that the FMU determines: periodic ones (constant, fixed, calculated, tunable) at
start + shift + k * interval, aperiodic ones (changing, countdown) an interval after the last tick, or after the event at which
the FMU returns the interval. Triggered ones are output clocks, which the FMU itself makes tick, and input clocks that are
connected to them. All of that happens in event mode (FMI 3.0, section 2.2.8), so that an FMU with clocks needs it.
"""

from __future__ import annotations

import math
from collections.abc import Iterable
from dataclasses import dataclass

from fmpy.model_description import ModelDescription, ModelVariable
from lxml import etree

from shaper_fmu.xml_files import parse_xml

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
        asks_fraction: whether the FMU gives intervals as fractions.
        problem: the reason why it cannot be run; "" if it can.
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
        """Whether the clock ticks at times that the FMU determines."""
        return self.is_input and self.variability != TRIGGERED


def is_clock(variable: ModelVariable) -> bool:
    """Whether a variable is a clock."""
    return variable.type == "Clock"


def read_clocks(description: etree._Element) -> tuple[Clock, ...]:
    """The clocks of a model description, whose root this is. FMPy does not read their intervals."""
    return tuple(_clock(element) for element in description.iterfind("ModelVariables/Clock"))


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
    """Interval, shift and resolution; as a fraction, if it is declared. Raises ValueError for texts that are not numbers."""
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
        raise ValueError(f"{name} = {text!r} is not a {'whole ' if name in _WHOLE else ''}number")
    return value


def _problem(causality: str, variability: str, interval: float | None, shift: float, resolution: float) -> str:
    if variability not in (*PERIODIC, *APERIODIC, TRIGGERED):
        return f"intervalVariability = {variability!r} is none of {', '.join((*PERIODIC, *APERIODIC, TRIGGERED))}"
    if causality not in ("input", "output", "local"):
        return f"it is of causality {causality!r}; clocks are inputs, outputs or local"
    if causality != "input" and variability != TRIGGERED:
        return f"it is of causality {causality}, and only inputs can be {variability}"
    if variability == "constant" and interval is None:
        return "it is constant, but neither intervalDecimal nor intervalCounter and resolution define its interval"
    if interval is not None and not interval > 0.0:
        return f"its interval {interval:g} must be above 0"
    if not shift >= 0.0:
        return f"its shift {shift:g} must not be below 0"
    return "" if resolution > 0.0 else f"its resolution {resolution:g} must be above 0"


def fmu_clock_problems(description: ModelDescription, content: bytes, name: str) -> list[str]:
    """The parts of an FMU's clocks and Scheduled Execution that this master cannot run; `content` is modelDescription.xml."""
    if description.coSimulation is None and description.scheduledExecution is not None:
        return ["it has only Scheduled Execution, which this master does not run; clocks need co-simulation with event mode"]
    if not any(is_clock(variable) for variable in description.modelVariables):
        return []
    event_mode = bool(getattr(description.coSimulation, "hasEventMode", False))
    clocks = read_clocks(parse_xml(content.lstrip(), f"{name}: modelDescription.xml"))
    return description_problems(clocks, description.coSimulation is not None, event_mode)


def description_problems(clocks: Iterable[Clock], co_simulation: bool, event_mode: bool) -> list[str]:
    """Faults in an FMU's clock declarations."""
    clocks = list(clocks)
    problems = [f"clock {clock.name}: {clock.problem}" for clock in clocks if clock.problem]
    ticking = [clock.name for clock in clocks if clock.causality != "local"]
    if ticking and co_simulation and not event_mode:
        problems.append(
            f"{named_clocks(ticking)} only in event mode, but co-simulation has none (hasEventMode is not true), so that this "
            "master refuses to run it"
        )
    return problems


def named_clocks(clocks: list[str]) -> str:
    """Some clocks by name, and that they tick."""
    shown = ", ".join(clocks[:5]) + (" ..." if len(clocks) > 5 else "")
    return f"clock {shown} ticks" if len(clocks) == 1 else f"clocks {shown} tick"
