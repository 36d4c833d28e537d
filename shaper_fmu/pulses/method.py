"""The record by which a pulse design declares itself."""

from __future__ import annotations

from dataclasses import dataclass
from types import FunctionType

from shaper_fmu.methods.record import Method


@dataclass(frozen=True, kw_only=True)
class PulseMethod(Method):
    """A design of on/off commands. Its parameters become parameters of PulseTrain and options of the command `design`.

    Attributes:
        switches: kernel (m, room): writes the times [s] at which the command switches, since its start, into m.switch_time, which
            has `room` elements; returns their number, an odd one, 0 if there is no such command, and -1 if there are more. It
            may read m.natural_frequency [rad/s], m.damping_ratio, m.duration [s], m.frequency_ratio and its own parameters;
            it sets m.travel_time [s] where that is not `duration`, m.frequency [Hz] where there is a carrier, and
            m.certificate_left where it solves equations.
        failure: the message if there is no such command; "{duration}" stands for that variable's value.
        reference: kernel (m, s): what the carrier modulates at s [s] before the end of the travel; without it a step.
        jumps_at_start, jumps_at_end: whether the reference jumps there.
        timed: whether it takes `duration`, and not the time that it needs.
        keeps_width: whether it heeds m.minimum_pulse_width_limit itself; else shorter pulses and gaps are left out afterwards.
    """

    switches: FunctionType
    failure: str = "there is no such command"
    reference: FunctionType | None = None
    jumps_at_start: bool = True
    jumps_at_end: bool = False
    timed: bool = True
    keeps_width: bool = False
