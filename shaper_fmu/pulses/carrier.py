"""Natural sampling: the cycloid + ramped versine + ramp profile y(s) against a triangle carrier c(s).

Taskin, Kilic and Kapucu 2019: c(s) = |1 - 2 frac(q f_d s)| with f_d = wd/(2 pi) and the frequency ratio q; the command
is 1 where y > c, and from the end of the profile on. Over half a carrier period c is a straight line, and y - c turns
where y' equals its slope, which is a closed form. Between two such points y - c is monotone, so that no crossing and no
pair of crossings is missed; each is found to the last bits by Newton's method inside its bracket. Where the profile
only touches the carrier, nothing switches.
"""

from __future__ import annotations

import math

from shaper_fmu.profiles.cycloid_versine_ramp import cycloid_versine_ramp
from shaper_fmu.pulses.method import PulseMethod
from shaper_fmu.pulses.minimum_width import enforce_minimum_width
from shaper_fmu.pulses.workspace import PulseWorkspace
from shaper_fmu.variable import Array

COINCIDENT = 1e-12
"""Switches closer than this part of the travel time are one: the profile only touches the carrier."""


def triangle(s: float, frequency: float) -> float:
    """The carrier |1 - 2 frac(frequency s)|, in [0, 1], continued to both sides; s in s, frequency in Hz."""
    periods = frequency * s
    return abs(1.0 - 2.0 * (periods - math.floor(periods)))


def carrier_frequency(natural_frequency: float, damping_ratio: float, frequency_ratio: float) -> float:
    """q f_d [Hz] for natural_frequency in rad/s."""
    return frequency_ratio * natural_frequency * math.sqrt(1.0 - damping_ratio * damping_ratio) / (2.0 * math.pi)


def carrier_switches(
    switch_time: Array, room: int, duration: float, natural_frequency: float, damping_ratio: float, frequency: float
) -> int:
    """Switch times [s] of the profile of `duration` [s] against the carrier of `frequency` [Hz] into switch_time.

    Returns their number, always odd, or -1 if there are more than `room`. natural_frequency in rad/s.
    """
    if 2.0 * frequency * duration > room:
        return -1
    count = 0
    on = False
    half = 0
    a = 0.0
    while a < duration:
        end = min(duration, 0.5 * (half + 1) / frequency)
        slope = 2.0 * frequency if half % 2 else -2.0 * frequency
        level = -float(half) if half % 2 else float(half + 1)  # the carrier is level + slope s here
        first, second = _turning_points(slope, duration, natural_frequency, damping_ratio)
        for i in range(3):
            b = end
            if i == 0:
                b = min(first, end)
            if i == 1:
                b = min(second, end)
            if b > a:
                above = _difference(b, duration, natural_frequency, damping_ratio, level, slope) > 0.0
                if above != on:
                    if count >= room - 1:
                        return -1
                    switch_time[count] = _crossing(a, b, above, duration, natural_frequency, damping_ratio, level, slope)
                    count += 1
                    on = above
                a = b
        half += 1
    return close_command(switch_time, count, duration)


def close_command(switch_time: Array, count: int, duration: float) -> int:
    """End the command: on from `duration` [s] on, and coincident switches removed; returns the new count."""
    if count % 2 == 0:
        switch_time[count] = duration
        count += 1
    if switch_time[count - 1] > duration * (1.0 - COINCIDENT):
        switch_time[count - 1] = duration
    return enforce_minimum_width(switch_time, count, COINCIDENT * duration)


def _turning_points(slope: float, duration: float, natural_frequency: float, damping_ratio: float) -> tuple[float, float]:
    """The two times in [0, duration) at which the profile's velocity equals `slope`, rising; `duration` if there are none.

    T y' = 1 - C cos(a) + D sin(a) with a = 2 pi s/T, C and D the profile's cycloid and versine parts.
    """
    ratio = 2.0 * math.pi / duration / natural_frequency
    cycloid_part = 1.0 - ratio * ratio
    versine_part = 2.0 * damping_ratio * ratio
    amplitude = math.sqrt(cycloid_part * cycloid_part + versine_part * versine_part)
    wanted = slope * duration - 1.0
    if abs(wanted) >= amplitude:
        return duration, duration
    phase = math.atan2(cycloid_part, versine_part)
    angle = math.atan2(wanted, math.sqrt((amplitude - wanted) * (amplitude + wanted)))
    first = (phase + angle) / (2.0 * math.pi)
    second = (phase - angle) / (2.0 * math.pi) + 0.5
    first = duration * (first - math.floor(first))
    second = duration * (second - math.floor(second))
    return min(first, second), max(first, second)


def _difference(s: float, duration: float, natural_frequency: float, damping_ratio: float, level: float, slope: float) -> float:
    position, _, _ = cycloid_versine_ramp(s, duration, natural_frequency, damping_ratio)
    return position - (level + slope * s)


def _crossing(
    a: float,
    b: float,
    above: bool,
    duration: float,
    natural_frequency: float,
    damping_ratio: float,
    level: float,
    slope: float,
) -> float:
    """The zero of y - c in [a, b], where y - c is monotone and positive at b if `above`, else at a."""
    x = 0.5 * (a + b)
    for _ in range(100):
        position, velocity, _ = cycloid_versine_ramp(x, duration, natural_frequency, damping_ratio)
        difference = position - (level + slope * x)
        if (difference > 0.0) == above:
            b = x
        else:
            a = x
        rate = velocity - slope
        better = 0.5 * (a + b)
        if abs(rate) * duration > 1e-9:
            newton = x - difference / rate
            if a <= newton <= b:
                better = newton
        if abs(better - x) <= 2e-16 * duration:
            return better
        x = better
    return x


def carrier(m: PulseWorkspace, room: int) -> int:
    """The profile's switches against the carrier into m.switch_time; returns their number, -1 for more than `room`."""
    m.frequency = carrier_frequency(m.natural_frequency, m.damping_ratio, m.frequency_ratio)
    return carrier_switches(m.switch_time, room, m.duration, m.natural_frequency, m.damping_ratio, m.frequency)


def profile_reference(m: PulseWorkspace, s: float) -> float:
    """The profile at s [s]."""
    position, _, _ = cycloid_versine_ramp(max(0.0, min(m.travel_time, s)), m.duration, m.natural_frequency, m.damping_ratio)
    return position


CARRIER = PulseMethod(
    name="carrier",
    number=1,
    switches=carrier,
    reference=profile_reference,
    jumps_at_start=False,
    summary="on where the cycloid + ramped versine + ramp profile of `duration` is above a triangle carrier of `frequency_ratio` "
    "times the damped frequency, exact crossings",
    paper="Taskin, Kilic and Kapucu 2019",
)
