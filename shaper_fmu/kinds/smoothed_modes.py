"""Designs the smoother of all modes: each mode's kernel, convolved over the modes."""

from __future__ import annotations

import math

from shaper_fmu.component import Variable
from shaper_fmu.kinds.smoothers import Smoother, terms_of
from shaper_fmu.smoothers.response import lay_out
from shaper_fmu.smoothers.terms import begin_kernel, convolve_factor
from shaper_fmu.smoothers.workspace import SmootherWorkspace

MODES = 3


class SmoothedModes(SmootherWorkspace):
    """Base of components that smooth for several modes; they declare these variables."""

    smoother: Variable[int]
    modes: Variable[int]
    natural_frequency: Variable[list[float]]
    damping_ratio: Variable[list[float]]
    certificate: Variable[float]


def design_smoother(m: SmoothedModes) -> bool:
    """The kernel of all modes into the record, laid out; false if there is no such smoother for one of them."""
    begin_kernel(m)
    m.certificate = 0.0
    if m.smoother != Smoother.none:
        for mode in range(m.modes):
            m.damping = m.damping_ratio[mode]
            count = terms_of(m.smoother, m, m.damping_ratio[mode])
            if count == 0:
                return False
            m.certificate = max(m.certificate, left_of_mode(m, count, m.damping_ratio[mode]))
            convolve_factor(m, count, m.natural_frequency[mode])
    lay_out(m)
    return True


def left_of_mode(m: SmootherWorkspace, count: int, damping_ratio: float) -> float:
    """What a factor of `count` terms for 1 rad/s leaves of its mode at its end: |sum of a exp(p (T - t)) / p^n|, and |p| = 1.

    A term of order n is the n-fold integral of an impulse, which a mode answers with 1 / p^n of its own motion, and with
    motions that end with the kernel.
    """
    damped = math.sqrt(1.0 - damping_ratio * damping_ratio)
    phase = math.atan2(damped, -damping_ratio)
    end = 0.0
    for i in range(count):
        end = max(end, m.factor_delay[i])
    real = 0.0
    imaginary = 0.0
    for i in range(count):
        age = end - m.factor_delay[i]
        weight = m.factor_amplitude[i] * math.exp(-damping_ratio * age)
        angle = damped * age - m.factor_order[i] * phase
        real += weight * math.cos(angle)
        imaginary += weight * math.sin(angle)
    return math.sqrt(real * real + imaginary * imaginary)
