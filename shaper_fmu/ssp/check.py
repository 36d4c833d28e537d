"""Checking SSP archives: the standard's schemas, and what they cannot see. Every problem at once, with file and line.

What is checked, and its words, is listed in docs/checking.md.
"""

from __future__ import annotations

from collections.abc import Mapping
from pathlib import Path, PurePosixPath

from shaper_fmu.archives import read_archive, read_file
from shaper_fmu.errors import ArchiveError, ModelError
from shaper_fmu.master.simulation import number_of_steps
from shaper_fmu.master.system import System
from shaper_fmu.ssp.annotations import run_settings
from shaper_fmu.ssp.archive import SETS, load_ssp, variants
from shaper_fmu.ssp.check_connections import check_connections
from shaper_fmu.ssp.check_dictionaries import check_dictionaries
from shaper_fmu.ssp.check_loops import check_loops
from shaper_fmu.ssp.check_parameters import check_parameters, check_whole_set
from shaper_fmu.ssp.check_scene import Scene, check_declarations, read_validated
from shaper_fmu.ssp.check_structure import OF_DESCRIPTION, check_elements
from shaper_fmu.ssp.document import SystemDescription
from shaper_fmu.ssp.names import DESCRIPTION
from shaper_fmu.ssp.read import read_description, read_dictionary, read_mapping, read_parameter_set

_READERS = {".ssv": read_parameter_set, ".ssm": read_mapping, ".ssb": read_dictionary}
Told = tuple[str, int, str]


def check_ssp(path: Path | str) -> list[str]:
    """Every problem of an archive, "file, line N: words", by file and line; empty if there is none.

    An archive that cannot be read at all, or is hostile, has the one problem that says so.
    """
    path = Path(path)
    try:
        files = read_archive(read_file(path), path.name)
        problems = check_files(files)
        if all(OF_DESCRIPTION in problem for problem in problems):  # else what stops it is told already
            problems += [problem for name in variants(files) for problem in _load_problems(path, name)]
        return problems
    except ArchiveError as error:
        return [str(error)]


def _load_problems(path: Path, variant: str) -> list[str]:
    """What stops a description that seems right from being run by our master."""
    try:
        loaded = load_ssp(path, variant)
        start, stop, step = loaded.structure.start_time or 0.0, loaded.structure.stop_time, loaded.structure.step_size
        told = loaded.system.check()
        return told + (_time_problems(loaded.system, start, stop, step) if stop is not None and step is not None else [])
    except ModelError as error:
        return error.problems


def check_files(files: Mapping[str, bytes]) -> list[str]:
    """Every problem of the files of an archive."""
    descriptions = sorted(
        (name for name in files if PurePosixPath(name).suffix == ".ssd"), key=lambda name: (name != DESCRIPTION, name)
    )
    if DESCRIPTION not in descriptions:
        found = f"; it has {', '.join(descriptions)}" if descriptions else ", so this is not an SSP archive"
        return [f"no {DESCRIPTION}{found}"]
    told: list[Told] = []
    for name in descriptions:
        told += _check_description(files, name)
    for name in sorted(files):  # what no description refers to
        reader = _READERS.get(PurePosixPath(name).suffix)
        if reader is not None:
            told += read_validated(files[name], name, reader).told
    order = {name: place for place, name in enumerate([*descriptions, *sorted(set(files) - set(descriptions))])}
    unique = sorted(dict.fromkeys(told), key=lambda item: (order.get(item[0], len(order)), item[1]))
    return [f"{file}, line {line}: {words}" if line else f"{file}: {words}" for file, line, words in unique]


def _check_description(files: Mapping[str, bytes], name: str) -> list[Told]:
    found = read_validated(files[name], name, read_description)
    description = found.document
    if not isinstance(description, SystemDescription):
        return found.told
    scene = Scene(files, description, name, list(found.told), set(found.lost))
    check_declarations(scene, description, name)
    _check_experiment(scene)
    fmus = check_elements(scene)
    directed = check_connections(scene, fmus)
    check_dictionaries(scene, directed)
    check_loops(scene, fmus, directed)
    check_parameters(scene, fmus)
    if name == DESCRIPTION:
        for path in sorted(path for path in files if path.startswith(SETS) and path.endswith(".ssv")):
            check_whole_set(scene, fmus, path)
    return scene.told


def _check_experiment(scene: Scene) -> None:
    description = scene.description
    experiment = description.experiment
    start, stop = description.start_time or 0.0, description.stop_time
    if experiment is not None and stop is not None and not stop > start:
        scene.tell(experiment.line, f"default experiment: stopTime = {stop:g} s is not after startTime = {start:g} s")
    for annotation in description.all_annotations():
        try:
            run_settings([annotation.xml])
        except ModelError as error:
            for problem in error.problems:
                scene.tell(annotation.line, problem)
            return
    step = description.step_size
    if experiment is not None and stop is not None and step is not None and stop > start:
        for problem in _time_problems(System(), start, stop, step):
            scene.tell(experiment.line, problem)


def _time_problems(system: System, start: float, stop: float, step: float) -> list[str]:
    """Why the system cannot be run from start to stop in these steps [s]; one without FMUs takes steps of any size."""
    try:
        number_of_steps(system, start, stop, step)
    except ModelError as error:
        return [f"default experiment: {problem}" for problem in error.problems]
    return []
