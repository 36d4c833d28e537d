"""Several modes: the convolution of impulse sequences (Hyde and Seering 1991)."""

from __future__ import annotations

from shaper_fmu.variable import Array, Values

COINCIDENT = 1e-12
"""Impulses closer than this fraction of the shaper duration are one."""


def convolve(amplitude: Array, delay: Array, count: int, factor_amplitude: Values, factor_delay: Values, factor_count: int) -> int:
    """Convolve the first `count` impulses with those of the factor, in place, sorted and merged; returns their number.

    Every pair of impulses gives one of amplitude A_i B_j at t_i + s_j. The arrays must hold count * factor_count.
    """
    for k in range(count * factor_count - 1, -1, -1):  # downwards: entry i <= k is still the old one
        i = k // factor_count
        j = k % factor_count
        amplitude[k] = amplitude[i] * factor_amplitude[j]
        delay[k] = delay[i] + factor_delay[j]
    sort_by_delay(amplitude, delay, count * factor_count)
    return merge_coincident(amplitude, delay, count * factor_count)


def sort_by_delay(amplitude: Array, delay: Array, count: int) -> None:
    """Sort the first `count` impulses by their delay, in place, keeping the order of equal ones."""
    for k in range(1, count):
        a = amplitude[k]
        d = delay[k]
        i = k
        while i > 0 and delay[i - 1] > d:
            amplitude[i] = amplitude[i - 1]
            delay[i] = delay[i - 1]
            i -= 1
        amplitude[i] = a
        delay[i] = d


def merge_coincident(amplitude: Array, delay: Array, count: int) -> int:
    """Add up impulses that coincide among the first `count`, sorted ones; returns how many remain."""
    kept = 0
    for k in range(1, count):
        if delay[k] - delay[kept] <= COINCIDENT * delay[count - 1]:
            amplitude[kept] += amplitude[k]
        else:
            kept += 1
            amplitude[kept] = amplitude[k]
            delay[kept] = delay[k]
    return kept + 1
