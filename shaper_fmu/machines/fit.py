"""Finds the setting of a firmware that serves the modes best, judged by the impulses that the firmware makes of it."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np
from scipy.optimize import minimize_scalar

from shaper_fmu.machines.firmware import Firmware, Setting
from shaper_fmu.tune.choice.bounds import remaining
from shaper_fmu.tune.choice.boxes import ModeBox
from shaper_fmu.tune.choice.candidates import Design, Factor
from shaper_fmu.tune.choice.requirements import Requirements
from shaper_fmu.tune.choice.result import fits
from shaper_fmu.tune.choice.search import Candidate, Search

_WIDE = (0.4, 2.5)
"""Frequencies that are tried, as shares of the lowest and of the highest one of the modes: shapers of several humps, and those for
several modes, are set to others than the modes' own."""
_STEPS = 160
_RADIANS = 2.0 * np.pi


@dataclass(frozen=True)
class Fitted:
    """The best setting of one of a firmware's shapers, and what its impulses leave: proven bounds, as of any candidate."""

    setting: Setting
    candidate: Candidate


def fit(firmware: Firmware, boxes: Sequence[ModeBox], requirements: Requirements) -> list[Fitted]:
    """The best setting of each shaper of the firmware that takes such frequencies, by rising delay.

    The damping ratio is that of the mode with the largest share, as near as the firmware takes it; the frequency is that with which
    the worst case over the boxes is least, in terms of the tolerances.
    """
    search = Search(boxes, requirements)
    zeta = boxes[int(np.argmax(search.shares.max(axis=1)))].centre[1]
    lowest, highest = min(box.frequencies[0] for box in boxes), max(box.frequencies[1] for box in boxes)
    found = []
    for shaper in firmware.shapers:
        setting = _best(firmware, shaper, (_WIDE[0] * lowest, _WIDE[1] * highest), zeta, search)
        if setting is not None:
            w = _RADIANS * setting.frequency
            name = f"{firmware.title}'s {shaper}"
            factor = Factor(name, tuple(range(len(boxes))), setting.sequence, (w,), (setting.damping_ratio,))
            found.append(Fitted(setting, search.add(Design((factor,)))))
    return sorted(found, key=lambda one: one.candidate.delay)


def best_of(found: Sequence[Fitted], requirements: Requirements) -> tuple[Fitted, bool]:
    """The shortest that fits, or else the one that leaves least in terms of the tolerances; and whether it fits."""
    fitting = [one for one in found if fits(one.candidate, requirements)]
    if fitting:
        return fitting[0], True
    return min(found, key=lambda one: _excess(one.candidate.worst_case, one.candidate.nominal, requirements)), False


def _excess(worst: float, nominal: float, requirements: Requirements) -> float:
    return max(worst / requirements.tolerance, nominal / requirements.nominal_tolerance)


def _best(firmware: Firmware, shaper: str, span: tuple[float, float], zeta: float, search: Search) -> Setting | None:
    """The frequency of the least excess [rad/s]: the best of a grid, then a bounded search around it."""

    def excess(w: float) -> float:
        setting = firmware.setting(shaper, w / _RADIANS, zeta)
        if setting is None:
            return np.inf
        levels = search.levels([remaining(setting.sequence, box) for box in search.boxes])
        return _excess(*levels, search.requirements)

    grid = np.geomspace(*span, _STEPS)
    levels = [excess(w) for w in grid]
    i = int(np.argmin(levels))
    if not np.isfinite(levels[i]):
        return None
    return firmware.setting(shaper, _refined(excess, grid, i) / _RADIANS, zeta)


def _refined(excess: Callable[[float], float], grid: np.ndarray, i: int) -> float:
    around = float(grid[max(i - 1, 0)]), float(grid[min(i + 1, len(grid) - 1)])
    found: Any = minimize_scalar(excess, bounds=around, method="bounded", options={"xatol": 1e-7 * around[1]})
    return float(found.x) if found.fun <= excess(float(grid[i])) else float(grid[i])
