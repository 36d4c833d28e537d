"""A study to start from: a file with a system's own names, which runs as it stands."""

from __future__ import annotations

import json
import math
import os
import re
from collections.abc import Iterator
from pathlib import Path
from typing import Any

from fmpy.model_description import ModelVariable

from shaper_fmu.drafts import draft_of
from shaper_fmu.errors import StudyError
from shaper_fmu.master.alone import rounded_step
from shaper_fmu.master.structure import SystemStructure
from shaper_fmu.master.variables import TRANSFERABLE, items_of, kind_of
from shaper_fmu.ssp.archive import archive_of, load_ssp

_MOST_LISTED = 40
_LONGEST = 90
"""Letters of a description, which is in a comment."""
_POINTS, _SPREAD = 5, 0.2
_STOP_TIME, _STEPS = 10.0, 1000
_SWINGS = re.compile("swing|angle|deflection|vibration")
_SHAPED = {"unshaped": "none", "ZV": "zv", "ZVD": "zvd"}
"""Cases of a system with a shaper, by the items of its parameter `shaper`."""


def write_study(system: Path | str, path: Path | str) -> str:
    """Write a commented study of an SSP archive, or of a system's folder, to `path`; returns the start value that it varies.

    It varies one start value of the last FMU, by 20 % to both sides in 5 points; of a system with a shaper it compares the unshaped
    command with ZV and ZVD, and measures what vibration is left. All other start values and outputs are listed in comments.
    Raises ModelError or ArchiveError for a system that cannot be read, StudyError for one in which nothing can be varied.
    """
    system, path = Path(system), Path(path)
    loaded = load_ssp(system)
    archive = archive_of(system) if system.is_dir() else system
    where = os.path.relpath(archive.resolve(), path.resolve().parent)
    structure = loaded.structure
    text, varied = study_text(loaded.system, Path(where).as_posix(), structure.stop_time, structure.step_size)
    with draft_of(path) as draft:
        draft.write_text(text, encoding="utf-8")
    return varied


def study_text(system: SystemStructure, where: str, stop_time: float | None, step: float | None) -> tuple[str, str]:
    """The study's text, and the start value that it varies; `where` is the archive's path, relative to the study."""
    found = next(_variable_values(system), None)
    if found is None:
        raise StudyError(f"{system.name} has no start value that is a number other than 0, so that nothing can be varied")
    name, value, low, high = found
    stop = stop_time if stop_time is not None else _STOP_TIME
    declared = "" if stop_time is not None else "   # the system declares none: correct it"
    shaper = _shaper(system)
    lines = [
        f"# A study of {_plain(system.name)}: which start values vary, what is compared, what is measured.",
        "# shaper-fmu sweep runs it, shaper-fmu report draws it; docs/sweeps.md explains all keys.",
        f"name = {_quoted(f'{system.name}: {name}')}",
        f"system = {_quoted(where)}   # relative to this file",
        f"stop_time = {float(stop)!r}   # [s]{declared.replace('   # ', '; ')}",
        f"step = {float(step if step is not None else rounded_step(stop / _STEPS))!r}   # communication step [s]",
        *(['reference = "unshaped"   # the case that the others are related to, in percent'] if shaper else []),
        "",
        '# What varies: all combinations are run. A second table [vary."..."] varies another start value, too.',
        f"[vary.{_quoted(name)}]",
        f"nominal = {value!r}{_unit_comment(system, name)}",
        f"low = {low!r}",
        f"high = {high!r}",
        f"points = {_POINTS}",
        '# or: values = [1.0, 2.0]; factors = [0.8, 1.0, 1.2]; spacing = "log"',
        "",
        *_cases(shaper),
        "",
        *_metrics(system, shaper),
        "",
        *_listed("Start values that can vary, or differ between cases (of an array the first element)", _start_values(system)),
        *_listed("Variables that can be measured", _outputs(system)),
    ]
    return "\n".join(lines).rstrip() + "\n", name


def _variable_values(system: SystemStructure) -> Iterator[tuple[str, float, float, float]]:
    """Start values that can vary by 20 %: name, value, low, high; those of the last FMUs, and those that were given, first."""
    for instance in reversed(system.instance_order()):
        given = system.start_values[instance]
        variables = [v for v in system.fmus[instance].variables.values() if v.causality == "parameter" and kind_of(v) == "real"]
        for variable in sorted(variables, key=lambda v: v.name not in given):  # sorted keeps the order of equals
            value = _number(given.get(str(variable.name), variable.start))
            ends = sorted((value * (1.0 - _SPREAD), value * (1.0 + _SPREAD)))
            low, high = (float(f"{end:.6g}") for end in ends)
            if math.isfinite(value) and value != 0.0 and _inside(variable, low, high):
                yield f"{instance}.{variable.name}", value, low, high


