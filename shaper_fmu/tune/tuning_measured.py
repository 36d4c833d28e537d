"""Tunes a shaper from a measured response."""

from __future__ import annotations

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
from shaper_fmu.tune.identify.measured import MeasuredIdentification, identify_measured
from shaper_fmu.tune.identify.measured_table import Table
from shaper_fmu.tune.recordings import boxes_of
from shaper_fmu.tune.tuning import Tuning, Verdict, requirements_for
from shaper_fmu.tune.verification.command import Command

_UNSTABLE = ("unstable", "growth")


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

    The modes' shares are those of the response as it was excited; with a command's column those of the response to a step of it.
    """
    requirements = requirements or requirements_for({})
    requirements.check_impulses_only()
    recordings = [identify_measured(one, outputs, **options) for one in (source, *also)]
    names = ["the table" if isinstance(one, Table) else Path(one).name for one in (source, *also)]
    measured, name = recordings[0], " and ".join(names)
    findings = (*measured.findings, *_further(names, recordings))
    modes = [mode for one in recordings for mode in one.identification.modes]
    found = Tuning(
        "for_modes_found", "", names[0], "", "", Command(), measured.outputs, {}, None, None, measured, None, None, (),
        findings,
    )  # fmt: skip
    against = [one for one in findings if one.code in CONTRADICTING]
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
