"""SSP archives as systems that run, and folders as archives."""

from __future__ import annotations

import hashlib
import re
from collections.abc import Iterable, Mapping, Sequence
from pathlib import Path, PurePosixPath

from shaper_fmu.archives import read_archive, read_file, write_archive
from shaper_fmu.errors import ArchiveError, BuildError, ModelError, NotInArchiveError, ShaperFmuError, nearest
from shaper_fmu.export.build import fmu_path
from shaper_fmu.master.fmu import Fmu, fmu_from_bytes
from shaper_fmu.master.system import System
from shaper_fmu.ssp.conversion import IDENTITY
from shaper_fmu.ssp.document import Component, SystemDescription
from shaper_fmu.ssp.flatten import Flat, Place, flatten
from shaper_fmu.ssp.loaded import SspSystem, start_values_of
from shaper_fmu.ssp.names import DESCRIPTION, FMU_TYPE
from shaper_fmu.ssp.network import Network, at
from shaper_fmu.ssp.own_fmus import own_fmus
from shaper_fmu.ssp.parameters import Settings, collect_settings
from shaper_fmu.ssp.read import read_description
from shaper_fmu.ssp.wires import make_network

SETS = "parameter_sets/"
"""Folder of an archive with parameter sets for the whole system, which are applied on demand."""


def load_ssp(path: Path | str, variant: str | None = None) -> SspSystem:
    """Read an .ssp file: its SystemStructure.ssd, or the variant of this name.

    Raises ArchiveError, or ModelError with every problem found, by file and line.
    """
    path = Path(path)
    content = read_file(path)
    files = read_archive(content, path.name)
    structure = read_variant(files, variant)
    flat = flatten(structure, files)
    problems = flat.problems
    network = make_network(flat, _load_fmus(flat, problems))
    settings = collect_settings(network, flat.files)
    _resize(network, settings)
    system = System(structure.name)
    instances = _instance_names(network.fmus)
    _add(system, network, instances, settings)
    _connect(system, network, instances)
    problems += network.problems + settings.problems
    if problems:
        raise ModelError(problems)
    notes = [*settings.notes, *_renamed(instances)]
    sets = {name.removeprefix(SETS): files[name] for name in sorted(files) if name.startswith(SETS)}
    digest = hashlib.sha256(content).hexdigest()
    return SspSystem(system, structure, digest, sets, tuple(notes), network=network, instances=instances)


def variants(files: Mapping[str, bytes]) -> list[str]:
    """The names of an archive's variants: its .ssd files beside each other, SystemStructure.ssd first."""
    found = sorted(name for name in files if name.endswith(".ssd") and "/" not in name)
    return sorted(found, key=lambda name: name != DESCRIPTION)


def read_variant(files: Mapping[str, bytes], variant: str | None = None) -> SystemDescription:
    """The default description of an archive with these files, or the variant of this file name (.ssd may be left out) or name.

    Raises ArchiveError if there is none.
    """
    if DESCRIPTION not in files:
        raise ArchiveError(f"no {DESCRIPTION}, so this is not an SSP archive")
    if variant is None:
        return read_description(files[DESCRIPTION], DESCRIPTION)
    known = variants(files)
    for name in known:
        if variant in (name, name.removesuffix(".ssd")):
            return read_description(files[name], name)
    for name in known:
        description = read_description(files[name], name)
        if description.name == variant:
            return description
    raise NotInArchiveError(f"there is no variant {variant!r}.{nearest(variant, [name.removesuffix('.ssd') for name in known])}")


def _load_fmus(flat: Flat, problems: list[str]) -> dict[str, Fmu]:
    """The FMUs of all components by path; what is wrong goes to `problems`."""
    fmus: dict[str, Fmu] = {}
    for place in flat.components():
        assert isinstance(place.element, Component)
        words = _why_not(place.element, place, flat.files)
        if words is None:
            try:
                fmus[place.path] = fmu_from_bytes(PurePosixPath(place.source).name, flat.files[place.source])
                problems += _wrong_connectors(place, fmus[place.path])
                continue
            except ShaperFmuError as error:
                words = str(error)
        problems.append(place.scope.at(place.element.line, f"component {place.path!r}: {words}"))
    return fmus


def _why_not(component: Component, place: Place, files: Mapping[str, bytes]) -> str | None:
    """Why a component cannot be run; None if it seems to be one that can."""
    if component.source is None:
        return "it has no source, so there is nothing to run"
    if component.type != FMU_TYPE:
        return f"it is of type {component.type}; FMUs and system structures can be run"
    if component.implementation not in ("any", "CoSimulation"):
        return f"it is to be used for {component.implementation}; this master runs co-simulation alone"
    return None if place.source in files else f"{component.source} is missing in the archive"


