"""The kinds of shapers, and the sequence of each for one mode."""

from __future__ import annotations

from enum import IntEnum

from shaper_fmu.shapers.closed_forms import equal_impulses, modified_zv
from shaper_fmu.shapers.conditions import vibration_sums
from shaper_fmu.shapers.extra_insensitive import extra_insensitive
from shaper_fmu.shapers.negative_amplitude import specified_negative_amplitude
from shaper_fmu.shapers.unity_magnitude import unity_magnitude_ei, unity_magnitude_zv, unity_magnitude_zvd
from shaper_fmu.shapers.zero_derivative import zero_derivative


class Shaper(IntEnum):
    """Kinds of shapers; the numbers are those of the FMU's enumeration and never change."""

    none = 1
    zv = 2
    zvd = 3
    zvdd = 4
    zvddd = 5
    mzv = 6
    ei = 7
    two_hump_ei = 8
    three_hump_ei = 9
    um_zv = 10
    um_zvd = 11
    sna_zv = 12
    custom = 13
    um_ei = 14
    miszv = 15


def design_mode(m, kind, damping_ratio):
    """Write the sequence of this kind for 1 rad/s into m.factor_amplitude and m.factor_delay.

    Returns the number of impulses, 0 if there is no such shaper. m.certificate_left becomes the largest residual of the
    equations that define it.
    """
    if kind == Shaper.ei:
        return extra_insensitive(m, 1, damping_ratio)
    if kind == Shaper.two_hump_ei:
        return extra_insensitive(m, 2, damping_ratio)
    if kind == Shaper.three_hump_ei:
        return extra_insensitive(m, 3, damping_ratio)
    if kind == Shaper.um_zv:
        return unity_magnitude_zv(m, damping_ratio)
    if kind == Shaper.um_zvd:
        return unity_magnitude_zvd(m, damping_ratio)
    if kind == Shaper.um_ei:
        return unity_magnitude_ei(m, damping_ratio)
    if kind == Shaper.sna_zv:
        return specified_negative_amplitude(m, damping_ratio)
    count = _closed_form(m, kind, damping_ratio)
    cosine, sine, _, _ = vibration_sums(m.factor_amplitude, m.factor_delay, count, damping_ratio, 1.0)
    m.certificate_left = max(abs(cosine), abs(sine))
    return count


def _closed_form(m, kind, damping_ratio):
    if kind == Shaper.mzv:
        return modified_zv(m, damping_ratio)
    if kind == Shaper.miszv:
        return equal_impulses(m, m.equal_impulses, damping_ratio)
    order = 0
    if kind == Shaper.zvd:
        order = 1
    if kind == Shaper.zvdd:
        order = 2
    if kind == Shaper.zvddd:
        order = 3
    return zero_derivative(m.factor_amplitude, m.factor_delay, order, 1.0, damping_ratio)
