"""The shortest time in which a move gets over the distance 1, on a grid that is refined where the control switches."""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass
from typing import cast

import numpy as np
from scipy.optimize import brentq

from shaper_fmu.design.moves.certificate import certificate
from shaper_fmu.design.moves.programme import GridMove, MoveProgramme
from shaper_fmu.design.moves.task import Task
from shaper_fmu.errors import NoSolutionError

_CELLS = 240
_CELLS_PER_PERIOD = 12
_MOST_CELLS = 900
_COARSE = 1e-3
_SPLIT = 8
_LEVELS = 3
_SATURATED = 1e-6
_GROWTH = 1.25
_LONGEST = 24.0
"""Periods of the slowest mode by which a move may be longer than with vibration."""
_ENOUGH = 1e-7
_LEAST_GAP = 1e-5
"""Share of the duration by which at least the proven one is sought below it."""
_AHEAD = 1.2
_TIGHT = 1e-3
_FINER = 4
_ROUNDING = 1e-12
_DIGITS = 12
"""Of the ends of cells, as shares of the duration: those that differ by rounding are one."""


@dataclass(frozen=True)
class Found:
    """The shortest move on the finest grid, and the duration below which it is proven that there is none."""

    move: GridMove
    proven: float


def shortest_on_grid(task: Task) -> Found:
    """See the module's text. Raises NoSolutionError if no move is short enough to be found."""
    programme = MoveProgramme(task)
    slowest = max((2.0 * math.pi / band.low for band in task.bands), default=0.0)
    longest = 1.0 + task.gentle() + _LONGEST * slowest
    duration = _roughly(programme, longest)
    edges = np.linspace(0.0, 1.0, _cells(task, duration) + 1)
    base = edges
    move = _exactly(programme, edges, duration)
    for _ in range(_LEVELS):
        if len(edges) > _MOST_CELLS:
            break
        finer = _refined(base, move, task)
        if task.deflections and len(finer) > _MOST_CELLS:  # along a held deflection many cells are loose
            break
        edges = finer
        move = _exactly(programme, edges, move.control.duration)
    return Found(move, _proven(programme, edges, move))


def _proven(programme: MoveProgramme, edges: np.ndarray, move: GridMove) -> float:
    """A duration, as long as it can be, for which the multipliers prove that the distance is out of reach; at least 1.

    Where the grid is too coarse for a tight bound, a finer one is taken.
    """
    duration, best = move.control.duration, 1.0
    for grid in (edges, _union(programme.task, [edges, np.linspace(0.0, 1.0, _FINER * _cells(programme.task, duration) + 1)])):
        if grid is not edges:
            move = programme.farthest(grid, duration)
        share = max(_LEAST_GAP, _AHEAD * (certificate(programme.task, move).farthest(duration) - 1.0))
        for _ in range(3):
            shorter = duration * (1.0 - share)
            if not best < shorter:
                break
            near = programme.farthest(grid, shorter)
            bound = certificate(programme.task, near).farthest(shorter)
            if bound < 1.0 - _ROUNDING:
                best = shorter
                break
            share *= 2.0
        if best >= duration * (1.0 - _TIGHT):
            break
    return best


def _roughly(programme: MoveProgramme, longest: float) -> float:
    """About the shortest duration, on a coarse grid."""

    def missing(duration: float) -> float:
        edges = np.linspace(0.0, 1.0, _cells(programme.task, duration) // 2 + 1)
        return 1.0 - programme.farthest(edges, duration).distance

    shorter, duration = 1.0, 1.0
    while missing(duration) > _COARSE:
        shorter, duration = duration, _GROWTH * duration
        if duration > longest:
            raise NoSolutionError(f"no move within {_LONGEST:g} periods of the slowest mode keeps these tolerances and limits")
    return cast(float, brentq(missing, shorter, duration, xtol=_COARSE)) if duration > 1.0 else 1.0


def _cells(task: Task, duration: float) -> int:
    highest = max((band.high for band in task.bands), default=0.0)
    return int(min(_MOST_CELLS, max(_CELLS, _CELLS_PER_PERIOD * duration * highest / (2.0 * math.pi))))


def _exactly(programme: MoveProgramme, edges: np.ndarray, duration: float) -> GridMove:
    """The move over the distance 1, by secants from a duration nearby; never shorter than 1, where the distance may be larger."""
    before: tuple[float, float] | None = None
    move = programme.farthest(edges, duration)
    for _ in range(12):
        miss = 1.0 - move.distance
        if abs(miss) <= _ENOUGH or (duration <= 1.0 and miss < 0.0):
            break
        slope = 1.0 if before is None else (move.distance - before[1]) / (duration - before[0])
        before = duration, move.distance
        step = miss / slope if slope > 0.0 else miss
        duration = max(1.0, duration + max(-0.1, min(0.1, step)))
        if duration == before[0]:
            break
        move = programme.farthest(edges, duration)
    return move


def _refined(base: np.ndarray, move: GridMove, task: Task) -> np.ndarray:
    """The base grid, and each cell of the move's grid split that is not saturated or whose neighbour has another value."""
    edges = move.control.times / move.control.duration
    levels = move.control.values
    snapped = task.nearest_level(levels)
    loose = np.abs(levels - snapped) > _SATURATED * task.largest_control
    changes = np.flatnonzero(np.diff(snapped) != 0.0)
    split = loose.copy()
    split[changes] = split[changes + 1] = True
    parts = [np.linspace(edges[i], edges[i + 1], _SPLIT + 1) for i in np.flatnonzero(split)]
    return _union(task, [base, *parts])


def _union(task: Task, grids: Sequence[np.ndarray]) -> np.ndarray:
    """All ends of cells; with a limited deflection once each: its state is not propagated over a cell without width."""
    ends = np.concatenate(grids)
    return np.unique(ends.round(_DIGITS) if task.deflections else ends)
