"""Loads SSP archives as systems that run, and folders as archives."""

from __future__ import annotations

import hashlib
import tempfile
from collections.abc import Mapping, Sequence
from pathlib import Path, PurePosixPath

from shaper_fmu.archives import read_archive, read_file, write_archive
from shaper_fmu.component import Component as OwnComponent
from shaper_fmu.errors import ArchiveError, BuildError, ModelError, NotInArchiveError, nearest
from shaper_fmu.export.build import fmu_path
from shaper_fmu.registry import components
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
    """Read an .ssp file: its SystemStructure.ssd, or the variant of this name; or a system's folder, from which one is built.

    FMUs that a folder lacks are taken from ./fmus, or built for this machine, where they are components of ours.
    Raises ArchiveError, or ModelError with every finding that stops it, by file and line.
    """
    path = Path(path)
    if path.is_dir():
        with tempfile.TemporaryDirectory(prefix="shaper-fmu-system-") as place:
            target = Path(place) / archive_of(path).name
            return load_ssp(pack_ssp(path, "fmus", target, ["this"], build=True), variant)
    content = read_file(path)
    archive = read_archive(content, path.name)
    name = description_name(archive, variant)
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
    name = description_name(files, variant)
    return read_description(files[name], name)


def description_name(files: Mapping[str, bytes], variant: str | None) -> str:
    """The file name of a variant of an archive with these files; the default one if it is None. Raises ArchiveError."""
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


def pack_ssp(
    folder: Path | str, fmus: Path | str, target: Path | str | None = None, platforms: Sequence[str] = (), build: bool = False
) -> Path:
    """Write `folder`.ssp (or `target`) from a folder with SystemStructure.ssd, its variants, resources and parameter_sets.

    An FMU that the system names and the folder lacks is built if the folder's fmus.toml describes it (see own_fmus.py), for
    these platforms (default: all), and else taken from `fmus` by its file name; with `build`, a component of ours that is not
    there is built. Raises BuildError or ArchiveError; then no
    file is written or changed.
    """
    folder, fmus = Path(folder), Path(fmus)
    files = folder_files(folder)
    own = own_fmus(folder)
    for source, component in lacking_fmus(folder, files).items():
        origin = fmu_origin(source, fmus, own) or (components().get(PurePosixPath(source).stem) if build else None)
        if origin is None:
            raise BuildError(
                f"{folder}: component {component!r} needs {_in(fmus, source)}, which is not there; run 'shaper-fmu build' first"
            )
        files[source] = (origin if isinstance(origin, Path) else fmu_path(origin, platforms=platforms)).read_bytes()
    return write_archive(Path(target) if target else archive_of(folder), files)


def folder_files(folder: Path) -> dict[str, bytes]:
    """The files of a folder that go into its archive, without the FMUs that it lacks. Raises ArchiveError."""
    if not (folder / DESCRIPTION).is_file():
        raise ArchiveError(f"{folder}: no {DESCRIPTION} in this folder")
    inner = [p for name in ("resources", SETS) for p in sorted((folder / name).rglob("*")) if p.is_file()]
    return {p.relative_to(folder).as_posix(): read_file(p) for p in [*sorted(folder.glob("*.ssd")), *inner]}


def lacking_fmus(folder: Path, files: Mapping[str, bytes]) -> dict[str, str]:
    """The FMUs that the systems of a folder with these files name and lack: name in the archive -> path of the first component.

    Raises BuildError for a source that leads out of the archive, ArchiveError or ModelError for a description that cannot be read.
    """
    found: dict[str, str] = {}
    inside = Files(files, Findings())
    for variant in variants(files):
        for place in elements_of(read_description(files[variant], variant), inside).places.values():
            component = place.element
            if not isinstance(component, Component) or component.type != FMU_TYPE or component.source is None:
                continue
            try:
                source = path_of(component.source, place.scope.file)
            except ArchiveError as error:
                raise BuildError(f"{folder}: component {place.path!r}: {error}") from None
            if source not in inside.content:
                found.setdefault(source, place.path)
    return found


def fmu_origin(source: str, fmus: Path, own: Mapping[str, type[OwnComponent]]) -> Path | type[OwnComponent] | None:
    """The origin of an FMU that a folder lacks: a component that is built, or a file of `fmus`; None if neither is there."""
    made = own.get(PurePosixPath(source).name)
    file = _in(fmus, source)
    return made if made is not None else file if file.is_file() else None


def _in(fmus: Path, source: str) -> Path:
    return fmus / PurePosixPath(source).name


def archive_of(folder: Path | str) -> Path:
    """The archive into which a folder is packed: beside it, with its name."""
    folder = Path(folder)
    named = folder if folder.name not in ("", "..") else folder.resolve()
    return named.with_name(named.name + ".ssp")
