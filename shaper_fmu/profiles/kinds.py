"""All profiles under one roof: kernel functions that take the kind of profile beside what the kinds need."""

from __future__ import annotations

import math
from enum import IntEnum

from shaper_fmu.profiles.cycloid import cycloid, cycloid_peaks, cycloid_shortest
from shaper_fmu.profiles.cycloid_versine_ramp import cycloid_versine_ramp
from shaper_fmu.profiles.cycloid_versine_ramp_limits import cycloid_versine_ramp_peak_velocity, cycloid_versine_ramp_shortest
from shaper_fmu.profiles.polynomial_345 import polynomial_345, polynomial_345_peaks, polynomial_345_shortest
from shaper_fmu.profiles.s_curve import s_curve, s_curve_boundary, s_curve_segment_time
from shaper_fmu.profiles.s_curve_limits import s_curve_peaks, s_curve_shortest
from shaper_fmu.profiles.step import step
from shaper_fmu.profiles.trapezoid import trapezoid, trapezoid_peaks, trapezoid_ramp, trapezoid_shortest
from shaper_fmu.profiles.two_part import two_part

NO_LIMIT = 1e300
"""A limit that is none, and a duration that is not reached [m/s, m/s2, s]."""


class ProfileKind(IntEnum):
    """Kinds of profiles; the numbers are those of the FMU's enumeration and never change."""

    step = 1
    trapezoid = 2
    cycloid = 3
    polynomial_345 = 4
    cycloid_versine_ramp = 5
    two_part = 6
    s_curve = 7


def unit_limit(limit: float, distance: float) -> float:
    """A limit of the unit move [1/s or 1/s2], from that of the move over `distance` [m]; NO_LIMIT if there is none."""
    if limit >= NO_LIMIT or distance == 0.0:
        return NO_LIMIT
    return min(NO_LIMIT, limit / abs(distance))


def unit_move(
    kind: int, s: float, duration: float, ramp: float, natural_frequency: float, damping_ratio: float
) -> tuple[float, float, float]:
    """Position [-], velocity [1/s] and acceleration [1/s2] of the unit move at s in [0, duration]; `ramp` by `ramp_time`."""
    if kind == ProfileKind.step:
        return step(s)
    if kind == ProfileKind.trapezoid:
        return trapezoid(s, duration, ramp)
    if kind == ProfileKind.cycloid:
        return cycloid(s, duration)
    if kind == ProfileKind.polynomial_345:
        return polynomial_345(s, duration)
    if kind == ProfileKind.cycloid_versine_ramp:
        return cycloid_versine_ramp(s, duration, natural_frequency, damping_ratio)
    if kind == ProfileKind.two_part:
        return two_part(s, duration, natural_frequency, damping_ratio)
    return s_curve(s, duration, ramp, natural_frequency, damping_ratio)


def ramp_time(kind: int, duration: float, max_velocity: float, max_acceleration: float) -> float:
    """Time of a trapezoid's ramp or of an S-curve's segment [s]; 0 for the others. Limits of the unit move, 1/s and 1/s2."""
    if kind == ProfileKind.trapezoid:
        return trapezoid_ramp(duration, max_velocity, max_acceleration)
    if kind == ProfileKind.s_curve:
        return s_curve_segment_time(duration, max_velocity)
    return 0.0


def inner_event(kind: int, i: int, duration: float, ramp: float) -> float:
    """Time [s] of the i-th (0, 1) jump of an acceleration within the move (a trapezoid's); `duration` if there is none."""
    if kind == ProfileKind.trapezoid:
        return ramp if i == 0 else duration - ramp
    return duration


def inner_kink(kind: int, i: int, duration: float, ramp: float) -> float:
    """Time [s] of the i-th (0 .. 3) kink of an acceleration within the move (an S-curve's); `duration` if there is none."""
    if kind == ProfileKind.s_curve:
        return s_curve_boundary(i, duration, ramp)
    return duration


def peaks(kind: int, duration: float, ramp: float, natural_frequency: float, damping_ratio: float) -> tuple[float, float]:
    """Peak speed [1/s] and peak acceleration [1/s2] of the unit move, infinite where their integral jumps."""
    if kind == ProfileKind.step:
        return math.inf, math.inf
    if kind == ProfileKind.trapezoid:
        return trapezoid_peaks(duration, ramp)
    if kind == ProfileKind.cycloid:
        return cycloid_peaks(duration)
    if kind == ProfileKind.polynomial_345:
        return polynomial_345_peaks(duration)
    if kind == ProfileKind.cycloid_versine_ramp:
        return cycloid_versine_ramp_peak_velocity(duration, natural_frequency, damping_ratio), math.inf
    if kind == ProfileKind.two_part:
        return 0.5 * cycloid_versine_ramp_peak_velocity(0.5 * duration, natural_frequency, damping_ratio), math.inf
    return s_curve_peaks(duration, ramp, natural_frequency, damping_ratio)


def shortest_duration(
    kind: int, max_velocity: float, max_acceleration: float, natural_frequency: float, damping_ratio: float
) -> tuple[float, float, float]:
    """Shortest duration [s] for limits of the unit move [1/s, 1/s2], and the ends of a gap of forbidden longer ones [s].

    NO_LIMIT if no duration will do: a step breaks any limit, a jump of the velocity any limit of the acceleration.
    """
    if max_velocity >= NO_LIMIT and max_acceleration >= NO_LIMIT:
        return 0.0, 0.0, 0.0
    if kind == ProfileKind.trapezoid:
        return trapezoid_shortest(max_velocity, max_acceleration), 0.0, 0.0
    if kind == ProfileKind.cycloid:
        return cycloid_shortest(max_velocity, max_acceleration), 0.0, 0.0
    if kind == ProfileKind.polynomial_345:
        return polynomial_345_shortest(max_velocity, max_acceleration), 0.0, 0.0
    if kind == ProfileKind.s_curve:
        return s_curve_shortest(max_velocity, max_acceleration, natural_frequency, damping_ratio), 0.0, 0.0
    if kind == ProfileKind.step or max_acceleration < NO_LIMIT:
        return NO_LIMIT, 0.0, 0.0
    if kind == ProfileKind.cycloid_versine_ramp:
        return cycloid_versine_ramp_shortest(max_velocity, natural_frequency, damping_ratio)
    half, gap_start, gap_end = cycloid_versine_ramp_shortest(2.0 * max_velocity, natural_frequency, damping_ratio)
    return 2.0 * half, 2.0 * gap_start, 2.0 * gap_end
