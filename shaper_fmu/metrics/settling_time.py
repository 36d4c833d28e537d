"""Settling time."""

from __future__ import annotations

import math

import numpy as np

from shaper_fmu.metrics.metric import OUTSIDE, Metric, Needs


class SettlingTime(Metric, tag="settling_time", frozen=True):
    """Time after which the output stays within `tolerance` of `target` [s since the start of the run]; inf if it does not."""

    target: float
    tolerance: float

    unit = "s"

    def needs(self) -> Needs:
        return Needs(self.output, parameter=self.tolerance, rest=self.target, kind=OUTSIDE)

    def values(self, gathered: np.ndarray) -> np.ndarray:
        outside = np.abs(gathered["last"] - self.target) > self.tolerance
        return np.where(outside, math.inf, gathered["sum"] - gathered["begin"])
