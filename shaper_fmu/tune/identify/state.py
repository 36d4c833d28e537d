"""Runs that begin in a settled state: it is simulated once, and the FMUs' states are restored for each run."""

from __future__ import annotations

from collections.abc import Callable
from typing import Any

import numpy as np

from shaper_fmu.errors import SimulationError
from shaper_fmu.master import layout as of
from shaper_fmu.master.loop_library import loop
from shaper_fmu.master.once import once_key
from shaper_fmu.master.program import Program
from shaper_fmu.master.results import Results
from shaper_fmu.master.signals import Table
from shaper_fmu.master.simulation import Simulation
from shaper_fmu.master.step_control import StepControl
from shaper_fmu.master.system import System
from shaper_fmu.tune.meter import Meter

EXACT = 1e-12
"""Difference of values, over the largest one, that a restored state may make."""
_CHUNK = 4096
_RESTORED = ("bus", "slopes", "guards")


class SettledRuns(Simulation):
    """A simulation whose `run` saves all states after `settled` communication steps; `again` goes on from there, at the same times.

    Systems differ in the table of an input alone, and have tables only. Where nothing is lost in the states, what `again` gives are
    the bits of a run from the start. Close it, or use it in a with statement.

    Attributes:
        failure: why the states could not be saved, after which `run` has failed; None if that was not tried, or went well.
    """

    def __init__(self, system: System, record: list[str], settled: int):
        super().__init__(system, record)
        self.failure: SimulationError | None = None
        self._settled = settled
        self._states: dict[str, Any] = {}
        self._arguments: tuple[Any, ...] = ()
        self._kept: tuple[dict[str, np.ndarray], np.ndarray, bytes] = {}, np.empty(0), b""

    @staticmethod
    def serves(system: System) -> bool:
        """Whether all its FMUs save their states and can be there beside others, and no input is given by a Python function."""
        saving = ("canGetAndSetFMUState", "canGetAndSetFMUstate")
        capable = all(any(getattr(fmu.capabilities, name, False) for name in saving) for fmu in system.fmus.values())
        capable = capable and all(once_key(fmu) is None for fmu in system.fmus.values())
        return capable and all(isinstance(signal, Table) for signal in system.signals.values())

    @property
    def remaining(self) -> int:
        """Steps that `again` takes."""
        return int(of.Control.from_buffer_copy(self._kept[2]).steps) - self._settled

    def again(self, system: System) -> np.ndarray:
        """Values recorded after the settling with the tables of this system instead, shape (steps - settled, recorded)."""
        self.system = system
        self._programs.clear()
        program = self._program(*self._arguments)
        arrays, next_event, numbers = self._kept
        program.reset()
        for name, content in arrays.items():
            getattr(program.layout, name)[:] = content
        program.layout.instances["next_event"] = next_event
        control = of.Control.from_buffer_copy(numbers)
        control.jump = control.rows = 0
        for name, state in self._states.items():
            self.instances[name].restore_state(state)
        times, record = self._room(control)
        self._go(program, control, int(control.steps))
        return record[: len(times[: control.rows])]  # both are alive until here: the loop writes to them

    def close(self) -> None:
        """Free the saved states and the instances."""
        for name, state in self._states.items():
            if self.instances[name].usable:
                self.instances[name].free_state(state)
        self._states.clear()
        super().close()

    def _program(self, *arguments: Any) -> Program:  # pyright: ignore[reportIncompatibleMethodOverride]
        self._arguments = arguments
        return super()._program(*arguments)

    def _stepped(
        self, program: Program, control: of.Control, progress: Any, notes: tuple[str, ...], controller: StepControl | None
    ) -> Results:
        times, record = self._room(control)
        control.returning = 1
        control.at_grid = 1
        loop().first_row(program.address, control)
        self._go(program, control, self._settled)
        self._save(program, control)
        self._go(program, control, int(control.steps))
        return self._results(program, control, times, record, notes)

    def _room(self, control: of.Control) -> tuple[np.ndarray, np.ndarray]:
        """Have the loop write its rows to new arrays."""
        rows = int(control.steps) + 2
        times, record = np.empty(rows), np.empty((rows, len(self._recorded)))
        control.room, control.next_time, control.next_row = rows, times.ctypes.data, record.ctypes.data
        return times, record

    def _go(self, program: Program, control: of.Control, steps: int) -> None:
        """Step until so many steps of the grid are done; each step of the loop does one at most."""
        while control.done < steps:
            if loop().run(program.address, control, min(steps - int(control.done), _CHUNK)) == of.FAULT:
                raise self._fault(program, control)

    def _save(self, program: Program, control: of.Control) -> None:
        try:
            for name, instance in self.instances.items():
                self._states[name] = instance.save_state()
        except SimulationError as error:
            self.failure = error
            raise
        layout = program.layout
        arrays = {name: getattr(layout, name).copy() for name in _RESTORED}
        self._kept = arrays, layout.instances["next_event"].copy(), bytes(control)


class Settling:
    """The plant's saved states: the runs that can be continued, or the reason why there are none."""

    def __init__(self, meter: Meter | None = None) -> None:
        self.problem: str | None = None
        self._meter: Meter = meter or Meter()
        self._runs: SettledRuns | None = None
        self._key: Any = None
        self._checked = False

    @property
    def at_hand(self) -> bool:
        """Whether runs that begin in saved states are at hand."""
        return self._runs is not None

    def holds(self, key: Any) -> bool:
        """Whether the runs at hand are those of this key."""
        return self._runs is not None and self._key == key

    def close(self) -> None:
        """Free the runs at hand."""
        if self._runs is not None:
            self._runs.close()
        self._runs, self._key = None, None

    def unexcited(self, key: Any, runs: SettledRuns, simulate: Callable[[], np.ndarray]) -> np.ndarray | None:
        """Values of a run without excitation, with states saved on the way; None if they cannot be saved.

        Raises SimulationError where the run itself fails.
        """
        self.close()
        try:
            values = simulate()
        except BaseException:
            runs.close()
            if runs.failure is None:
                raise
            self.problem = f"each run begins at its start, since states cannot be saved: {runs.failure}"
            return None
        self._runs, self._key = runs, key
        return values

    def excited(self, key: Any, excited: System, unexcited: System, rest: np.ndarray) -> np.ndarray | None:
        """Values of a run with excitation, those before it from `rest`; None if no states are at hand.

        The first time it is checked that after it the states still bring back `rest`.
        """
        if self._runs is None or self._key != key:
            self.close()  # some FMUs can be instantiated only once
            return None
        try:
            late = self._again(excited)
            checked = rest[-len(late) :] if self._checked else self._again(unexcited)
        except SimulationError:
            self.close()  # its instances may not go on after an error
            raise
        size = np.abs(rest).max(axis=0)
        lost = float(np.max(np.abs(checked - rest[-len(late) :]) / np.where(size > 0.0, size, 1.0), initial=0.0))
        if not lost <= EXACT:
            self.close()
            self.problem = (
                "each run begins at its start, since the FMUs do not restore all of their saved states: values differ by "
                f"{lost:.1e} of the largest (at most {EXACT:g})"
            )
            return None
        self._checked = True
        return np.concatenate([rest[: -len(late)], late])

    def _again(self, system: System) -> np.ndarray:
        assert self._runs is not None
        self._meter.allow(self._runs.remaining)
        late = self._runs.again(system)
        self._meter.add(len(late))
        return late
