"""Running a system: live instances and the stepping loop over fixed communication steps.

At each communication point t every instance gets its inputs, which hold over [t, t + h], and steps to t + h. With the
Jacobi algorithm all inputs are the outputs at t. With Gauss-Seidel the instances step in the order of their
connections, and an input fed by one that has already stepped is that one's output at t + h.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Mapping, Sequence
from typing import Any, Literal

import numpy as np
from fmpy.fmi1 import FMICallException

from shaper_fmu.errors import ModelError, SimulationError
from shaper_fmu.master.instance import Instance
from shaper_fmu.master.results import Results
from shaper_fmu.master.signals import Signal
from shaper_fmu.master.system import System
from shaper_fmu.master.wiring import Port

Algorithm = Literal["jacobi", "gauss_seidel"]
Progress = Callable[[float], None]
"""Called now and then with the simulated time [s]."""


class _Stepper:
    """One instance in the loop: where its inputs come from and where its outputs go on the bus."""

    def __init__(self, instance: Instance, system: System, places: dict[Port, int], outputs: list[str]):
        name = instance.name
        inputs = [v for v in instance.fmu.variables if (name, v) in system.connections or (name, v) in system.signals]
        self.instance = instance
        self.sources = [self._source(system, places, (name, v)) for v in inputs]
        self.input_names = inputs
        self.inputs, self.outputs = instance.transfer(inputs), instance.transfer(outputs)
        self.offset = places[(name, outputs[0])] if outputs else 0

    @staticmethod
    def _source(system: System, places: dict[Port, int], port: Port) -> int | Signal:
        """A place on the bus, or a signal."""
        return system.signals[port] if port in system.signals else places[system.connections[port]]

    def feed(self, t: float, bus: list[Any]) -> None:
        """Set the inputs from the bus and the signals at t."""
        values = [bus[source] if isinstance(source, int) else source(t) for source in self.sources]
        for name, value in zip(self.input_names, values, strict=True):
            if not math.isfinite(value):
                raise SimulationError(f"{self.instance.name} at t = {t:.15g} s: the value for input {name} is {value}")
        self.inputs.set(values)


class Simulation:
    """Live instances of a system, to be run once or, by `reset`, many times. Close it, or use it in a with statement.

    `record` names the variables to record ("instance.variable"); all outputs if None.
    """

    def __init__(self, system: System, record: Sequence[str] | None = None):
        problems = system.check()
        if problems:
            raise ModelError(problems)
        self.system = system
        self.instances: dict[str, Instance] = {}
        self._recorded = system.ports(record)
        self._fresh = True
        bus_ports = list(dict.fromkeys([*system.connections.values(), *self._recorded]))
        by_instance = {name: [p[1] for p in bus_ports if p[0] == name] for name in system.fmus}
        ordered = [(name, variable) for name, variables in by_instance.items() for variable in variables]
        self._places = {port: place for place, port in enumerate(ordered)}
        try:
            for name, fmu in system.fmus.items():
                self.instances[name] = Instance(name, fmu)
            self._steppers = {n: _Stepper(i, system, self._places, by_instance[n]) for n, i in self.instances.items()}
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
        algorithm: Algorithm = "gauss_seidel",
        start_values: Mapping[str, Any] | None = None,
        progress: Progress | None = None,
    ) -> Results:
        """Run from start_time to stop_time with communication steps of `step` [s]; the last one may be shorter.

        `start_values` ("instance.variable") come on top of the system's. Raises SimulationError with the instance's
        name, the time and its last messages when a call fails, and ModelError for wrong names.
        """
        if algorithm not in ("jacobi", "gauss_seidel"):
            raise ModelError([f"algorithm {algorithm!r} is neither 'jacobi' nor 'gauss_seidel'"])
        if not (math.isfinite(step) and step > 0.0 and math.isfinite(stop_time) and stop_time >= start_time):
            raise ModelError([f"cannot run from {start_time} s to {stop_time} s in steps of {step} s"])
        if not self._fresh:
            self.reset()
        self._fresh = False
        steps = math.ceil((stop_time - start_time) / step * (1.0 - 1e-12) - 1e-9)
        self._check_last_step(start_time + steps * step, stop_time, step)
        bus: list[Any] = [0.0] * len(self._places)
        record = np.empty((steps + 1, len(self._recorded)))
        columns = [self._places[port] for port in self._recorded]
        self._initialize(start_time, stop_time, start_values or {}, bus)
        record[0] = [bus[place] for place in columns]
        order = [self._steppers[name] for name in self.system.instance_order()]
        advance = _jacobi if algorithm == "jacobi" else _gauss_seidel
        for i in range(steps):
            t = start_time + i * step
            advance(order, t, step if i < steps - 1 else min(step, stop_time - t), bus)
            record[i + 1] = [bus[place] for place in columns]
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

    def _initialize(self, start_time: float, stop_time: float, start_values: Mapping[str, Any], bus: list[Any]) -> None:
        extra: dict[str, dict[str, Any]] = {name: {} for name in self.instances}
        for name, value in start_values.items():
            instance, variable = self.system.split(name)
            extra[instance].update(self.system.fmus[instance].start_values({variable: value}))
        for name, instance in self.instances.items():
            instance.call("setupExperiment", None, start_time, stop_time)
            instance.set_values({**self.system.start_values[name], **extra[name]})
            instance.call("enterInitializationMode")
        when = " at initialization"
        for (name, variable), signal in self.system.signals.items():
            self.instances[name].set_values({variable: signal(start_time)}, when)
        for target in self.system.signal_order()[0]:
            source = self.system.connections[target]
            value = self.instances[source[0]].get_values([source[1]], when)[0]
            self.instances[target[0]].set_values({target[1]: value}, when)
        for instance in self.instances.values():
            instance.call("exitInitializationMode", when=when)
        for stepper in self._steppers.values():
            _read(stepper, start_time, bus)

    def _results(self, time: np.ndarray, record: np.ndarray) -> Results:
        names = [".".join(port) for port in self._recorded]
        units = {name: self.system.unit(port) for name, port in zip(names, self._recorded, strict=True)}
        displays = {name: self.system.display_unit(port) for name, port in zip(names, self._recorded, strict=True)}
        return Results(time, dict(zip(names, record.T.copy(), strict=True)), units, displays)


def _jacobi(order: list[_Stepper], t: float, h: float, bus: list[Any]) -> None:
    for stepper in order:
        _guarded(stepper, t, stepper.feed, t, bus)
    for stepper in order:
        stepper.instance.call("doStep", t, h, when=f" at t = {t:.15g} s")
    for stepper in order:
        _read(stepper, t + h, bus)


def _gauss_seidel(order: list[_Stepper], t: float, h: float, bus: list[Any]) -> None:
    for stepper in order:
        _guarded(stepper, t, stepper.feed, t, bus)
        stepper.instance.call("doStep", t, h, when=f" at t = {t:.15g} s")
        _read(stepper, t + h, bus)


def _read(stepper: _Stepper, t: float, bus: list[Any]) -> None:
    _guarded(stepper, t, stepper.outputs.get, bus, stepper.offset)


def _guarded(stepper: _Stepper, t: float, function: Callable[..., None], *arguments: Any) -> None:
    try:
        function(*arguments)
    except FMICallException as error:
        raise stepper.instance.failure(error, f" at t = {t:.15g} s") from None
