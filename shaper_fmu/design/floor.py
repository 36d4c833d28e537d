"""The floor: the shortest duration that any shaper of positive impulses can have for a required insensitivity.

For a duration D, impulses A_i >= 0, sum A_i = 1, at times in [0, D] are sought with V(w) <= tolerance over a band of
frequencies; the least D for which they exist is the floor. For a fixed D the problem is a linear programme in the
amplitudes, and without damping a sequence may be taken symmetric to D/2, which makes V = |sum A_i cos(w (t_i - D/2))|.
Singhose, Seering and Singer 1996 give the problem; the specified-insensitivity designs solve it, and lie on the floor.
"""

from __future__ import annotations

import math
from functools import lru_cache

from shaper_fmu.analysis.vibration import tolerated_band
from shaper_fmu.design.impulse_sequence import ImpulseSequence
from shaper_fmu.design.lp.layout import Band
from shaper_fmu.design.specified_bands import FARTHEST, TOLERANCES, WIDEST, check_bands, design
from shaper_fmu.errors import ArgumentError

_ROUNDING = 1e-9


def shortest_duration(insensitivity: float, tolerance: float = 0.05) -> float:
    """Least duration of a positive shaper of this insensitivity, undamped, in periods T = 2 pi / wn.

    The band is [1 - insensitivity / 2, 1 + insensitivity / 2] in w / wn: it is centred at wn, as those of ZV and the
    extra-insensitive shapers are. (A band further up would allow a shorter shaper, in proportion to its mean frequency.)

    Args:
        insensitivity: width of the band of w / wn with V <= tolerance [-], 0 to 1.5.
        tolerance: largest V [-], 0.001 to 0.5.

    Raises:
        ArgumentError: if an argument is outside of these limits.
    """
    if not 0.0 <= insensitivity <= WIDEST:
        raise ArgumentError(f"insensitivity {insensitivity:g}: the floor is known from 0 to {WIDEST:g}")
    if not TOLERANCES[0] <= tolerance <= TOLERANCES[1]:
        raise ArgumentError(f"tolerance {tolerance:g}: must be {TOLERANCES[0]:g} to {TOLERANCES[1]:g}")
    half = 0.5 * float(insensitivity)
    return _shortest(1.0 - half, 1.0 + half, float(tolerance), 0.0) / (2.0 * math.pi)


@lru_cache(maxsize=256)
def _shortest(low: float, high: float, tolerance: float, damping_ratio: float) -> float:
    """Duration of the shortest positive shaper for one band; the unit of time is that of 1 / frequency."""
    return design([Band(low, high, tolerance, damping_ratio)]).duration


def distance_to_floor(
    sequence: ImpulseSequence, natural_frequency: float, tolerance: float = 0.05, damping_ratio: float = 0.0
) -> float | None:
    """Relative distance of a shaper from the floor: duration / floor - 1 [-]; 0 if no shaper is shorter.

    The floor is the shortest duration for the band of frequencies around `natural_frequency` [rad/s] that the sequence itself
    tolerates, V <= tolerance: for a band centred there it is T shortest_duration(sequence.insensitivity(natural_frequency)),
    else that of the band where it lies. A damped mode is compared with the floor for its damping ratio, from the same
    programme with V weighted by exp(zeta w (t_i - D)), which is shorter than the undamped one.

    Returns:
        The distance; None if no floor applies: an impulse is negative, V exceeds the tolerance at the natural frequency, or
        the band is wider than 1.5 of its mean frequency.

    Raises:
        ArgumentError: if the natural frequency is not positive, or tolerance or damping ratio are out of limits
            (0.001 to 0.5; 0 to 0.5).
    """
    check_bands([Band(natural_frequency, natural_frequency, tolerance, damping_ratio)])
    if min(sequence.amplitudes) < 0.0:
        return None
    edges = tolerated_band(sequence, natural_frequency, damping_ratio, tolerance)
    if edges is None:
        return None
    low, high = edges
    if high - low > 0.5 * WIDEST * (high + low) or high > FARTHEST * low:
        return None
    return sequence.duration * natural_frequency / _shortest(low, high, tolerance * (1.0 + _ROUNDING), damping_ratio) - 1.0
