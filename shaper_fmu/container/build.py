"""Packs a system of FMUs into one FMU: its description, the container's library, and the FMUs in its resources."""

from __future__ import annotations

import copy
import re
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, replace
from pathlib import Path

from shaper_fmu.archives import write_archive
from shaper_fmu.container.description2 import description2
from shaper_fmu.container.description3 import description3
from shaper_fmu.container.head import Capabilities, Experiment, Head
from shaper_fmu.container.library import container_library
from shaper_fmu.container.obstacles import obstacles
from shaper_fmu.container.outside import OuterVariable
from shaper_fmu.container.page import container_page
from shaper_fmu.container.planned import PlannedInstance, Symbols
from shaper_fmu.container.platforms import common_platforms, library_folders, platforms_of
from shaper_fmu.container.routes import outer_outputs, steered
from shaper_fmu.container.serialize import Identity, system_file
from shaper_fmu.errors import ModelError
from shaper_fmu.export.native.toolchain import PLATFORMS, Platform, platform_named
from shaper_fmu.export.packing import content_guid, licences
from shaper_fmu.master import layout as of
from shaper_fmu.master.algorithms import Algorithm
from shaper_fmu.master.clocks import has_clocks
from shaper_fmu.master.events import MEAN, Treatment, treat_events
from shaper_fmu.master.program import Program
from shaper_fmu.master.run_options import Times, set_up
from shaper_fmu.master.structure import SystemStructure
from shaper_fmu.master.variables import TRANSFERABLE, kind_of

_DESCRIPTIONS = {2: description2, 3: description3}
_INSIDE = "resources/container"


@dataclass(frozen=True)
class Packed:
    """What has been packed.

    Attributes:
        path: of the FMU.
        platforms: that it has a library for.
        left_out: platforms that one of the FMUs inside has, but not all.
        notes: what people should know of how it is run.
    """

    path: Path
    platforms: tuple[str, ...]
    left_out: tuple[str, ...]
    notes: tuple[str, ...]


def pack(
    system: SystemStructure,
    variables: Sequence[OuterVariable],
    path: Path | str,
    *,
    fmi: int = 2,
    name: str | None = None,
    description: str = "",
    step: float | None = None,
    algorithm: Algorithm = "jacobi",
    exact: bool | None = None,
    platforms: Sequence[str] = (),
    experiment: Experiment | None = None,
    time: str | None = None,
    own_tolerances: bool = True,
    progress: Callable[[str], None] = lambda what: None,
) -> Packed:
    """Write a system as one FMU of FMI 2.0 or 3.0, which shows these variables (see interface.py and ssp/packing.py).

    Args:
        system: what is inside; it is not changed.
        variables: what the FMU shows.
        path: the FMU's; its folder is made if it is missing.
        fmi: 2 or 3.
        name: of the model, from which that of the library is made; default: the file's.
        description: one sentence for the FMU's description.
        step: the longest communication step inside [s]; the host's steps are divided where they are longer. None: the host's.
        algorithm: how values move inside (see algorithms.py).
        exact: whether steps inside end at events; by default where the FMUs allow it (see `treat_events`).
        platforms: names such as "x86_64-windows", or "this"; default: all that every FMU inside has a library for.
        experiment: the default experiment.
        time: name of the independent variable, if FMI 2.0 is to show one.
        own_tolerances: whether FMUs get the tolerance of their own default experiment from a host that gives none, as in a run.
        progress: told what is being done.

    Raises ModelError with everything that stands against it, and BuildError; then no file is written or changed.
    """
    path = Path(path)
    problems = [*system.check(), *obstacles(system, fmi)]
    if not variables:
        problems.append("the system has no free input and no output, so there is nothing to show")
    if path.suffix.lower() != ".fmu":
        problems.append(f"{path.name}: the name of an FMU ends in .fmu")
    if step is not None and not step > 0.0:
        problems.append(f"step = {step} s must be positive")
    if problems:
        raise ModelError(problems)
    chosen, left_out = _platforms(system, platforms)
    treatment = treat_events(system, exact)
    inside = _with_inputs(system, variables)
    program, control = _program(inside, variables, treatment, algorithm)
    if not own_tolerances:
        program.layout.instances["tolerance"] = 0.0
    model = name or path.stem
    head = Head(
        name=model,
        identifier=_identifier(model),
        token="",
        description=description,
        experiment=experiment or Experiment(step=step),
        capabilities=_capabilities(program, variables, fmi, treatment.exact),
        time=time,
    )
    folders = _folders(system)
    files = _inner_files(system, folders, chosen)
    notes = (*_event_notes(system, treatment), *_tool_notes(system))
    page = container_page(model, description, system, variables, folders, notes, treatment.exact)
    files["documentation/index.html"] = page.encode()
    files |= licences("shaper-fmu")
    for platform in chosen:
        progress(f"{model}: {platform.name}")
        folder = platform.fmi2_folder if fmi == 2 else platform.fmi3_folder
        files[f"binaries/{folder}/{head.identifier}{platform.suffix}"] = container_library(fmi, platform)

    def complete(token: str) -> dict[str, bytes]:
        able = head.capabilities
        identity = Identity(model, token, step or 0.0, able.can_save_states, able.can_serialize)
        return {
            **files,
            "modelDescription.xml": _DESCRIPTIONS[fmi](inside, variables, replace(head, token=token)),
            f"{_INSIDE}/system.bin": system_file(identity, program, control, folders, variables),
        }

    progress(f"{model}: description")
    token = content_guid(complete(""))
    written = write_archive(path, complete(token))
    return Packed(written, tuple(platform.name for platform in chosen), left_out, notes)


