"""The requirements that a shaper has to meet."""

from __future__ import annotations

import math
from dataclasses import dataclass

from shaper_fmu.errors import ArgumentError, nearest
from shaper_fmu.kinds.profiles import PROFILES as METHODS
from shaper_fmu.kinds.shapers import SHAPERS
from shaper_fmu.kinds.smoothers import SMOOTHERS
from shaper_fmu.profiles.limits import NO_LIMIT

NEGATIVE = tuple(name for name, method in SHAPERS.items() if method.negative)
"""Shapers with negative impulses: the actuator must follow jumps that are larger than the command's."""
POSITIVE = tuple(name for name, method in SHAPERS.items() if not method.negative)
OFFLINE = ("si", "direct_zv", "direct_zvd")
PROFILES = tuple(name for name, method in METHODS.items() if method.span is None and method.tuned)
FASTEST = "fastest"
"""The profile that is designed for all modes at once, with the proof that none is faster."""
SMOOTH = tuple(SMOOTHERS)
"""Shapers without jumps, compared where they are named: of positive shapers, impulses are always the shortest."""
KNOWN = (*POSITIVE, *NEGATIVE, *OFFLINE, *PROFILES, FASTEST, *SMOOTH)


@dataclass(frozen=True)
class Move:
    """A rest-to-rest move: distance [m] and limits [m/s, m/s2], as those of `profile`; 1e300 for none."""

    distance: float
    max_velocity: float = NO_LIMIT
    max_acceleration: float = NO_LIMIT

    def __post_init__(self) -> None:
        if not (math.isfinite(self.distance) and self.distance != 0.0):
            raise ArgumentError(f"a move over {self.distance:g} m: the distance must be finite and not 0")
        if not (self.max_velocity > 0.0 and self.max_acceleration > 0.0):
            raise ArgumentError("limits of a move must be positive")


@dataclass(frozen=True)
class Requirements:
    """What a shaper has to achieve.

    Attributes:
        tolerance: residual vibration at the end of the command, as a share of what the unshaped step excites at its time (V of
            Singer and Seering 1990), 0 < tolerance < 1.
        longest_delay: how much later than the unshaped command the shaped one may end [s].
        frequency_margin, damping_margin: what is added to each mode's range on both sides, as a share of its ends: 0.1 for 10 %.
        allow_negative: whether impulses may be negative.
        kinds: the shapers and profiles to choose from, names of `KNOWN`; None for all but `SMOOTH`.
        move: a move that the command makes; None for any command.
        nominal_tolerance: like `tolerance`, where each mode has its nominal natural frequency and damping ratio,
            0 < nominal_tolerance <= 1. 1 is no condition, and nor is anything from `tolerance` on.
        least_saving: what a custom sequence must save of the delay of the shortest fitting shaper of a kind to be recommended, as a
            share; 0 for the shortest of all. A shaper of a kind follows its modes while it runs, and can be set by hand.
    """

    tolerance: float = 0.05
    longest_delay: float = math.inf
    frequency_margin: float = 0.0
    damping_margin: float = 0.0
    allow_negative: bool = False
    kinds: tuple[str, ...] | None = None
    move: Move | None = None
    nominal_tolerance: float = 1.0
    least_saving: float = 0.03

    def __post_init__(self) -> None:
        if not 0.0 < self.tolerance < 1.0:
            raise ArgumentError(f"tolerance = {self.tolerance:g} is outside its domain 0 < tolerance < 1")
        if not 0.0 < self.nominal_tolerance <= 1.0:
            raise ArgumentError(
                f"nominal_tolerance = {self.nominal_tolerance:g} is outside its domain 0 < nominal_tolerance <= 1 (1: no condition)"
            )
        if not self.longest_delay >= 0.0:
            raise ArgumentError(f"longest_delay = {self.longest_delay:g} s: it cannot be negative")
        if not 0.0 <= self.least_saving < 1.0:
            raise ArgumentError(f"least_saving = {self.least_saving:g} is outside its domain 0 <= least_saving < 1")
        for kind in self.kinds or ():
            if kind not in KNOWN:
                raise ArgumentError(f"there is no shaper or profile {kind!r}.{nearest(kind, KNOWN)}")
            if kind in NEGATIVE and not self.allow_negative:
                raise ArgumentError(f"{kind} has negative impulses; allow them (allow_negative), or leave it out")

    @property
    def nominal_asked(self) -> bool:
        """Whether anything is asked for at the nominal point, so that shapers are designed for it, too."""
        return self.nominal_tolerance < 1.0

    @property
    def nominal_stricter(self) -> bool:
        """Whether the nominal condition is stricter than the one over the ranges, which include the nominal point."""
        return self.nominal_tolerance < self.tolerance

    def wants(self, kind: str) -> bool:
        """Whether this kind is to be considered."""
        if self.kinds is not None:
            return kind in self.kinds
        return (kind not in NEGATIVE or self.allow_negative) and kind not in SMOOTH

    def check_impulses_only(self) -> None:
        """Raise ArgumentError for smoothers, of which a tuned InputShaper is none."""
        for kind in self.kinds or ():
            if kind in SMOOTH:
                raise ArgumentError(f"{kind} is no InputShaper, which tune makes; choose compares it, and SmoothShaper makes it")
