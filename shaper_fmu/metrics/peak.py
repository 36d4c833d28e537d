"""The largest magnitude."""

from __future__ import annotations

import numpy as np

from shaper_fmu.metrics.metric import Metric


class Peak(Metric, tag="peak", frozen=True):
    """Largest magnitude."""

    def values(self, gathered: np.ndarray) -> np.ndarray:
        return np.maximum(np.abs(gathered["largest"]), np.abs(gathered["smallest"]))
