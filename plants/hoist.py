"""A trolley and a hoist that follow their inputs, held or linear over a step, as functions without state."""

from __future__ import annotations


def travelled(speed: float, acceleration: float, slope: float, s: float) -> float:
    """Distance after s, begun at `speed`, under an acceleration that grows with `slope`."""
    return (speed + (0.5 * acceleration + slope * s / 6.0) * s) * s


def gained(rate: float, slope: float, s: float) -> float:
    """Integral over s of a rate that grows with `slope`: the speed that an acceleration gives, the rope that a hoist takes in."""
    return (rate + 0.5 * slope * s) * s


def most_hoisted(hoist_speed: float, slope: float, h: float) -> float:
    """The most rope that is taken in within a step h: at its end, or where hoisting turns to lowering."""
    if hoist_speed > 0.0 and hoist_speed + slope * h < 0.0:
        return -0.5 * hoist_speed * hoist_speed / slope
    return gained(hoist_speed, slope, h)
