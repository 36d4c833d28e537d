"""Figures of merit of a sampled response."""

from __future__ import annotations

import numpy as np


def command_end(time: np.ndarray, command: np.ndarray) -> float:
    """Time of the last change of a sampled command [s]; the first time if it never changes. Arrays of shape (n,)."""
    changed = np.flatnonzero(command != command[-1])
    return float(time[changed[-1] + 1]) if len(changed) else float(time[0])


def residual_amplitude(time: np.ndarray, response: np.ndarray, since: float) -> float:
    """Half the peak-to-peak value of a response from `since` [s] on, in its unit. Arrays of shape (n,).

    The record should go on for a period of the slowest mode after `since`; sampling a sine of the angular frequency w
    at intervals h misses up to (w h)^2 / 8 of its peak.
    """
    tail = response[time >= since]
    return float(np.max(tail) - np.min(tail)) / 2.0
