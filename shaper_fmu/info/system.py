"""Reads the facts about a system: an SSP archive, a folder from which one is built, or a description (.ssd) alone."""

from __future__ import annotations

import contextlib
from collections.abc import Mapping
from pathlib import Path, PurePosixPath

from shaper_fmu.archives import read_archive, read_file
from shaper_fmu.errors import ArchiveError, ModelError, ShaperFmuError
from shaper_fmu.info.connections import connections_of
from shaper_fmu.info.facts import ConnectorInfo, ElementInfo, Experiment, FmuInfo, SetInfo, SspInfo
from shaper_fmu.info.fmu import fmu_facts
from shaper_fmu.ssp.archive import description_name, fmu_origin, folder_files, lacking_fmus, variants
from shaper_fmu.ssp.check import check_description
from shaper_fmu.ssp.document import (
    Component,
    Connector,
    DictionaryReference,
    Parameter,
    ParameterBinding,
    ParameterSet,
    SystemDescription,
    SystemElement,
)
from shaper_fmu.ssp.files import path_of
from shaper_fmu.ssp.findings import Weight
from shaper_fmu.ssp.meaning import Scope
from shaper_fmu.ssp.names import DESCRIPTION, FMU_TYPE, SETS
from shaper_fmu.ssp.network import Network
from shaper_fmu.ssp.own_fmus import own_fmus
from shaper_fmu.ssp.read import read_parameter_set
from shaper_fmu.ssp.resolve import resolve
from shaper_fmu.ssp.structure import Place


def ssp_info(path: Path | str, variant: str | None = None, fmus: Path | str = "fmus") -> SspInfo:
    """What an archive, a folder of a system, or a description (.ssd) among its files is.

    FMUs that a folder lacks are read from `fmus`, as `pack_ssp` does; what it would build is not built. Raises ArchiveError for
    what `check` cannot read either, NotInArchiveError for a variant that is not there.
    """
    path, made = Path(path), frozenset[str]()
    if path.is_dir():
        files, name = folder_files(path), None
        made = _add_fmus(path, files, Path(fmus))
    elif path.suffix.lower() == ".ssd":
        beside = folder_files(path.parent) if (path.parent / DESCRIPTION).is_file() else {}
        files, name = {**beside, path.name: read_file(path)}, path.name
        made = _add_fmus(path.parent, files, Path(fmus))
    else:
        files, name = read_archive(read_file(path), path.name), None
    size = path.stat().st_size if path.is_file() else sum(map(len, files.values()))
    return system_facts(path.name or path.resolve().name, size, files, name or description_name(files, variant), made)


def _add_fmus(folder: Path, files: dict[str, bytes], fmus: Path) -> frozenset[str]:
    """Add the FMUs that a folder lacks to its files, as far as they are there; returns the names of those that `build` makes."""
    made: set[str] = set()
    with contextlib.suppress(ShaperFmuError):  # what cannot be read is a finding
        own = own_fmus(folder)
        for source in lacking_fmus(folder, files):
            origin = fmu_origin(source, fmus, own)
            if isinstance(origin, Path):
                files[source] = read_file(origin)
            elif origin is not None:
                made.add(source)
    return frozenset(made)


def system_facts(file: str, size: int, files: Mapping[str, bytes], name: str, made: frozenset[str] = frozenset()) -> SspInfo:
    """What the system is that the description called `name` among these files describes; `made` are FMUs that are not built yet.

    Raises ArchiveError.
    """
    read, found = resolve(files, name)
    if found is None:
        raise ArchiveError("\n".join(read.findings.texts(Weight.LOAD)))
    reader = _Reader(found.network, made)
    structure = found.structure
    findings = sorted(check_description(files, name).findings, key=lambda one: (one.file, one.line))
    return SspInfo(
        file=file,
        size=size,
        name=structure.name,
        description=structure.description or "",
        version=structure.version,
        tool=structure.attributes.get("generationTool", ""),
        generated=structure.attributes.get("generationDateAndTime", ""),
        variant=name,
        variants=variants(files),
        experiment=_experiment(structure),
        system=reader.element(found.network.places[""]),
        fmus=reader.fmus,
        parameter_sets=[_set_of_file(read.content, one) for one in sorted(files) if one.startswith(SETS)],
        findings=[f"{'' if finding.stops else 'note: '}{finding}" for finding in findings],
    )


