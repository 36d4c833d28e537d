"""Refinement: adds points where a metric crosses a level between two neighbours of a grid."""

from __future__ import annotations

import itertools
from collections.abc import Iterator

from shaper_fmu.sweep.plan import Value
from shaper_fmu.sweep.store import Store
from shaper_fmu.sweep.study import Study

_SHARES = (0.25, 0.5, 0.75)
"""Where an interval with a crossing is divided: each round makes it four times shorter."""

Point = tuple[Value, ...]
Slice = list[tuple[float, float]]
"""Values of one start value in rising order, each with the metric there."""


def points_to_add(study: Study, store: Store) -> list[tuple[str, Point]]:
    """The runs to do next: case and values. None when all intervals with crossings are short enough."""
    refine = study.refine
    if refine is None:
        return []
    found: dict[tuple[str, Point], None] = {}
    names = list(study.vary)
    for place in range(len(names)):
        for case, others, slice_ in slices(study, store, place):
            for low, high in crossing_intervals(slice_, refine.level):
                if high - low > refine.width:
                    points = [(*others[:place], low + share * (high - low), *others[place:]) for share in _SHARES]
                    for point in points:
                        found[case, point] = None
                        if study.reference is not None:
                            found[study.reference, point] = None
    return list(found)


def slices(study: Study, store: Store, place: int) -> Iterator[tuple[str, Point, Slice]]:
    """Case, values of the others, and the metric along one start value: for each choice of the others on the grid.

    With a reference the metric is a share of the reference's at the same point; points without one are left out.
    """
    assert study.refine is not None
    metrics: dict[str, dict[Point, float]] = {case: {} for case in study.compare}
    for run in store.iterate("done"):
        metrics[run.compared][tuple(run.varied.values())] = run.metrics[study.refine.metric]
    base = metrics.get(study.reference or "")
    grids = [set(vary.grid()) for i, vary in enumerate(study.vary.values()) if i != place]
    for case, values in metrics.items():
        if case == study.reference:
            continue
        along: dict[Point, Slice] = {}
        for point, metric in values.items():
            others = (*point[:place], *point[place + 1 :])
            if isinstance(point[place], str) or not all(v in grid for v, grid in zip(others, grids, strict=True)):
                continue
            if base is None:
                along.setdefault(others, []).append((float(point[place]), metric))
            elif base.get(point):
                along.setdefault(others, []).append((float(point[place]), metric / base[point]))
        for others, slice_ in along.items():
            yield case, others, sorted(slice_)


def crossing_intervals(slice_: Slice, level: float) -> list[tuple[float, float]]:
    """Neighbours between which the metric crosses the level."""
    return [(low, high) for (low, a), (high, b) in itertools.pairwise(slice_) if (a > level) != (b > level)]


def tolerated_band(slice_: Slice, level: float, nominal: float) -> tuple[float, float] | None:
    """The values around the nominal one up to which the metric stays within the level, by straight lines between neighbours.

    None if it is beyond the level at the nominal value; an end of the slice where it never crosses.
    """
    places = [value for value, _ in slice_]
    if nominal not in places or slice_[places.index(nominal)][1] > level:
        return None
    start = places.index(nominal)

    def edge(numbers: range) -> float:
        for i, k in itertools.pairwise(numbers):
            (inside, a), (outside, b) = slice_[i], slice_[k]
            if b > level:
                return inside + (outside - inside) * (level - a) / (b - a)
        return slice_[numbers[-1]][0]

    return edge(range(start, -1, -1)), edge(range(start, len(slice_)))
