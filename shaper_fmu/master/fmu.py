"""An FMU file: its description, its variables by name, and its unpacked folder."""

from __future__ import annotations

import copy
import functools
import hashlib
import math
import shutil
import tempfile
import weakref
from collections.abc import Iterable, Mapping
from pathlib import Path
from typing import Any, Literal, get_args

import numpy as np
from fmpy.model_description import CoSimulation, ModelDescription, ModelExchange, ModelVariable, Unit

from shaper_fmu.archives import archive_findings, extract_archive, read_archive, read_file
from shaper_fmu.errors import ArchiveError, ModelError, nearest
from shaper_fmu.master.annotations import declares_readable_after_set
from shaper_fmu.master.binaries import library_problems
from shaper_fmu.master.clock_descriptions import fmu_clock_problems
from shaper_fmu.master.description import read_description, without_collector
from shaper_fmu.master.variables import element_variables, in_own_unit, kind_of, typed_value

_DESCRIPTION = "modelDescription.xml"
_MANY = 10_000
_unpacked: weakref.WeakSet[Fmu] = weakref.WeakSet()


Interface = Literal["co_simulation", "model_exchange"]
"""By which interface of FMI an FMU is used: with the solver that it brings, or with the master's (see solver.py)."""
_WORDS: dict[Interface, str] = {"co_simulation": "co-simulation", "model_exchange": "model exchange"}
STRUCTURAL = "structuralParameter"
"""Causality of FMI 3.0's parameters that are set in configuration mode, among them sizes of arrays."""


def _new_folder(name: str) -> Path:
    """A new folder into which an FMU is unpacked."""
    try:
        return Path(tempfile.mkdtemp(prefix="shaper-fmu-")).resolve()
    except OSError as error:
        raise ModelError(
            [f"{name} cannot be unpacked: {error.strerror}; TMPDIR names another folder for temporary files"]
        ) from error