def _event_notes(system: SystemStructure, treatment: Treatment) -> list[str]:
    """What is to be known of events, and what to do where a mean over the step keeps them on the grid."""
    means = [".".join(source) for source in system.connections.values() if source[1].endswith(MEAN)]
    if treatment.exact or not means or not treatment.notes or "mean over it" not in treatment.notes[0]:
        return list(treatment.notes)
    return [f"{treatment.notes[0]}; connect {means[0].removesuffix(MEAN)} instead to have them exact", *treatment.notes[1:]]


def needing_tools(system: SystemStructure) -> list[str]:
    """The instances whose FMUs need a tool where they run; pythonfmu's need Python and what they import."""
    return [name for name, fmu in system.fmus.items() if getattr(fmu.capabilities, "needsExecutionTool", False)]


def _tool_notes(system: SystemStructure) -> list[str]:
    return [
        f"{name}: {system.fmus[name].name} needs a tool where the container runs (needsExecutionTool): {tool}"
        for name in needing_tools(system)
        for tool in [system.fmus[name].description.generationTool or "its description does not name it"]
    ]


def _identifier(model: str) -> str:
    """A name for the library that C and all systems take."""
    found = re.sub(r"[^A-Za-z0-9_]", "_", model)
    return found if re.match("[A-Za-z_]", found) else f"_{found}"


def _platforms(system: SystemStructure, wanted: Sequence[str]) -> tuple[list[Platform], tuple[str, ...]]:
    """The platforms to build for, and those that only some of the FMUs have. Raises ModelError for one that an FMU lacks."""
    common = common_platforms(system)
    if wanted:
        names = list(dict.fromkeys(platform_named(name).name for name in wanted))
        lacking = [name for name in names if name not in common]
        if lacking:
            without = ", ".join(name for name, fmu in system.fmus.items() if lacking[0] not in platforms_of(fmu))
            raise ModelError(
                [f"not every FMU has a library for {lacking[0]} (none in {without}); all have those for {', '.join(common)}"]
            )
        return [PLATFORMS[name] for name in names], ()
    some = {name for fmu in system.fmus.values() for name in platforms_of(fmu)}
    return [PLATFORMS[name] for name in common], tuple(sorted(some - set(common)))


