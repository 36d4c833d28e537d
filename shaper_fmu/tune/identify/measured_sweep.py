"""Modes from a recording of a sweep whose command was not recorded, such as the raw data of a 3D printer's resonance test."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from shaper_fmu.analysis.identification import Finding, FreeResponse
from shaper_fmu.analysis.identification.sweep_result import driven_column, identify_swept
from shaper_fmu.analysis.identification.swept import Sweep
from shaper_fmu.tune.identify.measured_result import MeasuredIdentification

_DRIVEN = "{} moves most along the sweep, and is looked at; name others to look at them, too (outputs, --output): {}"


def of_sweep(
    response: FreeResponse,
    found: Sweep,
    recording: tuple[np.ndarray, np.ndarray],
    units: Sequence[str],
    smallest_share: float,
    findings: Sequence[Finding],
    *,
    named: bool,
) -> MeasuredIdentification | None:
    """The modes from a sweep: of the columns that the user has named, or of that which moves most.

    None where the frequency is no straight line over time. `recording` is on the file's clock.
    """
    told: list[Finding] = []
    if not named and len(response.names) > 1:
        j = driven_column(response, found)
        if j is None:
            return None
        others = ", ".join(name for name in response.names if name != response.names[j])
        told.append(Finding("driven", _DRIVEN.format(response.names[j], others)))
        response = FreeResponse(response.values[:, [j]], response.step, (response.names[j],), response.floor[[j]])
        recording, units = (recording[0], recording[1][:, [j]]), [units[j]]
    swept = identify_swept(response, found, smallest_share)
    if swept is None:
        return None
    forced, end = swept.forced, float(recording[0][0]) + swept.law.end
    return MeasuredIdentification(
        forced.identification, swept.time, forced.response.values, response.names, tuple(units), end,
        (*findings, *told, *forced.identification.findings), forced, recording, swept.law,
    )  # fmt: skip