class Fmu:
    """An unpacked FMU.

    Attributes:
        name: the file's name.
        folder: where it is unpacked, until the process ends.
        description: fmpy's model description.
        version: of FMI, 1, 2 or 3.
        interface: by which it is used: co-simulation if it has it, unless model exchange was asked for (see `with_interface`).
        findings: what is wrong with the description, but does not stop it from being run.
        variables: the variables by name; an array of FMI 3.0 as its elements x[1], x[2], ... (x[1,1], x[1,2], ... in rows).
        structure: values of structural parameters by name, where they are not the FMU's own.
    """

    _origin: Fmu | None = None

    def __init__(self, name: str, content: bytes):
        self.name = name
        self.folder: Path = _new_folder(name)
        weakref.finalize(self, shutil.rmtree, self.folder, ignore_errors=True)
        _unpacked.add(self)
        extract_archive(content, name, self.folder)
        self.digest: str = hashlib.sha256(content).hexdigest()
        description, findings = _coupled_description(name, self.folder)
        self.description: ModelDescription = description
        self.findings: list[str] = [*archive_findings(content, name), *findings]
        self.version: int = int(str(self.description.fmiVersion)[0])
        self.structure: dict[str, float | int | bool] = {}
        self._looked_at: dict[Path, list[str]] = {}
        self._lay_out()
        self.interface: Interface = "co_simulation" if self.description.coSimulation is not None else "model_exchange"
        self._readable = declares_readable_after_set(self.folder, name, self.version)
        self._units = {unit.name: unit for unit in self.description.unitDefinitions}

    @without_collector()
    def _lay_out(self) -> None:
        """Variables by name. A name that several variables have is left out, since it is ambiguous."""
        self.variables: dict[str, ModelVariable] = {}
        self._wholes: dict[str, list[str]] = {}  # an element's name -> names of all elements of its array
        self._elements: dict[str, list[str]] = {}  # an array's name -> names of its elements
        owners: dict[str, ModelVariable] = {}
        doubtful: set[str] = set()
        for variable in self.description.modelVariables:
            elements = element_variables(variable, self.structure)
            names = [str(element.name) for element in elements]
            for name, element in zip(names, elements, strict=True):
                owner = owners.setdefault(name, variable)
                if (owner.valueReference, owner.type, len(owner.dimensions)) != (
                    variable.valueReference,
                    variable.type,
                    len(variable.dimensions),
                ):
                    doubtful |= {str(owner.name), str(variable.name)}
                self.variables.setdefault(name, element)
            if names:
                self._elements.setdefault(str(variable.name), names)
            self._wholes.update(dict.fromkeys(names, names))
        for name in doubtful:
            for element in self._elements.pop(name, []):
                self.variables.pop(element, None)

    @property
    def interfaces(self) -> tuple[Interface, ...]:
        """The interfaces that it offers."""
        offered: dict[Interface, object] = {
            "co_simulation": self.description.coSimulation, "model_exchange": self.description.modelExchange
        }  # fmt: skip
        return tuple(interface for interface, declared in offered.items() if declared is not None)

    def with_interface(self, interface: Interface | None) -> Fmu:
        """The FMU used by this interface; by its own choice for None. Raises ModelError if it does not offer it."""
        if interface is None or interface == self.interface:
            return self
        if interface not in get_args(Interface):
            raise ModelError([f"there is no interface {interface!r}.{nearest(interface, get_args(Interface))}"])
        if interface not in self.interfaces:
            offered = " and ".join(_WORDS[one] for one in self.interfaces)
            raise ModelError([f"{self.name} offers {offered} only, not {_WORDS[interface]}"])
        other = copy.copy(self)
        other._origin, other.interface = self, interface
        return other

    @property
    def capabilities(self) -> CoSimulation | ModelExchange:
        """What it declares of the interface by which it is used."""
        exchange = self.interface == "model_exchange"
        found = self.description.modelExchange if exchange else self.description.coSimulation
        assert found is not None  # see interfaces
        return found

    @property
    def readable_after_set(self) -> bool:
        """Whether outputs may be read between setting inputs and the step: by model exchange, or as it declares."""
        return self.exchanges_model or self._readable

    @property
    def exchanges_model(self) -> bool:
        """Whether it is used by model exchange."""
        return self.interface == "model_exchange"

    @property
    def has_event_mode(self) -> bool:
        """Whether it is used with event mode: FMI 3.0's in co-simulation, or that of model exchange."""
        return self.exchanges_model or (self.version == 3 and bool(getattr(self.capabilities, "hasEventMode", False)))

    @property
    def has_initialization_mode(self) -> bool:
        """Whether there is a mode in which inputs are found out; FMI 1.0 has to know them before it initializes an instance."""
        return self.version > 1

    @property
    def follows_at_start(self) -> bool:
        """Whether outputs may be asked for after inputs were set at the start; of a slave of FMI 1.0 only after a step."""
        return self.has_initialization_mode or self.exchanges_model

    @property
    def takes_any_step(self) -> bool:
        """Whether its communication steps may be of any length."""
        return self.exchanges_model or bool(getattr(self.capabilities, "canHandleVariableCommunicationStepSize", False))

    @property
    def default_tolerance(self) -> float | None:
        """The solver tolerance of the default experiment; None without a valid one."""
        experiment = self.description.defaultExperiment
        try:
            tolerance = float(experiment.tolerance) if experiment is not None and experiment.tolerance else 0.0
        except ValueError:
            return None
        return tolerance if 0.0 < tolerance < math.inf else None

    def variable(self, name: str, *causalities: str) -> ModelVariable:
        """The variable of this name and one of these causalities. Raises ModelError with the nearest name."""
        found = self.variables.get(name)
        if found is not None and (not causalities or found.causality in causalities):
            return found
        known = [str(v.name) for v in self.variables.values() if not causalities or v.causality in causalities]
        if len(known) > _MANY:  # to compare all of them would take seconds
            known = [other for other in known if abs(len(other) - len(name)) <= 2 and other[:1] == name[:1]][:_MANY]
        what = " or ".join(causalities) or "variable"
        other = f" (it is of causality {found.causality})" if found else ""
        raise ModelError([f"{self.name} has no {what} {name!r}{other}.{nearest(name, known)}"])

    def inputs_of(self, output: str) -> list[str]:
        """Names of the inputs that the output depends on without delay; all inputs if the FMU declares none."""
        declared = self._declared_inputs.get(output)
        return declared if declared is not None else self._inputs

    def declares_inputs_of(self, output: str) -> bool:
        """Whether the FMU declares the dependencies of the output."""
        return output in self._declared_inputs

    def library_problems(self, folder: Path) -> list[str]:
        """Problems of the libraries in its folder for a platform; the result is kept."""
        if folder not in self._looked_at:
            paths = (path for path in folder.rglob("*") if path.is_file())
            self._looked_at[folder] = library_problems((p.relative_to(folder).as_posix(), p.read_bytes()) for p in paths)
        return self._looked_at[folder]

    @functools.cached_property
    def _inputs(self) -> list[str]:
        return [name for name, variable in self.variables.items() if variable.causality == "input"]

    def with_structure(self, values: Mapping[str, Any]) -> Fmu:
        """The FMU with other values of structural parameters (FMI 3.0); the sizes of arrays follow.

        Raises ModelError for values that are none of their types, or no sizes, and for arrays too large.
        """
        other = copy.copy(self)
        other._origin = self  # whose folder lasts as long as it
        for cached in ("_inputs", "_declared_inputs"):
            other.__dict__.pop(cached, None)
        given = {name: typed_value(self.variable(name, STRUCTURAL), value, self.name) for name, value in values.items()}
        other.structure = {**self.structure, **given}
        other._lay_out()
        return other

    def split_structure(self, values: Mapping[str, Any]) -> tuple[Fmu, dict[str, Any]]:
        """The FMU with the structural parameters among these values, and the other values. Raises ModelError."""
        found = self.variables
        structure = {name: value for name, value in values.items() if name in found and found[name].causality == STRUCTURAL}
        rest = {name: value for name, value in values.items() if name not in structure}
        return (self.with_structure(structure) if structure else self), rest

    @functools.cached_property
    def _declared_inputs(self) -> dict[str, list[str]]:
        """Output -> the inputs it depends on, if declared."""
        found: dict[str, list[str]] = {}
        for unknown in self.description.outputs:
            if unknown.variable is not None and unknown.dependencies is not None:
                known = [v for v in unknown.dependencies if v.causality == "input"]
                inputs = [element for v in known for element in self._elements.get(str(v.name), [])]
                found.update(dict.fromkeys(self._elements.get(str(unknown.variable.name), []), inputs))
        return found

    def whole_variables(self, names: Iterable[str]) -> list[tuple[int, list[str]]]:
        """The value references of these variables, each with the names of all elements that are transferred with it.

        Aliases, which share a value reference, have an item each.
        """
        wholes = {(self.variables[name].valueReference, tuple(self.elements_with(name))): None for name in names}
        return [(reference, list(elements)) for reference, elements in wholes]

    def elements_of(self, name: str) -> list[str]:
        """The elements of the FMI 3.0 array of this name; of any other name, the name itself."""
        return self._elements.get(name, [name])

    def elements_with(self, name: str) -> list[str]:
        """The variable itself in FMI 1.0 and 2.0; in FMI 3.0 all elements of its array."""
        return self._wholes[name] if self.version == 3 else [name]

    def unit_of(self, name: str) -> str | None:
        """The unit of a variable, its own or its declared type's."""
        variable = self.variables[name]
        return variable.unit or (variable.declaredType.unit if variable.declaredType is not None else None)

    def display_unit_of(self, name: str) -> str | None:
        """The name of the unit in which people want to see a variable, its own or its declared type's."""
        variable = self.variables[name]
        return variable.displayUnit or (variable.declaredType.displayUnit if variable.declaredType is not None else None)

    def unit_definition(self, name: str) -> Unit | None:
        """The FMU's definition of a unit."""
        return self._units.get(name)

    def start_values(self, values: dict[str, Any]) -> dict[str, float | int | bool]:
        """Start values by scalar name: a sequence for x sets x[1], x[2], ...; enumeration items may be given by name.

        Raises ModelError that lists every unknown name and every value of another type.
        """
        found: dict[str, float | int | bool] = {}
        problems: list[str] = []
        for name, value in values.items():
            if isinstance(value, dict | set | frozenset) or (not isinstance(value, str) and np.ndim(value) == 1 and not len(value)):
                problems.append(f"{self.name}: {name} = {value!r} gives no values; use a number or a sequence of them")
                continue
            sequence = not isinstance(value, str) and np.ndim(value) > 0
            elements = {f"{name}[{i + 1}]": element for i, element in enumerate(value)} if sequence else {name: value}
            for element_name, element in elements.items():
                try:
                    found[element_name] = self._start_value(element_name, element)
                except ModelError as error:
                    problems += error.problems
        if problems:
            raise ModelError(problems)
        return found

    def _start_value(self, name: str, value: Any) -> float | int | bool:
        if name not in self.variables and f"{name}[1]" in self.variables:
            raise ModelError([f"{self.name}: {name} is an array; give its elements as a sequence, or set {name}[1]"])
        if self.version == 3 and name in self.variables and self.variables[name].causality == STRUCTURAL:
            message = (
                "is a structural parameter, which sizes of arrays follow: give it to System.add or System.set, before connections"
            )
            raise ModelError([f"{self.name}: {name} {message}"])
        variable = self.variable(name, "input", "parameter")
        if isinstance(value, str) and kind_of(variable) == "real":
            unit = self.unit_of(name) or ""
            value = in_own_unit(value, unit, self.unit_definition(unit), f"{self.name}: {name}")
        return typed_value(variable, value, self.name)


