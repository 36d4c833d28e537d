"""Parameter sets for whole systems: variants of values, kept in an archive's folder parameter_sets/ or in files of their own.

A set is an SSP file (.ssv) whose names are those of the root system: "component.variable", "system.component.variable", or a
connector's. It goes over all bindings of the system's own.
"""

from __future__ import annotations

from pathlib import Path

from shaper_fmu.archives import read_file
from shaper_fmu.errors import ArchiveError, NotInArchiveError, nearest
from shaper_fmu.ssp.document import ParameterSet
from shaper_fmu.ssp.files import Files
from shaper_fmu.ssp.findings import Findings, Weight
from shaper_fmu.ssp.loaded import SspSystem
from shaper_fmu.ssp.names import SETS
from shaper_fmu.ssp.read import read_parameter_set


def apply_parameter_set(loaded: SspSystem, which: Path | str) -> None:
    """Set the start values of a set: a file, or one of the archive's, by its name with or without ".ssv".

    Raises ArchiveError if there is no such set, ModelError with every problem by file and line; then nothing is set. A value
    that nothing takes is such a problem: who asks for a set wants its values.
    """
    name, content = _content(loaded, which)
    files = Files({name: content}, Findings())
    values = files.read(name, read_parameter_set)
    if name in files.unreadable:
        raise ArchiveError(files.findings.texts(Weight.LOAD)[0])
    loaded.apply(values or ParameterSet(""), files.findings)


def check_parameter_sets(loaded: SspSystem, findings: Findings) -> None:
    """Look for problems of the archive's own sets."""
    files = Files({f"{SETS}{name}": content for name, content in loaded.parameter_sets.items()}, findings)
    for name in sorted(files.content):
        values = files.read(name, read_parameter_set)
        if values is not None:
            loaded.checked(values, findings)


def parameter_set_problems(loaded: SspSystem) -> list[str]:
    """The problems of the archive's own sets, as messages."""
    findings = Findings()
    check_parameter_sets(loaded, findings)
    return findings.texts(Weight.LOAD)


def _content(loaded: SspSystem, which: Path | str) -> tuple[str, bytes]:
    path = Path(which)
    if path.is_file():
        return str(path), read_file(path)
    for name in (str(which), f"{which}.ssv"):
        if name in loaded.parameter_sets:
            return f"{SETS}{name}", loaded.parameter_sets[name]
    known = [Path(name).stem for name in loaded.parameter_sets]
    inside = f"the archive has none of that name.{nearest(path.stem, known)}" if known else "the archive has no parameter sets"
    raise NotInArchiveError(f"{which}: there is no such file, and {inside}")
