"""Specified insensitivity for the ranges of a plant's modes, and the floor that it gives."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace

import numpy as np

from shaper_fmu.design.impulse_sequence import ImpulseSequence
from shaper_fmu.design.lp.layout import Band
from shaper_fmu.design.specified_bands import MOST_DAMPED, TOLERANCES, check_bands, design
from shaper_fmu.errors import ComponentError
from shaper_fmu.tune.choice.bounds import proven
from shaper_fmu.tune.choice.boxes import UNDAMPED, ModeBox, shares
from shaper_fmu.tune.choice.requirements import Requirements

ROOM = 1e-4
"""Share of the tolerance that is kept free of rounding."""
_LEAST_NOMINAL = 1e-5
"""Least V at a nominal point for which sequences are designed; ZV and ZVD leave nothing there."""
_ATTEMPTS = 3
_NEAR = 0.97
"""Share of the tolerance that a design may leave unused."""


@dataclass(frozen=True)
class _Condition:
    """One of the two conditions on a design: `level`, the modes together in the worst output, is to be `wanted` at most."""

    wanted: float
    shaped: np.ndarray
    """Share of the shaped modes in each output, shape (outputs,)."""
    least: float
    """Least V that designs know."""

    @property
    def possible(self) -> bool:
        """Whether the unshaped modes leave room for the others."""
        return bool((1.0 - self.shaped).max(initial=0.0) <= self.wanted)

    def loosest(self) -> float:
        """V that each shaped mode may leave, if the others keep all that they have."""
        used = self.shaped > 0.0
        return float(((self.wanted - (1.0 - self.shaped[used])) / self.shaped[used]).min(initial=1.0)) * (1.0 - ROOM)


def specified(
    boxes: Sequence[ModeBox],
    modes: tuple[int, ...],
    requirements: Requirements,
    attempt: Callable[[Callable[[], ImpulseSequence]], ImpulseSequence | None],
) -> ImpulseSequence | None:
    """Specified insensitivity for these modes, as loose as the worst case of all modes allows; other modes are not shaped.

    Of a few designs the shortest one that fits: a design does not know what it leaves of other modes, nor that the modes are not at
    their worst in the same output. With a nominal condition each mode's nominal point is one more band, with its own tolerance.
    `attempt` calls what it is given, and returns None where there is no such design; so does this function.
    """
    parts = shares(boxes)
    shaped = parts[list(modes)].sum(axis=0)
    conditions = [_Condition(requirements.tolerance, shaped, TOLERANCES[0])]
    places = [list(boxes)]
    if requirements.nominal_stricter:
        conditions.append(_Condition(requirements.nominal_tolerance, shaped, _LEAST_NOMINAL))
        places.append([box.at_nominal for box in boxes])
    allowed = [one.loosest() for one in conditions]
    if not all(one.possible for one in conditions) or allowed[0] < TOLERANCES[0]:
        return None
    best: tuple[bool, float, ImpulseSequence] | None = None
    for number in range(_ATTEMPTS):
        allowed = [min(max(v, one.least), TOLERANCES[1]) for v, one in zip(allowed, conditions, strict=True)]
        sequence = attempt(lambda wanted=tuple(allowed): for_bands([boxes[k] for k in modes], *wanted))
        if sequence is None:
            break
        levels = [float((parts.T @ [proven(sequence, box).bound for box in each]).max()) for each in places]
        used = [level / one.wanted for level, one in zip(levels, conditions, strict=True)]
        rank = (max(used) > 1.0, sequence.duration, sequence)
        best = rank if best is None or rank[:2] < best[:2] else best
        if max(used) <= 1.0 and (number > 0 or max(used) >= _NEAR):
            break
        allowed = [v / max(share, 1e-12) * (1.0 - ROOM) for v, share in zip(allowed, used, strict=True)]
    return best[2] if best is not None else None


def for_bands(boxes: Sequence[ModeBox], tolerance: float, nominal_tolerance: float | None = None) -> ImpulseSequence:
    """The shortest positive sequence for the ranges of these modes, and for their nominal points. Raises ArgumentError."""
    bands = _bands(boxes, [tolerance] * len(boxes))
    points: list[Band] = []
    if nominal_tolerance is not None and nominal_tolerance < tolerance:
        points = _points(boxes, [nominal_tolerance] * len(boxes))
    return _checked(bands, points)


def shortest(boxes: Sequence[ModeBox], tolerance: float, nominal_tolerance: float = 1.0) -> float | None:
    """A floor [s]: no shaper of positive impulses whose worst case is within the tolerance is shorter. None if unknown.

    Each mode alone may then leave V <= tolerance / share at most, and V <= nominal_tolerance / share at its nominal point. The
    shortest sequence for all these bands, at two damping ratios of each box, is the specified-insensitivity design; modes that
    may leave more than half are no condition. 0 if none is.
    """
    parts = shares(boxes).max(axis=1).clip(1e-300)
    near, loose = _limiting(boxes, tolerance / parts, TOLERANCES[0])
    bands, points = _bands(near, loose), []
    if nominal_tolerance < tolerance:
        points = _points(*_limiting([box.at_nominal for box in boxes], nominal_tolerance / parts, _LEAST_NOMINAL))
    if not bands and not points:
        return 0.0
    try:
        return _checked(bands, points).duration
    except ComponentError:
        return None


def _limiting(boxes: Sequence[ModeBox], allowed: np.ndarray, least: float) -> tuple[list[ModeBox], list[float]]:
    """The boxes whose V is limited, as far as designs are known, and their limits."""
    limiting = [(box, float(v)) for box, v in zip(boxes, allowed, strict=True) if v < TOLERANCES[1]]
    limiting = [(box.damped_at_most(MOST_DAMPED), max(v, least)) for box, v in limiting if box.dampings[0] <= MOST_DAMPED]
    return [box for box, _ in limiting], [v for _, v in limiting]


def _bands(boxes: Sequence[ModeBox], tolerances: Sequence[float]) -> list[Band]:
    """A band for the least and for the largest damping ratio of each box: in between, V is hardly ever larger than at both."""
    return [
        Band(*box.frequencies, tolerance, zeta)
        for box, tolerance in zip(boxes, tolerances, strict=True)
        for zeta in dict.fromkeys(zeta if zeta > UNDAMPED else 0.0 for zeta in box.dampings)
    ]


def _points(boxes: Sequence[ModeBox], tolerances: Sequence[float]) -> list[Band]:
    return [Band(box.nominal[0], box.nominal[0], v, box.nominal[1]) for box, v in zip(boxes, tolerances, strict=True)]


def _checked(bands: Sequence[Band], points: Sequence[Band]) -> ImpulseSequence:
    """The shortest sequence for bands, of which a mode may have several. Raises ArgumentError for more than is served."""
    known = [replace(one, tolerance=max(one.tolerance, TOLERANCES[0])) for one in (*bands, *points)]
    for one in known:
        check_bands([one])
    check_bands(list({(one.low, one.high): one for one in known[: len(bands)] or known}.values()))
    return design([*bands, *points])
