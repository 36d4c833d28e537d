"""The FMI 2.0 life of a component inside a pythonfmu FMU.

pythonfmu's wrapper has no way to return an error but an exception, and after one it releases its references to the
slave, the class and the log a second time when the instance is freed. `_refusing` therefore adds the missing
references, so that the host can free a failed instance. It also doubles "%", which the wrapper hands to printf.
Likewise, each instantiation releases a borrowed reference to the entry module's namespace; `keep` adds it. And on
Linux the wrapper releases its interpreter twice when the process ends, which now and then aborts the host with a
corrupted heap; `_release_early` releases it before, so that there is nothing left to be released twice.
"""

from __future__ import annotations

import atexit
import ctypes
import functools
import os
import struct
import sys
from collections.abc import Callable
from pathlib import Path
from typing import Any, ClassVar

from pythonfmu.fmi2slave import Fmi2Slave

from shaper_fmu.component import Component, Variable
from shaper_fmu.errors import ComponentError

_INSTANTIATED, _INITIALIZING, _STEPPING, _TERMINATED = range(4)
_FMI_TYPES: dict[type, str] = {float: "Real", bool: "Boolean"}  # all others are integers
_released: set[Path] = set()
_LIFE = struct.Struct("<iid")  # phase, whether values were set since, time


def keep(*objects: Any) -> None:
    """Add a reference to each object, to make up for one that the wrapper releases without owning it."""
    for value in objects:
        ctypes.pythonapi.Py_IncRef(ctypes.py_object(value))


def _release_early(library: Path) -> None:
    """Have the wrapper let go of the interpreter while Python ends, before its own exit handlers do so twice."""
    if sys.platform != "linux" or library in _released:
        return
    try:
        wrapper = ctypes.CDLL(str(library), mode=os.RTLD_NOLOAD | os.RTLD_LAZY)
        atexit.register(wrapper.finalizePythonInterpreter)
    except (OSError, AttributeError):  # loaded from elsewhere, or another version of the wrapper
        return
    _released.add(library)


class Refusal(Exception):
    """An error on its way to the host; shown as its bare text."""

    def __repr__(self) -> str:
        return str(self)


def _refusing(function: Callable[..., Any]) -> Callable[..., Any]:
    @functools.wraps(function)
    def guarded(self: ComponentSlave, *arguments: Any) -> Any:
        try:
            return function(self, *arguments)
        except Exception as error:
            known = isinstance(error, ComponentError)
            text = str(error) if known else f"{type(self).__name__}: {type(error).__name__}: {error}"
            keep(self, type(self), self.log_queue)
            raise Refusal(text.replace("%", "%%")) from None

    return guarded


