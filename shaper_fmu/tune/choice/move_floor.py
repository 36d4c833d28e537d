"""The floor of a move: how much later than the fastest one a move must end that vibrates no more than tolerated."""

from __future__ import annotations

from collections.abc import Sequence

from shaper_fmu.design.fastest import shortest_move
from shaper_fmu.design.lp.layout import Band
from shaper_fmu.errors import ComponentError
from shaper_fmu.tune.choice.boxes import ModeBox, shares
from shaper_fmu.tune.choice.moves import fastest_move
from shaper_fmu.tune.choice.requirements import Requirements


def least_delay(boxes: Sequence[ModeBox], requirements: Requirements) -> float | None:
    """A proven floor of the delay [s] for a move within its limits, whatever the profile and the shaper. None if unknown.

    Each mode alone may leave V <= tolerance / share at most, here at the least damping of its box, and V <= nominal_tolerance /
    share at its nominal point: fewer conditions than a candidate has to meet, so that the floor is one. It is not known without a
    limit of the acceleration, and for modes of more than 100 periods in the move.
    """
    move, parts = requirements.move, shares(boxes).max(axis=1).clip(1e-300)
    if move is None:
        return None
    bands = []
    for box, part in zip(boxes, parts, strict=True):
        whole, nominal = requirements.tolerance / part, requirements.nominal_tolerance / part
        if whole < 1.0:
            bands.append(Band(*box.frequencies, float(whole), box.dampings[0]))
        if nominal < whole and nominal < 1.0:
            w, zeta = box.nominal
            bands.append(Band(w, w, float(nominal), zeta))
    limits = {"max_velocity": move.max_velocity, "max_acceleration": move.max_acceleration}
    try:
        return max(0.0, shortest_move(move.distance, **limits, modes=bands) - fastest_move(move).duration)
    except ComponentError:
        return None
