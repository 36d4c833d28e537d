"""A tuned shaper for a machine: the firmware's setting that serves the modes best, or the shaper itself in another language."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from pathlib import Path

from shaper_fmu.archives import write_file
from shaper_fmu.errors import ArgumentError, nearest
from shaper_fmu.machines.c_code import c_files
from shaper_fmu.machines.firmware import Firmware
from shaper_fmu.machines.fit import best_of, fit
from shaper_fmu.machines.klipper import KALICO, KLIPPER
from shaper_fmu.machines.marlin import MARLIN, MARLIN_FT
from shaper_fmu.machines.names import MACHINES
from shaper_fmu.machines.numbers import csv_text
from shaper_fmu.machines.prusa import PRUSA
from shaper_fmu.machines.reprapfirmware import REPRAPFIRMWARE
from shaper_fmu.machines.structured_text import structured_text
from shaper_fmu.machines.words import header, lost
from shaper_fmu.tune.choice.result import Choice
from shaper_fmu.tune.choice.search import Candidate

FIRMWARE = {one.name: one for one in (KLIPPER, KALICO, MARLIN, MARLIN_FT, REPRAPFIRMWARE, PRUSA)}


@dataclass(frozen=True)
class MachineSettings:
    """A shaper for a machine.

    Attributes:
        machine: a name of `MACHINES`.
        files: the texts by file name.
        words: what it is and what it leaves, in a sentence or two.
        candidate: what the machine makes of the setting, with its bounds; for c, st and csv the shaper itself.
        holds: whether it is within the requirements.
    """

    machine: str
    files: Mapping[str, str]
    words: str
    candidate: Candidate
    holds: bool

    def write(self, folder: Path | str) -> list[Path]:
        """Write the files into a folder, and return their paths. Raises ShaperFmuError if that fails."""
        folder = Path(folder)
        for name in self.files:
            (folder / name).parent.mkdir(parents=True, exist_ok=True)
        return [write_file(folder / name, text.encode()) for name, text in self.files.items()]


def machine_settings(machine: str, choice: Choice, *, axis: str = "x", cycle: float = 0.001, caveat: str = "") -> MachineSettings:
    """The settings with which a machine shapes its commands for the modes of a choice.

    A firmware has its own shapers: the best setting of each is found, judged by the impulses that it makes of it, and the
    shortest one within the requirements is taken, or else the one that leaves least. c, st (IEC 61131-3 structured text) and csv
    carry the recommended shaper itself.

    Args:
        machine: a name of `MACHINES`.
        choice: of `choose` or a tuning, with the modes and the requirements.
        axis: of the firmware.
        cycle: of a PLC [s], for st.
        caveat: what has to be known of the shaper; it begins every file.

    Raises ArgumentError for an unknown machine or axis, for modes outside of the firmware's range, and where there is no shaper.
    """
    if machine not in MACHINES:
        raise ArgumentError(f"machine {machine!r} is not known.{nearest(machine, MACHINES)}")
    if choice.requirements.move is not None:
        raise ArgumentError(f"{machine}: the choice is for a move; choose a shaper without a move for a machine")
    if machine in FIRMWARE:
        return _of_firmware(FIRMWARE[machine], choice, axis, caveat)
    candidate = choice.recommended or choice.nearest
    holds = choice.recommended is not None
    if not candidate.design.factors:
        raise ArgumentError(f"{machine}: no shaper is needed, so that there is nothing to carry over")
    words = f"{candidate.name}, {len(candidate.sequence.delays)} impulses over {candidate.sequence.duration:.6g} s"
    unfit = () if holds else (f"NOT HELD: {choice.reason}",)
    head = header(words, caveat, unfit)
    files = {
        "c": lambda: {f"c/{name}": text for name, text in c_files(candidate, head).items()},
        "st": lambda: {"shaped_command.st": structured_text(candidate.sequence, head, cycle)},
        "csv": lambda: {"impulses.csv": csv_text(candidate.sequence, head if caveat or unfit else ())},
    }[machine]()
    return MachineSettings(machine, files, words, candidate, holds)


def _of_firmware(firmware: Firmware, choice: Choice, axis: str, caveat: str) -> MachineSettings:
    axis = axis.lower()
    if firmware.axes and axis not in firmware.axes:
        raise ArgumentError(f"{firmware.title} shapes the axes {', '.join(firmware.axes)}, not {axis!r}")
    found = fit(firmware, choice.boxes, choice.requirements)
    if not found:
        low, high = firmware.frequencies
        modes = ", ".join(f"{box.natural_frequency.nominal / 6.283185307179586:.4g}" for box in choice.boxes)
        raise ArgumentError(f"{firmware.title} takes shapers of {low:.4g} to {high:.4g} Hz; the modes are at {modes} Hz")
    best, holds = best_of(found, choice.requirements)
    words = lost(firmware, best, holds, choice)
    lines = header(words, caveat, (f"For {firmware.title}, as of {firmware.definition}.", *firmware.how))
    text = "".join(f"{firmware.comment} {line}\n" for line in lines) + "\n" + firmware.lines(axis, best.setting)
    return MachineSettings(firmware.name, {f"{firmware.name}{firmware.suffix}": text}, words, best.candidate, holds)
