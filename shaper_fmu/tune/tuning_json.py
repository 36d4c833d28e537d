"""A tuning's numbers as JSON, for programs.

Numbers are in SI units, angles in rad, shares and damping ratios of 1. null stands where nothing is known, where a section does
not apply, and for a limit that is none (JSON has no infinity). In `choice`, `recommended` and `nearest` are whole candidates, and
`front` holds the numbers of those in `candidates`.
"""

from __future__ import annotations

import json
import math
from collections.abc import Iterable, Mapping, Sequence
from pathlib import Path
from typing import Any

import numpy as np

from shaper_fmu.analysis.identification import Finding, Identification, Mode, OtherPole
from shaper_fmu.archives import write_file
from shaper_fmu.profiles.limits import NO_LIMIT
from shaper_fmu.tune.choice.boxes import ModeBox, shares
from shaper_fmu.tune.choice.requirements import Requirements
from shaper_fmu.tune.choice.result import Choice
from shaper_fmu.tune.choice.search import Candidate
from shaper_fmu.tune.identify.experiment import PlantIdentification
from shaper_fmu.tune.identify.measured_result import MeasuredIdentification
from shaper_fmu.tune.identify.range import ModeRange, Range
from shaper_fmu.tune.meter import Effort
from shaper_fmu.tune.tuning import Tuning
from shaper_fmu.tune.verification.command import Command
from shaper_fmu.tune.verification.move import MoveCommand
from shaper_fmu.tune.verification.shares import Measured
from shaper_fmu.tune.verification.verify import Verification

SCHEMA = 1
"""Version of the layout: it changes when a name goes or comes to mean something else, not when one is added."""


def write_json(path: Path | str, tuning: Tuning) -> Path:
    """Write `tuning_numbers`, replacing the file only when it is complete; returns its path."""
    text = json.dumps(tuning_numbers(tuning), allow_nan=False, indent=1, ensure_ascii=False)
    return write_file(Path(path), f"{text}\n".encode())


def tuning_numbers(tuning: Tuning) -> dict[str, Any]:
    """All numbers of a tuning, as texts, numbers, lists and dictionaries that strict JSON can hold; in the same order each time."""
    choice, requirements = tuning.choice, tuning.choice.requirements if tuning.choice is not None else None
    found: dict[str, Any] = {
        "schema": SCHEMA,
        "verdict": tuning.verdict,
        "good": tuning.good,
        "words": tuning.summary,
        "caveat": tuning.caveat or None,
        "source": tuning.source,
        "input": tuning.input,
        "input_unit": tuning.input_unit,
        "outputs": list(tuning.outputs),
        "units": _units(tuning),
        "command": _command(tuning.command) if tuning.plant is not None else None,
        "settings": tuning.system.settings if tuning.system is not None else {},
        "spread": dict(tuning.spread),
        "wish": _requirements(requirements) if requirements is not None else None,
        "findings": _findings(tuning.findings),
        "modes": _modes(tuning),
        "other_poles": _other_poles(tuning),
        "operating_points": [_point(tuning, one) for one in tuning.plant.experiments] if tuning.plant is not None else [],
        "measured": _measured(tuning.measured) if tuning.measured is not None else None,
        "choice": _choice(choice) if choice is not None else None,
        "verification": verification_numbers(tuning.verification) if tuning.verification is not None else None,
        "effort": _effort(tuning) if tuning.efforts else None,
    }
    return strict(found)


def strict(value: Any) -> Any:
    """The same with plain Python numbers, and null for those that are not finite."""
    if isinstance(value, Mapping):
        return {str(name): strict(one) for name, one in value.items()}
    if isinstance(value, np.ndarray):
        return strict(value.tolist())
    if isinstance(value, list | tuple):
        return [strict(one) for one in value]
    if isinstance(value, bool | np.bool_):
        return bool(value)
    if isinstance(value, int | np.integer):
        return int(value)
    if isinstance(value, float | np.floating):
        return float(value) if math.isfinite(value) else None
    return value if value is None else str(value)


