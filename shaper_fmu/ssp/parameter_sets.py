"""Parameter sets for whole systems: variants, kept in an archive's folder parameter_sets/ or in files of their own.

A set is an SSP 1.0 file (.ssv) whose names are "instance.variable". It goes over the system's own values.
"""

from __future__ import annotations

from pathlib import Path

from shaper_fmu.archives import read_file
from shaper_fmu.errors import ArchiveError, ModelError, nearest
from shaper_fmu.ssp.archive import SspSystem, unit_problems
from shaper_fmu.ssp.reader import read_parameter_set
from shaper_fmu.ssp.structure import ParameterValue


def apply_parameter_set(loaded: SspSystem, which: Path | str) -> None:
    """Set the start values of a set: a file, or one of the archive's, by its name with or without ".ssv".

    Raises ArchiveError if there is no such set, ModelError with every problem by file and line; then nothing is set.
    """
    name, content = _content(loaded, which)
    values, problems = _checked(loaded, content, name)
    if problems:
        raise ModelError(problems)
    for value in values:
        loaded.system.set(value.name, value.text)


def parameter_set_problems(loaded: SspSystem) -> list[str]:
    """Every problem of the archive's own sets, in words."""
    problems = []
    for name, content in loaded.parameter_sets.items():
        try:
            problems += _checked(loaded, content, name)[1]
        except (ArchiveError, ModelError) as error:
            problems += error.problems if isinstance(error, ModelError) else [str(error)]
    return problems


def _content(loaded: SspSystem, which: Path | str) -> tuple[str, bytes]:
    path = Path(which)
    if path.is_file():
        return str(path), read_file(path)
    for name in (str(which), f"{which}.ssv"):
        if name in loaded.parameter_sets:
            return name, loaded.parameter_sets[name]
    known = [Path(name).stem for name in loaded.parameter_sets]
    inside = f"the archive has none of that name.{nearest(path.stem, known)}" if known else "the archive has no parameter sets"
    raise ArchiveError(f"{which}: there is no such file, and {inside}")


def _checked(loaded: SspSystem, content: bytes, name: str) -> tuple[list[ParameterValue], list[str]]:
    """The values of a set, and what is wrong with them."""
    values, problems = read_parameter_set(content, name), []
    for value in values:
        instance, dot, variable = value.name.partition(".")
        found = []
        try:
            if not dot:
                found = [f"{value.name!r} is not of the form instance.variable"]
            else:
                loaded.system.check_settable(value.name)
                loaded.system.fmus[instance].start_values({variable: value.text})
                found = unit_problems(loaded.system, value.name, value.unit)
        except ModelError as error:
            found = error.problems
        problems += [f"{name}, line {value.line}: {problem}" for problem in found]
    return values, problems
