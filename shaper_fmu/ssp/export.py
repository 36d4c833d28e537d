"""Writes systems built in Python as SSP archives, and start values as parameter sets."""

from __future__ import annotations

import tempfile
from collections.abc import Mapping
from pathlib import Path
from typing import Any, Literal

from shaper_fmu.archives import write_archive
from shaper_fmu.errors import ModelError
from shaper_fmu.master.fmu import Fmu
from shaper_fmu.master.system import System
from shaper_fmu.master.variables import TRANSFERABLE, kind_of, own_start
from shaper_fmu.ssp.annotations import osp_and_oms
from shaper_fmu.ssp.conversion import IDENTITY, unit_conversion
from shaper_fmu.ssp.document import (
    Component,
    Connection,
    Connector,
    DataType,
    DefaultExperiment,
    Dimension,
    Enumeration,
    LinearTransformation,
    MappingTransformation,
    Parameter,
    ParameterBinding,
    ParameterSet,
    SystemDescription,
    SystemElement,
    Unit,
)
from shaper_fmu.ssp.meaning import fmu_unit
from shaper_fmu.ssp.names import DESCRIPTION, OMS_URI, OSP_URI
from shaper_fmu.ssp.write import write_description, write_parameter_set

_TYPES = {"real": "Real", "integer": "Integer", "boolean": "Boolean", "enumeration": "Enumeration"}
SET_NAME = "nominal"
"""Name of all components' parameter sets: ecos applies those of one name alone."""


def write_system(
    system: System,
    path: Path | str,
    *,
    stop_time: float | None = None,
    step: float | None = None,
    start_time: float = 0.0,
    algorithm: Literal["jacobi", "parallel"] = "jacobi",
    description: str | None = None,
    more: Mapping[str, bytes] | None = None,
) -> Path:
    """Write a system as an .ssp archive of version 1.0 that other tools run: flat, with a parameter set per component.

    It is of version 2.0 if arrays of FMI 3.0 have values, which version 1.0 does not know.

    `stop_time`, `step` [s] and `algorithm` become the default experiment, with the annotations of OSP and OMSimulator; `more` are
    further files of the archive. What SSP does not define is not in the file: which outputs announce events, and the use of event
    mode. Raises ModelError, with every problem, for what it cannot hold: inputs that functions or tables drive, connections
    of clocks, and those of single elements of FMI 3.0 arrays.
    """
    problems = [f"input {'.'.join(port)} is driven from outside; SSP holds only start values" for port in system.signals]
    problems += [
        f"{'.'.join(source)} -> {'.'.join(target)} connects clocks, which SSP 1.0 does not know"
        for target, source in system.clock_connections.items()
    ]
    problems += _array_problems(system)
    if problems:
        raise ModelError(problems)
    units: dict[str, Unit] = {}
    enumerations: dict[str, Enumeration] = {}
    files: dict[str, bytes] = dict(more or {})
    sources = _sources(system, files)
    elements = [_component(system, name, sources[name], units, enumerations, files) for name in system.fmus]
    version = "2.0" if any(b'version="2.0"' in content for name, content in files.items() if name in _own_sets(system)) else "1.0"
    experiment, annotations = DefaultExperiment(start_time, stop_time), []
    if step is not None:
        experiment.annotations, annotations = osp_and_oms(step, algorithm)
    root = SystemElement("root", elements=[*elements], connections=_connections(system), annotations=annotations)
    document = SystemDescription(
        system.name,
        root,
        list(enumerations.values()),
        list(units.values()),
        experiment,
        namespaces={"osp": OSP_URI, "oms": OMS_URI},
        description=description,
        version=version,
    )
    return write_archive(Path(path), {**files, DESCRIPTION: write_description(document)})


