"""A move with on/off commands alone: where it holds a deflection with a lower acceleration, pulses take its place.

Between the pulses the deflection falls and rises again, and must stay within the limit: so the move takes longer, the less the more
pulses there are. Their switches are found by successive linear programmes and Newton's method, as those of the move.
"""

from __future__ import annotations

import numpy as np

from shaper_fmu.design.moves.control import Control
from shaper_fmu.design.moves.polish import made_exact
from shaper_fmu.design.moves.task import Task

_FULL = 1e-9
_NEARLY = 5e-3
"""Share by which on/off commands may be slower before fewer pulses are tried as well."""


def on_off(task: Task, control: Control, most: int) -> Control | None:
    """The move with at most so many pulses in place of each held deflection; None if no exact switches are found."""
    if _switched(task, control).all():
        return control
    best: Control | None = None
    for count in range(most, 0, -1):
        found = made_exact(task, _pulsed(task, control, count))
        if found is not None and _switched(task, found).all() and (best is None or found.duration < best.duration):
            best = found
        if best is not None and best.duration <= control.duration * (1.0 + _NEARLY):
            break
    return best


def _switched(task: Task, control: Control) -> np.ndarray:
    """For each segment whether the control is off or fully on."""
    size = np.abs(control.values) / task.largest_control
    return (size <= _FULL) | (size >= 1.0 - _FULL)


def _pulsed(task: Task, control: Control, count: int) -> Control:
    """Each other segment as equal pulses with the same mean, half a gap at its ends."""
    times, values = [np.zeros(1)], [np.zeros(0)]
    for begin, end, value, full in zip(
        control.times[:-1], control.times[1:], control.values, _switched(task, control), strict=True
    ):
        if full:
            values.append(np.array([value]))
            times.append(np.array([end]))
            continue
        period = (end - begin) / count
        gap = 0.5 * (1.0 - abs(value) / task.largest_control) * period
        starts = begin + period * np.arange(count)
        times += [np.column_stack((starts + gap, starts + period - gap)).ravel(), np.array([end])]
        values.append(np.append(np.tile([0.0, np.sign(value) * task.largest_control], count), 0.0))
    all_times, all_values = np.concatenate(times), np.concatenate(values)
    kept = np.append(np.diff(all_values) != 0.0, True)
    return Control(np.append(0.0, all_times[1:][kept]), all_values[kept], control.order)
