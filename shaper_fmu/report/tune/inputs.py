"""Writes what belongs to several inputs together: the archive with a shaper before each, and the numbers."""

from __future__ import annotations

import json
import math
from pathlib import Path
from typing import Any

from shaper_fmu.archives import write_file
from shaper_fmu.errors import ModelError
from shaper_fmu.export.build import fmu_path
from shaper_fmu.report.tune.outputs import ARCHIVE, NUMBERS, REPORT, command_of
from shaper_fmu.ssp.export import parameter_set, write_system
from shaper_fmu.ssp.template import OUTPUTS, rounded_step
from shaper_fmu.ssp.write import write_parameter_set
from shaper_fmu.tune.tuning import CAVEATS, Say
from shaper_fmu.tune.tuning_inputs import InputsTuning, folder_name
from shaper_fmu.tune.tuning_json import SCHEMA, strict, verification_numbers
from shaper_fmu.tune.verification.together import free_name, shaped_system

_STEPS, _PERIODS = 200, 5.0


def write_inputs(
    found: InputsTuning, folder: Path | str, *, report: bool = True, say: Say = lambda _: None
) -> list[Path]:  # fmt: skip
    """Write tuning.json, shaped_plant.ssp where all inputs were verified together, and report.html; returns the paths.

    The archive has a MotionProfile and an InputShaper before each input; without shaping with its parameter set `unshaped`. The
    files of each input are written by `write_tuning`. Raises ShaperFmuError if something cannot be written.
    """
    folder = Path(folder)
    folder.mkdir(parents=True, exist_ok=True)
    written = []
    if found.inputs:
        try:
            written.append(_write_system(found, folder / ARCHIVE))
        except ModelError as error:  # what was found is not lost for what an archive cannot hold
            say(f"the shaped plant cannot be an archive: {error}")
    text = json.dumps(strict(inputs_numbers(found)), allow_nan=False, indent=1, ensure_ascii=False)
    written.append(write_file(folder / NUMBERS, f"{text}\n".encode()))
    return [*written, *(_write_report(found, folder) if report else [])]


def _write_report(found: InputsTuning, folder: Path) -> list[Path]:
    from shaper_fmu.page.blocks import write_report
    from shaper_fmu.report.tune.inputs_page import inputs_blocks

    first = next(iter(found.tunings.values()))
    system = shaped_system(found.inputs)[0] if found.inputs else None
    title = f"Tuning of {first.source}: {', '.join(found.tunings)} to {', '.join(first.outputs)}"
    return write_report(folder / REPORT, title, inputs_blocks(found, system))


def inputs_numbers(found: InputsTuning) -> dict[str, Any]:
    """The numbers that belong to all inputs; those of each are in its own folder."""
    first = next(iter(found.tunings.values()))
    return {
        "schema": SCHEMA,
        "verdict": found.verdict,
        "good": found.good,
        "words": found.summary,
        "source": found.source,
        "input": found.input,
        "inputs": {name: {"folder": folder_name(name), "verdict": one.verdict} for name, one in found.tunings.items()},
        "common": found.common,
        "spread": dict(first.spread),
        "amplitudes": {one.plant.short(one.plant.input): one.command.amplitude for one in found.inputs},
        "verification": verification_numbers(found.together) if found.together is not None else None,
        "effort": dict(vars(found.effort)),
    }


def _write_system(found: InputsTuning, path: Path) -> Path:
    tunings = list(found.tunings.values())
    boxes = [box for one in tunings if one.choice is not None for box in one.choice.boxes]
    slowest, fastest = (2.0 * math.pi / limit(box.natural_frequency.nominal for box in boxes) for limit in (min, max))
    system, names = shaped_system(found.inputs, output="shaped_mean", fmu=fmu_path("InputShaper"))
    end = 0.0
    for one, shaper in zip(found.inputs, names, strict=True):
        order, duration, distance = command_of(one.command, one.plant, boxes)
        profile = free_name(system, shaper.replace("shaper", "profile", 1))
        values = {"distance": distance, "duration": duration, "start_time": one.command.start}
        system.add(profile, fmu_path("MotionProfile"), values)
        system.connect(f"{profile}.{OUTPUTS[order]}", f"{shaper}.command", offset=one.command.rest)
        end = max(end, one.end - one.command.end + one.command.start + duration)
    step = rounded_step(fastest / _STEPS)
    unshaped = parameter_set(system, {f"{shaper}.shaper": "none" for shaper in names}, "unshaped")
    caveat = f"{CAVEATS[found.verdict]}. " if found.verdict in CAVEATS else ""
    inputs = ", ".join(found.tunings)
    return write_system(
        system,
        path,
        stop_time=step * math.ceil((end + _PERIODS * slowest) / step),
        step=step,
        description=f"{caveat}{tunings[0].source} with a shaper before each of {inputs}; look at {', '.join(tunings[0].outputs)}.",
        more={"parameter_sets/unshaped.ssv": write_parameter_set(unshaped)},
    )
