"""Step: the whole distance at once; the impulses of its velocity and acceleration are not part of them."""

from __future__ import annotations


def step(s: float) -> tuple[float, float, float]:
    """Position [-], velocity [1/s] and acceleration [1/s2] at s [s] after a step of unit height."""
    return (1.0 if s >= 0.0 else 0.0), 0.0, 0.0