def remove_folders() -> None:
    """Remove the unpacked FMUs before the process ends without Python's normal exit."""
    for fmu in list(_unpacked):
        shutil.rmtree(fmu.folder, ignore_errors=True)


def event_output(fmu: Fmu) -> str | None:
    """The name of the output that announces the FMU's events; None if there is none."""
    variable: ModelVariable | None = fmu.variables.get("next_event_time")
    return "next_event_time" if variable is not None and variable.causality == "output" else None


def load_fmu(path: Path | str) -> Fmu:
    """The FMU at `path`, unpacked once for each content. Raises ArchiveError or ModelError."""
    path = Path(path)
    return fmu_from_bytes(path.name, read_file(path))


@functools.lru_cache(maxsize=64)
def fmu_from_bytes(name: str, content: bytes) -> Fmu:
    """The FMU with this file name and content, unpacked once for each. Raises ArchiveError or ModelError."""
    return Fmu(name, content)


def fmu_problems(path: Path) -> list[str]:
    """The problems of an FMU of any FMI version. Raises ArchiveError if it cannot be read at all, or must not be run."""
    return examined(path.name, read_file(path))[1]


def examined(name: str, content: bytes) -> tuple[ModelDescription, list[str]]:
    """The description of an FMU of any FMI version with this file name, and its problems. Raises as `fmu_problems`."""
    files = read_archive(content, name)
    text = description_of(name, files.get(_DESCRIPTION))
    description, findings = read_description(text, name)
    findings += fmu_clock_problems(description, text, name)
    binaries = ((file, binary) for file, binary in files.items() if file.startswith("binaries/"))
    return description, [*archive_findings(content, name), *findings, *library_problems(binaries)]


def description_of(name: str, content: bytes | None) -> bytes:
    """The content of an FMU's modelDescription.xml. Raises ArchiveError if there is none."""
    if content is None:
        raise ArchiveError(f"{name}: no {_DESCRIPTION}, so this is not an FMU")
    return content


def _coupled_description(name: str, folder: Path) -> tuple[ModelDescription, list[str]]:
    file = folder / _DESCRIPTION
    description, findings = read_description(description_of(name, file.read_bytes() if file.is_file() else None), name)
    if description.coSimulation is None and description.modelExchange is None:
        kind = " for Scheduled Execution only" if getattr(description, "scheduledExecution", None) is not None else ""
        raise ModelError([f"{name}: an FMI {description.fmiVersion} FMU{kind}; co-simulation and model exchange can be coupled"])
    if description.fmiVersion == "1.0" and description.coSimulation is not None and description.coSimulation.needsExecutionTool:
        raise ModelError(
            [f"{name}: an FMI 1.0 FMU that couples a tool (CoSimulation_Tool); only those that stand alone can be coupled"]
        )
    return description, findings
