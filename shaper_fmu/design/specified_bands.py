"""Specified insensitivity (SI): the shortest positive shaper that tolerates given intervals of natural frequency.

Singhose, Seering and Singer 1996, "Input shaping for vibration reduction with specified insensitivity to modeling errors":
minimise t_n subject to V(w) <= tolerance for w_low <= w <= w_high, A_i >= 0, sum A_i = 1, with V of Singer and Seering 1990
as in ImpulseSequence.residual_vibration. They enforce V at some frequencies; here it is enforced at every local maximum.

1. On a grid of impulse times the problem is a linear programme for each duration (lp.exchange): this gives the structure.
2. Neighbouring impulses are joined and their times are set free: Newton's method on the conditions of optimality finds the
   shortest duration (lp.stationary). Where it does not get there, successive linear programmes do (lp.polish).
3. All local maxima of V of the finished sequence are found once more; the largest excess over the tolerance is the
   certificate.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import replace

import numpy as np

from shaper_fmu.design.impulse_sequence import ImpulseSequence
from shaper_fmu.design.lp.exchange import grid_solution, peaks, shortest_on_grid
from shaper_fmu.design.lp.layout import Band, GeneralLayout, Layout, layout_for, to_sequence
from shaper_fmu.design.lp.polish import band_constraints, polished, starting_point
from shaper_fmu.design.lp.stationary import stationary
from shaper_fmu.errors import ArgumentError, NoSolutionError

WIDEST = 1.5
"""Largest width of a band, relative to its mean frequency."""
TOLERANCES = (0.001, 0.5)
"""Least and largest tolerated V [-]."""
MOST_DAMPED = 0.5
"""Largest damping ratio [-]."""
FARTHEST = 30.0
"""Largest ratio of the highest to the lowest frequency of all bands."""
MOST_BANDS = 4

_ALLOWED = 1e-9
_COARSE = 1e-4  # coarser ones leave impulses that belong to a longer sequence
_FINE = 1e-5


def specified_insensitivity(
    low: float,
    high: float,
    tolerance: float = 0.05,
    damping_ratio: float = 0.0,
    bands: Sequence[Band] | None = None,
) -> ImpulseSequence:
    """Shortest sequence of positive impulses with V <= tolerance for all natural frequencies from low to high, in rad/s.

    Args:
        low: lowest natural frequency [rad/s].
        high: highest natural frequency [rad/s]; may equal `low`.
        tolerance: largest V [-], 0.001 to 0.5.
        damping_ratio: of all modes in the interval [-], 0 to 0.5.
        bands: further intervals of other modes, each with its own tolerance and damping ratio.

    Returns:
        The sequence; its certificate is the largest V - tolerance over all intervals, 0 if there is no excess. It is at most
        1e-9 of the tolerance.

    Raises:
        ArgumentError: if an argument is out of its limits: width at most 1.5 of the mean frequency, frequencies of all
            intervals within a factor of 30, at most 4 intervals; or if no such sequence was found.
    """
    every = [Band(float(low), float(high), float(tolerance), float(damping_ratio)), *(bands or ())]
    check_bands(every)
    return design(every)


def check_bands(bands: Sequence[Band]) -> None:
    """Raise ComponentError, with the limit in its text, for bands that are not served."""
    for band in bands:
        if not 0.0 < band.low <= band.high < math.inf:
            raise ArgumentError(f"frequencies {band.low:g} to {band.high:g} rad/s: must be positive, finite and not decrease")
        width = 2.0 * (band.high - band.low) / (band.high + band.low)
        if width > WIDEST * (1.0 + 1e-12):
            raise ArgumentError(
                f"the band from {band.low:g} to {band.high:g} rad/s has a width of {width:.4g} of its mean; limit: {WIDEST:g}"
            )
        if not TOLERANCES[0] <= band.tolerance <= TOLERANCES[1]:
            raise ArgumentError(f"tolerance {band.tolerance:g}: must be {TOLERANCES[0]:g} to {TOLERANCES[1]:g}")
        if not 0.0 <= band.damping_ratio <= MOST_DAMPED:
            raise ArgumentError(f"damping ratio {band.damping_ratio:g}: must be 0 to {MOST_DAMPED:g}")
    if len(bands) > MOST_BANDS:
        raise ArgumentError(f"{len(bands)} bands; limit: {MOST_BANDS}")
    low, high = min(band.low for band in bands), max(band.high for band in bands)
    if high > FARTHEST * low:
        raise ArgumentError(f"frequencies from {low:g} to {high:g} rad/s are further apart than a factor of {FARTHEST:g}")


def design(bands: Sequence[Band]) -> ImpulseSequence:
    """The shortest positive sequence for bands that were checked; see specified_insensitivity."""
    unit = 2.0 / (bands[0].low + bands[0].high)  # seconds per unit of the computation
    scaled = [band.scaled(unit) for band in bands]
    layout = layout_for([band.damping_ratio for band in bands])
    best: ImpulseSequence | None = None
    for attempt in (_polished, _on_fine_grid):
        sequence, expected = attempt(scaled, layout, unit)
        excess = largest_excess(sequence, bands)
        if excess <= _ALLOWED and min(sequence.amplitudes) >= 0.0 and (best is None or sequence.duration < best.duration):
            worst = max(max(0.0, excess) * band.tolerance for band in bands)
            best = replace(sequence, certificate=worst)
        if best is not None and best.duration <= expected * (1.0 + _COARSE):
            return best
    if best is None:
        raise NoSolutionError("no sequence was found that meets the tolerances; widen them or narrow the bands")
    return best


def _polished(bands: Sequence[Band], layout: Layout, unit: float) -> tuple[ImpulseSequence, float]:
    """The optimum near the solution on the grid, and the duration [s] of that one, which no optimum exceeds."""
    found = grid_solution(bands, layout, _COARSE)
    start = starting_point(layout, found.amplitudes, found.positions, found.duration)
    x = stationary(start, bands, layout, found.active)
    if x is None or x[-1] > found.duration * (1.0 + _COARSE):
        x = polished(layout, found.amplitudes, found.positions, found.duration, band_constraints(bands, layout))
        exact = stationary(x, bands, layout)
        x = exact if exact is not None and exact[-1] <= x[-1] else x
    return to_sequence(*layout.impulses(x), unit), found.duration * unit


def _on_fine_grid(bands: Sequence[Band], layout: Layout, unit: float) -> tuple[ImpulseSequence, float]:
    """The solution on the grid for tolerances so little tighter that its excess is covered, longer by some 1e-4; its duration."""
    tighter = [replace(band, tolerance=band.tolerance * (1.0 - 3e-5)) for band in bands]
    duration, amplitudes, positions = shortest_on_grid(tighter, layout, _FINE)
    if layout is GeneralLayout:
        return to_sequence(amplitudes, positions, unit), duration * unit
    both = positions[-1] + np.concatenate((positions, -positions))
    return to_sequence(np.tile(0.5 * amplitudes, 2), both, unit), duration * unit


def largest_excess(sequence: ImpulseSequence, bands: Sequence[Band]) -> float:
    """The largest V / tolerance - 1 over the bands: samples dense against V's ripple, local maxima to the last bits."""
    amplitudes, delays = np.array(sequence.amplitudes), np.array(sequence.delays)
    worst = -math.inf
    for band in bands:
        along = GeneralLayout.sampled(amplitudes, delays, sequence.duration, band.damping_ratio)
        worst = max(worst, float(peaks(along, band.low, band.high, sequence.duration)[1].max()) / band.tolerance - 1.0)
    return worst
