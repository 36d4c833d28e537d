"""A smallest time between switches: shorter pulses are left out, shorter gaps are closed."""

from __future__ import annotations

from shaper_fmu.variable import Array


def remove_pair(switch_time: Array, count: int, first: int) -> int:
    """Take the switches `first` and `first` + 1 out of the array; returns the new count."""
    for i in range(first, count - 2):
        switch_time[i] = switch_time[i + 2]
    return count - 2


def enforce_minimum_width(switch_time: Array, count: int, limit: float) -> int:
    """Remove the shortest pulse or gap as long as it is shorter than `limit` [s]; returns the new count.

    Both switches of a pair go, so its neighbours grow into one. The last switch of an odd number is never lost
    without the one before it: the command still ends at 1.
    """
    while count > 1:
        shortest = 0
        for i in range(1, count - 1):
            if switch_time[i + 1] - switch_time[i] < switch_time[shortest + 1] - switch_time[shortest]:
                shortest = i
        if switch_time[shortest + 1] - switch_time[shortest] >= limit:
            return count
        count = remove_pair(switch_time, count, shortest)
    return count
