"""Tries whether a file can be coupled, run, tuned, put behind a shaper or built, as the commands do before they begin to run.

Each function returns the reasons why not, in the words of the functions that the commands call; none means that it can. No FMU is
loaded: whether it runs well shows only when it runs.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from pathlib import Path, PurePosixPath
from urllib.parse import quote
from xml.sax.saxutils import quoteattr

from shaper_fmu.archives import read_file
from shaper_fmu.container.obstacles import obstacles
from shaper_fmu.errors import ModelError, ShaperFmuError
from shaper_fmu.master.alone import ALONE, alone_system
from shaper_fmu.master.fmu import Fmu, load_fmu
from shaper_fmu.master.system import System
from shaper_fmu.master.variables import kind_of
from shaper_fmu.registry import components
from shaper_fmu.ssp.archive import fmu_origin, folder_files, lacking_fmus, load_ssp
from shaper_fmu.ssp.check import file_findings
from shaper_fmu.ssp.names import DESCRIPTION, FMU_TYPE, PREFIXES
from shaper_fmu.ssp.own_fmus import own_fmus
from shaper_fmu.ssp.packing import connector_variables
from shaper_fmu.ssp.template import check_ports
from shaper_fmu.tune.plant import Plant

_FMI = 2
"""Version of FMI that `pack` writes when none is asked for."""
_SYSTEM = (
    f'<ssd:SystemStructureDescription xmlns:ssd="{PREFIXES["ssd"]}" version="1.0" name="system"><ssd:System name="system">'
    f'<ssd:Elements><ssd:Component name="{ALONE}" type="{FMU_TYPE}" source={{}}/></ssd:Elements></ssd:System>'
    "</ssd:SystemStructureDescription>"
)
"""A system of one FMU."""


def fmu_in_a_system(path: Path) -> list[str]:
    """Why a system with this FMU cannot be run."""

    def attempt() -> list[str]:
        inside = f"resources/{path.name}"
        files = {DESCRIPTION: _SYSTEM.format(quoteattr(quote(inside))).encode(), inside: read_file(path)}
        texts = [finding.message for finding in file_findings(files) if finding.stops]
        return [text.removeprefix(f"component {ALONE!r}").removeprefix(": ") for text in texts]

    return _reasons(attempt)


def fmu_as_plant(path: Path) -> tuple[list[str], str]:
    """Why an FMU cannot be tuned alone, and the name of an input that could get the commands."""
    found = [""]

    def attempt() -> list[str]:
        problems, name = _driven(alone_system(load_fmu(path), {}))
        found[0] = name.removeprefix(f"{ALONE}.")
        return problems or fmu_in_a_system(path)

    return _reasons(attempt), found[0]


def fmu_behind_a_shaper(path: Path) -> list[str]:
    """Why `new system` refuses an FMU, whatever input and output are named."""

    def attempt() -> list[str]:
        fmu = load_fmu(path)
        names = [_first_real(fmu, causality) for causality in ("input", "output")]
        missing = [f"it has no {what} of real numbers" for what, name in zip(("input", "output"), names, strict=True) if not name]
        if missing:
            return missing
        check_ports(fmu, *names)
        System().add(ALONE, fmu)
        return []

    return _reasons(attempt)


def system_run(path: Path, variant: str | None, stops: Sequence[str]) -> tuple[list[str], bool]:
    """Why an archive cannot be run, and whether it tells how long and in which steps; `stops` are findings that stop a run."""
    timed = [True]

    def attempt() -> list[str]:
        if path.is_dir() and lacking_fmus(path, folder_files(path)):
            return _not_there(path)  # `run` builds them first, which is too much work to look
        loaded = load_ssp(path, variant)
        problems = [*stops, *loaded.system.check()]
        timed[0] = bool(problems) or None not in (loaded.structure.stop_time, loaded.structure.step_size)
        return problems

    return _reasons(attempt), timed[0]


def system_pack(path: Path, variant: str | None) -> list[str]:
    """Why an archive cannot be packed into one FMU."""

    def attempt() -> list[str]:
        loaded = load_ssp(path, variant)

        def shown() -> list[str]:
            connector_variables(loaded, _FMI)
            return []

        return [*loaded.system.check(), *obstacles(loaded.system, _FMI), *_reasons(shown)]

    return _reasons(attempt)


def fmu_in_a_container(path: Path) -> list[str]:
    """Why no system with this FMU can be packed into one FMU."""

    def attempt() -> list[str]:
        system = alone_system(load_fmu(path), {})
        return [text.removeprefix(f"{ALONE}: ") for text in obstacles(system, _FMI)]

    return _reasons(attempt)


def fmu_wrapped(path: Path) -> tuple[list[str], str]:
    """Why no input of an FMU can be shaped in place, and the name of one that could be."""
    found = [""]

    def attempt() -> list[str]:
        fmu = load_fmu(path)
        problems = fmu_in_a_container(path)
        found[0] = _first_real(fmu, "input")
        return problems if problems or found[0] else ["it has no input of real numbers"]

    return _reasons(attempt), found[0]


def system_as_plant(path: Path, stops: Sequence[str]) -> tuple[list[str], str]:
    """Why an archive cannot be tuned, and the name of an input that could get the commands."""
    found = [""]

    def attempt() -> list[str]:
        problems, found[0] = _driven(load_ssp(path).system)
        return problems or list(stops)

    return _reasons(attempt), found[0]


def _not_there(folder: Path) -> list[str]:
    """The FMUs that a folder lacks, and that are neither in ./fmus nor components of ours."""
    own, known = own_fmus(folder), components()
    return [
        f"component {component!r} needs {PurePosixPath(source).name}, which is not there"
        for source, component in lacking_fmus(folder, folder_files(folder)).items()
        if fmu_origin(source, Path("fmus"), own) is None and PurePosixPath(source).stem not in known
    ]


def folder_build(folder: Path, fmus: Path) -> list[str]:
    """Why a folder cannot be built into an archive with the FMUs in `fmus`."""

    def attempt() -> list[str]:
        lacking = lacking_fmus(folder, folder_files(folder))
        own = own_fmus(folder)
        absent = [source for source in lacking if fmu_origin(source, fmus, own) is None]
        return [f"{fmus / Path(source).name} is not there; run 'shaper-fmu build' first" for source in absent]

    return _reasons(attempt)


def _reasons(attempt: Callable[[], list[str]]) -> list[str]:
    try:
        found = attempt()
    except ModelError as error:
        found = error.problems
    except ShaperFmuError as error:
        found = str(error).splitlines()
    return list(dict.fromkeys(" ".join(text.split()) for text in found))


def _driven(system: System) -> tuple[list[str], str]:
    """Why no free input of a system can be a plant's; else the first that can."""
    fed = {*system.connections, *system.signals}
    free = [
        (f"{instance}.{name}", kind_of(variable) == "real")
        for instance, fmu in system.fmus.items()
        for name, variable in fmu.variables.items()
        if variable.causality == "input" and (instance, name) not in fed
    ]
    if not free:
        return ["it has no free input, which commands could drive"], ""
    name = next((name for name, real in free if real), free[0][0])
    try:
        Plant(system, name)
    except ModelError as error:
        return error.problems, ""
    return [], name


def _first_real(fmu: Fmu, causality: str) -> str:
    return next((name for name, v in fmu.variables.items() if v.causality == causality and kind_of(v) == "real"), "")