def _with_inputs(system: SystemStructure, variables: Sequence[OuterVariable]) -> SystemStructure:
    """The system with the outer inputs as signals from outside."""
    inside = copy.copy(system)
    inside.signals, inside.scalings, inside.mappings = dict(system.signals), dict(system.scalings), dict(system.mappings)
    for variable in variables:
        for element in variable.elements if variable.causality == "input" else ():
            for target in element:
                fmu = system.fmus[target.port[0]]
                if kind_of(fmu.variables[target.port[1]]) in TRANSFERABLE:
                    inside.signals[target.port] = _from_outside
                    inside.scalings[target.port] = (target.gain, target.offset)
                    if target.mapping:
                        inside.mappings[target.port] = dict(target.mapping)
    return inside


def _from_outside(t: float) -> float:
    """Stands for an input that the host sets."""
    raise AssertionError(t)


def _program(
    system: SystemStructure, variables: Sequence[OuterVariable], treatment: Treatment, algorithm: Algorithm
) -> tuple[Program, of.Control]:
    """The system laid out for the loop, with instances that are made later, and the state of a run at its start."""
    symbols = Symbols()
    instances = {}
    for number, (name, fmu) in enumerate(system.fmus.items()):
        event_mode = (treatment.exact or has_clocks(fmu)) and name not in system.without_event_mode
        instances[name] = PlannedInstance(number, name, fmu, event_mode, system.start_values[name], symbols)
    recorded = outer_outputs(variables, system.fmus)
    program = Program(system, instances, recorded, algorithm, treatment.connections, {}, treatment.exact, False)
    program.reset()
    control = of.Control()
    set_up(control, program, Times(0.0, 1.0, 1.0), algorithm, treatment.exact)
    control.cut = treatment.exact
    return program, control


def _capabilities(program: Program, variables: Sequence[OuterVariable], fmi: int, exact: bool) -> Capabilities:
    own = [fmu.capabilities for fmu in program.system.fmus.values()]

    def all_have(*names: str) -> bool:
        return all(any(bool(getattr(one, name, False)) for name in names) for one in own)

    inputs = [element for variable in variables if variable.causality == "input" for element in variable.elements]
    return Capabilities(
        can_save_states=all_have("canGetAndSetFMUstate", "canGetAndSetFMUState"),
        can_serialize=all_have("canSerializeFMUstate", "canSerializeFMUState"),
        only_once=any(bool(getattr(one, "canBeInstantiatedOnlyOncePerProcess", False)) for one in own),
        needs_tool=bool(needing_tools(program.system)),
        variable_steps=all(fmu.takes_any_step for fmu in program.system.fmus.values()),
        interpolates_inputs=fmi == 2 and any(steered(program, element) for element in inputs),
        has_event_mode=fmi == 3 and exact,
        readable_after_set=all(program.system.readable_after_set(name) for name in program.names),
    )


def _folders(system: SystemStructure) -> Mapping[str, str]:
    """Where each instance's FMU is below the resources; FMUs of equal content are there once."""
    known: dict[str, str] = {}
    found = {}
    for name, fmu in system.fmus.items():
        plain = re.sub(r"[^A-Za-z0-9_]", "_", Path(fmu.name).stem)
        found[name] = known.setdefault(fmu.digest, f"container/{len(known)}_{plain}")
    return found


def _inner_files(system: SystemStructure, folders: Mapping[str, str], platforms: Sequence[Platform]) -> dict[str, bytes]:
    """The files of the FMUs inside, but for libraries of other platforms."""
    files: dict[str, bytes] = {}
    for name, folder in folders.items():
        fmu = system.fmus[name]
        kept = {folder for platform in platforms for folder in library_folders(fmu, platform)}
        for path in sorted(path for path in fmu.folder.rglob("*") if path.is_file()):
            inner = path.relative_to(fmu.folder).as_posix()
            parts = inner.split("/")
            if parts[0] == "binaries" and len(parts) > 2 and parts[1] not in kept:
                continue
            files[f"resources/{folder}/{inner}"] = path.read_bytes()
    return files
