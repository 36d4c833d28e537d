"""Running a system: live instances over fixed communication steps.

A run initializes the instances, then steps them with one of the algorithms of `master/algorithms.py`, and records the
chosen variables at every communication point, from the right where they jump.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Mapping, Sequence
from typing import Any

import numpy as np

from shaper_fmu.errors import ModelError, nearest
from shaper_fmu.master.algorithms import ALGORITHMS, Algorithm, Loop
from shaper_fmu.master.instance import Instance
from shaper_fmu.master.results import Results
from shaper_fmu.master.system import System

_MOST_STEPS = 1e8
Progress = Callable[[float], None]
"""Called now and then with the simulated time [s]."""


class Simulation:
    """Live instances of a system, to be run once or, by `reset`, many times. Close it, or use it in a with statement.

    `record` names the variables to record ("instance.variable"); all outputs if None. Raises ModelError if the system
    has a problem, SimulationError if an FMU cannot be instantiated.
    """

    def __init__(self, system: System, record: Sequence[str] | None = None):
        problems = system.check()
        if problems:
            raise ModelError(problems)
        self.system = system
        self.instances: dict[str, Instance] = {}
        self._recorded = system.ports(record)
        self._fresh = True
        try:
            for name, fmu in system.fmus.items():
                self.instances[name] = Instance(name, fmu)
            self._loop = Loop(system, self.instances, self._recorded)
        except BaseException:
            self.close()
            raise

    def __enter__(self) -> Simulation:
        return self

    def __exit__(self, *error: object) -> None:
        self.close()

    def close(self) -> None:
        """Free the instances."""
        for instance in self.instances.values():
            instance.close()

    def reset(self) -> None:
        """Bring all instances back to the state after instantiation."""
        for instance in self.instances.values():
            instance.call("reset")
            instance.log.clear()
        self._fresh = True

    def run(
        self,
        stop_time: float,
        step: float,
        *,
        start_time: float = 0.0,
        algorithm: Algorithm = "jacobi",
        start_values: Mapping[str, Any] | None = None,
        progress: Progress | None = None,
    ) -> Results:
        """Run from start_time to stop_time with communication steps of `step` [s]; the last one may be shorter.

        `algorithm` is one of `ALGORITHMS`; `start_values` ("instance.variable") come on top of the system's. Raises
        SimulationError with the instance's name, the time and its last messages when a call fails, and ModelError for
        wrong names.
        """
        if algorithm not in ALGORITHMS:
            raise ModelError([f"there is no algorithm {algorithm!r}.{nearest(algorithm, ALGORITHMS)}"])
        if not (all(map(math.isfinite, (start_time, stop_time, step))) and step > 0.0 and stop_time >= start_time):
            raise ModelError([f"cannot run from {start_time} s to {stop_time} s in steps of {step} s"])
        if not self._fresh:
            self.reset()
        self._fresh = False
        if step < 16.0 * math.ulp(max(abs(start_time), abs(stop_time))) or (stop_time - start_time) / step > _MOST_STEPS:
            raise ModelError(
                [f"steps of {step} s from {start_time} s to {stop_time} s are too small or too many ({_MOST_STEPS:g} at most)"]
            )
        steps = math.ceil((stop_time - start_time) / step * (1.0 - 1e-12) - 1e-9)
        self._check_last_step(start_time + steps * step, stop_time, step)
        record = np.empty((steps + 1, len(self._recorded)))
        self._initialize(start_time, stop_time, start_values or {})
        advance = ALGORITHMS[algorithm]
        record[0] = self._loop.recorded()
        for i in range(steps):
            t = start_time + i * step
            advance(self._loop, t, step if i < steps - 1 else min(step, stop_time - t))
            record[i + 1] = self._loop.recorded()
            if progress is not None and i % 256 == 0:
                progress(t)
        if progress is not None:
            progress(stop_time)
        time = start_time + step * np.arange(steps + 1)
        time[-1] = stop_time
        return self._results(time, record)

    def _check_last_step(self, grid_end: float, stop_time: float, step: float) -> None:
        if grid_end > stop_time + 1e-9 * step:
            for name, fmu in self.system.fmus.items():
                if not fmu.co_simulation.canHandleVariableCommunicationStepSize:
                    raise ModelError([f"{name} takes no variable steps, so stop_time must be a multiple of the step {step} s"])

    def _initialize(self, start_time: float, stop_time: float, start_values: Mapping[str, Any]) -> None:
        extra: dict[str, dict[str, Any]] = {name: {} for name in self.instances}
        for name, value in start_values.items():
            self.system.check_settable(name)
            instance, variable = self.system.split(name)
            extra[instance].update(self.system.fmus[instance].start_values({variable: value}))
        for name, instance in self.instances.items():
            instance.call("setupExperiment", None, start_time, stop_time)
            instance.set_values({**self.system.start_values[name], **extra[name]})
            instance.call("enterInitializationMode")
        self._loop.read("initialization")
        self._loop.exchange(start_time, "initialization")
        for instance in self.instances.values():
            instance.call("exitInitializationMode", at="initialization")
        self._loop.read("initialization")

    def _results(self, time: np.ndarray, record: np.ndarray) -> Results:
        names = [".".join(port) for port in self._recorded]
        units = {name: self.system.unit(port) for name, port in zip(names, self._recorded, strict=True)}
        displays = {name: self.system.display_unit(port) for name, port in zip(names, self._recorded, strict=True)}
        return Results(time, dict(zip(names, record.T.copy(), strict=True)), units, displays)
