"""Designs the shaper of all modes: each mode's impulses, convolved over the modes, or the user's own."""

from __future__ import annotations

from shaper_fmu.component import Variable
from shaper_fmu.kinds.one_mode import design_mode
from shaper_fmu.kinds.shapers import SOLVED_WITH, Shaper
from shaper_fmu.shapers.convolution import convolve
from shaper_fmu.shapers.sensitivity import insensitivity
from shaper_fmu.shapers.workspace import DesignWorkspace

MODES = 4
MODE_IMPULSES = 16
IMPULSES = 640

CUSTOM_ORDER = 2
CUSTOM_SUM = 3
NO_SOLUTION = 4
TOO_MANY_IMPULSES = 7
"""Status numbers of `design`."""

DESIGN_MESSAGES = {
    CUSTOM_ORDER: "custom_delay must begin with 0 s and not decrease over the first {custom_impulses} elements",
    CUSTOM_SUM: "the first {custom_impulses} elements of custom_amplitude must add up to 1 within 1e-6, so that the "
    "command's final value is reached",
    NO_SOLUTION: "no {shaper} shaper was found beyond the damping ratio {damping} "
    f"({', '.join(f'{name} {{{name}}}' for name in SOLVED_WITH)}); choose another shaper or tolerance",
    TOO_MANY_IMPULSES: f"the {{modes}} modes convolved have more than {IMPULSES} impulses; choose a shaper with fewer of them",
}
"""Their texts."""


class ShapedModes(DesignWorkspace):
    """Base of components that shape several modes; they declare these variables."""

    shaper: Variable[int]
    modes: Variable[int]
    natural_frequency: Variable[list[float]]
    damping_ratio: Variable[list[float]]
    shape_mode: Variable[list[bool]]
    custom_impulses: Variable[int]
    custom_amplitude: Variable[list[float]]
    custom_delay: Variable[list[float]]
    duration: Variable[float]
    impulses: Variable[int]
    insensitivity: Variable[float]
    certificate: Variable[float]
    amplitude: Variable[list[float]]
    delay: Variable[list[float]]
    tuned_frequency: Variable[list[float]]
    tuned_damping: Variable[list[float]]


def design(m: ShapedModes) -> int:
    """Impulses of all shaped modes into m.amplitude, m.delay, m.impulses; and what is calculated from them."""
    m.amplitude[0] = 1.0
    m.delay[0] = 0.0
    m.impulses = 1
    m.certificate = 0.0
    for mode in range(MODES):
        m.tuned_frequency[mode] = m.natural_frequency[mode]
        m.tuned_damping[mode] = m.damping_ratio[mode]
    if m.shaper == Shaper.custom:
        status = design_custom(m)
        if status:
            return status
    elif m.shaper != Shaper.none:
        for mode in range(m.modes):
            if m.shape_mode[mode]:
                m.damping = m.damping_ratio[mode]
                count = design_mode(m, m.shaper, m.damping_ratio[mode])
                if count == 0:
                    return NO_SOLUTION
                if m.impulses * count > IMPULSES:
                    return TOO_MANY_IMPULSES
                m.certificate = max(m.certificate, m.certificate_left)
                for i in range(count):
                    m.factor_delay[i] /= m.natural_frequency[mode]
                m.impulses = convolve(m.amplitude, m.delay, m.impulses, m.factor_amplitude, m.factor_delay, count)
    m.duration = m.delay[m.impulses - 1]
    mode = first_shaped_mode(m)
    m.insensitivity = insensitivity(
        m.amplitude, m.delay, m.impulses, m.natural_frequency[mode], m.damping_ratio[mode], m.vibration_tolerance
    )
    return 0


def design_custom(m: ShapedModes) -> int:
    """The user's impulses, checked and normalised to the sum 1."""
    total = 0.0
    last = 0.0
    for i in range(m.custom_impulses):
        if m.custom_delay[i] < last or (i == 0 and m.custom_delay[i] > 0.0):
            return CUSTOM_ORDER
        last = m.custom_delay[i]
        total += m.custom_amplitude[i]
    if abs(total - 1.0) > 1e-6:
        return CUSTOM_SUM
    for i in range(m.custom_impulses):
        m.amplitude[i] = m.custom_amplitude[i] / total
        m.delay[i] = m.custom_delay[i]
    m.impulses = m.custom_impulses
    return 0


def first_shaped_mode(m: ShapedModes) -> int:
    """Index of the first mode that is shaped; 0 if none is."""
    for mode in range(m.modes):
        if m.shape_mode[mode]:
            return mode
    return 0
