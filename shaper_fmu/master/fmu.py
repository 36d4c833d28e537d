"""An FMU file: its description, its variables by name, and its unpacked folder."""

from __future__ import annotations

import copy
import functools
import hashlib
import math
import re
import shutil
import tempfile
import weakref
from collections.abc import Iterable
from pathlib import Path
from typing import Any

import numpy as np
from fmpy import read_model_description
from fmpy.model_description import CoSimulation, Dimension, ModelDescription, ModelVariable, Unit, ValidationError
from fmpy.validation import validate_fmu

from shaper_fmu.archives import extract_archive, read_file
from shaper_fmu.errors import ArchiveError, ModelError, nearest
from shaper_fmu.master.annotations import declares_readable_after_set
from shaper_fmu.xml_files import parse_xml

_TYPES: dict[str, type] = {"Real": float, "Integer": int, "Enumeration": int, "Boolean": bool, "Float64": float, "Float32": float}
_RANGES = {"Integer": (-(2**31), 2**31), "Enumeration": (-(2**31), 2**31)}
for _bits in (8, 16, 32, 64):
    _TYPES |= {f"Int{_bits}": int, f"UInt{_bits}": int}
    _RANGES |= {f"Int{_bits}": (-(2 ** (_bits - 1)), 2 ** (_bits - 1)), f"UInt{_bits}": (0, 2**_bits)}
TRANSFERABLE = ("real", "integer", "boolean", "enumeration")
"""What `kind_of` tells of variables that a master moves; texts, binaries and clocks stay where they are."""
_BEARABLE = re.compile(r"unit .* is not defined|is of type \w+ and must have variability != \"continuous\"")
"""FMPy's findings in model descriptions of others with which an FMU can be run all the same."""
_OTHER_XML = ("sources/buildDescription.xml", "terminalsAndIcons/terminalsAndIcons.xml")
_BOOLEANS = {"true": True, "false": False, "1": True, "0": False}


class Fmu:
    """An unpacked co-simulation FMU of FMI 2.0 or 3.0.

    Attributes:
        name: the file's name.
        folder: where it is unpacked, until the process ends.
        description: fmpy's model description.
        version: of FMI, 2 or 3.
        findings: what is wrong with the description, but does not stop it from being run.
        readable_after_set: whether it says that its outputs may be read between the setting of inputs and the step.
        variables: the variables by name; an array of FMI 3.0 as its elements x[1], x[2], ... (x[1,1], x[1,2], ... in rows).
    """

    def __init__(self, name: str, content: bytes):
        self.name = name
        self.folder = Path(tempfile.mkdtemp(prefix="shaper-fmu-")).resolve()
        weakref.finalize(self, shutil.rmtree, self.folder, ignore_errors=True)
        extract_archive(content, name, self.folder)
        self.digest = hashlib.sha256(content).hexdigest()
        self.findings: list[str] = []
        self.description = _coupled_description(name, self.folder, self.findings)
        self.version = int(str(self.description.fmiVersion)[0])
        self.variables: dict[str, ModelVariable] = {}
        self._wholes: dict[str, list[str]] = {}  # an element's name -> names of all elements of its array
        self._elements: dict[str, list[str]] = {}  # an array's name -> names of its elements
        for variable in self.description.modelVariables:
            elements = element_variables(variable)
            self.variables.update({element.name: element for element in elements})
            self._elements[str(variable.name)] = [element.name for element in elements]
            self._wholes.update({element.name: self._elements[str(variable.name)] for element in elements})
        assert self.description.coSimulation is not None  # checked by _coupled_description
        self.co_simulation: CoSimulation = self.description.coSimulation
        self.readable_after_set = declares_readable_after_set(self.folder, name, self.version)
        self._units = {unit.name: unit for unit in self.description.unitDefinitions}

    @property
    def has_event_mode(self) -> bool:
        """Whether it can be used with FMI 3.0's event mode in co-simulation."""
        return self.version == 3 and bool(getattr(self.co_simulation, "hasEventMode", False))

    @property
    def default_tolerance(self) -> float | None:
        """The tolerance of its solver in its default experiment, None if there is none that makes sense."""
        experiment = self.description.defaultExperiment
        try:
            told = float(experiment.tolerance) if experiment is not None and experiment.tolerance else 0.0
        except ValueError:
            return None
        return told if 0.0 < told < math.inf else None

    def variable(self, name: str, *causalities: str) -> ModelVariable:
        """The variable of this name. Raises ModelError, with the nearest name, if there is none of these causalities."""
        known = [v.name for v in self.variables.values() if not causalities or v.causality in causalities]
        if name not in known:
            what = " or ".join(causalities) or "variable"
            found = self.variables.get(name)
            other = f" (it is of causality {found.causality})" if found else ""
            raise ModelError([f"{self.name} has no {what} {name!r}{other}.{nearest(name, known)}"])
        return self.variables[name]

    def inputs_of(self, output: str) -> list[str]:
        """Names of the inputs that the output depends on without delay; all inputs if the FMU does not tell."""
        declared = self._declared_inputs.get(output)
        return declared if declared is not None else self._inputs

    def declares_inputs_of(self, output: str) -> bool:
        """Whether the FMU tells what the output depends on."""
        return output in self._declared_inputs

    @functools.cached_property
    def _inputs(self) -> list[str]:
        return [v.name for v in self.variables.values() if v.causality == "input"]

    @functools.cached_property
    def _declared_inputs(self) -> dict[str, list[str]]:
        """Output -> the inputs it depends on, where that is told."""
        found: dict[str, list[str]] = {}
        for unknown in self.description.outputs:
            if unknown.variable is not None and unknown.dependencies is not None:
                known = [v for v in unknown.dependencies if v.causality == "input"]
                inputs = [element for v in known for element in self._elements[str(v.name)]]
                found.update(dict.fromkeys(self._elements[str(unknown.variable.name)], inputs))
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
        """The variable itself in FMI 2.0; in FMI 3.0 all elements of its array."""
        return self._wholes[name] if self.version == 3 else [name]

    def unit_of(self, name: str) -> str | None:
        """The unit of a variable, its own or its declared type's."""
        variable = self.variables[name]
        return variable.unit or (variable.declaredType.unit if variable.declaredType is not None else None)

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
        variable = self.variable(name, "input", "parameter")
        return typed_value(variable, value, self.name)


