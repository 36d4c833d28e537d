"""The record by which a profile declares itself."""

from __future__ import annotations

from dataclasses import dataclass
from types import FunctionType

from shaper_fmu.methods.record import Method


@dataclass(frozen=True, kw_only=True)
class ProfileMethod(Method):
    """A profile: kernel functions of the move over the unit distance; each names the arguments that it takes.

    Its parameters become those of MotionProfile, and options of `profile` and of the command `design`; m is a record that has
    them, and nothing else. s and duration in s; natural_frequency in rad/s and damping_ratio of the mode to leave at rest;
    max_velocity in 1/s and max_acceleration in 1/s2, 1e300 for none; ramp is what `ramp` gives; i numbers events from 0.

    Attributes:
        move: position [-], velocity [1/s] and acceleration [1/s2] at s in [0, duration]; where one jumps, that on the right.
        peaks: peak speed [1/s] and acceleration [1/s2], infinite where their integral jumps.
        shortest: the shortest duration [s] within the limits, of which one at least is given, and the ends of a gap of
            forbidden longer ones, (0, 0) without; 1e300 where no duration will do.
        ramp: a time [s] that the limits or the mode decide, such as that of a trapezoid's ramp; without it 0.
        least: the duration [s] that the move must exceed to leave the mode at rest; without it 0.
        event: time [s] of the i-th jump of the acceleration within the move; without it there is none.
        events: how many there are; without it two. Those that equal the duration are none.
        kink: time [s] of the i-th kink of the acceleration within the move; without it there is none.
        kinks: how many there are; without it four. Those that equal the duration are none.
        span: what the move takes of `duration` [s]; without it all. A step takes 0.
        cruise_time: distance over cruise speed [s]; without it, or where it is 0, there is no cruise.
        constant: outputs of MotionProfile that are constant between the jumps, such as the acceleration of a trapezoid.
        jumps_at_ends: whether position, velocity or acceleration jumps at the start and at the end.
        jumps_at_start: whether they jump at the start alone.
        tuned: whether `tune` and `choose` try it: not those that are there for comparison, or for more than one mode.
    """

    move: FunctionType
    peaks: FunctionType
    shortest: FunctionType
    ramp: FunctionType | None = None
    least: FunctionType | None = None
    event: FunctionType | None = None
    events: FunctionType | int | None = None
    kink: FunctionType | None = None
    kinks: FunctionType | int | None = None
    span: FunctionType | None = None
    cruise_time: FunctionType | None = None
    constant: tuple[str, ...] = ()
    jumps_at_ends: bool = False
    jumps_at_start: bool = False
    tuned: bool = True
