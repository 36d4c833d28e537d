"""Moves the switches of a control to the shortest duration by successive linear programmes.

The unknowns are the durations of the segments, which may shrink to nothing: so segments that the grid has made up vanish. Each
programme minimises the duration plus a penalty on the largest violation of the linearised conditions, within a trust region that
shrinks where the linearisation misleads.
"""

from __future__ import annotations

import numpy as np
from scipy.optimize import linprog

from shaper_fmu.design.moves.control import Control
from shaper_fmu.design.moves.task import Task

_PENALTIES = (50.0, 2000.0)
"""Weights of the largest violation: the second where the first leaves one, since the duration depends so much on it."""
_HOLDS = 1e-6
_FIRST_RADIUS = 0.01
_LEAST_RADIUS = 1e-8
_STEPS = 60
_NEAR = 0.5
"""Limits and tolerances are looked at where at least this share of them is used."""

Conditions = tuple[np.ndarray, np.ndarray, np.ndarray]
"""Values that must be 0 or at most 0, whether they must be 0, and their changes with all times, a row each."""


def shorten(task: Task, control: Control) -> Control:
    """A control near this one that is as short as the conditions permit; they hold nearly, Newton's method makes them exact."""
    found = control
    for penalty in _PENALTIES:
        found = _shortened(task, control, penalty)
        if _violation(conditions(task, found)) <= _HOLDS:
            break
    return found


def _shortened(task: Task, control: Control, penalty: float) -> Control:
    radius = _FIRST_RADIUS
    found = conditions(task, control)
    for _ in range(_STEPS):
        change, promised = _step(control, found, radius, penalty)
        merit = control.duration + penalty * _violation(found)
        predicted = merit - promised
        if predicted <= 1e-10 or radius < _LEAST_RADIUS:
            break
        candidate = Control(np.concatenate(([0.0], np.cumsum(np.diff(control.times) + change))), control.values, control.order)
        new = conditions(task, candidate)
        gain = (merit - candidate.duration - penalty * _violation(new)) / predicted
        if gain > 0.0:
            control, found = candidate, new
        radius = min(0.1, 2.0 * radius) if gain > 0.75 else radius if gain > 0.25 else 0.25 * radius
    return control


def _violation(found: Conditions) -> float:
    values, exact, _ = found
    return float(np.where(exact, np.abs(values), np.maximum(values, 0.0)).max())


def _step(control: Control, found: Conditions, radius: float, penalty: float) -> tuple[np.ndarray, float]:
    """The best changes of the durations within the trust region, and the merit that they promise."""
    values, exact, by_time = found
    slopes = np.cumsum(by_time[:, :0:-1], axis=1)[:, ::-1]  # with a duration all later times change
    matrix = np.vstack((slopes, -slopes[exact]))
    matrix = np.hstack((matrix, np.full((len(matrix), 1), -1.0)))
    widths = np.diff(control.times)
    bounds = [*zip(np.maximum(-widths, -radius), np.full(len(widths), radius), strict=True), (0.0, None)]
    cost = np.append(np.ones(len(widths)), penalty)
    result = linprog(cost, matrix, np.concatenate((-values, values[exact])), bounds=bounds, method="highs")
    if result.x is None:
        return np.zeros(len(widths)), np.inf
    return result.x[:-1], control.duration + float(result.fun)


def conditions(task: Task, control: Control) -> Conditions:
    """Everything that the control must keep, each as a share of its limit."""
    values: list[np.ndarray] = []
    exact: list[np.ndarray] = []
    slopes: list[np.ndarray] = []

    def add(found: np.ndarray, equal: bool, by_time: np.ndarray) -> None:
        values.append(found)
        exact.append(np.full(len(found), equal))
        slopes.append(by_time)

    end = control.times[-1:]
    for k in range(task.order):
        add(control.state(k, end) - (k == 0), True, end_slopes(control, k))
    for band in task.bands:
        if band.tolerance == 0.0:
            add(*residual_conditions(control, band.low, band.damping_ratio))
        else:
            w, v = control.peaks(band)
            for one, height in zip(w[v > _NEAR * band.tolerance], v[v > _NEAR * band.tolerance], strict=True):
                by_time = residual_size_slopes(control, one, band.damping_ratio) / band.tolerance
                add(np.array([height / band.tolerance - 1.0]), False, by_time[None])
    for k in task.limited():
        x, by_time = limited_states(control, k)
        used = np.abs(x) >= _NEAR * task.limits[k - 1]
        sign = np.sign(x[used])
        add(sign * x[used] / task.limits[k - 1] - 1.0, False, sign[:, None] * by_time[used] / task.limits[k - 1])
    for one in task.deflections:
        excess, by_time = one.conditions(control, one.extremes(control))
        used = excess >= _NEAR - 1.0
        add(excess[used], False, by_time[used])
    return np.concatenate(values), np.concatenate(exact), np.vstack(slopes)


def end_slopes(control: Control, k: int) -> np.ndarray:
    """How the k-th derivative at the end changes with the times, of which the last is the end itself."""
    end = control.times[-1:]
    slopes = control.state_slopes(k, end)
    slopes[0, -1] = control.values[-1] if k == control.order - 1 else control.state(k + 1, end)[0]
    return slopes


def residual_conditions(control: Control, w: float, damping_ratio: float) -> tuple[np.ndarray, bool, np.ndarray]:
    """Real and imaginary part of a residual that must be 0, and their slopes."""
    scale = w ** (control.order - 2)
    r, slopes = scale * control.residual(w, damping_ratio), scale * control.residual_slopes(w, damping_ratio)
    return np.array([r.real, r.imag]), True, np.array([slopes.real, slopes.imag])


def residual_size_slopes(control: Control, w: float, damping_ratio: float) -> np.ndarray:
    """How V changes with the times."""
    r = control.residual(w, damping_ratio)
    return (np.conj(r) / max(abs(r), 1e-300) * control.residual_slopes(w, damping_ratio)).real


def limited_states(control: Control, k: int) -> tuple[np.ndarray, np.ndarray]:
    """The k-th derivative where it can be largest: at the inner switches, and where the next one passes through 0."""
    which = np.arange(1, len(control.times) - 1)
    x, slopes = at_switches(control, k, which)
    if k == 1 and control.order == 3:
        turns = control.turns()
        return np.append(x, control.state(1, turns)), np.vstack((slopes, control.state_slopes(1, turns)))
    return x, slopes


def at_switches(control: Control, k: int, which: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """The k-th derivative at these switches, and how it changes with the times when they move themselves."""
    at = control.times[which]
    slopes = control.state_slopes(k, at)
    ahead = control.before()[which] if k == control.order - 1 else control.state(k + 1, at)
    slopes[np.arange(len(at)), which] = ahead
    return control.state(k, at), slopes
