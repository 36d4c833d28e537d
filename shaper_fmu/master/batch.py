"""Batches: many short runs of a system on live instances, each compiled as a whole, with metrics instead of trajectories.

The numbers are those of `Simulation.run`, to the bit; what lies between the runs takes microseconds.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np

from shaper_fmu.errors import ModelError, SimulationError
from shaper_fmu.master import layout as of
from shaper_fmu.master.algorithms import Algorithm, Coupling, SolverMethod
from shaper_fmu.master.events import treat_events
from shaper_fmu.master.faults import fault_error
from shaper_fmu.master.instance import Instance
from shaper_fmu.master.loop_library import loop
from shaper_fmu.master.process_state import Share, keeping, put_back
from shaper_fmu.master.program import Program
from shaper_fmu.master.run_options import Times, checked_solving, set_up
from shaper_fmu.master.signals import Interpolation
from shaper_fmu.master.simulation import Simulation
from shaper_fmu.master.structure import SystemStructure
from shaper_fmu.master.wiring import Port
from shaper_fmu.metrics.metric import GATHERED, Metric

_MOST = 1 << 18
"""Macro steps until Python can be interrupted."""

_ENDLESS = 1 << 62


@dataclass(frozen=True)
class Plan:
    """The common settings of a batch's runs; times in s.

    With `stop_when` ("instance.variable") a run ends once that variable has been true for `stop_hold`.
    """

    stop_time: float
    step: float
    start_time: float = 0.0
    algorithm: Algorithm = "jacobi"
    interpolation: Interpolation = "hold"
    exact: bool | None = None
    stop_when: str | None = None
    stop_hold: float = 0.0
    solver: SolverMethod = "auto"
    coupling: Coupling = "monolithic"
    solver_tolerance: float | None = None


class Batch:
    """Runs of a system with different start values. Close it, or use it in a with statement.

    `varied` are the names ("instance.variable") of all start values that any run sets; what a run does not give has the
    system's own value, or the FMU's. Raises ModelError for wrong names, and for a system that cannot be run as a batch.

    Attributes:
        resets: whether the FMUs can be reset; if not, the batch is good for one run.
    """

    def __init__(self, system: SystemStructure, plan: Plan, metrics: Mapping[str, Metric], varied: Sequence[str]):
        self.system: SystemStructure = system
        self.plan: Plan = plan
        self._metrics, self._begun = dict(metrics), False
        self._simulation = Simulation(system, record=[], metrics=metrics)
        self.changed: dict[str, None] = self._simulation.changed
        try:
            self._prepare(varied)
        except BaseException:
            self.close()
            raise

    def __enter__(self) -> Batch:
        return self

    def __exit__(self, *error: object) -> None:
        self.close()

    def close(self) -> None:
        """Free the instances."""
        self._simulation.close()

    def _prepare(self, varied: Sequence[str]) -> None:
        plan, system = self.plan, self.system
        treatment = treat_events(system, plan.exact)
        self._simulation.instantiate(treatment.exact)
        self.instances: dict[str, Instance] = self._simulation.instances
        self.resets: bool = False not in [self._can_reset(name) for name in self.instances]
        self._ports = self._start_ports(varied)
        self._program = Program(
            system, self.instances, system.ports([plan.stop_when] if plan.stop_when else []), plan.algorithm,
            treatment.connections, self._metrics, treatment.exact, plan.interpolation == "linear", list(self._ports),
            checked_solving(plan.solver, plan.coupling, plan.solver_tolerance),
        )  # fmt: skip
        program = self._program
        if program.loops or program.signals or program.has_unfed_elements():
            raise ModelError(["loops without delay, inputs given by functions, and partly connected arrays need Simulation.run"])
        if any(fmu.structure for fmu in system.fmus.values()):
            raise ModelError(["values of structural parameters, which a reset takes back, need Simulation.run"])
        if not all(
            instance.fmu.version == 1 or instance.address(f"fmi{instance.fmu.version}Reset") for instance in self.instances.values()
        ):
            raise ModelError(["FMUs whose libraries lack the function to reset them need Simulation.run"])
        program.parts.check_counts(self.instances)
        program.reset()
        if plan.solver_tolerance is not None:
            program.layout.instances["tolerance"] = plan.solver_tolerance
        self._places = np.array(program.start_places(), np.int64)
        self._base = np.array([float(value) for value in self._ports.values()])
        self.columns: dict[str, int] = {".".join(port): column for column, port in enumerate(self._ports)}
        """Where each start value stands in a row."""
        self._in_event_mode = any(instance.event_mode for instance in self.instances.values())
        self._controls: Any = (of.Control * 2)()  # the one in use, and a fresh one
        self._control = self._controls[0]
        self._fill(self._controls[1], treatment.exact)

    def _can_reset(self, name: str) -> bool:
        """Whether an instance can be reset. That of FMI 1.0 is tried, since many return an error; it is as new afterwards."""
        instance = self.instances[name]
        if instance.fmu.version > 1:
            return True
        try:
            instance.enter_initialization(self.plan.start_time, self.plan.stop_time, self.system.start_values[name])
            instance.reset()
        except SimulationError:
            self._simulation.replace(name)
            return False
        return True

    def _fill(self, control: of.Control, exact: bool) -> None:
        plan = self.plan
        set_up(control, self._program, Times(plan.start_time, plan.stop_time, plan.step), plan.algorithm, exact)
        control.at_grid, control.unrecorded, control.room = 1, 1, _ENDLESS
        control.stop_hold, control.true_since = plan.stop_hold, of.NO_EVENT
        if plan.stop_when:
            control.stop_place = self._program.place(self.system.ports([plan.stop_when])[0])

    def _start_ports(self, varied: Sequence[str]) -> dict[Port, float | int | bool]:
        """All start values that are set at each run, with those of the system or of the FMU."""
        found: dict[Port, float | int | bool] = {}
        for name, values in self.system.start_values.items():
            found.update({(name, variable): value for variable, value in values.items()})
        for name in varied:
            self.system.check_settable(name)
            port = self.system.split(name)
            self.system.fmus[port[0]].variable(port[1], "input", "parameter")
            if port not in found:
                if self.system.fmus[port[0]].variables[port[1]].start is None:
                    raise ModelError([f"{name} has no start value; give it one in the system"])
                found[port] = self.instances[port[0]].start_value(port[1])
        return found

    def values_of(self, start_values: Mapping[str, Any]) -> dict[str, float]:
        """Start values by the names of scalars, as numbers: items of enumerations by name, sequences for arrays. ModelError."""
        found: dict[str, float] = {}
        for name, value in start_values.items():
            self.system.check_settable(name)
            instance, variable = self.system.split(name)
            elements = self.system.fmus[instance].start_values({variable: value})
            found.update({f"{instance}.{element}": float(number) for element, number in elements.items()})
        return found

    def rows(self, start_values: Sequence[Mapping[str, float]]) -> np.ndarray:
        """Start values of runs (scalars as numbers, see `values_of`), as `run_rows` takes them: shape (runs, len(self.columns))."""
        found = np.tile(self._base, (len(start_values), 1))
        for row, values in zip(found, start_values, strict=True):
            for name, value in values.items():
                row[self.columns[name]] = value
        return found

    def run(self, values: Mapping[str, float]) -> dict[str, float]:
        """The metrics of a run with these start values (scalars as numbers, see `values_of`).

        Raises SimulationError as `Simulation.run` does, or for a command that has not ended; then make another batch.
        """
        (found,) = self.run_rows(self.rows([values]))
        if isinstance(found, SimulationError):
            raise found
        return dict(zip(self._metrics, found, strict=True))

    @keeping
    def run_rows(
        self, rows: np.ndarray, numbers: np.ndarray | None = None, now: int = 0
    ) -> list[tuple[float, ...] | SimulationError]:
        """The metrics of a run for each row of start values, or why it failed; one compiled call does them all.

        A run that fails ends the list, and the batch: make another one for the rows that are left. While they are done, the
        number of the run at work (of `numbers`, int64) is kept at the address `now`, for others that watch this process.
        """
        if not self.resets and (self._begun or len(rows) > 1):
            raise ModelError(["an FMU cannot be reset, so that a batch is good for one run: make another one"])
        self._begun = True
        rows = np.ascontiguousarray(rows, np.float64)
        numbers = np.ascontiguousarray(np.arange(len(rows)) if numbers is None else numbers, np.int64)
        gathered = np.empty((len(rows), len(self._metrics)), GATHERED)
        done, failure = 0, None
        while done < len(rows) and failure is None:
            left = slice(done, len(rows))
            runs = of.Runs(
                _MOST, self._places.ctypes.data, len(self._places), rows[left].ctypes.data, len(rows) - done,
                numbers[left].ctypes.data, now, gathered[left].ctypes.data,
            )  # fmt: skip
            for instance in self.instances.values():
                instance.initialized = True
            loop().whole_runs(self._program.address, self._controls, self._in_event_mode, runs)
            put_back(Share.FOR_OTHERS)
            done, code = done + runs.finished, runs.answer
            while code == of.GOING_ON:  # a long one: from here on it can be interrupted
                code = loop().run(self._program.address, self._control, _MOST)
                put_back(Share.FOR_OTHERS)
                if code == of.FINISHED:
                    gathered[done] = self._program.layout.metrics
                    done += 1
            if code == of.FAULT:
                failure = fault_error(self._program, self.instances, self._control, None)
        return self._judged(gathered[:done]) + ([failure] if failure else [])

    def _judged(self, gathered: np.ndarray) -> list[tuple[float, ...] | SimulationError]:
        """The metrics of runs, or the reason of a failure."""
        columns = [metric.values(gathered[:, i]).tolist() for i, metric in enumerate(self._metrics.values())]
        found: list[tuple[float, ...] | SimulationError] = list(zip(*columns, strict=True)) if columns else [()] * len(gathered)
        for i, (name, metric) in reversed(list(enumerate(self._metrics.items()))):  # the first metric's word counts
            for run in np.flatnonzero(metric.unfinished(gathered[:, i])):
                found[run] = SimulationError(f"metric {name}: {metric.problem(gathered[run, i])}")
        return found
