"""Overshoot, as a share."""

from __future__ import annotations

from typing import ClassVar

import numpy as np

from shaper_fmu.metrics.metric import Metric


class Overshoot(Metric, tag="overshoot", frozen=True):
    """How far the output goes beyond its final value, as a share of its way from start to end; 0 if it does not move."""

    unit = "%"
    factor: ClassVar[float] = 100.0

    def values(self, gathered: np.ndarray) -> np.ndarray:
        first, last = gathered["first"], gathered["last"]
        beyond = np.where(last > first, gathered["largest"] - last, last - gathered["smallest"])
        way = np.abs(last - first)
        return np.maximum(0.0, beyond / np.where(way == 0.0, np.inf, way))
