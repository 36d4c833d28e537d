"""Exact switches from a move on a grid: the structure is read off the cells, then Newton's method moves the switches.

The equations are those that define the move: rest and distance at the end, no residual vibration (or the tolerance, where it is
reached), and the limits that it reaches. There are at least as many switches as equations in an optimum; a step is the least
change of the switches that solves the linearised equations, so that the duration stays that of the grid to first order.
"""

from __future__ import annotations

import numpy as np

from shaper_fmu.design.moves.control import Control
from shaper_fmu.design.moves.programme import GridMove
from shaper_fmu.design.moves.shorten import (
    at_switches,
    end_slopes,
    limited_states,
    residual_conditions,
    residual_size_slopes,
    shorten,
)
from shaper_fmu.design.moves.task import Task

_SATURATED = 0.02
_REACHED = 1e-4
"""A limit is reached where this share or less is missing."""
_TOLERANCE_REACHED = 1e-3
_MARGIN = 1e-13
"""Share by which reached limits are missed, so that rounding does not exceed them."""
_TINY = 1e-9
_STILL = 1e-2
_TOLERANCE_MARGIN = 1e-9
_DONE = 2e-13
_STEPS = 40
_VANISHED = 1e-7
_SHORTEST = (1e-2, 1e-3, 1e-4, 0.0)
"""Shares of the duration below which segments are left out at once, tried one after the other."""
_LONGER = 5e-3
"""A polished move may be longer than that on the grid by this share."""
_SIMPLER = 5e-5
"""The share by which fewer switches may make it longer."""
_RAMPS = 4.0
"""The ramps instead of jumps may make the move longer by this multiple of their time."""
_SHORT = 0.05
"""Share of the duration up to which a segment may be superfluous."""
_LIMITS_KEPT = 1e-12
_ROUNDING = 2e-15
"""Share of the control's limit to which the motion is known: a hard jerk for a short time."""


def polished(task: Task, move: GridMove) -> Control | None:
    """The exact move near one on a grid with few switches, None if there is none. It keeps all limits and tolerances."""
    read, whole = _coarsened(_read(task, move), _TINY), move.control.duration
    best: Control | None = None
    for share in _SHORTEST:
        control = _newton(task, _coarsened(shorten(task, _coarsened(read, share * whole)), _VANISHED))
        if control is not None and (best is None or control.duration < best.duration):
            best = control
            if best.duration <= whole * (1.0 + _SIMPLER):
                break
    return _simplified(task, best) if best is not None and best.duration <= whole * (1.0 + _LONGER) else None


def with_ramps(task: Task, control: Control) -> Control | None:
    """The move with limited jerk near one whose acceleration jumps: each jump becomes a ramp. None if there is none."""
    top = task.limits[2]
    jumps = control.jumps
    half = 0.5 * np.abs(jumps) / top
    at = control.times + half[0]
    times = np.column_stack((at - half, at + half)).ravel()
    values = np.column_stack((top * np.sign(jumps), np.zeros(len(jumps)))).ravel()[:-1]
    if np.diff(times).min() < 0.0:
        return None
    ramped = Control(np.concatenate(([0.0], times[1:])), values, 3)
    found = made_exact(task, ramped)
    return found if found is not None and found.duration <= control.duration + _RAMPS * float(half.sum()) else None


def made_exact(task: Task, control: Control) -> Control | None:
    """The exact move near any control with about the right switches, as short as they permit; None if there is none."""
    return _newton(task, _coarsened(shorten(task, _coarsened(control, _TINY)), _VANISHED))


def _simplified(task: Task, control: Control) -> Control:
    """Without segments that it can do without: each is left out, the shortest first, if the rest makes up for it at once."""
    longest = control.duration * (1.0 + _SIMPLER)
    while True:
        widths = np.diff(control.times)
        for k in np.argsort(widths):
            if widths[k] > _SHORT * control.duration or len(widths) < 3:
                return control
            shorter = _newton(task, _without(control, int(k)))
            if shorter is not None and shorter.duration <= longest:
                control = shorter
                break
        else:
            return control


def _read(task: Task, move: GridMove) -> Control:
    """Switches from cells: a loose cell between two levels is a switch at the place that keeps its area."""
    times, top = move.control.times, task.largest_control
    control = move.control.values / move.distance
    nearest = task.nearest_level(control)
    snapped = np.where(np.abs(control - nearest) <= _SATURATED * top, nearest, control) / top
    known = set((task.levels() / top).tolist())
    ends: list[float] = []
    values: list[float] = []
    i, n = 0, len(snapped)
    while i < n:
        level, j = snapped[i], i + 1
        while j < n and snapped[j] == level:
            j += 1
        alone = level not in known and values and j < n
        if alone:
            left, right = values[-1], snapped[j]
            begin, end = times[i], times[j]
            if left != right and min(left, right) <= level <= max(left, right):
                ends[-1] = begin + (end - begin) * (level - right) / (left - right)
                i = j
                continue
        if values and values[-1] == level:
            ends[-1] = times[j]
        else:
            values.append(float(level))
            ends.append(float(times[j]))
        i = j
    return Control(np.array([0.0, *ends]), top * np.array(values), task.order)


