"""A live instance of an FMU: its calls with checked status, and its log."""

from __future__ import annotations

from collections import deque
from collections.abc import Mapping, Sequence
from ctypes import byref, c_double, c_int, c_uint, c_void_p
from typing import Any

import fmpy
from fmpy.fmi1 import FMICallException, printLogMessage
from fmpy.fmi2 import (
    FMU2Slave,
    fmi2CallbackAllocateMemoryTYPE,
    fmi2CallbackFreeMemoryTYPE,
    fmi2CallbackFunctions,
    fmi2CallbackLoggerTYPE,
)
from fmpy.logging import addLoggerProxy
from fmpy.model_description import ModelVariable

from shaper_fmu.errors import ModelError, SimulationError
from shaper_fmu.master.fmu import Fmu

Moment = float | str | None
"""When something happens, for messages: a time [s], or a word such as "initialization"."""


def moment(at: Moment) -> str:
    """The moment as part of a message."""
    return "" if at is None else f" at {at}" if isinstance(at, str) else f" at t = {at:.15g} s"


_logs: dict[int, deque[str]] = {}
"""Log messages by the instance's number, which is its component environment."""


def _log(environment: int | None, name: bytes, status: int, category: bytes, message: bytes) -> None:
    log = _logs.get(environment or 0)
    if log is None:
        printLogMessage(c_void_p(environment), name, status, category, message)
    else:
        log.append(message.decode("utf-8", "replace").strip())


def _make_callbacks() -> fmi2CallbackFunctions:
    """fmpy's logger proxy keeps one Python function for the whole process, so all instances share this one."""
    callbacks = fmi2CallbackFunctions()
    callbacks.logger = fmi2CallbackLoggerTYPE(_log)
    callbacks.allocateMemory = fmi2CallbackAllocateMemoryTYPE(fmpy.calloc)
    callbacks.freeMemory = fmi2CallbackFreeMemoryTYPE(fmpy.free)
    addLoggerProxy(byref(callbacks))
    return callbacks


_callbacks = _make_callbacks()


class Transfer:
    """Variables of one instance that are set or got together, in a few calls: one for each FMI type.

    `places` tells where each variable's value stands in the lists that `get` fills; by default in their order.
    """

    def __init__(self, slave: FMU2Slave, variables: Sequence[ModelVariable], places: Sequence[int] | None = None):
        self._slave = slave
        self._groups = []
        kinds = {
            "Real": ("Real", c_double),
            "Integer": ("Integer", c_int),
            "Enumeration": ("Integer", c_int),
            "Boolean": ("Boolean", c_int),
        }
        for fmi_type in ("Real", "Integer", "Boolean"):
            chosen = [i for i, v in enumerate(variables) if kinds[str(v.type)][0] == fmi_type]
            if chosen:
                references = (c_uint * len(chosen))(*[variables[i].valueReference for i in chosen])
                buffer = (kinds[fmi_type][1] * len(chosen))()
                calls = getattr(slave, f"fmi2Get{fmi_type}"), getattr(slave, f"fmi2Set{fmi_type}")
                targets = chosen if places is None else [places[i] for i in chosen]
                self._groups.append((*calls, references, buffer, chosen, targets))

    def __bool__(self) -> bool:
        return bool(self._groups)

    def get(self, values: list[Any]) -> None:
        """Put the variables' values into their places in `values`."""
        for get, _, references, buffer, _, targets in self._groups:
            get(self._slave.component, references, len(targets), buffer)
            for target, value in zip(targets, buffer, strict=True):
                values[target] = value

    def set(self, values: Sequence[Any]) -> None:
        """Set the variables to `values`, in the order in which the variables were given."""
        for _, set_, references, buffer, chosen, _ in self._groups:
            for i, place in enumerate(chosen):
                buffer[i] = values[place]
            set_(self._slave.component, references, len(chosen), buffer)


class Instance:
    """An instantiated FMU. Every failing call raises SimulationError with the instance's name and its last messages."""

    def __init__(self, name: str, fmu: Fmu):
        self.name, self.fmu = name, fmu
        self.log: deque[str] = deque(maxlen=20)
        self.usable = False
        environment = max(_logs, default=0) + 1
        _logs[environment] = self.log
        self._environment = environment
        self._callbacks = fmi2CallbackFunctions.from_buffer_copy(_callbacks)
        self._callbacks.componentEnvironment = environment
        try:
            self.slave = FMU2Slave(
                guid=fmu.description.guid,
                modelIdentifier=fmu.co_simulation.modelIdentifier,
                unzipDirectory=str(fmu.folder),
                instanceName=name,
            )
            self.slave.instantiate(callbacks=self._callbacks, loggingOn=True)
        except Exception as error:  # fmpy raises bare Exceptions
            del _logs[environment]
            raise SimulationError(f"{name}: {fmu.name} cannot be instantiated: {self._words(error)}") from None
        self.usable = True

    def _words(self, error: Exception) -> str:
        return "; ".join(line for line in [str(error), *self.log] if line)

    def call(self, function: str, *arguments: Any, at: Moment = None) -> None:
        """Call a method of fmpy's slave, such as "reset"."""
        try:
            getattr(self.slave, function)(*arguments)
        except FMICallException as error:
            raise self.failure(error, at) from None

    def step(self, t: float, h: float) -> None:
        """Step from t to t + h [s]."""
        try:
            self.slave.fmi2DoStep(self.slave.component, t, h, 1)
        except FMICallException as error:
            raise self.failure(error, t) from None

    def failure(self, error: FMICallException, at: Moment = None) -> SimulationError:
        """The error to raise for a failed call; a fatal one leaves the instance unusable."""
        self.usable = self.usable and error.status < 4
        said = [text.removeprefix("Fatal py exception encountered: ").split("PyObject_CallMethod\n")[-1] for text in self.log]
        words = f": {'; '.join(said[-3:])}" if said else ""
        return SimulationError(
            f"{self.name}{moment(at)}: {error.function} failed{words or f' with status {error.status} and no message'}"
        )

    def transfer(self, names: Sequence[str], places: Sequence[int] | None = None) -> Transfer:
        """A transfer of these variables. Raises ModelError for a variable that is no number (a string)."""
        variables = [self.fmu.variables[name] for name in names]
        for variable in variables:
            if variable.type == "String":
                raise ModelError([f"{self.name}.{variable.name} is a string; only numbers and booleans can be transferred"])
        return Transfer(self.slave, variables, places)

    def set_values(self, values: Mapping[str, float | int | bool]) -> None:
        """Set variables by name."""
        try:
            self.transfer(list(values)).set(list(values.values()))
        except FMICallException as error:
            raise self.failure(error) from None

    def get_values(self, names: Sequence[str]) -> list[Any]:
        """Values of variables by name."""
        values: list[Any] = [0.0] * len(names)
        try:
            self.transfer(names).get(values)
        except FMICallException as error:
            raise self.failure(error) from None
        return values

    def close(self) -> None:
        """Terminate and free the instance; after a fatal status FMI allows neither, so it is left alone."""
        if self.usable:
            self.usable = False
            self.slave.freeInstance()
        _logs.pop(self._environment, None)