def _inside(variable: ModelVariable, low: float, high: float) -> bool:
    least, most = _number(variable.min), _number(variable.max)
    return not (low <= least or high >= most)  # NaN, which is no limit, is not compared


def _shaper(system: SystemStructure) -> str | None:
    """The instance whose enumeration `shaper` has the items of `_SHAPED`, and whose output leads to another FMU."""
    for instance, fmu in system.fmus.items():
        variable = fmu.variables.get("shaper")
        if variable is not None and items_of(variable).keys() >= set(_SHAPED.values()):
            return instance
    return None


def _cases(shaper: str | None) -> list[str]:
    head = "# What is compared: cases, with the start values in which they differ."
    if shaper is None:
        return [head, "[compare]", "all = {}", '# other = { "instance.parameter" = 1.0 }']
    return [
        head,
        "[compare]",
        *(f"{case} = {{ {_quoted(f'{shaper}.shaper')} = {_quoted(item)} }}" for case, item in _SHAPED.items()),
    ]


def _metrics(system: SystemStructure, shaper: str | None) -> list[str]:
    """What is measured of one output of the last FMU: of one that is called as what swings, if there is such a one."""
    last = system.instance_order()[-1]
    known = [name for name, _ in _outputs(system)]
    outputs = [name for name in known if name.startswith(f"{last}.")] or known
    if not outputs:
        raise StudyError(f"{system.name} has no output that is a number, so that nothing can be measured")
    commands = [".".join(source) for source in system.connections.values() if source[0] == shaper]
    lines = ["# What is measured of each run; kinds: residual, peak, final, overshoot, settling_time, effort, envelope."]
    output = next((name for name in outputs if _SWINGS.search(name)), outputs[0])
    name = re.sub(r"[^A-Za-z0-9]+", "_", output.rpartition(".")[2]).strip("_") or "output"
    if commands:
        lines += [
            f"[metrics.residual_{name}]   # half the peak-to-peak value after the command's last change",
            'kind = "residual"', f"output = {_quoted(output)}", f"command = {_quoted(commands[0])}", "",
        ]  # fmt: skip
    lines += [f"[metrics.peak_{name}]   # largest magnitude", 'kind = "peak"', f"output = {_quoted(output)}"]
    return lines


def _start_values(system: SystemStructure) -> list[tuple[str, str]]:
    """Names of parameters, and their values, units and descriptions."""
    found = []
    for instance in reversed(system.instance_order()):
        fmu = system.fmus[instance]
        for variable in fmu.variables.values():
            if variable.causality == "parameter" and kind_of(variable) in TRANSFERABLE and _is_first(str(variable.name)):
                value = system.start_values[instance].get(str(variable.name), variable.start)
                names = {str(number): item for item, number in items_of(variable).items()}
                shown = names.get(str(value), value)
                items = f" (of {', '.join(names.values())})" if names else ""
                unit = system.unit((instance, str(variable.name)))
                about = f"= {shown} {unit}".rstrip() + items
                found.append((f"{instance}.{variable.name}", f"{about}{_about(variable)}"))
    return found


def _outputs(system: SystemStructure) -> list[tuple[str, str]]:
    """Names of real outputs, and their units and descriptions."""
    return [
        (".".join(port), f"[{system.unit(port)}]{_about(system.fmus[port[0]].variables[port[1]])}".replace("[]", ""))
        for port in system.ports(None)
        if kind_of(system.fmus[port[0]].variables[port[1]]) == "real" and port[1] != "next_event_time"
    ]


def _is_first(name: str) -> bool:
    """Whether it is no element of an array, or the first one, which is listed for all."""
    return set(re.findall(r"[0-9]+", "".join(re.findall(r"\[([0-9,]+)\]$", name)))) <= {"1"}


def _about(variable: ModelVariable) -> str:
    text = _plain(str(variable.description or ""))
    return f"   {text[:_LONGEST]}{'...' if len(text) > _LONGEST else ''}" if text else ""


def _listed(title: str, entries: list[tuple[str, str]]) -> list[str]:
    if not entries:
        return []
    more = len(entries) - _MOST_LISTED
    tail = [f"#   and {more} more, which shaper-fmu info --all shows"] if more > 0 else []
    return [f"# {title}:", *(_plain(f"#   {name} {about}") for name, about in entries[:_MOST_LISTED]), *tail, ""]


def _unit_comment(system: SystemStructure, name: str) -> str:
    unit = system.unit(system.split(name))
    return f"   # [{_plain(unit)}], the system's own value" if unit else "   # the system's own value"


def _quoted(text: str) -> str:
    """As a text of TOML."""
    return json.dumps(text, ensure_ascii=False).replace("\x7f", "\\u007f")


def _plain(text: str) -> str:
    """In one line, without characters that TOML's comments cannot have."""
    return "".join(one if one.isprintable() else " " for one in text)


def _number(value: Any) -> float:
    try:
        return float(value)
    except (TypeError, ValueError):
        return math.nan
