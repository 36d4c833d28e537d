"""Steps that are long for what is in a system: told before somebody believes the numbers.

Held over a step, a smooth command becomes a staircase, whose error goes with the square of the step: at ten steps a move about
2 % of residual vibration (docs/coupling.md, "Profiles": 2.9e-6 at 800). On the grid, edges are moved by up to a step: at ten steps
a period even `shaped_mean` leaves (w h)^2 / 16 = 2.5 %. Where steps end at events, edges are exact at any step, and two steps a
period are what a sampled oscillation needs to be seen.
"""

from __future__ import annotations

import math
from collections.abc import Mapping

from shaper_fmu.master.events import Treatment
from shaper_fmu.master.system import System
from shaper_fmu.master.wiring import Port

_STEPS_OF_A_MOVE = 10
_STEPS_OF_A_PERIOD = {True: 2, False: 10}  # with exact events, and on the grid
_UNITS = {"duration": "s", "natural_frequency": "rad/s"}


def time_scales(system: System) -> list[Port]:
    """The variables that tell how fast a system is: durations and natural frequencies, by their usual names and units."""
    return [
        (name, variable.name)
        for name, fmu in system.fmus.items()
        for variable in fmu.variables.values()
        if variable.causality in ("parameter", "calculatedParameter")
        and _UNITS.get(variable.name.split("[")[0]) == (fmu.unit_of(variable.name) or "")
    ]


def own_values(system: System, ports: list[Port]) -> dict[Port, float]:
    """The values of those of them that are parameters, as far as they are known without running anything."""
    values = {}
    for name, variable in ports:
        declared = system.fmus[name].variables[variable]
        told = system.start_values[name].get(variable, declared.start)
        if declared.causality == "parameter" and told is not None:
            values[name, variable] = float(told)
    return values


def step_notes(system: System, treatment: Treatment, step: float, values: Mapping[Port, float]) -> tuple[str, ...]:
    """Notes on a communication step [s] that is long for these durations [s] and natural frequencies [rad/s]."""
    shortest: dict[str, tuple[float, str]] = {}
    for (name, variable), value in values.items():
        if not (math.isfinite(value) and value > 0.0 and _is_used(system, name, variable)):
            continue
        move = variable == "duration"
        length = value if move else 2.0 * math.pi / value
        needed = _steps_of_a_move(system, name, variable, treatment) if move else _STEPS_OF_A_PERIOD[treatment.exact]
        if step * needed > length * (1.0 + 1e-9):
            words = f"{name}.{variable} = {value:.6g} {_UNITS[variable.split('[')[0]]}"
            what = f"it has {length / step:.3g} steps{'' if move else ' a period'}, and needs {needed} ({length / needed:.3g} s)"
            shortest[name] = min(shortest.get(name, (math.inf, "")), (length / needed, f"{words}: {what}"))
    return tuple(f"a step of {step:.6g} s is long for {text}" for _, text in shortest.values())


def _is_used(system: System, name: str, variable: str) -> bool:
    """Whether a frequency is of this system: calculated or given, not a default; of an array, of one of the `modes` in use."""
    declared = system.fmus[name].variables[variable]
    if variable != "duration" and declared.causality == "parameter" and variable not in system.start_values[name]:
        return False
    modes = system.fmus[name].variables.get("modes")
    if "[" not in variable or modes is None:
        return True
    used = int(float(system.start_values[name].get("modes", modes.start or 1)))
    return int(variable.split("[")[1].rstrip("]").split(",")[0]) <= used


def _steps_of_a_move(system: System, name: str, variable: str, treatment: Treatment) -> int:
    """How many steps a move of this duration needs: one, for jumps that steps end at; more for what is smooth."""
    fmu = system.fmus[name]
    if not treatment.exact and fmu.variables[variable].causality == "parameter":
        return _STEPS_OF_A_MOVE
    rates = {id(v) for v in fmu.variables.values() if v.derivative is not None}
    smooth = rates | {id(v.derivative) for v in fmu.variables.values() if v.derivative is not None}
    outputs = [fmu.variables[source[1]] for source in treatment.connections.values() if source[0] == name]
    return _STEPS_OF_A_MOVE if any(id(output) in smooth for output in outputs) else 1
