"""Designs the shaper of a kind for one mode."""

from __future__ import annotations

from shaper_fmu.kinds.shapers import impulses_of, is_solved
from shaper_fmu.shapers.conditions import vibration_sums
from shaper_fmu.shapers.workspace import DesignWorkspace


def design_mode(m: DesignWorkspace, kind: int, damping_ratio: float) -> int:
    """Write the sequence of this kind for 1 rad/s into m.factor_amplitude and m.factor_delay.

    Returns the number of impulses, 0 if there is no such shaper. m.certificate_left becomes the largest residual of the
    equations that define it.
    """
    count = impulses_of(kind, m, damping_ratio)
    if not is_solved(kind):
        cosine, sine, _, _ = vibration_sums(m.factor_amplitude, m.factor_delay, count, damping_ratio, 1.0)
        m.certificate_left = max(abs(cosine), abs(sine))
    return count