def _newton(task: Task, control: Control) -> Control | None:
    """The control with its switches moved until all equations hold; None if they cannot.

    Tolerances that are nearly reached are equations at first; where there are not enough switches for that, only those exceeded.
    """
    for near in (_TOLERANCE_REACHED, 0.0):
        found = _solved(task, control, near)
        if found is not None:
            return found
    return None


def _solved(task: Task, control: Control, near: float) -> Control | None:
    done = max(_DONE, 0.1 * _rounding(task))
    for _ in range(_STEPS):
        misses, slopes = _equations(task, control, near)
        if np.abs(misses).max() <= done:
            break
        change = np.linalg.lstsq(slopes[:, 1:], -misses, rcond=1e-9)[0]
        change *= min(1.0, 0.05 / max(1e-300, float(np.abs(change).max())))
        control = Control(np.concatenate(([0.0], control.times[1:] + change)), control.values, control.order)
        control = _coarsened(control, _TINY)
        if not np.isfinite(control.times).all() or len(control.values) < 2:
            return None
    return control if keeps(task, control) else None


def _coarsened(control: Control, shortest: float) -> Control:
    """Without segments that are shorter than this, the shortest first."""
    while len(control.values) > 2:
        widths = np.diff(control.times)
        if widths.min() > shortest:
            break
        control = _without(control, int(np.argmin(widths)))
    return control


def _without(control: Control, k: int) -> Control:
    """Without the k-th segment, half of whose time goes to each neighbour, nor switches that change nothing then."""
    times = control.times.copy()
    if 0 < k < len(times) - 2:
        times[k] = 0.5 * (times[k] + times[k + 1])
    times = np.delete(times, k if k == len(times) - 2 else k + 1)
    values = np.delete(control.values, k)
    kept = np.flatnonzero(np.diff(values) != 0.0)
    return Control(np.concatenate(([0.0], times[1:-1][kept], times[-1:])), np.append(values[kept], values[-1]), control.order)


def _equations(task: Task, control: Control, near: float) -> tuple[np.ndarray, np.ndarray]:
    """By how much the equations of the move are missed, and their changes with the times: rest, distance, and what is reached."""
    end = control.times[-1:]
    found = [(control.state(k, end) - (k == 0), end_slopes(control, k)) for k in range(task.order)]
    for band in task.bands:
        if band.tolerance == 0.0:
            misses, _, slopes = residual_conditions(control, band.low, band.damping_ratio)
            found.append((misses, slopes))
            continue
        for w, v in zip(*control.peaks(band), strict=True):
            if v > band.tolerance * (1.0 - near):
                slopes = residual_size_slopes(control, w, band.damping_ratio)[None]
                found.append((np.array([v - band.tolerance * (1.0 - _TOLERANCE_MARGIN)]), slopes))
    for k in task.limited():
        x, slopes = limited_states(control, k)
        reached = np.abs(x) >= task.limits[k - 1] * (1.0 - _REACHED)
        found.append(((x - np.sign(x) * task.limits[k - 1] * (1.0 - _MARGIN))[reached], slopes[reached]))
    if task.order == 3 and 1 in task.limited():
        found.append(_cruise(task, control))
    found += [one.equations(control, _REACHED, _MARGIN) for one in task.deflections]
    return np.concatenate([misses for misses, _ in found]), np.vstack([slopes for _, slopes in found])


def _cruise(task: Task, control: Control) -> tuple[np.ndarray, np.ndarray]:
    """Along the largest speed the acceleration is 0."""
    inner = np.arange(1, len(control.times) - 1)
    resting = control.values == 0.0
    fast = np.abs(control.state(1, control.times[inner])) >= task.limits[0] * (1.0 - _REACHED)
    a, slopes = at_switches(control, 2, inner)
    found = fast & (resting[inner] | resting[inner - 1]) & (np.abs(a) <= _STILL * np.abs(control.state(2, control.times)).max())
    return a[found], slopes[found]


def keeps(task: Task, control: Control) -> bool:
    """Whether the control is at rest at the distance 1 at its end, keeps its limits and leaves no more vibration than tolerated."""
    end, rounding = control.times[-1:], _rounding(task)
    if any(abs(float(control.state(k, end)[0]) - (k == 0)) > rounding for k in range(task.order)):
        return False
    if np.abs(control.values).max() > task.largest_control * (1.0 + rounding):
        return False
    instants = np.concatenate((control.times, control.turns()))
    if any(np.abs(control.state(k, instants)).max() > task.limits[k - 1] * (1.0 + rounding) for k in task.limited()):
        return False
    for band in task.bands:
        worst = abs(control.residual(band.low, band.damping_ratio)) if band.tolerance == 0.0 else control.peaks(band)[1].max()
        if worst > max(band.tolerance, 1e-11, rounding):
            return False
    return all(one.peak(control) <= one.limit * (1.0 + rounding) for one in task.deflections)


def _rounding(task: Task) -> float:
    """What limits, rest and distance are kept to."""
    return max(_LIMITS_KEPT, _ROUNDING * task.largest_control)
