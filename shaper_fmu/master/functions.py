"""fmpy's FMUs with libraries that lack functions: a function that is never called may be missing."""

from __future__ import annotations

import inspect
from ctypes import c_int
from typing import Any, NoReturn

from fmpy.fmi1 import FMU1Model, FMU1Slave
from fmpy.fmi2 import FMU2Model, FMU2Slave
from fmpy.fmi3 import FMU3Model, FMU3Slave

from shaper_fmu.errors import SimulationError


class Missing:
    """Stands for a function that the library lacks; calling it raises SimulationError."""

    def __init__(self, name: str):
        self.name = name

    def __call__(self, *_of_the_call: object) -> NoReturn:
        raise SimulationError(f"its library lacks the function {self.name}")


class _Lenient:
    """Mixin for fmpy's classes: loads only the functions that exist."""

    dll: Any
    modelIdentifier: str
    _functions: dict[str, Any]

    def _loadFunctions(self) -> None:
        for name, _ in inspect.getmembers(type(self), inspect.isfunction):
            symbol = symbol_of(name, self.modelIdentifier)
            if name.startswith(("fmi1", "fmi2", "fmi3")) and not hasattr(self.dll, symbol):
                setattr(self.dll, symbol, Missing(symbol))
        super()._loadFunctions()  # pyright: ignore[reportAttributeAccessIssue]
        for name, function in self._functions.items():
            if name.startswith("fmi1") and name not in _TEXTS1 and "Instance" not in name and "Instantiate" not in name:
                function.restype = c_int  # of some fmpy thinks that they return a text, and would follow a status as a pointer


_TEXTS1 = ("fmi1GetVersion", "fmi1GetTypesPlatform", "fmi1GetModelTypesPlatform")


def symbol_of(name: str, identifier: str) -> str:
    """The name in the library of a function that fmpy calls fmi1DoStep, fmi2DoStep and so on."""
    return f"{identifier}_fmi{name[4:]}" if name.startswith("fmi1") else name


def standard_name(name: str) -> str:
    """The standard's name of a function that fmpy calls fmi1DoStep, fmi2DoStep and so on: FMI 1.0 has no number in it."""
    return f"fmi{name[4:]}" if name.startswith("fmi1") else name


LENIENT: dict[tuple[int, bool], type] = {
    (version, model_exchange): type(kind.__name__ + "Lenient", (_Lenient, kind), {})
    for version, kinds in ((1, (FMU1Slave, FMU1Model)), (2, (FMU2Slave, FMU2Model)), (3, (FMU3Slave, FMU3Model)))
    for model_exchange, kind in zip((False, True), kinds, strict=True)
}
"""The classes by version of FMI, and whether they are for model exchange; fmpy looks at how their names begin."""
_NEEDED = ("FreeInstance", "EnterInitializationMode", "ExitInitializationMode")
_EXCHANGE = {
    2: ["fmi2EnterEventMode", "fmi2NewDiscreteStates", "fmi2EnterContinuousTimeMode"],
    3: ["fmi3EnterEventMode", "fmi3UpdateDiscreteStates", "fmi3EnterContinuousTimeMode"],
}
_NEEDED1 = {
    False: ("InstantiateSlave", "FreeSlaveInstance", "InitializeSlave", "DoStep"),
    True: ("InstantiateModel", "FreeModelInstance", "SetTime", "Initialize", "EventUpdate", "GetDerivatives"),
}
_EVENTS = ("fmi3EnterEventMode", "fmi3EnterStepMode", "fmi3UpdateDiscreteStates")


def lacking(slave: Any, version: int, model_exchange: bool, event_mode: bool) -> list[str]:
    """The functions without which an instance cannot be run at all, and that its library lacks."""
    if version == 1:
        needed = [symbol_of(f"fmi1{name}", slave.modelIdentifier) for name in _NEEDED1[model_exchange]]
        return [name for name in needed if isinstance(getattr(slave.dll, name), Missing)]
    needed = [f"fmi{version}{name}" for name in _NEEDED]
    kind = "ModelExchange" if model_exchange else "CoSimulation"
    needed.append("fmi2Instantiate" if version == 2 else f"fmi3Instantiate{kind}")
    needed += ["fmi2SetupExperiment"] if version == 2 else []
    needed += _EXCHANGE[version] if model_exchange else [f"fmi{version}DoStep", *(_EVENTS if event_mode else [])]
    return [name for name in needed if isinstance(getattr(slave.dll, name), Missing)]
