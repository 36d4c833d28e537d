"""Runs a system: live instances, stepped by the compiled loop.

A run initializes the instances, then steps them with one of the algorithms of `master/algorithms.py`, and records the
chosen variables. With exact events (the default) steps end where an output announces an event (an output called
`next_event_time`, FMI 3.0's event mode) or where an input table jumps; else on the grid alone.
"""

from __future__ import annotations

import contextlib
import math
import time
from collections.abc import Callable, Mapping, Sequence
from dataclasses import replace
from typing import Any, get_args

import numpy as np

from shaper_fmu.errors import ModelError, SimulationError, nearest
from shaper_fmu.master import layout as of
from shaper_fmu.master.algorithms import ALGORITHMS, Algorithm, Coupling, SolverMethod
from shaper_fmu.master.clocks import has_clocks, is_clocked
from shaper_fmu.master.events import Treatment, treat_events
from shaper_fmu.master.faults import fault_error, warning_notes
from shaper_fmu.master.instance import Instance
from shaper_fmu.master.loop_library import loop
from shaper_fmu.master.loops import solve_loops
from shaper_fmu.master.metrics import check_metrics, metric_values
from shaper_fmu.master.model_exchange import Solving
from shaper_fmu.master.notes import coupling_notes, system_notes
from shaper_fmu.master.process_state import Kept, Share, keeping, process_notes, put_back
from shaper_fmu.master.program import Program
from shaper_fmu.master.results import Results
from shaper_fmu.master.run_options import Times, checked_solving, number_of_steps, set_up
from shaper_fmu.master.signals import Interpolation
from shaper_fmu.master.step_control import StepControl, ask_functions
from shaper_fmu.master.step_notes import step_notes, time_scales
from shaper_fmu.master.structure import SystemStructure
from shaper_fmu.master.wiring import Port
from shaper_fmu.metrics.metric import Metric

_CHUNK_SECONDS = 0.1
_MOST_PROGRAMS = 16
"""That are kept for other runs."""
_GROWTH = 256
"""How many times as many steps are taken at once, at most, as were taken before: they may become slower."""
Progress = Callable[[float], None]
"""Called now and then with the simulated time [s]."""


