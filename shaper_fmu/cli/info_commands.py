"""Which commands take a file, and why not: the commands' own arguments are given the file, then what they call is tried."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any, Literal

import typer

from shaper_fmu.cli.check import file_problems
from shaper_fmu.errors import ShaperFmuError
from shaper_fmu.info.facts import FmuInfo, SspInfo
from shaper_fmu.info.trials import (
    fmu_as_plant,
    fmu_behind_a_shaper,
    fmu_in_a_container,
    fmu_in_a_system,
    fmu_wrapped,
    folder_build,
    system_as_plant,
    system_pack,
    system_run,
)
from shaper_fmu.registry import find_component
from shaper_fmu.ssp.archive import archive_of

_MOST = 3
_ARGUMENTS = {
    ("check",): "files", ("run",): "system", ("pack",): "system", ("tune",): "plant", ("wrap",): "plant", ("new", "system"): "plant"
}  # fmt: skip
"""The names of the arguments for files, by the words of their commands."""


@dataclass(frozen=True)
class Answer:
    """What a command says to a file; `reason` says why not, or what it needs besides."""

    command: str
    takes: Literal["yes", "no", "in a system"]
    reason: str = ""


def fmu_commands(context: typer.Context, path: Path, fmu: FmuInfo) -> list[Answer]:
    """What the commands say to an FMU."""
    coupled = fmu_in_a_system(path)
    tuned, input_ = fmu_as_plant(path)
    behind = fmu_behind_a_shaper(path)
    packed = coupled or fmu_in_a_container(path)
    wrapped, shaped = fmu_wrapped(path)
    inside = "in an SSP archive that contains it" + ("" if behind else ", such as `new system` writes")
    component = Answer("", "no", _several(coupled)) if coupled else Answer("", "in a system", inside)
    return [
        _checked(context, path, fmu.findings),
        _tried(
            context, ("run",), path, coupled, "" if fmu.experiment.stop is not None else "with --until: it declares no stop time"
        ),
        Answer("sweep", component.takes, component.reason),
        Answer("pack", "no", _several(packed)) if packed else Answer("pack", "in a system", component.reason or inside),
        _plant(context, path, tuned, input_),
        _tried(context, ("wrap",), path, wrapped, f"for example with --input {shaped}"),
        _tried(context, ("new", "system"), path, behind, "with an input and an output of yours"),
        _build(path),
    ]


def system_commands(context: typer.Context, path: Path, variant: str | None, system: SspInfo) -> list[Answer]:
    """What the commands say to an archive, a folder of a system or a description."""
    refused = _refused(context, ("run",), path)
    stops = [finding for finding in system.findings if not finding.startswith("note: ")]
    run, timed = ([refused], True) if refused else system_run(path, variant, stops)
    tuned, input_ = ([refused], "") if refused else system_as_plant(path, [] if variant else stops)
    return [
        _checked(context, path, system.findings),
        _tried(context, ("run",), path, run, "" if timed else "with --stop-time and --step: it declares none or only one"),
        Answer("sweep", "no" if run else "yes", _several(run) if run else "as the system of a study"),
        _tried(context, ("pack",), path, [] if refused else system_pack(path, variant)),
        _plant(context, path, tuned, input_),
        _tried(context, ("wrap",), path, []),
        _tried(context, ("new", "system"), path, []),
        _build(path),
    ]


def _checked(context: typer.Context, path: Path, findings: Sequence[str]) -> Answer:
    refused = _refused(context, ("check",), path)
    if refused:
        return Answer("check", "no", refused)
    if path.suffix.lower() not in (".fmu", ".ssp"):
        return Answer("check", "no", _several(file_problems(path)))
    return Answer("check", "yes", f"finds: {_several(findings)}" if findings else "finds nothing")


def _plant(context: typer.Context, path: Path, problems: Sequence[str], input_: str) -> Answer:
    return _tried(context, ("tune",), path, problems, f"for example with --input {input_}")


def _tried(context: typer.Context, words: tuple[str, ...], path: Path, problems: Sequence[str], more: str = "") -> Answer:
    """What a command says that has these problems with what is in the file."""
    refused = _refused(context, words, path)
    reason = refused or _several(problems)
    return Answer(" ".join(words), "no" if reason else "yes", reason or more)


def _build(path: Path) -> Answer:
    """`build` makes archives of folders, and FMUs of components."""
    if path.is_dir():
        problems = folder_build(path, Path("fmus"))
        return Answer("build", "no" if problems else "yes", _several(problems) or f"writes {archive_of(path).name}")
    try:
        find_component(path.name)
    except ShaperFmuError as error:
        return Answer("build", "no", _without_hint(str(error), path.stem))
    return Answer("build", "yes")


def _without_hint(message: str, stem: str) -> str:
    """A message without the names that are near, unless one of them is the file's own."""
    return message if repr(stem) in message else message.partition(" Did you mean ")[0].partition(" Known: ")[0]


def _several(problems: Sequence[str]) -> str:
    """The first problems, and how many more there are."""
    more = f"; and {len(problems) - _MOST} more" if len(problems) > _MOST else ""
    return "; ".join(problems[:_MOST]) + more


def _refused(context: typer.Context, words: tuple[str, ...], path: Path) -> str:
    """Why a command's argument for a file refuses the file; "" if it takes it."""
    command: Any = context.find_root().command
    for word in words:
        command = command.commands[word]
    argument = next(one for one in command.params if one.name == _ARGUMENTS[words])
    try:
        argument.process_value(context, [str(path)] if argument.nargs == -1 else str(path))
    except typer.BadParameter as error:
        return error.message
    return ""
