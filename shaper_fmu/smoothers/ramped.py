"""ZV and ZVD whose jumps are ramps, the moving average among them, and the smoother, whose jumps are S-curves.

A shaper convolved with a box has all zeros of the shaper, damped or not, and no jump. Where the box of ZV takes half a damped
period, one ramp follows the other: without damping this is the mean over a period. Twice that is, without damping, the triangle of
the smoother of Xie, Huang and Liang 2013.
"""

from __future__ import annotations

import math

from shaper_fmu.component import Parameter
from shaper_fmu.shapers.zero_derivative import zero_derivative
from shaper_fmu.smoothers.method import SmootherMethod
from shaper_fmu.smoothers.terms import put_box, square
from shaper_fmu.smoothers.workspace import SmootherWorkspace


def _ramped(m: SmootherWorkspace, damping_ratio: float, order: int, periods: float) -> int:
    """The sequence with `order` zero derivatives for 1 rad/s, each impulse a box of so many damped periods."""
    impulses = zero_derivative(m.unknown, m.kept, order, 1.0, damping_ratio)
    width = periods * 2.0 * math.pi / math.sqrt(1.0 - damping_ratio * damping_ratio)
    count = 0
    for i in range(impulses):
        count = put_box(m, count, m.unknown[i], m.kept[i], width)
    return count


def ramped_zv(m: SmootherWorkspace, damping_ratio: float) -> int:
    """Ramped ZV; returns the number of terms."""
    return _ramped(m, damping_ratio, 0, m.ramp_periods)


def ramped_zvd(m: SmootherWorkspace, damping_ratio: float) -> int:
    """Ramped ZVD; returns the number of terms."""
    return _ramped(m, damping_ratio, 1, m.ramp_periods)


def smoother(m: SmootherWorkspace, damping_ratio: float) -> int:
    """Ramped ZV of half a period, twice; returns the number of terms."""
    return square(m, _ramped(m, damping_ratio, 0, 0.5))


_RAMP_PERIODS = {
    "ramp_periods": Parameter(
        0.5, "", "damped periods that each ramp of ramped_zv and ramped_zvd takes", min=0.0, max=2.0, exclusive="min",
        published=(1e-3, 2.0),
    )
}  # fmt: skip
RAMPED_ZV = SmootherMethod(
    name="ramped_zv",
    number=4,
    title="ramped ZV",
    kernel=ramped_zv,
    parameters=_RAMP_PERIODS,
    summary="ZV with ramps in place of jumps; with ramps of half a period and no damping the mean over a period",
)
RAMPED_ZVD = SmootherMethod(
    name="ramped_zvd",
    number=5,
    title="ramped ZVD",
    kernel=ramped_zvd,
    parameters=_RAMP_PERIODS,
    summary="ZVD with ramps in place of jumps",
)
SMOOTHER = SmootherMethod(
    name="smoother",
    number=6,
    kernel=smoother,
    summary="ramped ZV twice: S-curves without a kink, with a zero derivative",
    paper="Xie, Huang and Liang 2013",
)
