"""Tunes a shaper from a measured response."""

from __future__ import annotations

import re
from collections.abc import Sequence
from dataclasses import replace
from pathlib import Path
from typing import Any

from shaper_fmu.analysis.identification import CONTRADICTING, Finding
from shaper_fmu.renamed import renamed_argument
from shaper_fmu.tune.choice.choice import choose
from shaper_fmu.tune.choice.reasons import percent
from shaper_fmu.tune.choice.requirements import Requirements
from shaper_fmu.tune.hidden import hidden_of_forced, hidden_share
from shaper_fmu.tune.identify.measured_parts import identify_ring_downs
from shaper_fmu.tune.identify.measured_result import MeasuredIdentification
from shaper_fmu.tune.identify.measured_table import Table
from shaper_fmu.tune.recordings import boxes_of
from shaper_fmu.tune.tuning import Tuning, Verdict, requirements_for
from shaper_fmu.tune.verification.command import Command

_AXIS = re.compile(r"(?:^|[_ .-])([xyz])$", re.IGNORECASE)
_UNSTABLE = ("unstable", "growth")
_OPEN = (*CONTRADICTING, "time_unit")
"""Findings with which the modes are not proven: also where the unit of time was assumed, since all frequencies depend on it."""


@renamed_argument("wish", "requirements")
def tune_measured(
    source: Path | str | Table,
    outputs: Sequence[str] | None = None,
    *,
    requirements: Requirements | None = None,
    also: Sequence[Path | str | Table] = (),
    **options: Any,
) -> Tuning:
    """Find a shaper from a measured response; there is no plant to verify it on.

    Args:
        source, outputs, options: of `identify_measured`.
        requirements: what is wanted; by default `requirements_for({})`.
        also: further recordings of the machine (other axes, places, loads): the shaper is for the modes' ranges over all of them.

    Of a recording with several ring-downs each is identified (see `identify_ring_downs`), and counts as a recording of its own.
    The modes' shares are those of the response as it was excited; with a command's column those of the response to a step of it.
    """
    recordings, names = _identified((source, *also), outputs, requirements, options)
    return _tuned(recordings, names, requirements or requirements_for({}))


def tune_axes(
    source: Path | str | Table,
    outputs: Sequence[str] | None = None,
    *,
    requirements: Requirements | None = None,
    also: Sequence[Path | str | Table] = (),
    **options: Any,
) -> dict[str, Tuning]:
    """Find a shaper for each axis from sweeps along different ones, such as the raw data of a 3D printer's resonance tests.

    The axis of a recording is that of the column that moves most along its sweep: "x" of accel_x. The recordings of one axis are
    taken together, as `tune_measured` takes all. Recordings that are no sweeps, or whose columns name no axis, give one tuning for
    all, of the axis "".
    """
    recordings, names = _identified((source, *also), outputs, requirements, options)
    axes = [axis_of(one) for one in recordings]
    if not all(axes):
        axes = [""] * len(axes)
    found = {}
    for axis in dict.fromkeys(axes):
        mine = [k for k, one in enumerate(axes) if one == axis]
        of_axis = [recordings[k] for k in mine], [names[k] for k in mine]
        found[axis] = _tuned(*of_axis, requirements or requirements_for({}))
    return found


def axis_of(one: MeasuredIdentification) -> str:
    """The axis along which a sweep drives, by the name of its column; "" where none is known."""
    if one.law is None or len(one.outputs) != 1:
        return ""
    match = _AXIS.search(one.outputs[0])
    return match[1].lower() if match else ""


def _identified(
    sources: Sequence[Path | str | Table], outputs: Sequence[str] | None, requirements: Requirements | None, options: dict[str, Any]
) -> tuple[list[MeasuredIdentification], list[str]]:
    """The identifications, of each ring-down of a file, and their names."""
    if requirements is not None:
        requirements.check_impulses_only()
    found, names = [], []
    for source in sources:
        name = "the table" if isinstance(source, Table) else Path(source).name
        parts = identify_ring_downs(source, outputs, **options)
        found += parts
        names += [name, *(f"{name} (ring-down {number})" for number in range(2, len(parts) + 1))]
    return found, names


def _tuned(recordings: Sequence[MeasuredIdentification], names: Sequence[str], requirements: Requirements) -> Tuning:
    measured, name = recordings[0], " and ".join(names)
    findings = (*measured.findings, *_further(names, recordings))
    modes = [mode for one in recordings for mode in one.identification.modes]
    found = Tuning(
        "for_modes_found", "", names[0], "", "", Command(), measured.outputs, {}, None, None, measured, None, None, (),
        findings,
    )  # fmt: skip
    against = [one for one in findings if one.code in _OPEN]
    reasons = "; ".join(one.text for one in against)
    if against and all(one.code in _UNSTABLE for one in against):  # what contradicts a fit contradicts its unstable poles
        return replace(found, verdict="unstable", summary=reasons)
    if not modes and against:
        return replace(found, verdict="not_proven", summary=f"no mode was found, but {reasons}")
    if not modes:
        when = f"after {measured.excitation_end:g} s" if measured.forced is None else "that the command excites"
        return replace(found, verdict="no_vibration", summary=f"{name} shows no vibration {when}, so that no shaper is needed")
    boxes = boxes_of(recordings)
    choice = choose(boxes, requirements)
    verdict: Verdict = "for_modes_found" if choice.recommended is not None else "nothing_fits"
    forced = measured.forced
    hidden = max(_hidden(one) for one in recordings)
    if not against and hidden > requirements.tolerance:
        reasons = (
            f"the noise may hide a mode of up to {percent(hidden)} of the vibration, more than the tolerance of "
            f"{percent(requirements.tolerance)}: excite more, measure with less noise or more samples, "
            "or name outputs that show more"
        )
        found = replace(found, findings=(*found.findings, Finding("hidden", reasons)))
    elif not against:
        band = f" between {forced.band[0]:.3g} and {forced.band[1]:.3g} Hz" if forced else ""
        only = f". This holds for the modes found in {name}{band}, within these ranges. Nothing was tried on the machine itself"
        return replace(found, verdict=verdict, summary=choice.reason + only, choice=choice)
    return replace(found, verdict="not_proven", summary=f"{reasons}. If the modes were those found: {choice.reason}", choice=choice)


def _hidden(one: MeasuredIdentification) -> float:
    """The share of a mode that the noise of a recording may hide; of one without modes nothing is known by shares."""
    found = one.identification
    if not found.modes:
        return 0.0
    return hidden_of_forced(found, one.forced.weakest) if one.forced is not None else hidden_share(found)


def _further(names: Sequence[str], recordings: Sequence[MeasuredIdentification]) -> list[Finding]:
    """What further recordings have shown, with their names."""
    found = []
    for name, one in zip(names[1:], recordings[1:], strict=True):
        modes = " and ".join(
            f"{mode.frequency:.4g} Hz (damping ratio {mode.damping_ratio:.3g})" for mode in one.identification.modes
        )
        found.append(Finding("recording", f"{name}: {modes or 'no mode of vibration'}"))
        found += [Finding(other.code, f"{name}: {other.text}") for other in one.findings]
    return found
