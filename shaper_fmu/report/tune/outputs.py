"""Writes the files of a tuning: the shaper as an FMU and a parameter set, the shaped plant as an archive, report, numbers."""

from __future__ import annotations

import json
import math
import re
from collections.abc import Callable, Mapping, Sequence
from pathlib import Path
from typing import TYPE_CHECKING, Any

from shaper_fmu.archives import write_file
from shaper_fmu.container.wrap import other_starts, wrap
from shaper_fmu.errors import BuildError, ModelError, ShaperFmuError
from shaper_fmu.export.build import fmu_path
from shaper_fmu.export.native.toolchain import has_toolchain
from shaper_fmu.export.start_values import with_start_values
from shaper_fmu.master.system import System
from shaper_fmu.registry import find_component
from shaper_fmu.ssp.export import parameter_set, write_system
from shaper_fmu.ssp.template import OUTPUTS, PROFILE, rounded_step
from shaper_fmu.ssp.write import write_parameter_set
from shaper_fmu.tune.choice.boxes import ModeBox
from shaper_fmu.tune.plant import SHAPER, Plant
from shaper_fmu.tune.tuning import Say, Tuning
from shaper_fmu.tune.tuning_inputs import InputsTuning
from shaper_fmu.tune.tuning_json import write_json
from shaper_fmu.tune.verification.command import Command, even_width
from shaper_fmu.tune.verification.move import MoveCommand

if TYPE_CHECKING:
    from shaper_fmu.page.blocks import Block

_PLAIN = "InputShaper.fmu"
REPORT, NUMBERS, PARAMETERS, MOVE, ARCHIVE = "report.html", "tuning.json", "shaper.ssv", "move.ssv", "shaped_plant.ssp"
Panel = Callable[[Tuning], Sequence["Block"]]
"""Makes the live panel of the report, such as `shaper_fmu.live.tuning_panel`."""
_STEPS, _PERIODS = 200, 5.0
_ABRUPT = 0.01
"""Duration of the reference's move, in periods of the fastest mode: nearly a step, as in the verification."""


def write_tuning(
    tuning: Tuning, folder: Path | str, *, report: bool = True, say: Say = lambda _: None, panel: Panel = lambda _: []
) -> list[Path]:
    """Write all files of a tuning into a folder; returns the paths.

    tuning.json and, with `report`, report.html and its pictures are always written; the shaper's FMU and shaper.ssv where
    there is a recommendation, shaped_plant.ssp where there is a plant, too, and an archive can hold it, and <plant>_shaped.fmu,
    which takes the plant's place, where that is an FMU that a container can run (else `say` tells why).
    `panel` makes the live panel of the report; `shaper_fmu.live.tuning_panel` does.
    With a verdict that is not good each of these files begins its description with `Tuning.caveat`.
    Raises ShaperFmuError if something cannot be written.
    """
    folder = Path(folder)
    folder.mkdir(parents=True, exist_ok=True)
    written = []
    if tuning.choice is not None and tuning.choice.recommended is not None:
        say("writing the shaper and the system")
        written += _write_move(tuning, folder) + _write_shaper(tuning, folder, say)
        written += _write_plant(tuning, folder, say)
    written.append(write_json(folder / NUMBERS, tuning))
    if report:
        say("writing the report")
        written += _write_report(tuning, folder, panel(tuning))
    return written


def folder_for(tuning: Tuning | InputsTuning, folder: Path) -> Path:
    """The folder, or a new one beside it where it has something that this tuning must not replace.

    That is the tuning of another file or input, and a good one if this one is not.
    """
    found, number = folder, 1
    while _keeps(found, tuning):
        number += 1
        found = folder.with_name(f"{folder.name}_{number}")
    return found


def _keeps(folder: Path, tuning: Tuning | InputsTuning) -> bool:
    try:
        known = json.loads((folder / NUMBERS).read_bytes())
        other = (known["source"], known["input"] or "") != (tuning.source, tuning.input)
        return other or bool(known["good"] and not tuning.good)
    except (OSError, ValueError, KeyError, TypeError):
        return False  # there is none, or nothing that can be read


