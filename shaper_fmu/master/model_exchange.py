"""FMUs of model exchange as the loop sees them: parts of one system of equations (see loop/parts.h)."""

from __future__ import annotations

import ctypes
from collections.abc import Mapping
from typing import Any, NamedTuple

import numpy as np

from shaper_fmu.errors import ModelError, SimulationError
from shaper_fmu.master import layout as of
from shaper_fmu.master.algorithms import Coupling, SolverMethod
from shaper_fmu.master.cvode import Cvode
from shaper_fmu.master.fmu import Fmu
from shaper_fmu.master.functions import standard_name
from shaper_fmu.master.instance import Instance
from shaper_fmu.master.variables import kind_of
from shaper_fmu.xml_files import parse_xml

TOLERANCE = 1e-6
"""Relative tolerance of the solver where neither the user nor an FMU's default experiment gives one."""

_SPARE = 4096
"""Room for values that a function writes beyond those that its description tells of."""

_LOCAL = 0.1
"""Of the tolerance, in each of CVODE's steps, whose errors add up."""


class Solving(NamedTuple):
    """How FMUs of model exchange are solved.

    Attributes:
        method: CVODE's.
        coupling: of these FMUs with each other.
        tolerance: relative; absolute times the states' nominal values. None for the FMUs' default.
    """

    method: SolverMethod = "auto"
    coupling: Coupling = "monolithic"
    tolerance: float | None = None


SOLVING = Solving()
"""How they are solved if nobody has said it."""

_FUNCTIONS: dict[str, dict[int, str]] = {
    "set_time": {1: "SetTime", 2: "SetTime", 3: "SetTime"},
    "set_states": {1: "SetContinuousStates", 2: "SetContinuousStates", 3: "SetContinuousStates"},
    "get_states": {1: "GetContinuousStates", 2: "GetContinuousStates", 3: "GetContinuousStates"},
    "get_nominals": {
        1: "GetNominalContinuousStates", 2: "GetNominalsOfContinuousStates", 3: "GetNominalsOfContinuousStates",
    },
    "get_derivatives": {1: "GetDerivatives", 2: "GetDerivatives", 3: "GetContinuousStateDerivatives"},
    "get_indicators": {1: "GetEventIndicators", 2: "GetEventIndicators", 3: "GetEventIndicators"},
    "completed": {1: "CompletedIntegratorStep", 2: "CompletedIntegratorStep", 3: "CompletedIntegratorStep"},
}  # fmt: skip


_COUNTS = (
    ("states", "fmi3GetNumberOfContinuousStates", "continuous states"),
    ("indicators", "fmi3GetNumberOfEventIndicators", "event indicators"),
)
_ASK_COUNT = ctypes.CFUNCTYPE(ctypes.c_int, ctypes.c_void_p, ctypes.POINTER(ctypes.c_size_t))


def states_of(fmu: Fmu) -> int:
    """How many continuous states it declares; those of arrays by their elements."""
    if fmu.version < 3:
        return int(fmu.description.numberOfContinuousStates)
    return sum(len(fmu.elements_of(str(one.variable.name))) for one in fmu.description.derivatives if one.variable is not None)


def indicators_of(fmu: Fmu) -> int:
    """How many event indicators it declares."""
    if fmu.version < 3:
        return int(fmu.description.numberOfEventIndicators)
    return sum(len(fmu.elements_of(str(one.variable.name))) for one in fmu.description.eventIndicators if one.variable is not None)


def directional_flags(fmu: Fmu) -> tuple[bool, bool]:
    """Whether co-simulation and model exchange provide directional derivatives.

    Read from the file: fmpy does not keep the name that FMI 3.0 has for it.
    """
    name = {2: "providesDirectionalDerivative", 3: "providesDirectionalDerivatives"}.get(fmu.version, "")
    root = parse_xml((fmu.folder / "modelDescription.xml").read_bytes(), f"{fmu.name}: modelDescription.xml")
    found = [root.find(kind) for kind in ("CoSimulation", "ModelExchange")]
    declared = [one is not None and one.get(name) in ("true", "1") for one in found]
    return declared[0], declared[1]


def state_pairs(fmu: Fmu) -> list[tuple[int, int]]:
    """References of the states and of their derivatives; none where arrays or an incomplete description leave them unknown."""
    pairs: list[tuple[int, int]] = []
    for unknown in fmu.description.derivatives:
        rate = unknown.variable
        state = rate.derivative if rate is not None else None
        if rate is None or state is None or state.dimensions or rate.dimensions or kind_of(state) != "real":
            return []
        pairs.append((int(state.valueReference), int(rate.valueReference)))
    return pairs


