"""The plan of a study: all runs in a fixed order, computed on demand and not as a list."""

from __future__ import annotations

import itertools
import math
from collections.abc import Callable, Iterator
from functools import cached_property
from typing import Any

import msgspec
import numpy as np

from shaper_fmu.errors import StudyError
from shaper_fmu.sweep.variation import Vary

MOST_RUNS = 100_000_000
MOST_VALUES = 10_000_000
"""Of one start value, or in all samples of a plan: these are held in memory."""
Value = float | bool | str


class Sampling(msgspec.Struct, forbid_unknown_fields=True):
    """How points are chosen: all combinations of the grids ("grid"), the grids side by side ("zip"), or `samples` points.

    Sampled plans are "random", "latin_hypercube" and "sobol" (scrambled; a power of two is best), by scipy.stats.qmc with `seed`.
    All compared cases get the same points.
    """

    kind: str = "grid"
    samples: int | None = None
    seed: int = 0


SAMPLED = ("random", "latin_hypercube", "sobol")
KINDS = ("grid", "zip", *SAMPLED)


class Points:
    """The points of a plan, by number. Raises StudyError for variations that give none."""

    def __init__(self, vary: dict[str, Vary], sampling: Sampling):
        self.names: list[str] = list(vary)
        self.sampling = sampling
        self._vary = vary
        if sampling.kind in SAMPLED:
            if sampling.samples is None or sampling.samples < 1:
                raise StudyError(f"plan: {sampling.kind} needs samples, at least 1")
            _refuse("plan.samples", sampling.samples * len(vary), MOST_VALUES, "values of all samples")
            self.count = sampling.samples
            self._shape: tuple[int, ...] = ()
        else:
            for name, one in vary.items():
                _refuse(f"vary.{name}", one.size, MOST_VALUES, "values")
            if sampling.kind == "grid":
                _refuse("plan", math.prod(one.size for one in vary.values()), MOST_RUNS, "points")
            kinds = [(name, one.grid if sampling.kind == "grid" else one.listed) for name, one in vary.items()]
            self._grids = [self._named(name, values) for name, values in kinds]
            self._shape = tuple(len(grid) for grid in self._grids)
            self.count: int = math.prod(self._shape) if sampling.kind == "grid" else self._common_length()
        _refuse("plan", self.count, MOST_RUNS, "points")

    @staticmethod
    def _named(name: str, grid: Callable[[], Any]) -> Any:
        try:
            return grid()
        except StudyError as error:
            raise StudyError(f"vary.{name}: {error}") from None

    def _common_length(self) -> int:
        if len(set(self._shape)) > 1:
            shown = ", ".join(f"{name}: {n}" for name, n in zip(self.names, self._shape, strict=True))
            raise StudyError(f"plan: zip needs lists of one length; here are {shown}")
        return self._shape[0]

    def point(self, number: int) -> tuple[Value, ...]:
        """The values at a point, in the order of `names`."""
        if self.sampling.kind in SAMPLED:
            return tuple(self._samples[number].tolist())
        if self.sampling.kind == "zip":
            return tuple(grid[number] for grid in self._grids)
        return tuple(grid[i] for grid, i in zip(self._grids, np.unravel_index(number, self._shape), strict=True))

    def __iter__(self) -> Iterator[tuple[Value, ...]]:
        if self.sampling.kind in SAMPLED:
            return (tuple(row.tolist()) for row in self._samples)
        return itertools.product(*self._grids) if self.sampling.kind == "grid" else zip(*self._grids, strict=True)

    @cached_property
    def _samples(self) -> np.ndarray:
        """Shape (count, variables)."""
        shares = _shares(self.sampling, self.count, len(self.names))
        columns = [
            self._named(name, lambda i=i, one=one: one.quantiles(shares[:, i])) for i, (name, one) in enumerate(self._vary.items())
        ]
        return np.column_stack(columns)


def _refuse(where: str, number: int, most: int, what: str) -> None:
    """Raise StudyError for a number that is too large; before anything is made of it."""
    if number > most:
        shown = str(number) if number < 10**15 else f"more than {10**15}"
        raise StudyError(f"{where}: {shown} {what} are too many ({most} at most)")


def _shares(sampling: Sampling, count: int, dimensions: int) -> np.ndarray:
    """Points of the unit cube, shape (count, dimensions), the same for the same seed."""
    from scipy.stats import qmc

    if sampling.kind == "random":
        return np.random.default_rng(sampling.seed).random((count, dimensions))
    generator = np.random.default_rng(sampling.seed)
    if sampling.kind == "latin_hypercube":
        return qmc.LatinHypercube(dimensions, rng=generator).random(count)
    # its balance needs a power of two; what is asked for is the beginning
    shares = qmc.Sobol(dimensions, rng=generator).random_base2(math.ceil(math.log2(count)))[:count]
    return np.clip(shares, 1e-12, 1.0 - 1e-12)  # a share of 0 would be an endless value of a normal distribution