def parameter_set(system: System, values: Mapping[str, Any], name: str) -> ParameterSet:
    """A set for the whole system from values by "instance.variable". Raises ModelError for names that it does not have."""
    units: dict[str, Unit] = {}
    parameters = []
    for full, value in values.items():
        instance, variable = system.split(full)
        fmu = system.fmus[instance]
        parameters += _parameters(fmu, fmu.start_values({variable: value}), units, f"{instance}.")
    return _set_of(name, parameters, units)


def _set_of(name: str, parameters: list[Parameter], units: dict[str, Unit]) -> ParameterSet:
    version = "2.0" if any(parameter.dimensions for parameter in parameters) else "1.0"
    return ParameterSet(name, parameters, units=list(units.values()), version=version)


def _own_sets(system: System) -> dict[str, str]:
    """The files of the components' sets, and the components."""
    return {f"resources/{name}.ssv": name for name in system.fmus}


def _array_problems(system: System) -> list[str]:
    """Problems of connected elements of FMI 3.0 arrays: version 1.0 of the standard connects only variables."""
    return [
        f"{'.'.join(port)} is an element of an array; SSP 1.0 connects only variables"
        for ends in system.connections.items()
        for port in ends
        if system.fmus[port[0]].version == 3 and system.fmus[port[0]].elements_with(port[1]) != [port[1]]
    ]


def _sources(system: System, files: dict[str, bytes]) -> dict[str, str]:
    """Add each FMU once to the files, and return its path for each instance."""
    paths: dict[str, str] = {}
    for fmu in system.fmus.values():
        if fmu.digest not in paths:
            stem, number = Path(fmu.name).stem, 1
            path = f"resources/{stem}.fmu"
            while path in paths.values():
                number += 1
                path = f"resources/{stem}_{number}.fmu"
            paths[fmu.digest] = path
            files[path] = _packed(fmu)
    return {name: paths[fmu.digest] for name, fmu in system.fmus.items()}


def _packed(fmu: Fmu) -> bytes:
    """The FMU as a file again, from where it is unpacked."""
    inner = {file.relative_to(fmu.folder).as_posix(): file.read_bytes() for file in fmu.folder.rglob("*") if file.is_file()}
    with tempfile.TemporaryDirectory() as folder:
        return write_archive(Path(folder) / "packed.fmu", inner).read_bytes()


def _component(
    system: System,
    name: str,
    source: str,
    units: dict[str, Unit],
    enumerations: dict[str, Enumeration],
    files: dict[str, bytes],
) -> Component:
    fmu = system.fmus[name]
    component = Component(name, _connectors(fmu, units, enumerations), source=source)
    if fmu.exchanges_model:
        component.implementation = "ModelExchange"
    own: dict[str, Unit] = {}
    values = {scalar: value for scalar, value in system.start_values[name].items() if not _is_own_item(fmu, scalar, value)}
    parameters = _parameters(fmu, {**fmu.structure, **values}, own, "")
    if parameters:
        path = f"resources/{name}.ssv"
        files[path] = write_parameter_set(_set_of(SET_NAME, parameters, own))
        component.bindings = [ParameterBinding(path)]
    return component


def _is_own_item(fmu: Fmu, scalar: str, value: float | int | bool) -> bool:
    """Whether this is an enumeration's start value in the FMU: libcosim and ecos stop at any enumeration in a set."""
    variable = fmu.variables[scalar]
    return kind_of(variable) == "enumeration" and variable.start is not None and int(str(variable.start)) == value


def _connectors(fmu: Fmu, units: dict[str, Unit], enumerations: dict[str, Enumeration]) -> list[Connector]:
    """All inputs and outputs that are numbers or booleans; no arrays of FMI 3.0."""
    found = []
    for name, variable in fmu.variables.items():
        kind = kind_of(variable)
        array = fmu.version == 3 and fmu.elements_with(name) != [name]
        if variable.causality not in ("input", "output") or kind not in TRANSFERABLE or array:
            continue
        declared = variable.declaredType
        if kind == "enumeration" and declared is not None:
            items = {str(item.name): int(str(item.value)) for item in declared.items}
            enumerations.setdefault(str(declared.name), Enumeration(str(declared.name), items))
        unit = _unit(fmu, name, units) if kind == "real" else None
        enumeration = str(declared.name) if kind == "enumeration" and declared is not None else None
        found.append(Connector(name, str(variable.causality), DataType(_TYPES[kind], unit, enumeration)))
    return found