def _wrong_connectors(place: Place, fmu: Fmu) -> list[str]:
    """Connectors that are no such variables of the FMU."""
    problems = []
    for connector in place.element.connectors:
        variable = fmu.variables.get(fmu.elements_of(connector.name)[0])
        told = connector.kind in ("input", "output", "parameter")
        if variable is None or (told and variable.causality != connector.kind):
            words = f"connector {place.path}.{connector.name} of kind {connector.kind!r} is not such a variable of {place.source}"
            problems.append(place.scope.at(connector.line, words))
    return problems


def _instance_names(fmus: Iterable[str]) -> dict[str, str]:
    """Names for instances by path: the path, if it is one."""
    names: dict[str, str] = {}
    for path in fmus:
        parts = [re.sub(r"^(?=\d)|[^A-Za-z0-9_]", "_", part) or "_" for part in path.split(".")]
        name = ".".join(parts)
        while name in names.values():
            name += "_"
        names[path] = name
    return names


def _renamed(instances: Mapping[str, str]) -> list[str]:
    return [f"component {path!r} is called {name} here" for path, name in instances.items() if path != name]


def _resize(network: Network, settings: Settings) -> None:
    """Give components their structural parameters, which sizes of arrays follow; what is wrong goes to the settings' problems."""
    for (path, variable), setting in list(settings.values.items()):
        try:
            fmu, rest = network.fmus[path].split_structure({variable: setting.value})
        except ModelError as error:
            settings.problems += [f"{setting.file}, line {setting.line}: {path}: {problem}" for problem in error.problems]
            continue
        if not rest:
            network.fmus[path] = fmu
            del settings.values[path, variable]


def _add(system: System, network: Network, instances: Mapping[str, str], settings: Settings) -> None:
    """Add the instances with their start values; what is wrong goes to the settings' problems."""
    for path, name in instances.items():
        system.add(name, network.fmus[path])
    for (path, variable), setting in settings.values.items():
        try:
            system.start_values[instances[path]].update(start_values_of(network, path, variable, setting.value))
        except ModelError as error:
            settings.problems += [f"{setting.file}, line {setting.line}: {path}: {problem}" for problem in error.problems]


def _connect(system: System, network: Network, instances: Mapping[str, str]) -> None:
    """Connect what wires connect through all levels; what is wrong goes to the network's problems."""
    for target, last in network.into.items():
        if not network.is_variable(target):
            continue
        try:
            path = network.path_to(target)
            source, mapping = path[0].source, network.mapping(path)
            affine = IDENTITY if mapping else network.affine(path)
        except ModelError as error:
            network.problems += error.problems
            continue
        if not network.is_variable(source):
            continue  # a connector that nothing feeds; its value, if it has one, is among the settings
        start, end = (f"{instances[node.path]}.{node.name}" for node in (source, target))
        if network.variable(target).causality != "input":
            network.problems.append(at(last, f"{start} feeds the parameter {end}; this master feeds inputs alone"))
            continue
        try:
            system.connect_raw(start, end, *affine, mapping=mapping)
        except ModelError as error:
            network.problems += [at(last, problem) for problem in error.problems]


def pack_ssp(folder: Path | str, fmus: Path | str, target: Path | str | None = None, platforms: Sequence[str] = ()) -> Path:
    """Write `folder`.ssp (or `target`) from a folder with SystemStructure.ssd, its variants, resources and parameter_sets.

    An FMU that the system names and the folder lacks is built if the folder's fmus.toml describes it (see own_fmus.py), for
    these platforms (default: all), and else taken from `fmus` by its file name. Raises BuildError or ArchiveError; then no
    file is written or changed.
    """
    folder, fmus = Path(folder), Path(fmus)
    if not (folder / DESCRIPTION).is_file():
        raise ArchiveError(f"{folder}: no {DESCRIPTION} in this folder")
    inner = [p for name in ("resources", SETS) for p in sorted((folder / name).rglob("*")) if p.is_file()]
    files = {p.relative_to(folder).as_posix(): p.read_bytes() for p in [*sorted(folder.glob("*.ssd")), *inner]}
    own = own_fmus(folder)
    for variant in variants(files):
        flat = flatten(read_description(files[variant], variant), files)
        for place in flat.components():
            assert isinstance(place.element, Component)
            if place.source in flat.files or place.element.type != FMU_TYPE or place.element.source is None:
                continue
            if place.source.startswith(("/", "..")) or ":" in place.source:
                raise BuildError(f"{folder}: component {place.path!r} names {place.source}, which lies outside of the archive")
            fmu = fmus / PurePosixPath(place.source).name
            if fmu.name in own:
                fmu = fmu_path(own[fmu.name], platforms=platforms)
            if not fmu.is_file():
                raise BuildError(
                    f"{folder}: component {place.path!r} needs {fmu}, which is not there; run 'shaper-fmu build' first"
                )
            files[place.source] = fmu.read_bytes()
    return write_archive(Path(target) if target else archive_of(folder), files)


def archive_of(folder: Path | str) -> Path:
    """The archive that a folder is packed into: beside it, and of its name."""
    folder = Path(folder)
    named = folder if folder.name not in ("", "..") else folder.resolve()
    return named.with_name(named.name + ".ssp")
