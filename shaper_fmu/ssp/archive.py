"""Loads SSP archives as systems that run, and folders as archives."""

from __future__ import annotations

import hashlib
from collections.abc import Mapping, Sequence
from pathlib import Path, PurePosixPath

from shaper_fmu.archives import read_archive, read_file, write_archive
from shaper_fmu.errors import ArchiveError, BuildError, ModelError, NotInArchiveError, nearest
from shaper_fmu.export.build import fmu_path
from shaper_fmu.ssp.document import Component, SystemDescription
from shaper_fmu.ssp.files import Files, path_of
from shaper_fmu.ssp.findings import Findings, Weight
from shaper_fmu.ssp.loaded import SspSystem
from shaper_fmu.ssp.names import DESCRIPTION, FMU_TYPE, SETS
from shaper_fmu.ssp.own_fmus import own_fmus
from shaper_fmu.ssp.read import read_description
from shaper_fmu.ssp.resolve import resolve
from shaper_fmu.ssp.structure import elements_of

_SHOWN = 3


def load_ssp(path: Path | str, variant: str | None = None) -> SspSystem:
    """Read an .ssp file: its SystemStructure.ssd, or the variant of this name.

    Raises ArchiveError, or ModelError with every finding that stops it, by file and line.
    """
    path = Path(path)
    content = read_file(path)
    archive = read_archive(content, path.name)
    name = _file_of(archive, variant)
    files, found = resolve(archive, name)
    problems = files.findings.texts(Weight.LOAD)
    if name in files.unreadable:
        raise ArchiveError("\n".join(problems))
    if problems or found is None:
        raise ModelError(problems)
    notes = [*files.findings.texts(Weight.NOTE), *_deviations(path.name, files.findings), *_renamed(found.instances)]
    sets = {name.removeprefix(SETS): archive[name] for name in sorted(archive) if name.startswith(SETS)}
    return SspSystem(
        found.system,
        found.structure,
        hashlib.sha256(content).hexdigest(),
        sets,
        tuple(notes),
        tuple(files.findings),
        network=found.network,
        instances=found.instances,
    )


def _deviations(name: str, findings: Findings) -> list[str]:
    """A note that there are findings which do not matter for a run."""
    deviations = findings.texts(Weight.DEVIATION, Weight.DEVIATION)
    if not deviations:
        return []
    more = f"; and {len(deviations) - _SHOWN} more" if len(deviations) > _SHOWN else ""
    listed = "; ".join(deviations[:_SHOWN])
    return [f"{name} deviates from the standard, but can be run ('shaper-fmu check' lists all): {listed}{more}"]


def variants(files: Mapping[str, bytes]) -> list[str]:
    """The names of an archive's variants: its .ssd files beside each other, SystemStructure.ssd first."""
    found = sorted(name for name in files if name.endswith(".ssd") and "/" not in name)
    return sorted(found, key=lambda name: name != DESCRIPTION)


def read_variant(files: Mapping[str, bytes], variant: str | None = None) -> SystemDescription:
    """The default description of an archive with these files, or the variant of this file name (.ssd may be left out) or name.

    Raises ArchiveError if there is none.
    """
    name = _file_of(files, variant)
    return read_description(files[name], name)


def _file_of(files: Mapping[str, bytes], variant: str | None) -> str:
    """The file name of a variant; the default one if it is None."""
    if DESCRIPTION not in files:
        raise ArchiveError(f"no {DESCRIPTION}, so this is not an SSP archive")
    if variant is None:
        return DESCRIPTION
    known = variants(files)
    for name in known:
        if variant in (name, name.removesuffix(".ssd")):
            return name
    for name in known:
        if read_description(files[name], name).name == variant:
            return name
    raise NotInArchiveError(f"there is no variant {variant!r}.{nearest(variant, [name.removesuffix('.ssd') for name in known])}")


def _renamed(instances: Mapping[str, str]) -> list[str]:
    return [f"component {path!r} is called {name} here" for path, name in instances.items() if path != name]


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
        inside = Files(files, Findings())
        for place in elements_of(read_description(files[variant], variant), inside).places.values():
            component = place.element
            if not isinstance(component, Component) or component.type != FMU_TYPE or component.source is None:
                continue
            try:
                source = path_of(component.source, place.scope.file)
            except ArchiveError as error:
                raise BuildError(f"{folder}: component {place.path!r}: {error}") from None
            if source in inside.content:
                continue
            fmu = fmus / PurePosixPath(source).name
            if fmu.name in own:
                fmu = fmu_path(own[fmu.name], platforms=platforms)
            if not fmu.is_file():
                raise BuildError(
                    f"{folder}: component {place.path!r} needs {fmu}, which is not there; run 'shaper-fmu build' first"
                )
            files[source] = fmu.read_bytes()
    return write_archive(Path(target) if target else archive_of(folder), files)


def archive_of(folder: Path | str) -> Path:
    """The archive into which a folder is packed: beside it, with its name."""
    folder = Path(folder)
    named = folder if folder.name not in ("", "..") else folder.resolve()
    return named.with_name(named.name + ".ssp")