def event_output(fmu: Fmu) -> str | None:
    """The output that announces the FMU's events, by its name; None if there is none."""
    variable: ModelVariable | None = fmu.variables.get("next_event_time")
    return "next_event_time" if variable is not None and variable.causality == "output" else None


def element_variables(variable: ModelVariable) -> list[ModelVariable]:
    """The variable itself, or a copy for each element of an array, with that element's start value."""
    if not variable.dimensions:
        return [variable]
    shape = [_extent(dimension) for dimension in variable.dimensions]
    starts = str(variable.start).split() if variable.start is not None else []
    elements = []
    for i, index in enumerate(np.ndindex(*shape)):
        element = copy.copy(variable)
        element.name = f"{variable.name}[{','.join(str(k + 1) for k in index)}]"
        element.start = starts[i if len(starts) > 1 else 0] if starts else None
        elements.append(element)
    return elements


def _extent(dimension: Dimension) -> int:
    if dimension.start is not None:
        return int(dimension.start)
    return int(str(dimension.variable.start)) if dimension.variable is not None else 1


def kind_of(variable: ModelVariable) -> str:
    """What a variable's values are: real, integer, boolean, enumeration, or its type in small letters."""
    if variable.type in ("Enumeration", "Boolean"):
        return str(variable.type).lower()
    kind = _TYPES.get(str(variable.type))
    return "real" if kind is float else "integer" if kind is int else str(variable.type).lower()


def typed_value(variable: ModelVariable, value: Any, where: str) -> float | int | bool:
    """`value`, which may be text, in the variable's type. Raises ModelError."""
    if variable.type == "Enumeration" and isinstance(value, str) and variable.declaredType is not None:
        items = {str(item.name): int(str(item.value)) for item in variable.declaredType.items}
        if value in items:
            return items[value]
        if not value.lstrip("-").isdigit():
            raise ModelError([f"{where}: {value!r} is no {variable.name}.{nearest(value, items)}"])
    kind = _TYPES.get(str(variable.type))
    if kind is None:
        raise ModelError([f"{where}: {variable.name} is of type {variable.type}, which cannot be set"])
    try:
        if kind is bool and isinstance(value, str):
            return _BOOLEANS[value.lower()]
        if kind is not float and not isinstance(value, int) and float(value) != int(value):
            raise ValueError
        if kind is bool and int(value) not in (0, 1):
            raise ValueError
        low, high = _RANGES.get(str(variable.type), (-math.inf, math.inf))
        if kind is int and not low <= int(value) < high:
            raise ValueError
        return kind(value)
    except (ValueError, TypeError, KeyError, OverflowError):
        raise ModelError([f"{where}: {variable.name} = {value!r} is not of type {variable.type}"]) from None


def load_fmu(path: Path | str) -> Fmu:
    """The FMU at `path`, unpacked once for each content. Raises ArchiveError or ModelError."""
    path = Path(path)
    return fmu_from_bytes(path.name, read_file(path))


@functools.lru_cache(maxsize=64)
def fmu_from_bytes(name: str, content: bytes) -> Fmu:
    """The FMU with this file name and content, unpacked once for each. Raises ArchiveError or ModelError."""
    return Fmu(name, content)


def fmu_problems(path: Path) -> list[str]:
    """What is wrong with an FMU of any version of FMI. Raises ArchiveError if it cannot be read at all."""
    with tempfile.TemporaryDirectory() as folder:
        extract_archive(read_file(path), path.name, Path(folder))
        _read_description(path.name, Path(folder), [])
    return validate_fmu(str(path))


def _read_description(name: str, folder: Path, findings: list[str]) -> ModelDescription:
    """The model description; what is wrong with it, but bearable, goes to `findings`. Raises ArchiveError for anything else."""
    if not (folder / "modelDescription.xml").is_file():
        raise ArchiveError(f"{name}: no modelDescription.xml, so this is not an FMU")
    for file in ("modelDescription.xml", *_OTHER_XML):
        if (folder / file).is_file():
            parse_xml((folder / file).read_bytes(), f"{name}: {file}")
    try:
        try:
            return read_model_description(str(folder))
        except ValidationError as error:
            if not all(_BEARABLE.search(str(problem)) for problem in error.problems):
                raise
            findings += map(str, error.problems)
            return read_model_description(str(folder), validate=False)
    except Exception as error:  # fmpy raises many kinds
        raise ArchiveError(f"{name}: modelDescription.xml is not valid: {error}") from error


def _coupled_description(name: str, folder: Path, findings: list[str]) -> ModelDescription:
    description = _read_description(name, folder, findings)
    if str(description.fmiVersion)[:2] not in ("2.", "3.") or description.coSimulation is None:
        raise ModelError([f"{name}: an FMI {description.fmiVersion} FMU; co-simulation FMUs of FMI 2.0 and 3.0 can be coupled"])
    return description
