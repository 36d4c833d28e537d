"""Moves: the fastest one within the limits, and profiles that leave less vibration."""

from __future__ import annotations

import itertools
import math
from collections.abc import Iterator, Sequence
from typing import Any

import numpy as np

from shaper_fmu.design.fastest import fastest_move as designed_move
from shaper_fmu.design.impulse_sequence import ImpulseSequence
from shaper_fmu.design.lp.layout import Band
from shaper_fmu.design.profiles import Profile, profile
from shaper_fmu.design.quadrature import as_masses
from shaper_fmu.errors import ComponentError
from shaper_fmu.profiles.limits import NO_LIMIT
from shaper_fmu.tune.choice.bounds import remaining
from shaper_fmu.tune.choice.boxes import ModeBox, shares
from shaper_fmu.tune.choice.candidates import LeftOut
from shaper_fmu.tune.choice.requirements import FASTEST, PROFILES, Move, Requirements

_DURATIONS = 25
_BISECTIONS = 7
_ROOM = 1e-3
"""Share of the tolerance that is kept free for what lies between the points at which V is looked at."""
_PERIODS = 3.0
"""How much longer than the fastest move profiles are tried, in periods of the slowest mode."""


def fastest_move(move: Move) -> Profile:
    """The move that ends first: a trapezoid, without limits a step."""
    limits: dict[str, Any] = {"max_velocity": move.max_velocity, "max_acceleration": move.max_acceleration}
    if min(limits.values()) >= NO_LIMIT:
        return profile("step", move.distance, 1.0)
    return profile("trapezoid", move.distance, **limits)


def as_impulses(law: Profile, highest: float) -> ImpulseSequence:
    """Impulses with the same V as the move on all modes up to `highest` [rad/s]: its velocity by Gauss-Legendre quadrature.

    Amplitudes add up to 1 and delays are the nodes' [s]; V is exact to rounding. It is for bounds only, no shaper.
    """
    if law.duration == 0.0:
        return ImpulseSequence((1.0,), (0.0,), 0.0)
    times, masses = as_masses(law.pieces, lambda t: law.velocity(t) / law.distance, highest)
    moves = (0.0, *masses.tolist(), 0.0)  # the last one at the end of the move, from which V counts
    return ImpulseSequence(moves, (0.0, *times.tolist(), law.duration))


def profiles(boxes: Sequence[ModeBox], requirements: Requirements, left_out: dict[LeftOut, None]) -> Iterator[Profile]:
    """Profiles of each kind whose V is less than that of all shorter ones of the kind, as far as a grid shows."""
    if requirements.move is None:
        return
    fastest = fastest_move(requirements.move).duration
    parts = shares(boxes)
    box = boxes[int(np.argmax(parts.max(axis=1)))]
    modes = dict.fromkeys([box.centre, box.nominal] if requirements.nominal_asked else [box.centre])
    slowest = min(box.natural_frequency.low for box in boxes)
    longest = fastest + min(requirements.longest_delay, 2.0 * math.pi * _PERIODS / slowest)
    for kind, mode in itertools.product(filter(requirements.wants, PROFILES), modes):
        try:
            yield from _Kind(kind, requirements, mode, boxes, parts).improving(fastest, longest)
        except ComponentError as error:
            left_out[LeftOut(kind.replace("_", " "), str(error))] = None


def without_vibration(boxes: Sequence[ModeBox], requirements: Requirements, left_out: dict[LeftOut, None]) -> Profile | None:
    """The fastest move that keeps the tolerances on every mode alone, and so on all of them together; None where there is none.

    Each box is a band of frequencies at its least and at its largest damping ratio, and its nominal point is one more.
    """
    move = requirements.move
    if move is None or not requirements.wants(FASTEST):
        return None
    limits: dict[str, Any] = {"max_velocity": move.max_velocity, "max_acceleration": move.max_acceleration}
    tolerance, nominal = (limit * (1.0 - _ROOM) for limit in (requirements.tolerance, requirements.nominal_tolerance))
    bands = [Band(*box.frequencies, tolerance, zeta) for box in boxes for zeta in dict.fromkeys(box.dampings)]
    if requirements.nominal_stricter:
        bands += [Band(w, w, nominal, zeta) for w, zeta in (box.nominal for box in boxes)]
    try:
        values = designed_move(move.distance, **limits, modes=bands).start_values()
        segments = {name: value for name, value in values.items() if name not in ("profile", "distance")}
        return profile(FASTEST, move.distance, **limits, **segments)
    except ComponentError as error:
        left_out[LeftOut(FASTEST, str(error))] = None
        return None


class _Kind:
    """The profiles of a kind, by their duration."""

    def __init__(
        self, kind: str, requirements: Requirements, mode: tuple[float, float], boxes: Sequence[ModeBox], parts: np.ndarray
    ):
        assert requirements.move is not None  # profiles are for moves only
        self._kind, self._move, self._mode, self._boxes, self._parts = kind, requirements.move, mode, boxes, parts
        self._tolerances = np.array([requirements.tolerance, requirements.nominal_tolerance]) * (1.0 - _ROOM)
        self._highest = max(box.natural_frequency.high for box in boxes)

    def improving(self, fastest: float, longest: float) -> Iterator[Profile]:
        """The profiles that leave less than all shorter ones of a grid, or less nominally, and the shortest one that fits."""
        limited = min(self._move.max_velocity, self._move.max_acceleration) < NO_LIMIT
        first = max(fastest, self._law(None).duration if limited else 0.0)
        before, best, fits = first, np.full(2, math.inf), False
        for duration in np.linspace(first, longest, _DURATIONS).tolist() if first <= longest else ():
            law, levels = self._seen(duration)
            if law is not None and (levels < best).any():
                if self._fits(levels) and not fits:
                    fits = True
                    if duration > before:
                        yield self._shortest(before, duration, law)
                best = np.minimum(best, levels)
                yield law
            before = duration

    def _fits(self, levels: np.ndarray) -> bool:
        return bool((levels <= self._tolerances).all())

    def _shortest(self, short: float, long: float, law: Profile) -> Profile:
        """The shortest that fits between two durations, of which the longer one's `law` does."""
        for _ in range(_BISECTIONS):
            middle = 0.5 * (short + long)
            found, levels = self._seen(middle)
            if found is not None and self._fits(levels):
                long, law = middle, found
            else:
                short = middle
        return law

    def _law(self, duration: float | None) -> Profile:
        limits = {"max_velocity": self._move.max_velocity, "max_acceleration": self._move.max_acceleration}
        return profile(self._kind, self._move.distance, duration, *self._mode, **limits)

    def _seen(self, duration: float) -> tuple[Profile | None, np.ndarray]:
        """A profile, its worst case at some points of the boxes and its nominal level as far as it is above its tolerance.

        None for a duration of 0, or in a gap that limits leave.
        """
        try:
            law = self._law(duration)
        except ComponentError:
            return None, np.full(2, math.inf)
        moves = as_impulses(law, self._highest)
        sizes = np.abs([remaining(moves, box) for box in self._boxes])
        levels = [float((self._parts.T @ of_modes).max()) for of_modes in (sizes[:, :-1].max(axis=1), sizes[:, -1])]
        return law, np.maximum(levels, [0.0, self._tolerances[1]])
