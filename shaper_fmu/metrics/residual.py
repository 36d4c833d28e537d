"""Residual vibration, by extremes."""

from __future__ import annotations

import numpy as np

from shaper_fmu.metrics.metric import Metric, Needs


class Residual(Metric, tag="residual", frozen=True):
    """Residual vibration: half the peak-to-peak value from the last change of the variable `command` on.

    The run should go on for a period of the slowest mode after it; steps of h miss up to (w h)^2 / 8 of a sine's peak.
    """

    command: str

    def needs(self) -> Needs:
        return Needs(self.output, self.command)

    def values(self, gathered: np.ndarray) -> np.ndarray:
        return 0.5 * (gathered["largest"] - gathered["smallest"])
