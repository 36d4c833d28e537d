"""Root mean square."""

from __future__ import annotations

import numpy as np

from shaper_fmu.metrics.metric import SQUARE, Metric, Needs


class Effort(Metric, tag="effort", frozen=True):
    """Root mean square of a variable that is held over the steps, such as a force."""

    def needs(self) -> Needs:
        return Needs(self.output, kind=SQUARE)

    def values(self, gathered: np.ndarray) -> np.ndarray:
        span = gathered["time"] - gathered["begin"]
        passed = span > 0.0
        return np.where(passed, np.sqrt(gathered["sum"] / np.where(passed, span, 1.0)), np.abs(gathered["last"]))
