"""The record by which a smoother declares itself."""

from __future__ import annotations

from dataclasses import dataclass
from types import FunctionType

from shaper_fmu.methods.record import Method


@dataclass(frozen=True, kw_only=True)
class SmootherMethod(Method):
    """A shaper with distributed delays. Its parameters become parameters of SmoothShaper and options of `smoother`.

    Attributes:
        kernel: kernel function (m, damping_ratio): writes the kernel for one mode of 1 rad/s, as the sum of at most 16 terms, into
            m.factor_amplitude, m.factor_delay and m.factor_order; returns their number, 0 if there is no such smoother. A term
            of order 0 is an impulse of this amplitude, one of order n its n-fold integral; the response to a step ends at 1.
            `shaper_fmu.smoothers.terms` writes boxes. It may read its own parameters.
    """

    kernel: FunctionType