def _command(command: Command | MoveCommand) -> dict[str, Any]:
    """The input's values and the times [s] from which each holds; before the first it is at rest. A move begins at its one time."""
    if isinstance(command, MoveCommand):
        return {"kind": command.name, "rest": command.rest, "distance": command.move.distance, "times": [command.start]}
    values = [command.rest + command.amplitude * level for level in command.levels()]
    return {
        "kind": command.name, "rest": command.rest, "amplitude": command.amplitude, "times": list(command.times()), "values": values
    }  # fmt: skip


def _units(tuning: Tuning) -> list[str]:
    """Unit of each output."""
    if tuning.system is not None:
        return [tuning.system.unit(name) for name in tuning.outputs]
    return list(tuning.measured.units) if tuning.measured is not None else ["" for _ in tuning.outputs]


def _requirements(requirements: Requirements) -> dict[str, Any]:
    found: dict[str, Any] = dict(vars(requirements))
    found["kinds"] = list(requirements.kinds) if requirements.kinds is not None else None
    found["move"] = _limits(vars(requirements.move)) if requirements.move is not None else None
    return found


def _limits(values: Mapping[str, Any]) -> dict[str, Any]:
    """Values, of which NO_LIMIT stands for no limit."""
    return {name: math.inf if isinstance(value, float) and value >= NO_LIMIT else value for name, value in values.items()}


def _findings(findings: Iterable[Finding]) -> list[dict[str, str]]:
    return [{"code": one.code, "text": one.text} for one in findings]


def _modes(tuning: Tuning) -> list[dict[str, Any]]:
    """Modes of the nominal experiment, by rising natural frequency."""
    parts = shares(tuning.choice.boxes).max(axis=1) if tuning.choice is not None else None
    if tuning.plant is not None:
        nominal = tuning.plant.nominal
        found = [
            {**_mode(mode), **_ranges(one), "residues": _residues(tuning, nominal, mode)}
            for one, mode in zip(tuning.plant.ranges, nominal.modes, strict=True)
        ]
    else:
        found = [
            {**_mode(mode), "residues": dict(zip(tuning.outputs, _pairs(mode.residues[0]), strict=True))}
            for mode in _identification(tuning).modes
        ]
    for k, mode in enumerate(found):
        mode["step_share"] = parts[k] if parts is not None else None
        mode["box"] = _box(tuning.choice.boxes[k]) if tuning.choice is not None else None
    return found


def _identification(tuning: Tuning) -> Identification:
    if tuning.plant is not None:
        return tuning.plant.nominal.identification
    assert tuning.measured is not None  # a tuning has either
    return tuning.measured.identification


def _mode(mode: Mode) -> dict[str, Any]:
    return {
        "natural_frequency": mode.natural_frequency,
        "natural_frequency_std": mode.natural_frequency_std,
        "damping_ratio": mode.damping_ratio,
        "damping_ratio_std": mode.damping_ratio_std,
        "share": mode.share,
        "pole": [mode.pole.real, mode.pole.imag],
    }


def _ranges(found: ModeRange) -> dict[str, Any]:
    return {"natural_frequency_range": _ends(found.natural_frequency), "damping_ratio_range": _ends(found.damping_ratio)}


def _ends(found: Range) -> list[float]:
    return [found.low, found.high]


def _box(box: ModeBox) -> dict[str, Any]:
    """The ranges that the shaper has to cover, with the required margins."""
    return {"natural_frequency": list(box.frequencies), "damping_ratio": list(box.dampings)}


def _residues(tuning: Tuning, found: PlantIdentification, mode: Mode) -> dict[str, list[float]]:
    """By output, of the response to a unit step of the input."""
    names = [_short(tuning, name) for name in found.outputs]
    return dict(zip(names, _pairs(found.step_residues(mode)), strict=True))


def _pairs(values: np.ndarray) -> list[list[float]]:
    return [[float(one.real), float(one.imag)] for one in values]


def _short(tuning: Tuning, name: str) -> str:
    return tuning.system.short(name) if tuning.system is not None else name


def _other_poles(tuning: Tuning) -> list[dict[str, Any]]:
    def numbers(one: OtherPole) -> dict[str, Any]:
        return {"kind": one.kind, "pole": [one.pole.real, one.pole.imag], "pole_std": one.pole_std, "share": one.share}

    return [numbers(one) for one in _identification(tuning).others]


