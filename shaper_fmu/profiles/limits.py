"""Limits of a move, and of the move over the unit distance."""

from __future__ import annotations

from shaper_fmu.component import NO_EVENT

NO_LIMIT = NO_EVENT
"""A limit that is none, and a duration that is not reached [m/s, m/s2, s]."""


def unit_limit(limit: float, distance: float) -> float:
    """A limit of the unit move [1/s or 1/s2], from that of the move over `distance` [m]; NO_LIMIT if there is none."""
    if limit >= NO_LIMIT or distance == 0.0:
        return NO_LIMIT
    return min(NO_LIMIT, limit / abs(distance))
