"""What the command `tune` prints and writes of a tuning."""

from __future__ import annotations

import re
from collections.abc import Callable, Mapping
from pathlib import Path
from typing import TYPE_CHECKING

from shaper_fmu.cli.paths import shown, wrote
from shaper_fmu.console import err, out, show
from shaper_fmu.errors import ArgumentError
from shaper_fmu.machines.names import Machine

if TYPE_CHECKING:
    from shaper_fmu.machines.settings import MachineSettings
    from shaper_fmu.tune.tuning import Tuning

_OF_SHAPERS = (".fmu", ".ssv", ".ssp")
_SENTENCES = re.compile(r"(?<=[.;]) (?=[A-Z])")
"""Where a result in words is parted into lines."""


def print_result(found: Tuning) -> None:
    """Print the modes, the findings and the result."""
    from shaper_fmu.report.tune.evidence import evidence
    from shaper_fmu.report.tune.modes import modes_table
    from shaper_fmu.tune.meter import effort_words

    seen = evidence(found)
    if seen.found.modes:
        show(modes_table(found, seen))
    for finding in found.findings:
        err.print(f"note: {finding.text}")
    verdict = found.verdict.replace("_", " ")
    said = found.summary if found.summary.startswith(verdict) else f"{verdict}: {found.summary}"
    print_sentences(said)
    words = effort_words(found.efforts)
    if words:
        err.print(words)


def print_sentences(said: str) -> None:
    """Print a result in words, a line for each sentence."""
    out.print("\n  ".join(_SENTENCES.split(said)))


def write_results(found: Tuning, wanted: Path, report: bool, say: Callable[[str], None]) -> Path:
    """Write the files of a tuning into the folder, or into another one beside it, which is returned."""
    from shaper_fmu.live.panel import tuning_panel
    from shaper_fmu.report.tune.outputs import folder_for, is_plain, left_over, write_tuning

    target = folder_for(found, wanted)
    if target != wanted:
        err.print(f"note: {shown(wanted)} keeps its tuning: it is another plant's, or good, which this one is not")
    written = write_tuning(found, target, report=report, say=say, panel=tuning_panel)
    for path in written:
        if path.suffix != ".png":
            plain = ["plain: it needs the values in shaper.ssv"] if is_plain(path) else []
            caveat = [found.verdict.replace("_", " ")] if found.caveat and path.suffix in _OF_SHAPERS else []
            wrote(path, f" ({'; '.join([*caveat, *plain])})" if caveat or plain else "")
    for path in left_over(found, target, written):
        err.print(f"note: {shown(path)} is of an earlier tuning")
    return target


def write_for(machine: Machine, found: Mapping[str, Tuning], axes: Mapping[str, str], cycle: float, folder: Path) -> bool:
    """Write the settings of a machine, of all axes in common files, and say what they leave; whether they are what was asked for.

    A machine that cannot have them is told in a line, and the next one is written.
    """
    try:
        made = {along: _setting(machine, one, axes[along], cycle) for along, one in found.items()}
        known = {along: one for along, one in made.items() if one is not None}
        _write_settings(found, known, folder)
    except ArgumentError as error:
        err.print(f"{machine}: {error}")
        return False
    return all(one.holds for one in known.values())


def _setting(machine: Machine, found: Tuning, axis: str, cycle: float) -> MachineSettings | None:
    """The shaper for a machine, after saying what it leaves there; None, with the reason told, if there is no shaper.

    Raises ArgumentError if the machine cannot have it.
    """
    from shaper_fmu.machines import machine_settings

    if found.choice is None:
        err.print(f"note: nothing is written for {machine}, since there is no shaper")
        return None
    settings = machine_settings(machine, found.choice, axis=axis, cycle=cycle, caveat=found.caveat)
    out.print(f"{machine}: {settings.words}")
    return settings


def _write_settings(found: Mapping[str, Tuning], settings: Mapping[str, MachineSettings], folder: Path) -> None:
    """Write the settings of one machine, of one axis or of several in common files."""
    from shaper_fmu.machines.axes import write_axes

    doubts = {found[axis].verdict.replace("_", " "): None for axis in settings if found[axis].caveat}
    if not all(one.holds for one in settings.values()):
        doubts["not held"] = None
    for path in write_axes(settings, folder):
        wrote(path, f" ({'; '.join(doubts)})" if doubts else "")
