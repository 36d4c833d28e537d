"""The last value."""

from __future__ import annotations

import numpy as np

from shaper_fmu.metrics.metric import Metric


class Final(Metric, tag="final", frozen=True):
    """Value at the end."""

    def values(self, gathered: np.ndarray) -> np.ndarray:
        return gathered["last"].copy()