def left_over(tuning: Tuning, folder: Path, written: Sequence[Path]) -> list[Path]:
    """Files of a shaper that an earlier tuning of the same plant has left in the folder, and this one has not written."""
    fmus = (f"{_name(tuning)}.fmu", _PLAIN, f"{_name(tuning, 'MotionProfile')}.fmu", _shaped_name(tuning))
    names = (*fmus, PARAMETERS, MOVE, ARCHIVE)
    return [path for path in (folder / name for name in names) if path.is_file() and path not in written]


def shaped_system(tuning: Tuning) -> System:
    """The plant behind the recommended shaper, and a reference like the command of the verification.

    It is a short move. Its position goes to the input for a step; its velocity for a pulse, and where the input is a velocity; its
    acceleration for a doublet, and where the input is an acceleration. Pulse and doublet leave a rigid body at rest.
    """
    plant, candidate = tuning.system, tuning.candidate
    if plant is None or candidate is None:
        raise ShaperFmuError(f"{tuning.source}: there is no plant, or no shaper for it, so that no system can be written")
    command = tuning.command
    if isinstance(command, MoveCommand):
        return command.shown(plant, candidate)[1].system
    system = plant.behind(candidate.start_values(), command.rest, _shaper(tuning), output="shaped_mean")
    order, duration, distance = command_of(command, plant, _boxes(tuning))
    profile = plant.free_name(PROFILE)
    system.add(profile, fmu_path("MotionProfile"), distance=distance, duration=duration, start_time=command.start)
    system.connect(f"{profile}.{OUTPUTS[order]}", f"{plant.shaper}.command", offset=command.rest)
    return system


def _reference(tuning: Tuning, plant: Plant) -> tuple[int, float]:
    """Which of a move's position (0), velocity and acceleration (2) goes to the input, and the move's duration [s]."""
    if isinstance(tuning.command, MoveCommand):
        assert tuning.candidate is not None
        assert tuning.candidate.profile is not None
        return tuning.command.order, tuning.candidate.profile.duration
    return command_of(tuning.command, plant, _boxes(tuning))[:2]


def command_of(command: Command, plant: Plant, boxes: Sequence[ModeBox]) -> tuple[int, float, float]:
    """The move that is like a command: which of its outputs goes to the input, its duration [s] and its distance."""
    order = max(command.integrators, plant.input_order)
    if order == 0:
        duration = _ABRUPT * 2.0 * math.pi / max(box.natural_frequency.nominal for box in boxes)
    else:
        duration = order * (command.width or even_width(boxes))
    peak = (1.0, 2.0 / duration, 2.0 * math.pi / duration**2)[order]  # of a cycloid over a distance of 1
    return order, duration, command.amplitude / peak


def _write_move(tuning: Tuning, folder: Path) -> list[Path]:
    """The MotionProfile of a move, and its parameters."""
    assert tuning.candidate is not None
    law = tuning.candidate.profile
    if law is None:
        return []
    source, values = find_component("MotionProfile"), law.start_values()
    if has_toolchain():
        source = with_start_values(source, values, _name(tuning, "MotionProfile"), note=tuning.caveat)
    fmu = fmu_path(source)
    return [write_file(folder / fmu.name, fmu.read_bytes()), _write_parameters(folder / MOVE, fmu, values, tuning.caveat)]


def _write_parameters(path: Path, source: Path, values: Mapping[str, Any], caveat: str) -> Path:
    """Start values of an FMU as a parameter set."""
    alone = System()
    alone.add(SHAPER, source)
    numbers = parameter_set(alone, {f"{SHAPER}.{name}": value for name, value in values.items()}, "tuned")
    for parameter in numbers.parameters:
        parameter.name = parameter.name.removeprefix(f"{SHAPER}.")
    numbers.description = caveat or None
    return write_file(path, write_parameter_set(numbers))


def _write_shaper(tuning: Tuning, folder: Path, say: Say) -> list[Path]:
    candidate = tuning.candidate
    assert candidate is not None
    written = []
    if candidate.profile is None or candidate.design.factors:
        source = _shaper(tuning)
        if is_plain(source):
            say(f"note: there is no compiler (pip install 'shaper-fmu[native]'), so that {_plain_words(source)}")
        written = [
            write_file(folder / source.name, source.read_bytes()),
            _write_parameters(folder / PARAMETERS, source, candidate.start_values(), tuning.caveat),
        ]
    if tuning.system is not None:
        try:
            written.append(_write_system(tuning, folder))
        except ModelError as error:  # what was found is not lost for what an archive cannot hold
            say(f"the shaped plant cannot be an archive: {error}")
    return written


