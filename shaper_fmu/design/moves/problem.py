"""The arguments of a fastest move, checked, and the task that they make."""

from __future__ import annotations

import math
from collections.abc import Sequence

from shaper_fmu.component import NO_EVENT
from shaper_fmu.design.lp.layout import Band
from shaper_fmu.design.moves.deflection import Deflection
from shaper_fmu.design.moves.task import Task, duration_with_vibration
from shaper_fmu.errors import ArgumentError

MOST_BANDS = 6
MOST_PERIODS = 100.0
"""Periods of the highest mode in the fastest move with vibration, up to which grids resolve it."""

Mode = float | tuple[float, float] | Band
"""A natural frequency [rad/s], alone or with a damping ratio, or a band of frequencies with a tolerance of its own."""


class Problem:
    """Checked arguments, and the task that they make."""

    def __init__(
        self,
        distance: float,
        limits: tuple[float, float, float],
        modes: Sequence[Mode],
        tolerance: float,
        deflection_limit: float | Sequence[float] = math.inf,
    ):
        speed, acceleration, jerk = (math.inf if limit >= NO_EVENT else float(limit) for limit in limits)
        self.limits: tuple[float, float, float] = (speed, acceleration, jerk)
        _check(distance, self.limits)
        bands = [_band(mode, tolerance) for mode in modes]
        self.bands: tuple[Band, ...] = tuple(dict.fromkeys(bands))
        deflections = _deflections(bands, deflection_limit, self.limits)
        self.deflection_limits: tuple[float, ...] = tuple(
            min(
                (one.limit for one in deflections if (one.frequency, one.damping_ratio) == (band.low, band.damping_ratio)),
                default=math.inf,
            )
            for band in self.bands
        )
        if len(self.bands) > MOST_BANDS:
            raise ArgumentError(f"{len(self.bands)} modes; limit: {MOST_BANDS}")
        length = abs(distance)
        self.unit: float = duration_with_vibration(length, *self.limits)
        unit = self.unit
        scaled = speed * unit / length, acceleration * unit**2 / length, jerk * unit**3 / length
        scaled_deflections = tuple(Deflection(one.frequency * unit, one.damping_ratio, one.limit / length) for one in deflections)
        self.task: Task = Task(scaled, tuple(band.scaled(unit) for band in self.bands), scaled_deflections)
        time = unit * self.task.gentle()
        for band in self.bands:
            periods = band.high * time / (2.0 * math.pi)
            if periods > MOST_PERIODS:
                raise ArgumentError(
                    f"a mode of {band.high:g} rad/s has {periods:.0f} periods in the move of {time:.4g} s; limit: {MOST_PERIODS:g}"
                )


def _check(distance: float, limits: tuple[float, ...]) -> None:
    if not math.isfinite(distance) or distance == 0.0:
        raise ArgumentError(f"distance = {distance}: must be a finite number other than 0")
    for name, limit in zip(("max_velocity", "max_acceleration", "max_jerk"), limits, strict=True):
        if not limit > 0.0:
            raise ArgumentError(f"{name} = {limit}: a limit must be greater than 0")
    if math.isinf(limits[1]) and math.isinf(limits[2]):
        raise ArgumentError("the fastest move needs max_acceleration or max_jerk: without both nothing keeps it from jumping")


def _deflections(
    bands: Sequence[Band], limit: float | Sequence[float], limits: tuple[float, float, float]
) -> tuple[Deflection, ...]:
    """The modes whose deflection is limited, by one limit for all or one for each."""
    each = [float(limit)] * max(1, len(bands)) if isinstance(limit, float | int) else [float(one) for one in limit]
    for one in each:
        if not one > 0.0:
            raise ArgumentError(f"deflection_limit = {one}: a limit must be greater than 0 [m]")
    if all(math.isinf(one) for one in each):
        return ()
    if len(each) != len(bands):
        raise ArgumentError(f"deflection_limit: {len(each)} for {len(bands)} modes; give one for all modes, or one for each")
    if math.isfinite(limits[2]):
        raise ArgumentError(f"max_jerk = {limits[2]:g}: a limit of the deflection is for moves without a limit of the jerk")
    for band, one in zip(bands, each, strict=True):
        if band.high > band.low and math.isfinite(one):
            raise ArgumentError(
                f"a band from {band.low:g} to {band.high:g} rad/s: the deflection is limited for single frequencies; "
                "give its ends and some between as modes"
            )
    found = (Deflection(band.low, band.damping_ratio, one) for band, one in zip(bands, each, strict=True) if math.isfinite(one))
    return tuple(dict.fromkeys(found))


def _band(mode: Mode, tolerance: float) -> Band:
    if isinstance(mode, Band):
        band = mode
    else:
        w, damping_ratio = mode if isinstance(mode, tuple) else (mode, 0.0)
        band = Band(float(w), float(w), float(tolerance), float(damping_ratio))
    if not 0.0 < band.low <= band.high < math.inf:
        raise ArgumentError(f"frequencies {band.low:g} to {band.high:g} rad/s: must be positive, finite and not decrease")
    if not 0.0 <= band.damping_ratio < 1.0:
        raise ArgumentError(f"damping ratio {band.damping_ratio:g}: must be at least 0 and less than 1")
    if not 0.0 <= band.tolerance < 1.0:
        raise ArgumentError(f"tolerance {band.tolerance:g}: must be at least 0 and less than 1")
    if band.tolerance == 0.0 and band.high > band.low:
        raise ArgumentError(f"a band from {band.low:g} to {band.high:g} rad/s needs a tolerance: without any vibration is no move")
    return band
