"""The modes from a measured response, and what was taken of the recording."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from shaper_fmu.analysis.identification import Finding, Identification
from shaper_fmu.analysis.identification.forced import Forced
from shaper_fmu.analysis.identification.sweep_law import SweepLaw


@dataclass(frozen=True)
class MeasuredIdentification:
    """The result of an identification from a measured response.

    Attributes:
        identification: modes and other poles; time 0 is the first sample after the excitation.
        time: of the samples that were used [s], shape (n,), on the file's clock; of a sweep those of its impulse response.
        response: shape (n, m), as it was fitted; of a sweep the impulse response within its band.
        outputs, units: names and units of the columns, "" without one.
        excitation_end: after which the response is free [s], on the file's clock.
        findings: what the user should know, of the table and of the identification.
        forced: what is known of the command; None for a free response.
        recording: all times [s] and values of the outputs, shapes (n,) and (n, m), of which `response` was cut out; None if nothing
            was cut.
        law: of the sweep, if that is the excitation and was not recorded.
        parts: begin and end of all ring-downs of the recording [s], of which this is the first; () if it is the only one.
    """

    identification: Identification
    time: np.ndarray
    response: np.ndarray
    outputs: tuple[str, ...]
    units: tuple[str, ...]
    excitation_end: float
    findings: tuple[Finding, ...]
    forced: Forced | None = None
    recording: tuple[np.ndarray, np.ndarray] | None = None
    law: SweepLaw | None = None
    parts: tuple[tuple[float, float], ...] = ()

    @property
    def span(self) -> tuple[float, float]:
        """From when to when the part lasts that was taken of the recording [s], on the file's clock."""
        if self.law is not None and self.recording is not None:
            first = float(self.recording[0][0])
            return first + self.law.begin, first + self.law.end
        return float(self.time[0]), float(self.time[-1])