class ComponentSlave(Fmi2Slave):
    """Base of the generated slaves: serves the variables of `component` by value reference, in their declared order."""

    component: ClassVar[type[Component]]

    def __init__(self, **kwargs: Any):
        super().__init__(**kwargs)
        sys.path[:] = [entry for entry in sys.path if entry != kwargs.get("resources")]  # added again for each instance
        _release_early(Path(str(kwargs.get("resources"))).parent / "binaries" / "linux64" / f"{type(self).__name__}.so")
        self.record: Component = self.component()
        self.scalars: list[tuple[Variable[Any], int]] = [
            (variable, index)
            for variable in self.component.variables.values()
            if variable.causality != "state"
            for index in range(variable.size or 1)
        ]
        self.phase: int = _INSTANTIATED
        self.time: float = 0.0
        self.stale: bool = True

    @_refusing
    def setup_experiment(self, start_time: float, stop_time: float | None, tolerance: float | None) -> None:
        self.time = start_time

    @_refusing
    def enter_initialization_mode(self) -> None:
        self.phase, self.stale = _INITIALIZING, True

    @_refusing
    def exit_initialization_mode(self) -> None:
        self._refresh()
        self.phase = _STEPPING

    @_refusing
    def do_step(self, current_time: float, step_size: float) -> bool:
        if self.phase != _STEPPING:
            raise ComponentError(f"{type(self).__name__}: a step is possible only between initialization and termination")
        self.record.do_step(current_time, step_size)
        self.time, self.stale = current_time + step_size, False
        return True

    @_refusing
    def terminate(self) -> None:
        self.phase = _TERMINATED

    def _refresh(self) -> None:
        """Outputs follow the values set so far: all of them while initializing, inputs without delay at a communication point."""
        if self.stale and self.phase == _INITIALIZING:
            self.record.initialize(self.time)
            self.stale = False
        elif self.stale and self.phase == _STEPPING:
            self.record.do_step(self.time, 0.0)
            self.stale = False

    @_refusing
    def get_real(self, vrs: list[int]) -> list[float]:
        return self._get("Real", vrs)

    @_refusing
    def get_integer(self, vrs: list[int]) -> list[int]:
        return self._get("Integer", vrs)

    @_refusing
    def get_boolean(self, vrs: list[int]) -> list[bool]:
        return self._get("Boolean", vrs)

    @_refusing
    def set_real(self, vrs: list[int], values: list[float]) -> None:
        self._set("Real", vrs, values)

    @_refusing
    def set_integer(self, vrs: list[int], values: list[int]) -> None:
        self._set("Integer", vrs, values)

    @_refusing
    def set_boolean(self, vrs: list[int], values: list[bool]) -> None:
        self._set("Boolean", vrs, values)

    def _get(self, fmi_type: str, vrs: list[int]) -> list[Any]:
        self._refresh()
        values = []
        for vr in vrs:
            variable, index = self._scalar(vr, fmi_type)
            value = getattr(self.record, variable.name)
            values.append(value if variable.size is None else value[index])
        return values

    def _set(self, fmi_type: str, vrs: list[int], values: list[Any]) -> None:
        for vr, value in zip(vrs, values, strict=True):
            variable, index = self._scalar(vr, fmi_type)
            self._check_settable(variable, index, value)
            if variable.size is None:
                setattr(self.record, variable.name, value)
            else:
                getattr(self.record, variable.name)[index] = value
        self.stale = True

    def _scalar(self, vr: int, fmi_type: str) -> tuple[Variable[Any], int]:
        if not 0 <= vr < len(self.scalars):
            raise ComponentError(f"{type(self).__name__}: there is no variable with the value reference {vr}")
        variable, index = self.scalars[vr]
        if _FMI_TYPES.get(variable.kind, "Integer") != fmi_type:
            raise ComponentError(f"{type(self).__name__}: {variable.scalar_names[index]} is not of type {fmi_type}")
        return variable, index

    def _check_settable(self, variable: Variable[Any], index: int, value: Any) -> None:
        name = f"{type(self).__name__}: {variable.scalar_names[index]}"
        if variable.causality not in ("input", "parameter"):
            raise ComponentError(f"{name} is an {variable.causality} and cannot be set")
        if variable.causality == "parameter" and self.phase not in (_INSTANTIATED, _INITIALIZING):
            if not variable.tunable:
                raise ComponentError(f"{name} is fixed: it can be set only before and during initialization")
            problem = variable.problem(variable.scalar_names[index], value)
            if problem:
                raise ComponentError(f"{type(self).__name__}: {problem}")

    @_refusing
    def _get_fmu_state(self) -> bytes:
        return _LIFE.pack(self.phase, self.stale, self.time) + self.record.get_state()

    @_refusing
    def _set_fmu_state(self, state: bytes) -> None:
        self.record.set_state(state[_LIFE.size :])
        self.phase, stale, self.time = _LIFE.unpack_from(state)
        self.stale = bool(stale)

    @staticmethod
    def _fmu_state_to_bytes(state: Any) -> bytes:
        return state

    @staticmethod
    def _fmu_state_from_bytes(state: bytes) -> Any:
        return state
