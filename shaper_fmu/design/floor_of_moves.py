"""The floor of moves: how much longer a profile, alone or through a shaper, takes than the fastest move without vibration.

The floor is the duration below which no move of the same distance within the same limits of speed and acceleration leaves as little
vibration on the mode; it is proven (shaper_fmu.design.fastest).
"""

from __future__ import annotations

import math
from dataclasses import dataclass
from functools import lru_cache

from shaper_fmu.component import NO_EVENT
from shaper_fmu.design.fastest import shortest_move
from shaper_fmu.design.impulse_sequence import ImpulseSequence
from shaper_fmu.design.lp.layout import Band
from shaper_fmu.design.profiles import Profile

_NOTHING = 1e-6
"""Vibration that counts as none."""


@dataclass(frozen=True)
class MoveFloor:
    """A move beside the floor of its limits, mode and vibration.

    Attributes:
        duration: of the move, with the shaper behind it [s].
        residual: V that it leaves on the mode.
        floor: no move within the same limits that leaves as little is shorter [s].
    """

    duration: float
    residual: float
    floor: float

    @property
    def above(self) -> float:
        """Relative distance of the move from the floor: duration / floor - 1."""
        return self.duration / self.floor - 1.0


def move_floor(
    law: Profile,
    natural_frequency: float,
    damping_ratio: float = 0.0,
    shaper: ImpulseSequence | None = None,
    tolerance: float = 0.0,
) -> MoveFloor | None:
    """How far a profile, alone or through a shaper, is above the floor of moves for a mode [rad/s].

    The limits are those that the profile was given, or else its own largest speed and acceleration. The floor may leave the
    vibration V that the move itself leaves, or the tolerance, if that is more. None where no floor applies: the profile jumps,
    so that its acceleration has no limit, or moves nothing, or the shaper has negative impulses, with which limits are not kept.
    """
    if law.distance == 0.0 or not math.isfinite(law.peak_acceleration) or (shaper is not None and min(shaper.amplitudes) < 0.0):
        return None
    limits = [
        given if given < NO_EVENT else peak
        for given, peak in ((law.max_velocity, law.peak_velocity), (law.max_acceleration, law.peak_acceleration))
    ]
    v, duration = law.residual_vibration(natural_frequency, damping_ratio), law.duration
    if shaper is not None:
        v *= shaper.residual_vibration(natural_frequency, damping_ratio)
        duration += shaper.duration
    left = max(v, tolerance)
    left = 0.0 if left < _NOTHING else math.ceil(left * 1e4) / 1e4  # rounded up: so the floor is one, and is known already for some
    return MoveFloor(duration, v, _floor(abs(law.distance), limits[0], limits[1], natural_frequency, damping_ratio, left))


@lru_cache(maxsize=256)
def _floor(distance: float, speed: float, acceleration: float, w: float, damping_ratio: float, tolerance: float) -> float:
    modes = [Band(w, w, tolerance, damping_ratio)] if tolerance < 1.0 else []
    return shortest_move(distance, max_velocity=speed, max_acceleration=acceleration, modes=modes)
