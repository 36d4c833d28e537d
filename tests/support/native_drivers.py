"""Instances of native FMUs, of either version of FMI, driven by fmpy's calls under the same names."""

from __future__ import annotations

import atexit
import functools
import re
import shutil
import tempfile
from ctypes import CFUNCTYPE, c_char_p, c_int, c_void_p, cast
from pathlib import Path
from typing import Any

import fmpy
from fmpy.fmi2 import (
    FMU2Model,
    FMU2Slave,
    fmi2CallbackAllocateMemoryTYPE,
    fmi2CallbackFreeMemoryTYPE,
    fmi2CallbackFunctions,
    fmi2CallbackLoggerTYPE,
)
from fmpy.fmi3 import FMU3Model, FMU3Slave

from shaper_fmu.archives import extract_archive

_ELEMENT = re.compile(r"(.+)\[(\d+)\]$")
_messages: list[str] = []


# Our FMUs log with the format "%s" and one text, which is the sixth argument: no need of a C function to format it.
_LOGGER = CFUNCTYPE(None, c_void_p, c_char_p, c_int, c_char_p, c_char_p, c_char_p)


def _log2(environment, name, status, category, form, message) -> None:
    assert form == b"%s"
    _messages.append(message.decode())


def _log3(environment, status, category, message) -> None:
    _messages.append(message.decode())


_callbacks = fmi2CallbackFunctions()
_logger = _LOGGER(_log2)
_callbacks.logger = cast(_logger, fmi2CallbackLoggerTYPE)
_callbacks.allocateMemory = fmi2CallbackAllocateMemoryTYPE(fmpy.calloc)
_callbacks.freeMemory = fmi2CallbackFreeMemoryTYPE(fmpy.free)


def logged() -> str:
    """What all drivers have logged since the last one was made."""
    return "\n".join(_messages)


@functools.lru_cache
def unpacked(path: Path) -> Path:
    """The folder of the unpacked FMU, until the process ends."""
    folder = Path(tempfile.mkdtemp())
    atexit.register(shutil.rmtree, folder, ignore_errors=True)
    extract_archive(path.read_bytes(), path.name, folder)
    return folder


class Driver:
    """An instance for co-simulation, or for model exchange with `exchange`. Options of FMI 3.0's instantiation: eventModeUsed, earlyReturnAllowed, intermediateUpdate."""

    def __init__(self, path: Path, exchange: bool = False, **options: Any):
        _messages.clear()  # of drivers before it, in other tests
        self.folder = unpacked(path)
        self.description = fmpy.read_model_description(str(self.folder))
        self.variables = {v.name: v for v in self.description.modelVariables}
        self.fmi = int(str(self.description.fmiVersion)[0])
        kinds: Any = (FMU3Model if exchange else FMU3Slave) if self.fmi == 3 else (FMU2Model if exchange else FMU2Slave)
        kind = self.description.modelExchange if exchange else self.description.coSimulation
        self.slave: Any = kinds(
            guid=self.description.instantiationToken if self.fmi == 3 else self.description.guid,
            modelIdentifier=kind.modelIdentifier if kind else None,
            unzipDirectory=str(self.folder),
            instanceName="instance",
        )
        if self.fmi == 3:
            self.slave.instantiate(logMessage=_log3, **options)
        else:
            self.slave.instantiate(callbacks=_callbacks)
        arrays = [v for v in self.variables.values() if v.dimensions and v.start is not None]
        self.starts: dict[str, list[Any]] = {
            v.name: [x == "true" if v.type == "Boolean" else float(x) for x in str(v.start).split()] for v in arrays
        }

    @property
    def messages(self) -> list[str]:
        """What was logged since the last look, or since the last driver was made, by all drivers."""
        found = list(_messages)
        _messages.clear()
        return found

    def initialize(self, values: dict[str, Any] | None = None, start_time: float = 0.0, stop_time: float | None = None) -> Driver:
        """Set start values by FMI 2 names and go through the initialization."""
        self.set(values or {})
        if self.fmi == 3:
            self.slave.enterInitializationMode(startTime=start_time, stopTime=stop_time)
        else:
            self.slave.setupExperiment(startTime=start_time, stopTime=stop_time)
            self.slave.enterInitializationMode()
        self.slave.exitInitializationMode()
        return self

    def set(self, values: dict[str, Any]) -> None:
        """Set variables; x[2] is an element of the array x in both versions."""
        arrays: dict[str, list[float]] = {}
        for name, value in values.items():
            match = _ELEMENT.match(name)
            if self.fmi == 3 and match and name not in self.variables:
                arrays.setdefault(match[1], self.starts[match[1]])[int(match[2]) - 1] = value
            else:
                self._call("set", name, [value])
        for name, elements in arrays.items():
            self._call("set", name, elements)

    def get(self, name: str) -> Any:
        """The value of a scalar, or the list of an FMI 3 array."""
        values = self._call("get", name, None)
        return values[0] if len(values) == 1 else list(values)

    def elements(self, causality: str) -> list[float]:
        """The values of all variables of a causality, arrays element by element."""
        values = [self.get(name) for name in self.names(causality)]
        return [float(x) for value in values for x in (value if isinstance(value, list) else [value])]

    def _call(self, verb: str, name: str, values: list[Any] | None) -> Any:
        variable = self.variables[name]
        kinds = {"Enumeration": "Int64" if self.fmi == 3 else "Integer"}
        function = getattr(self.slave, f"{verb}{kinds.get(str(variable.type), variable.type)}")
        if values is not None:
            return function([variable.valueReference], values)
        if self.fmi == 3:
            count = int(variable.dimensions[0].start) if variable.dimensions else 1
            return function([variable.valueReference], nValues=count)
        return function([variable.valueReference])

    def names(self, causality: str) -> list[str]:
        return [v.name for v in self.variables.values() if v.causality == causality]

    def labels(self, causality: str) -> list[str]:
        """The same, but FMI 3 arrays element by element, as FMI 2 has them."""
        found = [v for v in self.variables.values() if v.causality == causality]
        return [
            label
            for v in found
            for label in ([f"{v.name}[{i + 1}]" for i in range(len(self.starts[v.name]))] if v.dimensions else [v.name])
        ]

    def step(self, t: float, h: float) -> tuple[bool, float]:
        """Step; returns whether an event waits and the time reached."""
        answer = self.slave.doStep(t, h)
        if self.fmi == 2:
            return False, t + h
        event, terminate, _early, reached = answer
        assert not terminate
        return event, reached

    def handle_event(self) -> float | None:
        """FMI 3.0: go through event mode, from step mode; returns the next event's time."""
        self.slave.enterEventMode()
        return self.leave_event_mode()

    def leave_event_mode(self) -> float | None:
        while True:
            again, terminate, *_changes, defined, following = self.slave.updateDiscreteStates()
            assert not terminate
            if not again:
                break
        self.slave.enterStepMode()
        return following if defined else None

    def update(self) -> float | None:
        """In event mode: update the discrete states; returns the next event's time, if there is one."""
        if self.fmi == 3:
            *flags, defined, following = self.slave.updateDiscreteStates()
        else:
            *flags, defined, following = self.slave.newDiscreteStates()
        assert not any(flags)
        return following if defined else None

    def close(self) -> None:
        self.slave.freeInstance()
