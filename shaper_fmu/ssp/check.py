"""Checks SSP archives: reports the findings of reading them, and those of a run, with file and line.

docs/checking.md lists the checks.
"""

from __future__ import annotations

import contextlib
from collections.abc import Mapping
from pathlib import Path, PurePosixPath

import fmpy

from shaper_fmu.archives import read_archive, read_file
from shaper_fmu.errors import ArchiveError, ModelError
from shaper_fmu.master.fmu import Fmu
from shaper_fmu.master.run_options import number_of_steps
from shaper_fmu.master.system import System
from shaper_fmu.ssp.annotations import run_settings
from shaper_fmu.ssp.archive import variants
from shaper_fmu.ssp.document import Component, SystemDescription
from shaper_fmu.ssp.files import Files
from shaper_fmu.ssp.findings import Finding, Findings, Weight
from shaper_fmu.ssp.loaded import SspSystem
from shaper_fmu.ssp.loops import check_loops
from shaper_fmu.ssp.names import DESCRIPTION, SETS
from shaper_fmu.ssp.parameter_sets import check_parameter_sets
from shaper_fmu.ssp.read import read_dictionary, read_mapping, read_parameter_set
from shaper_fmu.ssp.resolve import Resolved, resolve

_READERS = {".ssv": read_parameter_set, ".ssm": read_mapping, ".ssb": read_dictionary}


def check_ssp(path: Path | str) -> list[str]:
    """The problems of an archive as "file, line N: message", by file and line; empty if there are none.

    An archive that cannot be read at all, or is hostile, has one problem, the reason.
    """
    return [str(finding) for finding in ssp_findings(path)]


def ssp_findings(path: Path | str) -> list[Finding]:
    """Every problem of an archive, with what follows from it."""
    path = Path(path)
    try:
        return file_findings(read_archive(read_file(path), path.name))
    except ArchiveError as error:
        return [Finding("", 0, str(error), Weight.LOAD)]


def check_files(files: Mapping[str, bytes]) -> list[str]:
    """Every problem of the files of an archive."""
    return [str(finding) for finding in file_findings(files)]


def file_findings(files: Mapping[str, bytes]) -> list[Finding]:
    """Every problem of the files of an archive, with what follows from it: the variants, and what none of them refers to."""
    descriptions = sorted(
        (name for name in files if PurePosixPath(name).suffix == ".ssd"), key=lambda name: (name != DESCRIPTION, name)
    )
    if DESCRIPTION not in files:
        found = f"; it has {', '.join(descriptions)}" if descriptions else ", so this is not an SSP archive"
        return [Finding("", 0, f"no {DESCRIPTION}{found}", Weight.LOAD)]
    reported, seen = Findings(), set()
    for name in [*variants(files), *descriptions]:
        if name not in seen:
            own = check_description(files, name)
            seen |= own.seen.keys()
            reported.add(own.findings, Weight.LOAD if "/" not in name else Weight.DEVIATION)
    rest = Files(files, Findings())
    for name in sorted(files.keys() - seen):
        reader = _READERS.get(PurePosixPath(name).suffix)
        if reader is not None:
            rest.read(name, reader)
    reported.add(rest.findings, Weight.DEVIATION)
    order = {name: place for place, name in enumerate([*descriptions, *sorted(set(files) - set(descriptions))])}
    return sorted(reported, key=lambda one: (order.get(one.file, len(order)), one.line))


def check_description(files: Mapping[str, bytes], name: str) -> Files:
    """The findings of a description and everything that it refers to, in an archive with these files."""
    own, found = resolve(files, name)
    if found is not None:
        _check_experiment(found.structure, name, own.findings)
        _check_fmus(found)
        check_loops(found.network)
        if name == DESCRIPTION:
            _check_sets(found)
        if not own.findings.texts(Weight.LOAD):
            _check_run(found)
    return own


def _check_experiment(description: SystemDescription, file: str, findings: Findings) -> None:
    experiment = description.experiment
    start, stop = description.start_time or 0.0, description.stop_time
    if experiment is not None and stop is not None and not stop > start:
        message = f"default experiment: stopTime = {stop:g} s is not after startTime = {start:g} s"
        findings.report(file, experiment.line, message, Weight.RUN if stop < start else Weight.DEVIATION)
    for annotation in description.all_annotations():
        try:
            run_settings([annotation.xml])
        except ModelError as error:
            for problem in error.problems:
                findings.report(file, annotation.line, problem, Weight.RUN)
            return
    step = description.step_size
    if experiment is not None and stop is not None and step is not None and stop > start:
        for problem in _time_problems(System(), start, stop, step):
            findings.report(file, experiment.line, problem, Weight.RUN)


def _time_problems(system: System, start: float, stop: float, step: float) -> list[str]:
    """Why the system cannot be run from start to stop in these steps [s]; one without FMUs takes steps of any size."""
    try:
        number_of_steps(system, start, stop, step)
    except ModelError as error:
        return [f"default experiment: {problem}" for problem in error.problems]
    return []


def _check_fmus(found: Resolved) -> None:
    """Faults of FMUs that do not prevent reading them."""
    for path, fmu in found.network.fmus.items():
        place = found.network.places[path]
        assert isinstance(place.element, Component)
        what = f"component {place.element.name!r}"
        for finding in fmu.findings:
            place.scope.report(place.element.line, f"{what}: {fmu.name}: modelDescription.xml: {finding}", Weight.DEVIATION)
        for problem in _library_problems(fmu):
            place.scope.report(place.element.line, f"{what}: {fmu.name}{problem}", Weight.RUN)


def _library_problems(fmu: Fmu) -> list[str]:
    """Problems of the FMU's libraries for this machine."""
    folder, name = (fmpy.platform_tuple if fmu.version == 3 else fmpy.platform), fmu.capabilities.modelIdentifier
    binaries = fmu.folder / "binaries"
    if (binaries / folder / f"{name}{fmpy.sharedLibraryExtension}").is_file():
        return [f": {problem}" for problem in fmu.library_problems(binaries / folder)]
    others = sorted({path.parent.name for path in binaries.glob("*/*")})
    return [f" has no library for this machine ({folder}); it has {', '.join(others) or 'none at all'}"]


def _check_sets(found: Resolved) -> None:
    """The sets in parameter_sets/, which are for the whole system and applied on demand: a run with one of them is refused."""
    sets = {name.removeprefix(SETS): content for name, content in found.files.content.items() if name.startswith(SETS)}
    reported = Findings()
    loaded = SspSystem(found.system, found.structure, "", sets, network=found.network, instances=found.instances)
    check_parameter_sets(loaded, reported)
    found.findings.add(reported, Weight.RUN)
    found.files.seen.update({f"{SETS}{name}": None for name in sets})


def _check_run(found: Resolved) -> None:
    """Problems that prevent our master from running the whole system."""
    reported, structure = found.system.check(), found.structure
    with contextlib.suppress(ModelError):  # of an annotation, which is reported
        start, stop, step = structure.start_time or 0.0, structure.stop_time, structure.step_size
        if stop is not None and step is not None and stop > start:
            reported += _time_problems(found.system, start, stop, step)
    known = {finding.message for finding in found.findings}
    for problem in reported:
        if problem not in known:
            found.findings.report("", 0, problem, Weight.RUN)