def _write_system(tuning: Tuning, folder: Path) -> Path:
    system, boxes = shaped_system(tuning), _boxes(tuning)
    assert tuning.candidate is not None
    slowest = 2.0 * math.pi / min(box.natural_frequency.nominal for box in boxes)
    fastest = 2.0 * math.pi / max(box.natural_frequency.nominal for box in boxes)
    step = rounded_step(fastest / _STEPS)
    assert tuning.system is not None
    end = tuning.command.start + _reference(tuning, tuning.system)[1] + tuning.candidate.delay
    stop_time = step * math.ceil((end + _PERIODS * slowest) / step)
    caveat = f"{tuning.caveat}. " if tuning.caveat else ""
    more = {}
    if tuning.system.shaper in system.fmus:
        unshaped = parameter_set(system, {f"{tuning.system.shaper}.shaper": "none"}, "unshaped")
        more = {"parameter_sets/unshaped.ssv": write_parameter_set(unshaped)}
    by = "behind the shaper" if tuning.candidate.profile is None else "moved by"
    return write_system(
        system,
        folder / ARCHIVE,
        stop_time=stop_time,
        step=step,
        description=f"{caveat}{tuning.source} {by} {tuning.candidate.name}; look at {', '.join(tuning.outputs)}.",
        more=more,
    )


def _write_plant(tuning: Tuning, folder: Path, say: Say) -> list[Path]:
    """The plant's FMU with the input shaped."""
    plant, candidate = tuning.system, tuning.candidate
    if plant is None or candidate is None or not plant.alone or candidate.profile is not None:
        return []
    (fmu,) = plant.fmus.values()
    caveat = f"{tuning.caveat}. " if tuning.caveat else ""
    for note in other_starts(fmu, plant.settings):
        say(f"note: {note}")
    words = f"{caveat}{fmu.name} with {tuning.input} shaped by {candidate.name}."
    try:
        return [wrap(fmu, [tuning.input], folder / _shaped_name(tuning), candidate.start_values(), description=words).path]
    except (ModelError, BuildError) as error:
        say(f"the plant cannot be shaped in place: {' '.join(str(error).split())}")
        return []


def _shaped_name(tuning: Tuning) -> str:
    return f"{Path(tuning.source).stem}_shaped.fmu"


def _shaper(tuning: Tuning) -> Path:
    """An InputShaper FMU that begins as the recommended shaper; without a compiler the plain one, which needs the parameters."""
    assert tuning.candidate is not None
    component = find_component("InputShaper")
    if has_toolchain():
        component = with_start_values(component, tuning.candidate.start_values(), _name(tuning), note=tuning.caveat)
    return fmu_path(component)


def is_plain(path: Path) -> bool:
    """Whether an FMU of a tuning is the plain InputShaper, which does not begin as the recommended shaper."""
    return path.name == _PLAIN


def _plain_words(path: Path) -> str:
    return f"{path.name} is the plain one: it begins with its own start values, and needs those in {PARAMETERS}"


def _name(tuning: Tuning, component: str = "InputShaper") -> str:
    plant = re.sub(r"\W+", "_", Path(tuning.source).stem, flags=re.ASCII).strip("_")
    return f"{component}_{plant or 'tuned'}"


def _boxes(tuning: Tuning) -> tuple[ModeBox, ...]:
    assert tuning.choice is not None
    return tuning.choice.boxes


def _write_report(tuning: Tuning, folder: Path, panel: Sequence[Block]) -> list[Path]:
    from shaper_fmu.page.blocks import write_report
    from shaper_fmu.report.tune.report import tuning_blocks

    title = f"Tuning of {tuning.source}" + (f": {tuning.input} to {', '.join(tuning.outputs)}" if tuning.input else "")
    system = shaped_system(tuning) if tuning.system is not None and tuning.good and tuning.candidate is not None else None
    return write_report(folder / REPORT, title, tuning_blocks(tuning, system, panel))
