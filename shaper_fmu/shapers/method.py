"""The record by which a shaper declares itself."""

from __future__ import annotations

from dataclasses import dataclass
from types import FunctionType

from shaper_fmu.methods.record import Method


@dataclass(frozen=True, kw_only=True)
class ShaperMethod(Method):
    """A shaper. Its parameters become parameters of InputShaper, and options of `shaper` and of the command `design`.

    Attributes:
        impulses: kernel (m, damping_ratio): writes the sequence for one mode of 1 rad/s into m.factor_amplitude and
            m.factor_delay, at most 16 impulses that add up to 1, the first one at 0; returns their number, 0 if there is no
            such shaper. It may read m.vibration_tolerance and its own parameters.
        solved: whether it solves equations (see newton.py), which leaves their residual in m.certificate_left. Of a closed
            form, what it leaves of the mode is measured.
        negative: whether impulses may be negative.
        tolerant: whether it leaves V = m.vibration_tolerance on purpose, as the EI shapers do; then `tune` chooses it.
    """

    impulses: FunctionType
    solved: bool = False
    negative: bool = False
    tolerant: bool = False
