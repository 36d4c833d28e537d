"""The worst case of a verification: a grid over the range of the parameters, and a compass search from its worst place."""

from __future__ import annotations

import itertools
import math
from collections.abc import Iterable, Iterator, Mapping, Sequence

import numpy as np

from shaper_fmu.errors import ComponentError, SimulationError
from shaper_fmu.tune.plant import Plant
from shaper_fmu.tune.verification.runs import STAYS, ShapedRuns
from shaper_fmu.tune.verification.shares import Measured

_POINTS = {1: 9, 2: 5}
_FEWEST_POINTS = 3
_LITTLE = 0.2
"""Of what a share may change by: a search ends where there is no more to gain."""
_FINEST = 1.0 / 128.0
_MOST_SEARCHED = 80
_FEWEST = 2
"""Places that are worth a worker."""


def run_at(plant: Plant, runs: ShapedRuns, values: Mapping[str, float]) -> None:
    """In a worker: make the runs at a place, which keeps them."""
    assert runs.plant is plant  # else they would not be kept
    runs.measured(values)


class WorstCase:
    """A search for the largest share, over places in [-1, 1]^n."""

    def __init__(self, runs: ShapedRuns, nominals: Mapping[str, float], spread: Mapping[str, float]):
        self._runs, self._nominals, self._spread = runs, nominals, spread
        self.points: dict[tuple[float, ...], Measured] = {}
        self.failed: list[tuple[Mapping[str, float], str]] = []
        self._tried: set[tuple[float, ...]] = set()
        self._ended: dict[tuple[float, ...], str] = {}

    def measured(self, place: tuple[float, ...], needed: bool = False) -> Measured | None:
        """The measured shares at a point; None if the plant could not be run."""
        if place in self._tried:
            return self.points.get(place)
        self._tried.add(place)
        values = self._values(place)
        if place in self._ended:
            self.failed.append((values, self._ended[place]))
            return None
        try:
            found = self._runs.measured(values)
            self._runs.check_rest(found)
        except (SimulationError, ComponentError) as error:
            if needed:
                raise
            self.failed.append((values, str(error)))
            return None
        self.points[place] = found
        return self.points[place]

    def _values(self, place: tuple[float, ...]) -> dict[str, float]:
        pairs = zip(self._nominals.items(), place, strict=True)
        return {name: value * (1.0 + x * self._spread[name]) for (name, value), x in pairs}

    def _run_ahead(self, places: Iterable[tuple[float, ...]]) -> None:
        """Have the workers make the runs at these places, which are then at hand here."""
        plant = self._runs.plant
        wanted = [place for place in places if place not in self._tried]
        if plant.workers is None or len(wanted) < _FEWEST:
            return
        plant.workers.share(plant)
        calls = [(self._runs, self._values(place)) for place in wanted]
        for place, done in zip(wanted, plant.workers.each(plant, run_at, calls, self._runs.steps), strict=False):
            if done is None:
                break
            if done.ended:
                self._ended[place] = f"an FMU fails: {done.ended}"
            plant.workers.take(plant, done, ahead=True)

    def grid(self) -> None:
        """Corners and points between them."""
        count = _POINTS.get(len(self._spread), _FEWEST_POINTS)
        places = list(itertools.product(np.linspace(-1.0, 1.0, count).tolist(), repeat=len(self._spread)))
        self._run_ahead(places)
        for place in places:
            self.measured(place)

    def compass(self) -> None:
        """From the worst place on to the worst of its neighbours, with ever smaller steps, as long as these can matter."""
        place = max(self.points, key=lambda one: self.points[one].share)
        step, begun = 0.5, len(self._tried)
        spacing = 2.0 / (_POINTS.get(len(self._spread), _FEWEST_POINTS) - 1)
        while step >= _FINEST and len(self._tried) - begun < _MOST_SEARCHED and place:
            self._run_ahead(_neighbours(place, step))
            around = [(near, self.measured(near)) for near in _neighbours(place, step)]
            better = [(found.share, near) for near, found in around if found is not None and found.share > self.points[place].share]
            if better:
                place = max(better)[1]
            elif step < spacing and self._to_gain(place, step) <= _LITTLE * STAYS * self._runs.tolerance:
                break
            else:
                step *= 0.5

    def _to_gain(self, place: tuple[float, ...], step: float) -> float:
        """What the parabolas through a place and two of its neighbours on each axis, both sides or two on one, rise above it."""
        gain = 0.0
        for k, at in enumerate(place):
            inside = [x for x in (at - step, at + step) if -1.0 <= x <= 1.0]
            inside = inside if len(inside) > 1 else [inside[0], 2.0 * inside[0] - at]
            seen = [self.points.get((*place[:k], x, *place[k + 1 :])) for x in inside]
            if None in seen:
                return math.inf
            shares = [self.points[place].share, *(one.share for one in seen if one is not None)]
            gain = max(gain, _rise([0.0, *(x - at for x in inside)], shares))
        return gain


def _neighbours(place: tuple[float, ...], step: float) -> Iterator[tuple[float, ...]]:
    for k, sign in itertools.product(range(len(place)), (-1.0, 1.0)):
        yield (*place[:k], min(1.0, max(-1.0, place[k] + sign * step)), *place[k + 1 :])


def _rise(places: Sequence[float], values: Sequence[float]) -> float:
    """How much the parabola through three points rises above the first one, between the outer ones."""
    second, first, level = np.polyfit(places, values, 2)
    if second >= 0.0:
        return 0.0
    top = min(max(-0.5 * first / second, min(places)), max(places))
    return float(max(0.0, (second * top + first) * top + level - values[0]))