def _experiment(structure: SystemDescription) -> Experiment:
    """The default experiment, with the settings of other tools' annotations as far as they can be read."""
    try:
        settings = structure.settings
    except ModelError:  # which is a finding
        settings = []
    step, algorithm, tool = (settings[0].step_size, settings[0].algorithm, settings[0].tool) if settings else (None, None, "")
    return Experiment(structure.start_time, structure.stop_time, step, None, algorithm, tool)


class _Reader:
    """Reads the elements of a flattened system as a tree; `fmus` are the facts about its FMUs by their paths in the archive."""

    def __init__(self, network: Network, made: frozenset[str]):
        self._network, self._made = network, made
        self._files = network.structure.files
        self._problems: dict[str, str] = {}
        self.fmus: dict[str, FmuInfo] = {}

    def element(self, place: Place) -> ElementInfo:
        """The element at a place, with all in it."""
        element = place.element
        common = {
            "name": element.name,
            "description": element.description or "",
            "connectors": [_connector(one) for one in element.connectors],
            "values": [self._bound(binding, scope) for binding, scope in place.bindings()],
        }
        if isinstance(element, SystemElement):
            inside = [self.element(inner) for inner in self._network.structure.inside(place.path)]
            source = (place.component.source if place.component is not None else "") or ""
            connections = connections_of(self._network, place, element)
            return ElementInfo(kind="system", source=source, elements=inside, connections=connections, **common)
        if isinstance(element, DictionaryReference):
            return ElementInfo(kind="signal dictionary", source=element.dictionary, **common)
        fmu, problem = self._fmu(element, place.scope)
        return ElementInfo(
            kind="component",
            source=element.source or "",
            implementation=element.implementation,
            fmu=fmu,
            problem=problem,
            **common,
        )

    def _fmu(self, component: Component, scope: Scope) -> tuple[str, str]:
        """The path of a component's FMU, and why it has none that can be read."""
        if component.source is None:
            return "", "it has no source yet"
        if component.type != FMU_TYPE:
            return "", f"it is of type {component.type}"
        try:
            path = path_of(component.source, scope.file)
        except ArchiveError as error:
            return "", str(error)
        content = self._files.content.get(path)
        if content is None:
            return "", "it is not built yet; build makes it" if path in self._made else "this file is not there"
        if path not in self.fmus and path not in self._problems:
            try:
                self.fmus[path] = fmu_facts(PurePosixPath(path).name, content)
            except ShaperFmuError as error:
                self._problems[path] = " ".join(str(error).split())
        return (path, "") if path in self.fmus else ("", self._problems[path])

    def _bound(self, binding: ParameterBinding, scope: Scope) -> SetInfo:
        if binding.source is None:
            return SetInfo("", _values(binding.values), binding.prefix)
        path = ""
        if binding.source_base == "SSD":
            try:
                path = path_of(binding.source, scope.file)
            except ArchiveError:
                path = ""
        read = self._files.seen.get(path)
        return SetInfo(binding.source, _values(read if isinstance(read, ParameterSet) else None), binding.prefix)


def _connector(one: Connector) -> ConnectorInfo:
    declared = one.type
    return ConnectorInfo(one.name, one.kind, declared.name if declared else "", (declared.unit if declared else None) or "")


def _set_of_file(files: Mapping[str, bytes], name: str) -> SetInfo:
    try:
        return SetInfo(name.removeprefix(SETS), _values(read_parameter_set(files[name], name)))
    except ShaperFmuError:  # which is a finding
        return SetInfo(name.removeprefix(SETS), None)


def _values(found: ParameterSet | None) -> dict[str, str] | None:
    return {one.name: _text(one) for one in found.parameters} if found is not None else None


def _text(parameter: Parameter) -> str:
    value = parameter.value if parameter.value is not None else " ".join(parameter.items)
    return f"{value} {parameter.unit}" if parameter.unit else value
