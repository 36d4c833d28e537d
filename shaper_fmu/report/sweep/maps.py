"""Maps of a sweep's metrics over pairs of varied values."""

from __future__ import annotations

import itertools

import numpy as np

from shaper_fmu.page.blocks import Block, Text
from shaper_fmu.page.figures import Map
from shaper_fmu.report.sweep.curves import slug
from shaper_fmu.report.sweep.data import Axis, SweepData
from shaper_fmu.report.sweep.levels import judged

MOST_LINES = 61
"""Values of an axis that a map is drawn with."""

_FULL = 1.0
"""End of the colour scale of shares: what is worse than the reference has one colour."""


def shown_grid(axis: Axis) -> np.ndarray:
    """The values of the grid that a map shows, shape (n,): all, or evenly chosen ones with the ends and the nominal one."""
    grid = np.array(axis.grid)
    if len(grid) <= MOST_LINES:
        return grid
    chosen = set(np.linspace(0, len(grid) - 1, MOST_LINES).round().astype(int).tolist())
    return grid[sorted(chosen | set(np.flatnonzero(grid == axis.nominal).tolist()))]


def map_values(data: SweepData, values: np.ndarray, case: str, x: int, y: int) -> np.ndarray:
    """Values of a case's completed runs over the start values of the numbers x and y, the others nominal; NaN without a run.

    Shape (values of y, values of x) of `shown_grid`; points off the grid, where a refinement looked, are left out.
    """
    chosen = data.of(case)
    for i, axis in enumerate(data.axes):
        if i not in (x, y):
            chosen &= data.points[:, i] == axis.nominal
    xs, ys = shown_grid(data.axes[x]), shown_grid(data.axes[y])
    columns = np.minimum(np.searchsorted(xs, data.points[:, x]), len(xs) - 1)
    rows = np.minimum(np.searchsorted(ys, data.points[:, y]), len(ys) - 1)
    chosen &= (xs[columns] == data.points[:, x]) & (ys[rows] == data.points[:, y])
    found = np.full((len(ys), len(xs)), np.nan)
    found[rows[chosen], columns[chosen]] = values[chosen]
    found[~np.isfinite(found)] = np.nan
    return found


def metric_map(data: SweepData, metric: str, x: int, y: int) -> Map | None:
    """A panel for each judged case, with the level as a contour; None if no case has values."""
    judgement, quantity = judged(data, metric), data.quantities[metric]
    across, up = data.axes[x], data.axes[y]
    panels = [(case, map_values(data, judgement.values, case, x, y) * judgement.factor) for case in judgement.cases]
    panels = [(case, values) for case, values in panels if np.isfinite(values).any()]
    if not panels:
        return None
    worst = max(float(np.nanmax(values)) for _, values in panels)
    relative = data.study.reference is not None
    largest = 100.0 * _FULL if relative and worst > 100.0 * _FULL else None
    return Map(
        f"map_{metric}_{slug(across.name)}_{slug(up.name)}",
        f"{quantity.description[:1].upper()}{quantity.description[1:]}"
        + (f" relative to {data.study.reference}" if relative else ""),
        across.label(),
        up.label(),
        judgement.label,
        shown_grid(across) * across.factor,
        shown_grid(up) * up.factor,
        panels,
        [(judgement.level * judgement.factor, judgement.shown(judgement.level))],
        largest,
        [(across.nominal * across.factor, up.nominal * up.factor)],
    )


def map_blocks(data: SweepData) -> list[Block]:
    """Maps of every metric over every pair of varied numbers of a grid."""
    if data.study.plan.kind != "grid" or not data.done.any():
        return []
    numbers = [i for i, axis in enumerate(data.axes) if not axis.texts and len(axis.grid) > 1]
    blocks: list[Block] = []
    for metric in data.quantities:
        maps = [metric_map(data, metric, x, y) for x, y in itertools.combinations(numbers, 2)]
        text = judged(data, metric).description
        if any(maps):
            blocks.append(
                Text(f"The strong line is {text}, the cross is the nominal point. Where there is no colour, a run failed.")
            )
        blocks += [one for one in maps if one is not None]
    return blocks
