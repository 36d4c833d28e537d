"""SSP archives as systems that run, and folders as archives."""

from __future__ import annotations

import hashlib
from dataclasses import dataclass, field
from pathlib import Path, PurePosixPath

from shaper_fmu.archives import read_archive, read_file, write_archive
from shaper_fmu.errors import ArchiveError, BuildError, ModelError
from shaper_fmu.master.fmu import fmu_from_bytes
from shaper_fmu.master.system import System
from shaper_fmu.ssp.reader import DESCRIPTION, read_structure
from shaper_fmu.ssp.structure import Element, Structure

SETS = "parameter_sets/"
"""Folder of an archive with parameter sets for the whole system: variants, which are applied on demand."""


@dataclass(frozen=True)
class SspSystem:
    """A system read from an SSP archive, its structure (which holds the default experiment), and the file's SHA-256.

    `parameter_sets` are the files of the archive's folder of that name: file name -> content (see parameter_sets.py).
    """

    system: System
    structure: Structure
    digest: str
    parameter_sets: dict[str, bytes] = field(default_factory=dict)


def load_ssp(path: Path | str) -> SspSystem:
    """Read an .ssp file. Raises ArchiveError, or ModelError with every problem found, by file and line."""
    path = Path(path)
    content = read_file(path)
    files = read_archive(content, path.name)
    structure = read_structure(files)
    system = System(structure.name)
    problems: list[str] = []
    for element in structure.elements:
        _collect(problems, element.line, lambda element=element: _add(system, element, files))
    for connection in structure.connections:
        start, end = ".".join(connection.start), ".".join(connection.end)
        _collect(problems, connection.line, lambda start=start, end=end: system.connect(start, end))
    if problems:
        raise ModelError(problems)
    sets = {name.removeprefix(SETS): files[name] for name in sorted(files) if name.startswith(SETS)}
    return SspSystem(system, structure, hashlib.sha256(content).hexdigest(), sets)


def _collect(problems: list[str], line: int, action) -> None:
    try:
        action()
    except ModelError as error:
        problems += [f"{DESCRIPTION}, line {line}: {problem}" for problem in error.problems]
    except ArchiveError as error:
        problems.append(f"{DESCRIPTION}, line {line}: {error}")


def _add(system: System, element: Element, files: dict[str, bytes]) -> None:
    if element.source not in files:
        raise ModelError([f"component {element.name!r}: {element.source} is missing in the archive"])
    fmu = fmu_from_bytes(PurePosixPath(element.source).name, files[element.source])
    system.add(element.name, fmu, {parameter.name: parameter.text for parameter in element.parameters})
    problems = [problem for p in element.parameters for problem in unit_problems(system, f"{element.name}.{p.name}", p.unit)]
    for name, kind in element.connectors.items():
        variable = fmu.variables.get(name)
        if variable is None or (kind in ("input", "output", "parameter") and variable.causality != kind):
            problems.append(f"connector {element.name}.{name} of kind {kind!r} is not such a variable of {element.source}")
    if problems:
        raise ModelError(problems)


def unit_problems(system: System, name: str, unit: str | None) -> list[str]:
    """What is wrong with giving a value of "instance.variable" in a unit: nothing, or that the FMU has another one."""
    own = system.unit(system.split(name))
    return [f"{name} is given in {unit}, but the FMU's unit is {own}"] if unit and own and unit != own else []


def pack_ssp(folder: Path | str, fmus: Path | str, target: Path | str | None = None) -> Path:
    """Write `folder`.ssp (or `target`) from a folder with SystemStructure.ssd, resources and parameter_sets, and FMUs from `fmus`.

    An FMU that the system names and the folder lacks is taken from `fmus` by its file name. Raises BuildError or
    ArchiveError; then no file is written or changed.
    """
    folder, fmus = Path(folder), Path(fmus)
    if not (folder / DESCRIPTION).is_file():
        raise ArchiveError(f"{folder}: no {DESCRIPTION} in this folder")
    inner = [p for name in ("resources", SETS) for p in sorted((folder / name).rglob("*")) if p.is_file()]
    found = [folder / DESCRIPTION, *inner]
    files = {p.relative_to(folder).as_posix(): p.read_bytes() for p in found}
    for element in read_structure(files).elements:
        if element.source not in files:
            fmu = fmus / PurePosixPath(element.source).name
            if not fmu.is_file():
                raise BuildError(
                    f"{folder}: component {element.name!r} needs {fmu}, which is not there; run 'shaper-fmu build' first"
                )
            files[element.source] = fmu.read_bytes()
    return write_archive(Path(target) if target else folder.with_name(folder.name + ".ssp"), files)
