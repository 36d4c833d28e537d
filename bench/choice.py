"""`choose` among all shapers for two and for five damped modes, as `tune` does after it has identified them."""

from __future__ import annotations

import time
from collections.abc import Callable, Sequence
from pathlib import Path
from statistics import median

from harness import Row

from shaper_fmu.tune import ModeBox, choose
from shaper_fmu.tune.identify.range import Range

TWO = ((5.0, 0.03, 1.0), (13.0, 0.02, 0.3))
FIVE = ((5.0, 0.03, 1.0), (9.0, 0.02, 0.5), (14.0, 0.02, 0.3), (23.0, 0.03, 0.2), (37.0, 0.02, 0.1))
"""Natural frequencies [rad/s], damping ratios and amplitudes."""
_SPREAD, _DAMPING_SPREAD = 0.04, 0.2


def _boxes(modes: Sequence[tuple[float, float, float]]) -> list[ModeBox]:
    def around(value: float, spread: float) -> Range:
        return Range(nominal=value, low=value * (1.0 - spread), high=value * (1.0 + spread))

    return [ModeBox(around(w, _SPREAD), around(zeta, _DAMPING_SPREAD), (size,)) for w, zeta, size in modes]


def _row(name: str, modes: Sequence[tuple[float, float, float]], allowed: float, turns: int) -> Callable[[Path], Row]:
    def measure(folder: Path) -> Row:
        boxes, seconds = _boxes(modes), []
        for _ in range(turns):
            begin = time.perf_counter()
            choose(boxes)
            seconds.append(time.perf_counter() - begin)
        return Row(name, median(seconds) * 1e6, note=f"the whole choice, once; {allowed:g} s are allowed")

    measure.__name__ = name
    return measure


CHOICES = (_row("choose_two_modes", TWO, 1.0, 3), _row("choose_five_modes", FIVE, 20.0, 1))
