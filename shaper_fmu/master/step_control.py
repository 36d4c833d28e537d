"""Controls the step size by Richardson extrapolation: each step is taken once whole and once as two halves.

The difference of both estimates the error of a method of first order, as the coupling algorithms are while inputs are held
(Schierz, Arnold and Clauss 2012), or of second order while they are linear. A step whose error is too large is taken back
by the FMUs' saved states and tried again, shorter. What goes on is the result of the halves.
"""

from __future__ import annotations

import ctypes
from collections.abc import Mapping

import numpy as np

from shaper_fmu.errors import ModelError, SimulationError
from shaper_fmu.master import layout as of
from shaper_fmu.master.instance import Instance
from shaper_fmu.master.loop_library import loop
from shaper_fmu.master.program import Program

_SHORTEST = 1e-9
_SAFETY, _LEAST, _MOST = 0.8, 0.2, 4.0


def check_rollback(instances: Mapping[str, Instance]) -> None:
    """Raise ModelError, which names them, if FMUs cannot save their states or take steps of other lengths."""
    rigid = [name for name, instance in instances.items() if not instance.can_save_states()]
    if rigid:
        raise ModelError(
            [f"control of the step size needs FMUs that save their states; {', '.join(rigid)} cannot: leave tolerance out"]
        )
    for name, instance in instances.items():
        if not instance.fmu.takes_any_step:
            raise ModelError([f"control of the step size needs steps of other lengths, which {name} does not take"])


def ask_functions(program: Program, control: of.Control, target: float) -> None:
    """Ask the functions that give inputs for the values that a step to the target needs."""
    if control.exchange:
        program.ask_functions(target)
    else:  # what is held over the step, and what an event at its end gets
        program.ask_functions(float(control.t), target)


class StepControl:
    """Steps of controlled size within the intervals of the grid; `tolerance` is relative to 1 + |value|, per step."""

    def __init__(self, program: Program, control: of.Control, tolerance: float):
        self._order = 2 if program.linear_inputs else 1
        control.returning = 1
        check_rollback(program.instances)
        self._program, self._control, self._tolerance = program, control, tolerance
        self._judged = program.continuous_places()
        self._step = float(control.step)
        self.rejected: int = 0

    def advance(self) -> int:
        """Take one accepted step; returns a code of the compiled loop's."""
        control, address = self._control, self._program.address
        if control.done >= control.steps:
            return of.FINISHED
        if control.rows + 2 > control.room:
            return of.FULL
        while True:
            loop().plan_step(address, control)
            t, end, whole = float(control.t), float(control.target), bool(control.at_grid)
            h = end - t if end - t <= self._step * (1.0 + 1e-9) else self._step
            reaches_end = h == end - t
            error = self._both_ways(t, t + h if not reaches_end else end, whole and reaches_end)
            if error is None:
                return of.FAULT
            factor = min(_MOST, max(_LEAST, _SAFETY * (1.0 / max(error, 1e-10)) ** (1.0 / (self._order + 1))))
            if error <= 1.0:
                self._step = min(float(control.step), max(self._step, h) * factor if reaches_end else h * factor)
                loop().first_row(address, control)
                return of.FINISHED if control.done >= control.steps else of.GOING_ON
            self.rejected += 1
            self._step = h * factor
            if self._step < _SHORTEST * float(control.step):
                raise SimulationError(
                    f"at t = {t:.15g} s no step is short enough for the tolerance {self._tolerance:g}; the coupled system may jump "
                    "or be unstable there: use a larger tolerance"
                )

    def _both_ways(self, t: float, end: float, at_grid: bool) -> float | None:
        """Step from t to the end once whole, then by halves; the error over the tolerance, or None for a fault."""
        control, bus = self._control, self._program.layout.bus
        control.silent = 1
        saved = _Saved(self._program, control)
        try:
            if not self._take(end, at_grid):
                return None
            once = bus[self._judged].copy()
            if float(control.target) != end:  # an event came in between: the way to it is judged by halves of its own
                end, at_grid = float(control.target), False
            saved.restore()
            middle = 0.5 * (t + end)
            if not (self._take(middle, False) and self._take(end, at_grid)):
                return None
            twice = bus[self._judged]
            error = np.max(np.abs(twice - once) / (1.0 + np.abs(twice)), initial=0.0) / (2**self._order - 1) / self._tolerance
            if error > 1.0:
                saved.restore()
            return float(error)
        finally:
            control.silent = 0
            saved.free()

    def _take(self, target: float, at_grid: bool) -> bool:
        self._control.target, self._control.at_grid, self._control.at_event = target, at_grid, 0
        ask_functions(self._program, self._control, target)
        return bool(loop().take_planned_step(self._program.address, self._control))


class _Saved:
    """All that a step changes: the FMUs' states and the loop's numbers."""

    def __init__(self, program: Program, control: of.Control):
        self._program, self._control = program, control
        self._states = {name: instance.save_state() for name, instance in program.instances.items()}
        layout = program.layout
        changed = [layout.bus, layout.tables, layout.instances, layout.slopes, layout.guards, layout.watched, layout.clocks]
        changed += [layout.solvers, *program.solved()]
        self._arrays = [(array, array.copy()) for array in changed]
        self._numbers = of.Control.from_buffer_copy(control)

    def restore(self) -> None:
        for name, state in self._states.items():
            self._program.instances[name].restore_state(state)
        for array, content in self._arrays:
            array[:] = content
        self._program.layout.solvers["restart"] = 1
        ctypes.pointer(self._control)[0] = self._numbers

    def free(self) -> None:
        for name, state in self._states.items():
            self._program.instances[name].free_state(state)
