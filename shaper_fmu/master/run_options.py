"""What the options of a run mean: its steps, whether they end at events, how FMUs of model exchange are solved."""

from __future__ import annotations

import math
from typing import NamedTuple, get_args

from shaper_fmu.errors import ModelError, nearest
from shaper_fmu.master import layout as of
from shaper_fmu.master.algorithms import Algorithm, Coupling, SolverMethod
from shaper_fmu.master.model_exchange import Solving
from shaper_fmu.master.program import Program
from shaper_fmu.master.structure import SystemStructure

_MOST_STEPS = 1e8


def checked_solving(solver: SolverMethod, coupling: Coupling, tolerance: float | None) -> Solving:
    """How FMUs of model exchange are solved. Raises ModelError for what does not exist."""
    for what, given, known in (("solver", solver, get_args(SolverMethod)), ("coupling", coupling, get_args(Coupling))):
        if given not in known:
            raise ModelError([f"there is no {what} {given!r}.{nearest(given, known)}"])
    if tolerance is not None and not 0.0 < tolerance < 1.0:
        raise ModelError([f"solver_tolerance = {tolerance} must lie between 0 and 1"])
    return Solving(solver, coupling, tolerance)


class Times(NamedTuple):
    """From when to when a run goes, and its communication step [s]."""

    start: float
    stop: float
    step: float


def set_up(control: of.Control, program: Program, times: Times, algorithm: Algorithm, exact: bool) -> None:
    """Bring a fresh control to the start of a run; `exact`: whether its steps end at events. Raises ModelError for wrong times."""
    control.start = control.t = control.smooth_from = times.start
    control.stop, control.step = times.stop, times.step
    control.steps = number_of_steps(program.system, *times)
    control.ends_whole = _ends_whole(times, int(control.steps))
    control.exact = exact or bool(program.clocks.ports)
    control.on_grid = control.exact and not exact  # clocks tick at points of the grid, and tables jump there
    control.jump = 0 if exact else len(program.layout.jumps)
    control.exchange = algorithm == "jacobi"
    control.cut = exact and not program.signals  # Python's functions are asked before a step, for its end
    control.stop_place, control.all_open, control.rereading = -1, 1, program.reads_locals()


def number_of_steps(system: SystemStructure, start_time: float, stop_time: float, step: float) -> int:
    """How many communication steps a run takes; the last one may be shorter. Raises ModelError for times that make no sense."""
    if not (all(map(math.isfinite, (start_time, stop_time, step))) and step > 0.0 and stop_time >= start_time):
        raise ModelError([f"cannot run from {start_time} s to {stop_time} s in steps of {step} s"])
    span = stop_time - start_time
    if 0.0 < span * (1.0 + 1e-9) < step:
        raise ModelError([f"a step of {step:g} s does not fit into a run of {span:g} s; give a step of {span:g} s at most"])
    if step < 16.0 * math.ulp(max(abs(start_time), abs(stop_time))) or (stop_time - start_time) / step > _MOST_STEPS:
        raise ModelError(
            [f"steps of {step} s from {start_time} s to {stop_time} s are too small or too many ({_MOST_STEPS:g} at most)"]
        )
    steps = math.ceil((stop_time - start_time) / step * (1.0 - 1e-12) - 1e-9)
    if start_time + steps * step > stop_time + 1e-9 * step:
        for name, fmu in system.fmus.items():
            if not fmu.takes_any_step:
                raise ModelError([f"{name} takes no variable steps, so stop_time must be a multiple of the step {step} s"])
    return steps


def _ends_whole(times: Times, steps: int) -> bool:
    """Whether the last step is meant to be as long as the others and differs only by rounding."""
    rounding = 1e-9 * times.step + 4.0 * math.ulp(max(abs(times.start), abs(times.stop)))
    return bool(abs(times.start + steps * times.step - times.stop) <= rounding)  # of times that numpy made, too
