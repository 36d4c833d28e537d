"""One FMU alone: as a system of its own, and simulated with its inputs driven."""

from __future__ import annotations

import math
import re
from collections.abc import Iterable, Mapping
from dataclasses import replace
from pathlib import Path
from typing import Any, NamedTuple, TypeVar

from shaper_fmu.errors import ArgumentError, SimulationError
from shaper_fmu.master.fmu import Fmu, Interface, load_fmu
from shaper_fmu.master.results import Results
from shaper_fmu.master.system import System
from shaper_fmu.master.variables import TRANSFERABLE, kind_of, own_start
from shaper_fmu.slips import checked_mapping, checked_number

ALONE = "plant"
"""Name of the instance of an FMU that is given alone."""
_STEPS = 1000
"""Steps of a run where nothing declares how long they are."""
_Value = TypeVar("_Value")


class Span(NamedTuple):
    """From when to when an FMU runs, in which steps [s], and a note on what nobody has said."""

    start: float
    stop: float
    step: float
    note: str


def simulate_fmu(
    fmu: Fmu | Path | str,
    stop_time: float | None = None,
    step: float | None = None,
    *,
    inputs: Mapping[str, Any] | None = None,
    linear: bool = False,
    start_values: Mapping[str, Any] | None = None,
    record: Iterable[str] | None = None,
    interface: Interface | None = None,
    **options: Any,
) -> Results:
    """Run one FMU, by co-simulation or model exchange, of FMI 1.0, 2.0 or 3.0, with its inputs driven.

        results = simulate_fmu("crane.fmu", 20.0, 0.01, inputs={"trolley_acceleration": [(0, 0), (1, 0.5), (2, 0)]})
        results["swing_angle"]

    Args:
        fmu: its path, or loaded.
        stop_time: end of the run [s]; by default the FMU's default experiment has it.
        step: communication step [s]; by default the FMU's own, or a thousandth of the run, rounded down.
        inputs: name -> a number, a function of time [s], or a table of (time, value), shape (n, 2). Values of functions, and of
            linear tables, are taken at the beginning of each step and held over it; a held table jumps where it says.
            Other inputs keep their start values.
        linear: whether tables go straight between their rows; else each value holds until the next row.
        start_values: name -> start value of parameters and inputs.
        record: names of variables; by default all outputs, and the inputs that are driven.
        interface: "co_simulation" or "model_exchange"; by default the first, if it is there.
        options: those of `Simulation.run`, such as start_time, everywhere, solver and progress; isolate and time_limit.

    Returns the results, with the variables' own names. Raises ModelError for names that the FMU does not have, with the nearest
    one, ArgumentError where the length of the run is not known, SimulationError for a run that fails.
    """
    checked_mapping("inputs", inputs, '{"force": 1.0}')
    checked_mapping("start_values", start_values, '{"mass": 2.0}')
    loaded = (fmu if isinstance(fmu, Fmu) else load_fmu(fmu)).with_interface(interface)
    span = span_of(loaded, options.pop("start_time", None), stop_time, step)
    name = instance_name(loaded)
    system = alone_system(loaded, start_values or {}, name)
    for variable, source in (inputs or {}).items():
        drive(system, f"{name}.{variable}", source, linear)
    wanted = [f"{name}.{variable}" for variable in record] if record is not None else recorded(system)
    try:
        results = system.simulate(span.stop, span.step, start_time=span.start, record=wanted, **options)
    except SimulationError as error:
        if error.results is not None:
            error.results = plain_results(error.results, name)
        raise
    return replace(plain_results(results, name), notes=(*([span.note] if span.note else []), *results.notes))


def alone_system(source: Fmu | Path | str, start_values: Mapping[str, Any], name: str = ALONE) -> System:
    """A system of one FMU, whose free inputs have their start values."""
    fmu = source if isinstance(source, Fmu) else load_fmu(source)
    system = System(fmu.name)
    system.add(name, fmu, start_values)
    for variable in system.fmus[name].variables.values():
        free = variable.causality == "input" and variable.name not in system.start_values[name]
        if free and kind_of(variable) in TRANSFERABLE and variable.start is not None:
            system.start_values[name][str(variable.name)] = own_start(variable, fmu.name)
    return system


def drive(system: System, target: str, source: Any, linear: bool = False) -> None:
    """Feed an input in place of its start value. Raises ModelError."""
    system.drive(target, source, "linear" if linear else "hold")
    instance, variable = system.split(target)
    system.start_values[instance].pop(variable, None)


def recorded(system: System) -> list[str]:
    """All outputs, after the inputs that are driven."""
    return [".".join(port) for port in [*system.signals, *system.ports(None)]]


def instance_name(fmu: Fmu) -> str:
    """The FMU's name as that of an instance, for messages."""
    return re.sub(r"[^A-Za-z0-9_]|^(?=[0-9])", "_", Path(fmu.name).stem) or ALONE


def span_of(fmu: Fmu, start: float | None, stop: float | None, step: float | None) -> Span:
    """The times of a run: those given, else the FMU's own. Raises ArgumentError for a stop time that nobody tells."""
    for what, given in (("start_time", start), ("stop_time", stop), ("step", step)):
        if given is not None:
            checked_number(what, given)
    declared = fmu.description.defaultExperiment
    own_start_, own_stop, own_step = (
        _number(getattr(declared, attribute, None)) for attribute in ("startTime", "stopTime", "stepSize")
    )
    begin = start if start is not None else own_start_ or 0.0
    end = stop if stop is not None else own_stop
    if end is None:
        raise ArgumentError(f"{fmu.name} does not say how long it runs by default: give a stop time")
    if step is None:
        step = _number(getattr(fmu.capabilities, "fixedInternalStepSize", None)) or own_step
    if step is not None:
        return Span(begin, end, step, "")
    step = rounded_step((end - begin) / _STEPS) if end > begin else 1.0
    return Span(begin, end, step, f"{fmu.name} declares no step: {step:g} s was taken, a thousandth of the run or a little less")


def rounded_step(step: float) -> float:
    """The step's next lower one among 1, 2 and 5 times powers of ten, which divides times that people write."""
    power = 10.0 ** math.floor(math.log10(step))
    digit = next(digit for digit in (5, 2, 1) if digit * power <= step * (1.0 + 1e-12))
    return float(f"{digit * power:.1g}")


def plain_results(results: Results, name: str) -> Results:
    """Results with the variables' own names."""

    def without(mapping: Mapping[str, _Value]) -> dict[str, _Value]:
        return {key.removeprefix(f"{name}."): value for key, value in mapping.items()}

    return replace(
        results, values=without(results.values), units=without(results.units), display_units=without(results.display_units)
    )


def _number(text: Any) -> float | None:
    try:
        value = float(text)
    except (TypeError, ValueError):
        return None
    return value if math.isfinite(value) else None
