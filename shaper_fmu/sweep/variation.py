"""The variation of one start value in a study: values on a grid or from a distribution."""

from __future__ import annotations

import math
from collections.abc import Sequence
from typing import Literal

import msgspec
import numpy as np

from shaper_fmu.errors import StudyError

_SAME = 1e-11


class Vary(msgspec.Struct, forbid_unknown_fields=True):
    """Values of one start value.

    On a grid: `values`; or `factors` of the nominal value; or `points` from `low` to `high`, spaced evenly or by equal
    ratios ("log"). In a sampled plan: a `distribution`, uniform from `low` to `high` if none is named; normal and log_normal
    take the mean and the standard deviation of the value itself, triangular has its mode at the nominal value.
    `nominal` is the system's own value if it is left out.
    """

    nominal: float | None = None
    values: list[float | bool | str] | None = None
    factors: list[float] | None = None
    low: float | None = None
    high: float | None = None
    points: int = 21
    spacing: Literal["linear", "log"] = "linear"
    distribution: Literal["uniform", "normal", "log_normal", "triangular"] | None = None
    mean: float | None = None
    deviation: float | None = None

    @property
    def size(self) -> int:
        """How many values are listed, without the list."""
        listed = self.values if self.values is not None else self.factors
        return len(listed) if listed is not None else self.points

    def grid(self) -> Sequence[float | bool | str]:
        """The values in rising order (those of a list of texts in their order), the nominal one among them. StudyError."""
        chosen = self.listed()
        numbers = [float(value) for value in chosen if not isinstance(value, bool | str)]
        if len(numbers) < len(chosen):
            return chosen
        if self.nominal is not None:
            numbers = [value for value in numbers if abs(value - self.nominal) > _SAME * abs(self.nominal)] + [self.nominal]
        return sorted(numbers)

    def listed(self) -> Sequence[float | bool | str]:
        """The values as they are given, in their order. StudyError."""
        if self.values is not None:
            chosen = list(self.values)
        elif self.factors is not None:
            if self.nominal is None:
                raise StudyError("factors need a nominal value")
            chosen = [float(f"{factor * self.nominal:.12g}") for factor in self.factors]
        elif self.low is not None and self.high is not None and self.points >= 2:
            space = np.linspace if self.spacing == "linear" else np.geomspace
            if self.spacing == "log" and not 0.0 < self.low < self.high:
                raise StudyError(f"log spacing needs 0 < low < high, not low = {self.low:g} and high = {self.high:g}")
            with np.errstate(over="ignore", invalid="ignore"):  # reported below
                chosen = [float(f"{value:.12g}") for value in space(self.low, self.high, self.points)]
        else:
            raise StudyError("give values, or factors, or low and high with at least 2 points")
        if not chosen:
            raise StudyError(f"{'values' if self.values is not None else 'factors'} = [] must have at least one entry")
        wrong = next((value for value in chosen if not isinstance(value, str) and not math.isfinite(value)), None)
        if wrong is not None:
            raise StudyError(f"a value of {wrong} is not a finite number; low, high, factors and nominal are too large together")
        return chosen

    def quantiles(self, shares: np.ndarray) -> np.ndarray:
        """The values at which the distribution function reaches these shares in (0, 1), shape (n,). StudyError."""
        from scipy import stats

        if self.distribution in (None, "uniform"):
            low, high = self._bounds()
            return low + (high - low) * shares
        if self.distribution == "triangular":
            low, high = self._bounds()
            if self.nominal is None or not low <= self.nominal <= high:
                raise StudyError(f"triangular needs a nominal value between low and high, not {self.nominal}")
            return np.asarray(stats.triang.ppf(shares, (self.nominal - low) / (high - low), low, high - low))
        mean = self.mean if self.mean is not None else self.nominal
        if mean is None or self.deviation is None or not self.deviation > 0.0:
            raise StudyError(f"{self.distribution} needs a mean (or a nominal value) and a deviation above 0")
        if self.distribution == "normal":
            return np.asarray(stats.norm.ppf(shares, mean, self.deviation))
        if not mean > 0.0:
            raise StudyError(f"log_normal needs a mean above 0, not {mean:g}")
        spread = math.sqrt(math.log1p((self.deviation / mean) ** 2))
        return np.asarray(stats.lognorm.ppf(shares, spread, scale=mean * math.exp(-0.5 * spread * spread)))

    def _bounds(self) -> tuple[float, float]:
        if self.low is None or self.high is None or not self.low < self.high:
            raise StudyError(f"{self.distribution or 'uniform'} needs low < high, not {self.low} and {self.high}")
        return self.low, self.high