class Parts:
    """The parts of a system, and their solver.

    Attributes:
        names: the instances.
        rows, solvers: see layout.py.
    """

    def __init__(self, instances: Mapping[str, Instance], solving: Solving, coupled: bool, in_loops: bool):
        self._memory: list[np.ndarray] = []  # that addresses in the rows point into
        self.names: list[str] = [name for name, instance in instances.items() if instance.fmu.exchanges_model]
        self.rows: np.ndarray = np.zeros(len(self.names), of.PART)
        numbers = list(instances)
        states = indicators = 0
        for row, name in zip(self.rows, self.names, strict=True):
            fmu = instances[name].fmu
            row["instance"], row["first"], row["first_indicator"] = numbers.index(name), states, indicators
            row["states"], row["indicators"] = states_of(fmu), indicators_of(fmu)
            states, indicators = states + int(row["states"]), indicators + int(row["indicators"])
            self._fill(row, instances[name])
        self._cvodes: list[Cvode] = []
        self.solvers: np.ndarray = np.zeros(0, of.SOLVER)
        if self.names:
            with_jacobian = in_loops or (not coupled and bool(np.all(self.rows["directional"] != 0)))
            methods = ("adams", "bdf") if solving.method == "auto" else (solving.method,)
            self._cvodes = [Cvode(method, states, indicators, with_jacobian) for method in methods]
            self.solvers = self._cvodes[0].row
            self._spare = np.zeros(max(states, indicators) + _SPARE)
            self.solvers["spare"], self.solvers["spare_count"] = self._spare.ctypes.data, len(self._spare)
            for cvode in self._cvodes:
                cvode.attach(self.solvers.ctypes.data)
            if len(self._cvodes) > 1:
                self.solvers["stiff_memory"] = self._cvodes[1].row["memory"]
            self.solvers["relative"] = _LOCAL * (solving.tolerance or self._default_tolerance(instances))

    def check_counts(self, instances: Mapping[str, Instance]) -> None:
        """Raise SimulationError for an FMU that has other numbers of states or event indicators than its description tells of.

        FMI 3.0 has functions to ask for them.
        """
        for row, name in zip(self.rows, self.names, strict=True):
            for field, function, what in _COUNTS:
                address = instances[name].address(function) if row["version"] == 3 else 0
                found = ctypes.c_size_t()
                if not address or _ASK_COUNT(address)(instances[name].handle, ctypes.byref(found)) > 1:
                    continue
                if found.value != row[field]:
                    raise SimulationError(
                        f"{name}: {function} tells of {found.value} {what}, the description of {row[field]}; get the FMU again"
                    )

    def kept(self) -> list[np.ndarray]:
        """Event indicators at the end of the last step, among others."""
        return [cvode.values for cvode in self._cvodes[:1]]

    def reset(self) -> None:
        """Bring the solver back to the state before a run."""
        for row in self.solvers:
            row["restart"], row["has_left"], row["shrinking"], row["events_at_once"] = 1, 0, 0, 0
            row["last_event"] = row["last_interval"] = np.nan
            if row["is_stiff"]:
                row["memory"], row["stiff_memory"], row["is_stiff"] = row["stiff_memory"], row["memory"], 0

    def _default_tolerance(self, instances: Mapping[str, Instance]) -> float:
        """The smallest of the FMUs' default experiments."""
        return min(instances[name].fmu.default_tolerance or TOLERANCE for name in self.names)

    def _fill(self, row: Any, instance: Instance) -> None:
        """The FMU's functions. Raises ModelError for one that is needed and that its library lacks."""
        fmu, version = instance.fmu, instance.fmu.version
        row["handle"], row["version"] = instance.handle, version
        unneeded = {
            "completed": version > 1 and not getattr(fmu.capabilities, "needsCompletedIntegratorStep", True),
            "get_indicators": not row["indicators"],
            **dict.fromkeys(("set_states", "get_states", "get_nominals", "get_derivatives"), not row["states"]),
        }
        for field, names in _FUNCTIONS.items():
            if unneeded.get(field):
                continue
            function = standard_name(f"fmi{version}{names[version]}")
            row[field] = instance.address(function)
            if not row[field] and field != "get_nominals":
                raise ModelError([f"{instance.name}: the library of {fmu.name} lacks the function {function}"])
        pairs = state_pairs(fmu) if version > 1 and directional_flags(fmu)[1] else []
        if pairs and len(pairs) == row["states"]:
            row["directional"] = instance.address(f"fmi{version}GetDirectionalDerivative")
            self._memory.append(np.array(pairs, np.uint32).T.copy())
            row["references"], row["rates"] = (line.ctypes.data for line in self._memory[-1])