def _point(tuning: Tuning, found: PlantIdentification) -> dict[str, Any]:
    """An experiment: its operating point, its settings, and its result."""
    made = found.excitation
    return {
        "start_values": {_short(tuning, name): value for name, value in found.start_values.items()},
        "excitation": {"kind": made.kind, "amplitude": made.amplitude, "width": made.width, "start": made.start, "rest": made.rest},
        "settle_time": found.settle_time,
        "nonlinearity": found.nonlinearity,
        "coupling": found.coupling,
        "modes": [{**_mode(mode), "residues": _residues(tuning, found, mode)} for mode in found.modes],
        "fit": _fit(found.identification, [_short(tuning, name) for name in found.outputs]),
    }


def _fit(found: Identification, outputs: Sequence[str]) -> dict[str, Any]:
    """How well the modes and the other poles explain the free response."""
    left = np.sqrt(np.mean(found.residual[:, 0] ** 2, axis=0))
    return {
        "samples": found.samples,
        "step": found.step,
        "order": found.order,
        "signal": dict(zip(outputs, found.signal[0].tolist(), strict=True)),
        "residual": dict(zip(outputs, left.tolist(), strict=True)),
    }


def _measured(found: MeasuredIdentification) -> dict[str, Any]:
    band = list(found.forced.band) if found.forced is not None else None
    law = found.law
    sweep = None
    if law is not None:
        sweep = {"begin": found.span[0], "end": found.span[1], "first": law.first, "last": law.last, "rate": law.rate}
        sweep |= {"stepped": law.stepped, "growing": law.growing}
    fit = _fit(found.identification, found.outputs)
    return {"excitation_end": found.excitation_end, "excited_band": band, "sweep": sweep, "span": list(found.span), "fit": fit}


def _choice(choice: Choice) -> dict[str, Any]:
    numbers = {id(one): number for number, one in enumerate(choice.candidates)}
    candidates = [_candidate(number, one) for number, one in enumerate(choice.candidates)]
    recommended = candidates[numbers[id(choice.recommended)]] if choice.recommended is not None else None
    return {
        "reason": choice.reason,
        "recommended": recommended,
        "nearest": candidates[numbers[id(choice.nearest)]],
        "floor": choice.floor,
        "front": [numbers[id(one)] for one in choice.front],
        "candidates": candidates,
        "dominated": len(choice.dominated),
        "left_out": [{"name": one.name, "reason": one.reason} for one in choice.left_out],
    }


def _candidate(number: int, one: Candidate) -> dict[str, Any]:
    return {
        "number": number,
        "name": one.name,
        "delay": one.delay,
        "worst_case": one.worst_case,
        "nominal": one.nominal,
        "bounds": list(one.bounds),
        "at": [list(place) for place in one.at],
        "impulses": {"amplitude": list(one.sequence.amplitudes), "delay": list(one.sequence.delays)},
        "start_values": one.start_values(),
        "profile": one.profile.start_values() if one.profile is not None else None,
    }


def verification_numbers(found: Verification) -> dict[str, Any]:
    """All numbers of a verification."""
    return {
        "reason": found.reason,
        "holds": found.holds,
        "tolerance": found.tolerance,
        "step": found.step,
        "step_change": found.step_change,
        "doubt": found.doubt,
        "noise": list(found.noise),
        "subtracted": found.subtracted,
        "slow": found.slow,
        "outputs": list(found.outputs),
        "nominal": _measurement(found.nominal),
        "worst": _measurement(found.worst),
        "points": [_measurement(one) for one in found.points],
        "failed": [{"values": dict(values), "reason": reason} for values, reason in found.failed],
    }


def _measurement(one: Measured) -> dict[str, Any]:
    return {"values": dict(one.values), "before": list(one.before), "after": list(one.after), "share": one.share}


def _effort(tuning: Tuning) -> dict[str, Any]:
    """Steps and runs of the plant, and wall times [s], which differ each time."""
    whole = sum(tuning.efforts.values(), Effort())
    return {**vars(whole), "parts": {name: dict(vars(one)) for name, one in tuning.efforts.items()}}