class Simulation:
    """Live instances of a system, to be run once or, by `reset`, many times. Close it, or use it in a with statement.

    `record` names the variables to record ("instance.variable"); all outputs if None. `metrics` are computed while the
    system is stepped (see shaper_fmu/metrics): with record=[] no trajectory is kept. `exact`: as runs will be (see `run`), so
    that FMUs are used with event mode or without it from the beginning. Raises ModelError if the system has a problem,
    SimulationError if an FMU cannot be instantiated.
    """

    def __init__(
        self,
        system: SystemStructure,
        record: Sequence[str] | None = None,
        metrics: Mapping[str, Metric] | None = None,
        exact: bool | None = None,
    ):
        problems = system.check()
        if problems:
            raise ModelError(problems)
        self.system = system
        self.instances: dict[str, Instance] = {}
        self._recorded = system.ports(record)
        self._metrics = dict(metrics or {})
        check_metrics(self._metrics)
        self._fresh = True
        self.changed: dict[str, None] = {}  # of the process's state, by FMUs, and put back
        self._programs: dict[tuple[object, ...], Program] = {}
        try:
            self.instantiate(treat_events(system, exact).exact)
        except BaseException:
            self.close()
            raise

    def __enter__(self) -> Simulation:
        return self

    def __exit__(self, *error: object) -> None:
        self.close()

    def close(self) -> None:
        """Free the instances; where one has failed beyond repair, FMI allows no call of the others of its FMU either."""
        lost = {instance.fmu.digest for instance in self.instances.values() if instance.fatal}
        with Kept(last=True):
            for instance in self.instances.values():
                instance.usable = instance.usable and instance.fmu.digest not in lost
                instance.close()

    @keeping
    def reset(self) -> None:
        """Bring all instances back to the state after instantiation. Raises SimulationError if they are closed or lost."""
        for name, instance in list(self.instances.items()):
            if instance.fatal:
                raise SimulationError(
                    f"{name}: {instance.fmu.name} failed beyond repair in an earlier run; make another Simulation"
                )
            if not instance.usable:
                raise SimulationError(f"{name}: the simulation is closed; make another one")
            try:
                instance.reset()
            except SimulationError:
                if instance.fmu.version > 1 or instance.fatal:
                    raise
                self.replace(name)  # FMI 1.0's models have no reset, and many slaves refuse it
        self._fresh = True

    def replace(self, name: str) -> None:
        """Make an instance anew."""
        self._programs.clear()  # they know the instance by its address
        self.instances[name].close()
        self.instances[name] = Instance(name, self.system.fmus[name], self.instances[name].event_mode)

    @keeping
    def instantiate(self, exact: bool) -> None:
        """Make the instances that are missing, or that have event mode where steps do not end at events, or the reverse."""
        for name, fmu in self.system.fmus.items():
            wanted = (exact or has_clocks(fmu)) and name not in self.system.without_event_mode
            event_mode = fmu.exchanges_model or (wanted and fmu.has_event_mode)
            known = self.instances.get(name)
            if known is not None and known.event_mode == event_mode:
                continue
            if known is not None:
                self._programs.clear()  # they know the instance by its address
                known.close()
            self.instances[name] = Instance(name, fmu, event_mode)

    @keeping
    def run(
        self,
        stop_time: float,
        step: float,
        *,
        start_time: float = 0.0,
        algorithm: Algorithm = "jacobi",
        start_values: Mapping[str, Any] | None = None,
        exact: bool | None = None,
        everywhere: bool = False,
        interpolation: Interpolation = "hold",
        tolerance: float | None = None,
        solver_tolerance: float | None = None,
        solver: SolverMethod = "auto",
        coupling: Coupling = "monolithic",
        progress: Progress | None = None,
    ) -> Results:
        """Run from start_time to stop_time with communication steps of `step` [s]; the last one may be shorter.

        `algorithm` is one of `ALGORITHMS`; `start_values` ("instance.variable") come on top of the system's. `exact`: steps
        end at events, too; by default where the system allows it (see `treat_events`). `everywhere`: rows are recorded at
        events, too, on both sides of a jump; else at the communication points alone. `interpolation`: inputs are held over a
        step, or "linear" where an FMU takes their derivatives (see linear_inputs.py). `tolerance`: the steps are divided so that
        coupling errs by less than this, relative to 1 + |value|, in each (see step_control.py). `solver_tolerance`: of solvers
        in the FMUs, where they take one, in place of their own default, and of CVODE, which solves FMUs of model exchange by
        `solver` (see algorithms.py). `coupling`: they are solved as one system of equations ("monolithic"), or exchange values
        at communication points ("steps"). Raises SimulationError with the instance's name, the time
        and its last messages when a call fails, and what was recorded until then as its `results`, and ModelError for wrong
        names. After an error the simulation can be run again, unless it was fatal.
        """
        if algorithm not in ALGORITHMS:
            raise ModelError([f"there is no algorithm {algorithm!r}.{nearest(algorithm, ALGORITHMS)}"])
        number_of_steps(self.system, start_time, stop_time, step)  # wrong times are told before anything is done
        treatment = treat_events(self.system, exact)
        if not self._fresh:
            self.reset()
        self._fresh = False
        self.instantiate(treatment.exact)
        if interpolation not in get_args(Interpolation):
            raise ModelError([f"there is no interpolation {interpolation!r}.{nearest(interpolation, get_args(Interpolation))}"])
        program = self._program(
            algorithm, treatment, interpolation == "linear", checked_solving(solver, coupling, solver_tolerance)
        )
        control = of.Control()
        set_up(control, program, Times(start_time, stop_time, step), algorithm, treatment.exact)
        control.everywhere = bool(everywhere)
        if program.signals and not control.exchange:
            control.functions, control.function_place = len(program.signals), program.signals[0][0]
        self._initialize(program, control, start_values or {}, solver_tolerance)
        controller = self._controller(program, control, tolerance) if tolerance is not None else None
        linear_notes = (_linear_note(program.linear_inputs),) if interpolation == "linear" else ()
        notes = (
            *system_notes(self.system),
            *coupling_notes(self.system, treatment, algorithm, self._recorded, coupling),
            *linear_notes,
        )
        notes += step_notes(self.system, treatment, step, [self._scales])
        return self._stepped(program, control, progress, notes, controller)

    def _controller(self, program: Program, control: of.Control, tolerance: float) -> StepControl:
        if not (math.isfinite(tolerance) and tolerance > 0.0):
            raise ModelError([f"tolerance = {tolerance} must be a positive number"])
        return StepControl(program, control, tolerance)

    def _program(self, algorithm: str, treatment: Treatment, linear: bool, solving: Solving) -> Program:
        key = (algorithm, treatment.exact, treatment.notes, linear, solving)
        if key not in self._programs:
            if len(self._programs) >= _MOST_PROGRAMS:
                del self._programs[next(iter(self._programs))]
            connections = treatment.connections
            self._programs[key] = Program(
                self.system, self.instances, self._recorded, algorithm, connections, self._metrics, treatment.exact, linear,
                solving=solving,
            )  # fmt: skip
        return self._programs[key]

    def _stepped(
        self,
        program: Program,
        control: of.Control,
        progress: Progress | None,
        notes: tuple[str, ...],
        controller: StepControl | None,
    ) -> Results:
        """Step to the end. The record grows where events take more room."""
        rows = int(control.steps) + 2 + (64 if control.everywhere else 0)
        times, record = np.empty(rows), np.empty((rows, len(self._recorded)))
        _record_into(control, times, record)
        control.at_grid = 1
        loop().first_row(program.address, control)
        most, stepwise, spent = 1, controller is not None or bool(program.signals), 0.0
        while True:
            begin = time.perf_counter()
            try:
                if controller is not None:
                    code = controller.advance()
                elif program.signals and control.done < control.steps and control.rows + 2 <= rows:
                    code = self._step_with_signals(program, control)
                else:
                    code = loop().run(program.address, control, most)
                taken = time.perf_counter() - begin
                spent += taken
                if code == of.FAULT:
                    raise self._fault(program, control)
                put_back(Share.FOR_OTHERS if progress is None or stepwise else Share.EVERYTHING)
            except SimulationError as error:
                error.results = self._results(program, control, times, record, notes)
                raise
            if code == of.FULL:
                rows *= 2
                times, record = (np.concatenate([kept, np.empty_like(kept)]) for kept in (times, record))
                _record_into(control, times, record)
            elif code == of.FINISHED:
                break
            elif not stepwise:  # so long that Python costs nothing, so short that people see progress and can interrupt
                fitting = most * _CHUNK_SECONDS / max(1e-6, taken)
                most = max(1, min(1 << 24, _GROWTH * most, int(fitting)))
            if progress is not None:
                progress(float(control.t))
        if progress is not None:
            progress(float(control.stop))
        return replace(self._results(program, control, times, record, notes), stepping_time=spent)

    def _step_with_signals(self, program: Program, control: of.Control) -> int:
        """A step of a system with inputs that Python functions give."""
        loop().plan_step(program.address, control)
        ask_functions(program, control, float(control.target))
        if not loop().take_planned_step(program.address, control):
            return of.FAULT
        return of.FINISHED if control.done >= control.steps else of.GOING_ON

    def _fault(self, program: Program, control: of.Control, at: str | None = None) -> SimulationError:
        return fault_error(program, self.instances, control, at)

    def _initialize(
        self, program: Program, control: of.Control, start_values: Mapping[str, Any], solver_tolerance: float | None
    ) -> None:
        extra: dict[str, dict[str, Any]] = {name: {} for name in self.instances}
        for name, value in start_values.items():
            self.system.check_settable(name)
            instance, variable = self.system.split(name)
            extra[instance].update(self.system.fmus[instance].start_values({variable: value}))
        for name, instance in self.instances.items():
            values = {**self.system.start_values[name], **extra[name]}
            clocked = {key: value for key, value in values.items() if is_clocked(instance.fmu, key)}
            others = {key: value for key, value in values.items() if key not in clocked}
            if not instance.fmu.has_initialization_mode:
                instance.set_values(others, "initialization")
                continue
            instance.enter_initialization(float(control.start), float(control.stop), others, solver_tolerance)
            instance.set_values(clocked, "initialization")
        program.reset()
        t = float(control.start)
        program.ask_functions(t)
        if not loop().begin_early(program.address, control, t):
            raise self._fault(program, control, "initialization")
        for instance in self.instances.values():
            if not instance.fmu.has_initialization_mode:
                instance.enter_initialization(t, float(control.stop), {}, solver_tolerance)
        program.note_initialization()
        program.parts.check_counts(self.instances)
        if not loop().initialize(program.address, control, t):
            raise self._fault(program, control, "initialization")
        self._scales = self._time_scales()
        if program.loops:
            self._solve_loops(program, control, t)
        if program.clocks.ports and not loop().start_clocks(program.address, control):
            raise self._fault(program, control, "initialization")
        for instance in self.instances.values():
            instance.exit_initialization()
        in_event_mode = any(instance.event_mode for instance in self.instances.values())
        if not loop().begin(program.address, control, t, in_event_mode):
            raise self._fault(program, control, "initialization")

    def _time_scales(self) -> dict[Port, float]:
        """Values of the variables that give the system's time scales, in initialization mode; an FMU need not return them."""
        found: dict[Port, float] = {}
        for port in time_scales(self.system):
            with contextlib.suppress(SimulationError):
                found[port] = float(self.instances[port[0]].get_values([port[1]])[0])
        return found

    def _solve_loops(self, program: Program, control: of.Control, t: float) -> None:
        def exchange() -> None:
            if not loop().exchange(program.address, control, t):
                raise self._fault(program, control, "initialization")

        solve_loops(program.loops, program.layout.bus, program.cut_places(), exchange)

    def _results(
        self, program: Program, control: of.Control, times: np.ndarray, record: np.ndarray, notes: tuple[str, ...]
    ) -> Results:
        """The results recorded so far."""
        times, columns = times[: control.rows], np.ascontiguousarray(record[: control.rows].T)
        notes = (*notes, *process_notes(self.changed), *warning_notes(program, self.instances, control))
        names = [".".join(port) for port in self._recorded]
        units = {name: self.system.unit(port) for name, port in zip(names, self._recorded, strict=True)}
        displays = {name: self.system.display_unit(port) for name, port in zip(names, self._recorded, strict=True)}
        for name, column in zip(names, columns, strict=True):
            if np.isnan(column.min(initial=0.0)):
                notes = (*notes, f"{name} is not a number from t = {times[np.isnan(column).argmax()]:.15g} s on")
        return Results(
            times,
            dict(zip(names, columns, strict=True)),
            units,
            displays,
            notes,
            metric_values(self._metrics, program.layout.metrics),
        )


def _record_into(control: of.Control, times: np.ndarray, record: np.ndarray) -> None:
    """Have the loop go on writing rows to these arrays, of shapes (rows,) and (rows, recorded)."""
    control.room = len(times)
    control.next_time = times.ctypes.data + int(control.rows) * times.itemsize
    control.next_row = record.ctypes.data + int(control.rows) * record.shape[1] * record.itemsize


def _linear_note(linear: list[Port]) -> str:
    """A note on the inputs that are linear over a step."""
    if not linear:
        return "all inputs are held over each step: no FMU takes derivatives of its connected inputs"
    return f"linear over each step: {', '.join('.'.join(port) for port in linear)}; all other inputs are held"