def _parameters(fmu: Fmu, values: Mapping[str, float | int | bool], units: dict[str, Unit], prefix: str) -> list[Parameter]:
    """Parameters for values by scalar name. An array of FMI 3.0 is one, which version 1.0 of the standard does not know.

    Its elements without a value have their start value.
    """
    found: dict[str, Parameter] = {}
    for scalar, value in values.items():
        elements = fmu.elements_with(scalar)
        if fmu.version == 2 or elements == [scalar]:
            found[scalar] = _parameter(fmu, scalar, value, units, prefix + scalar)
            continue
        name = scalar.rpartition("[")[0]
        if name not in found:
            whole = {e: values[e] if e in values else own_start(fmu.variables[e], name) for e in elements}
            single = [_parameter(fmu, element, number, units, prefix + name) for element, number in whole.items()]
            found[name] = single[0]
            texts = [str(parameter.value) for parameter in single]
            if single[0].type == "Enumeration":
                found[name].value, found[name].items = None, texts
            else:
                found[name].value = " ".join(texts)
            found[name].dimensions = [Dimension(int(size)) for size in elements[-1].rpartition("[")[2].rstrip("]").split(",")]
    return list(found.values())


def _parameter(fmu: Fmu, scalar: str, value: float | int | bool, units: dict[str, Unit], name: str) -> Parameter:
    variable = fmu.variables[scalar]
    kind = kind_of(variable)
    text = repr(float(value)) if kind == "real" else str(value).lower()
    if kind == "enumeration":
        items = variable.declaredType.items if variable.declaredType is not None else []
        text = next((str(item.name) for item in items if int(str(item.value)) == value), text)
    return Parameter(name, _TYPES[kind], text, _unit(fmu, scalar, units) if kind == "real" else None)


def _unit(fmu: Fmu, name: str, units: dict[str, Unit]) -> str | None:
    unit = fmu_unit(fmu, name)
    if unit is None or (definition := fmu.unit_definition(unit.name)) is None or definition.baseUnit is None:
        return None
    known = units.setdefault(unit.name, unit)
    return unit.name if known == unit else None


def _connections(system: System) -> list[Connection]:
    found = []
    for target, source in system.connections.items():
        connection = Connection(source[0], source[1], target[0], target[1])
        total = system.scalings.get(target, IDENTITY)
        if target in system.mappings:
            connection.transformation = _mapping(system, source, target)
        elif total != _converted(system, source, target):
            connection.transformation, connection.suppress_unit_conversion = LinearTransformation(*total), True
        found.append(connection)
    return found


def _mapping(system: System, source: tuple[str, str], target: tuple[str, str]) -> MappingTransformation:
    """The table of a connection, as texts."""
    ends = [system.fmus[name].variables[variable] for name, variable in (source, target)]
    kind = kind_of(ends[1])
    types = [end.declaredType for end in ends]
    names = [{int(str(i.value)): str(i.name) for i in (found.items if found else None) or []} for found in types]
    pairs = system.mappings[target].items()
    if kind == "boolean":
        return MappingTransformation("Boolean", [(str(bool(a)).lower(), str(bool(b)).lower()) for a, b in pairs])
    if all(names):
        return MappingTransformation("Enumeration", [(names[0][a], names[1][b]) for a, b in pairs])
    return MappingTransformation("Integer", [(str(a), str(b)) for a, b in pairs])


def _converted(system: System, source: tuple[str, str], target: tuple[str, str]) -> tuple[float, float] | None:
    """The conversion that a reader does by the units alone; None if it cannot."""
    try:
        return unit_conversion(*(fmu_unit(system.fmus[name], variable) for name, variable in (source, target)))
    except ModelError:
        return None
