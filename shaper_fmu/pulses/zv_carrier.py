"""The staircase of a ZV shaper against the triangle carrier, the comparison of Taskin, Kilic and Kapucu 2019.

The staircase is 1/(1 + K) from 0 and 1 from half a damped period on (Smith 1958; Singer and Seering 1990), with
K = exp(-zeta pi/sqrt(1 - zeta^2)). Its crossings with the carrier are a closed form.
"""

from __future__ import annotations

import math

from shaper_fmu.pulses.carrier import carrier_frequency, close_command
from shaper_fmu.pulses.method import PulseMethod
from shaper_fmu.pulses.workspace import PulseWorkspace
from shaper_fmu.variable import Array


def staircase_level(damping_ratio: float) -> float:
    """The first step 1/(1 + K) of the staircase."""
    return 1.0 / (1.0 + math.exp(-damping_ratio * math.pi / math.sqrt(1.0 - damping_ratio * damping_ratio)))


def half_damped_period(natural_frequency: float, damping_ratio: float) -> float:
    """The staircase's duration pi/wd [s] for natural_frequency in rad/s."""
    return math.pi / (natural_frequency * math.sqrt(1.0 - damping_ratio * damping_ratio))


def zv_carrier_switches(switch_time: Array, room: int, natural_frequency: float, damping_ratio: float, frequency: float) -> int:
    """Switch times [s] for the carrier of `frequency` [Hz] into switch_time; natural_frequency in rad/s.

    Returns their number, always odd, or -1 if there are more than `room`.
    """
    duration = half_damped_period(natural_frequency, damping_ratio)
    level = staircase_level(damping_ratio)
    if 2.0 * frequency * duration > room - 4:
        return -1
    count = 0
    period = 0
    rise = 0.5 * (1.0 - level) / frequency
    while rise < duration:
        switch_time[count] = rise
        count += 1
        fall = (period + 0.5 * (1.0 + level)) / frequency
        if fall < duration:
            switch_time[count] = fall
            count += 1
        period += 1
        rise = (period + 0.5 * (1.0 - level)) / frequency
    return close_command(switch_time, count, duration)


def zv_carrier(m: PulseWorkspace, room: int) -> int:
    """The staircase's switches into m.switch_time; returns their number, -1 for more than `room`."""
    m.frequency = carrier_frequency(m.natural_frequency, m.damping_ratio, m.frequency_ratio)
    m.travel_time = half_damped_period(m.natural_frequency, m.damping_ratio)
    return zv_carrier_switches(m.switch_time, room, m.natural_frequency, m.damping_ratio, m.frequency)


def staircase(m: PulseWorkspace, s: float) -> float:
    """The staircase before its second step."""
    return staircase_level(m.damping_ratio)


ZV_CARRIER = PulseMethod(
    name="zv_carrier",
    number=6,
    switches=zv_carrier,
    reference=staircase,
    jumps_at_end=True,
    timed=False,
    summary="the staircase of a ZV shaper against the carrier",
    paper="Taskin, Kilic and Kapucu 2019",
)
