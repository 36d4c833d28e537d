"""Notes on steps that are long compared with the system's periods and durations.

Held over a step, a smooth command becomes a staircase, whose error goes with the square of the step: at ten steps a move about
2 % of residual vibration (docs/coupling.md, "Profiles": 2.9e-6 at 800). On the grid, edges are moved by up to a step: at ten steps
a period even `shaped_mean` leaves (w h)^2 / 16 = 2.5 %. Where steps end at events, edges are exact at any step, and two steps a
period are what a sampled oscillation needs to be seen.
"""

from __future__ import annotations

import contextlib
import math
from collections.abc import Mapping, Sequence

from shaper_fmu.kinds.profiles import PROFILES
from shaper_fmu.master.events import Treatment
from shaper_fmu.master.fmu import Fmu
from shaper_fmu.master.structure import SystemStructure
from shaper_fmu.master.variables import items_of, kind_of
from shaper_fmu.master.wiring import Port
from shaper_fmu.profiles.method import ProfileMethod

_STEPS_OF_A_MOVE = 10
_STEPS_OF_A_PERIOD = {True: 2, False: 10}  # with exact events, and on the grid
_UNITS = {"duration": "s", "natural_frequency": "rad/s"}
_CHOICES = ("modes", "profile")
"""Parameters that decide which of the others count: how many modes there are, and what the move is."""


def time_scales(system: SystemStructure) -> list[Port]:
    """The variables with a system's time scales: durations and natural frequencies, by their usual names and units; and what
    is chosen among them."""
    found = []
    for name, fmu in system.fmus.items():
        times = [
            variable.name
            for variable in fmu.variables.values()
            if variable.causality in ("parameter", "calculatedParameter")
            and _UNITS.get(variable.name.split("[")[0]) == (fmu.unit_of(variable.name) or "")
        ]
        choices = [choice for choice in _CHOICES if choice in fmu.variables and fmu.variables[choice].causality == "parameter"]
        found += [(name, variable) for variable in (times + choices if times else [])]
    return found


def own_values(system: SystemStructure, ports: list[Port]) -> dict[Port, float]:
    """The values of those of them that are parameters, as far as they are known without running anything."""
    values = {}
    for name, variable in ports:
        declared = system.fmus[name].variables[variable]
        given = system.start_values[name].get(variable, declared.start)
        if declared.causality == "parameter" and given is not None:
            with contextlib.suppress(ValueError):  # a text: not one of these
                values[name, variable] = float(given)
    return values


def is_choice(port: Port) -> bool:
    """Whether a variable of `time_scales` chooses among the others, and is no duration or frequency itself."""
    return port[1] in _CHOICES


def step_notes(system: SystemStructure, treatment: Treatment, step: float, runs: Sequence[Mapping[Port, float]]) -> tuple[str, ...]:
    """Notes on a communication step [s] that is long for the durations [s] and natural frequencies [rad/s] of one of these runs."""
    shortest: dict[str, tuple[float, str]] = {}
    for values, ((name, variable), value) in [(run, item) for run in runs for item in run.items()]:
        if variable in _CHOICES or not (math.isfinite(value) and value > 0.0 and _is_used(system, name, variable, values)):
            continue
        move = variable == "duration"
        length = value if move else 2.0 * math.pi / value
        needed = _steps_of_a_move(system, name, treatment, values) if move else _STEPS_OF_A_PERIOD[treatment.exact]
        if step * needed > length * (1.0 + 1e-9):
            which = f"{name}.{variable} = {value:.6g} {_UNITS[variable.split('[')[0]]}"
            what = f"it has {length / step:.3g} steps{'' if move else ' a period'}, and needs {needed} ({length / needed:.3g} s)"
            shortest[name] = min(shortest.get(name, (math.inf, "")), (length / needed, f"{which}: {what}"))
    return tuple(f"a step of {step:.6g} s is long for {text}" for _, text in shortest.values())


def _is_used(system: SystemStructure, name: str, variable: str, values: Mapping[Port, float]) -> bool:
    """Whether a duration or frequency is of this system: not that of a jump; calculated or given, not a default; of an array, of
    one of the `modes` in use."""
    declared = system.fmus[name].variables[variable]
    if variable == "duration":
        method = _profile(system, name, values)
        return declared.causality != "parameter" or method is None or method.span is None
    default = variable not in system.start_values[name] and values[name, variable] == float(declared.start or math.nan)
    if declared.causality == "parameter" and default:
        return False
    modes = values.get((name, "modes"))
    return "[" not in variable or modes is None or int(variable.split("[")[1].rstrip("]").split(",")[0]) <= modes


def _profile(system: SystemStructure, name: str, values: Mapping[Port, float]) -> ProfileMethod | None:
    """The profile that is chosen, None if there is no choice, or none that is known here."""
    if (name, "profile") not in values:
        return None
    items = {number: item for item, number in items_of(system.fmus[name].variables["profile"]).items()}
    return PROFILES.get(items.get(int(values[name, "profile"]), ""))


def _steps_of_a_move(system: SystemStructure, name: str, treatment: Treatment, values: Mapping[Port, float]) -> int:
    """The number of steps that a move of this duration needs: one for jumps at which steps end, more for smooth moves.

    On the grid the edges of jumps are moved, too. A description says that outputs are smooth by the order up to which it gives
    their derivatives, or by derivatives of theirs among the variables.
    """
    fmu = system.fmus[name]
    if not treatment.exact and fmu.variables["duration"].causality == "parameter":
        return _STEPS_OF_A_MOVE
    if _gives_derivatives(fmu):
        smooth = {v.name for v in fmu.variables.values() if kind_of(v) == "real" and v.variability == "continuous"}
    else:
        rates = [v for v in fmu.variables.values() if v.derivative is not None]
        smooth = {v.name for v in rates} | {str(v.derivative.name) for v in rates if v.derivative is not None}
    method = _profile(system, name, values)
    smooth -= set(method.constant if method else ())
    used = {source[1] for source in treatment.connections.values() if source[0] == name}
    return _STEPS_OF_A_MOVE if used & smooth else 1


def _gives_derivatives(fmu: Fmu) -> bool:
    return int(getattr(fmu.capabilities, "maxOutputDerivativeOrder", 0) or 0) > 0
