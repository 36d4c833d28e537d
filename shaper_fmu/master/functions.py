"""fmpy's FMUs with libraries that lack functions: a function that is never called may be missing."""

from __future__ import annotations

import inspect
from typing import Any, NoReturn

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

    def _loadFunctions(self) -> None:
        for name, _ in inspect.getmembers(type(self), inspect.isfunction):
            if name.startswith(("fmi2", "fmi3")) and not hasattr(self.dll, name):
                setattr(self.dll, name, Missing(name))
        super()._loadFunctions()  # pyright: ignore[reportAttributeAccessIssue]


LENIENT: dict[tuple[int, bool], type] = {
    (version, kind in (FMU2Model, FMU3Model)): type(kind.__name__ + "Lenient", (_Lenient, kind), {})
    for version, kinds in ((2, (FMU2Slave, FMU2Model)), (3, (FMU3Slave, FMU3Model)))
    for kind in kinds
}
"""The classes by version of FMI, and whether they are for model exchange; fmpy looks at how their names begin."""
_NEEDED = ("FreeInstance", "EnterInitializationMode", "ExitInitializationMode")
_EXCHANGE = {
    2: ["fmi2EnterEventMode", "fmi2NewDiscreteStates", "fmi2EnterContinuousTimeMode"],
    3: ["fmi3EnterEventMode", "fmi3UpdateDiscreteStates", "fmi3EnterContinuousTimeMode"],
}
_EVENTS = ("fmi3EnterEventMode", "fmi3EnterStepMode", "fmi3UpdateDiscreteStates")


def lacking(slave: Any, version: int, model_exchange: bool, event_mode: bool) -> list[str]:
    """The functions without which an instance cannot be run at all, and that its library lacks."""
    needed = [f"fmi{version}{name}" for name in _NEEDED]
    kind = "ModelExchange" if model_exchange else "CoSimulation"
    needed.append("fmi2Instantiate" if version == 2 else f"fmi3Instantiate{kind}")
    needed += ["fmi2SetupExperiment"] if version == 2 else []
    needed += _EXCHANGE[version] if model_exchange else [f"fmi{version}DoStep", *(_EVENTS if event_mode else [])]
    return [name for name in needed if isinstance(getattr(slave.dll, name), Missing)]
