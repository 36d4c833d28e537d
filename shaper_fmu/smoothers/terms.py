"""Kernels as sums of terms: impulses, their integrals (steps), the integrals of those (ramps), and so on.

A box of the area A from t to t + w is the term A / w of order 1 at t, and -A / w at t + w. The convolution of two terms is one
term: amplitudes are multiplied, delays and orders added.
"""

from __future__ import annotations

from shaper_fmu.smoothers.workspace import SmootherWorkspace

COINCIDENT = 1e-12
"""Terms closer than this fraction of the kernel's duration are at one time."""


def put_impulse(m: SmootherWorkspace, count: int, area: float, delay: float) -> int:
    """An impulse among the factor's terms; returns their number."""
    return _put(m, count, area, delay, 0)


def put_box(m: SmootherWorkspace, count: int, area: float, begin: float, width: float) -> int:
    """A box of this area; where another one ends, their terms become one. Returns the number of terms."""
    count = _put(m, count, area / width, begin, 1)
    return _put(m, count, -area / width, begin + width, 1)


def _put(m: SmootherWorkspace, count: int, amplitude: float, delay: float, order: int) -> int:
    for i in range(count):
        if m.factor_order[i] == order and abs(m.factor_delay[i] - delay) <= COINCIDENT * abs(delay):
            m.factor_amplitude[i] += amplitude
            return count
    m.factor_amplitude[count] = amplitude
    m.factor_delay[count] = delay
    m.factor_order[count] = order
    return count + 1


def square(m: SmootherWorkspace, count: int) -> int:
    """The factor convolved with itself; returns the number of its terms."""
    for i in range(count):
        m.kept[i] = m.factor_amplitude[i]
        m.above[i] = m.factor_delay[i]
        m.kept_order[i] = m.factor_order[i]
    total = 0
    for i in range(count):
        for j in range(count):
            total = _put(m, total, m.kept[i] * m.kept[j], m.above[i] + m.above[j], m.kept_order[i] + m.kept_order[j])
    return total


def begin_kernel(m: SmootherWorkspace) -> None:
    """The kernel that changes nothing: one impulse."""
    m.terms = 1
    m.term_amplitude[0] = 1.0
    m.term_delay[0] = 0.0
    m.term_order[0] = 0


def convolve_factor(m: SmootherWorkspace, count: int, natural_frequency: float) -> None:
    """Convolve the kernel with a factor of `count` terms for 1 rad/s, brought to natural_frequency [rad/s]; sorted and merged."""
    for k in range(m.terms * count - 1, -1, -1):  # downwards: entry i <= k is still the old one
        i = k // count
        j = k % count
        scale = 1.0
        for _ in range(m.factor_order[j]):
            scale *= natural_frequency
        m.term_amplitude[k] = m.term_amplitude[i] * (m.factor_amplitude[j] * scale)
        m.term_delay[k] = m.term_delay[i] + m.factor_delay[j] / natural_frequency
        m.term_order[k] = m.term_order[i] + m.factor_order[j]
    m.terms *= count
    _sort(m)
    _merge(m)


def _sort(m: SmootherWorkspace) -> None:
    """Sort the terms by their delay, keeping the order of equal ones."""
    for k in range(1, m.terms):
        amplitude = m.term_amplitude[k]
        delay = m.term_delay[k]
        order = m.term_order[k]
        i = k
        while i > 0 and m.term_delay[i - 1] > delay:
            m.term_amplitude[i] = m.term_amplitude[i - 1]
            m.term_delay[i] = m.term_delay[i - 1]
            m.term_order[i] = m.term_order[i - 1]
            i -= 1
        m.term_amplitude[i] = amplitude
        m.term_delay[i] = delay
        m.term_order[i] = order


def _merge(m: SmootherWorkspace) -> None:
    """Bring terms that coincide to one delay, and add up those of the same order."""
    last = m.term_delay[m.terms - 1]
    kept = 0
    for k in range(m.terms):
        delay = m.term_delay[k]
        if kept > 0 and delay - m.term_delay[kept - 1] <= COINCIDENT * last:
            delay = m.term_delay[kept - 1]
        i = kept - 1
        while i >= 0 and m.term_delay[i] == delay and m.term_order[i] != m.term_order[k]:
            i -= 1
        if i >= 0 and m.term_delay[i] == delay:
            m.term_amplitude[i] += m.term_amplitude[k]
        else:
            m.term_amplitude[kept] = m.term_amplitude[k]
            m.term_delay[kept] = delay
            m.term_order[kept] = m.term_order[k]
            kept += 1
    m.terms = kept
