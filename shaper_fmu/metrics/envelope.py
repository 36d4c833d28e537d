"""Residual vibration, by its envelope."""

from __future__ import annotations

import numpy as np

from shaper_fmu.metrics.metric import ENVELOPE, Metric, Needs


class Envelope(Metric, tag="envelope", frozen=True):
    """Residual vibration by its envelope: the largest hypot(x - rest, v / w) from the last change of `command` on.

    `rate` is the variable that is the output's derivative v, `natural_frequency` w [rad/s] that of the mode, `rest` the value
    about which the output swings. It does not depend on where in the period the steps fall; damping is not undone.
    """

    command: str
    rate: str
    natural_frequency: float
    rest: float = 0.0

    def needs(self) -> Needs:
        return Needs(self.output, self.command, self.rate, self.natural_frequency, self.rest, ENVELOPE)

    def values(self, gathered: np.ndarray) -> np.ndarray:
        return gathered["largest"].copy()
