"""Designing on/off commands in Python: the functions that the PulseTrain component uses, with checks and results."""

from __future__ import annotations

import math
from typing import Literal

from shaper_fmu.design.pulse_sequence import PulseSequence
from shaper_fmu.design.shapers import shaper
from shaper_fmu.errors import ComponentError
from shaper_fmu.pulses.carrier import carrier_frequency, carrier_switches
from shaper_fmu.pulses.carrier_polished import polish_until_wide
from shaper_fmu.pulses.minimax import BAND, NONE, minimax_switches
from shaper_fmu.pulses.minimum_width import enforce_minimum_width
from shaper_fmu.pulses.residual import switch_residual
from shaper_fmu.pulses.zv_carrier import half_damped_period, zv_carrier_switches

MOST_SWITCHES = 100_000


def carrier_pulses(
    duration: float,
    natural_frequency: float,
    damping_ratio: float,
    frequency_ratio: float,
    *,
    minimum_pulse_width: float = 0.0,
) -> PulseSequence:
    """The cycloid + ramped versine + ramp profile against a triangle carrier (Taskin, Kilic and Kapucu 2019).

    duration in s, natural_frequency in rad/s; the carrier's frequency is frequency_ratio times the damped one. Pulses and
    gaps shorter than minimum_pulse_width [s] are left out. Raises ComponentError for values outside their domains.
    """
    times, count = _carrier(duration, natural_frequency, damping_ratio, frequency_ratio, minimum_pulse_width)
    count = enforce_minimum_width(times, count, minimum_pulse_width)
    return _on_off(times[:count], duration)


def polished_pulses(
    duration: float,
    natural_frequency: float,
    damping_ratio: float,
    frequency_ratio: float,
    *,
    minimum_pulse_width: float = 0.0,
) -> PulseSequence:
    """`carrier_pulses` with the smallest shifts of its switches that leave no vibration at all.

    Raises ComponentError when no shift that keeps the switches in order and within the duration does that.
    """
    times, count = _carrier(duration, natural_frequency, damping_ratio, frequency_ratio, minimum_pulse_width)
    room = [0.0] * len(times)
    count = polish_until_wide(times, room, count, duration, natural_frequency, damping_ratio, minimum_pulse_width)
    if count == 0:
        raise ComponentError(
            f"no shift of the switches leaves no vibration: a frequency_ratio of {frequency_ratio:g} gives too few or too "
            f"unlucky switches within {duration:g} s"
        )
    certificate = switch_residual(times, count, duration, natural_frequency, damping_ratio)
    return _on_off(times[:count], duration, certificate)


def minimax_pulses(
    duration: float,
    natural_frequency: float,
    damping_ratio: float = 0.0,
    *,
    band: float = BAND,
    minimum_pulse_width: float = 0.0,
) -> PulseSequence:
    """Five switches: no vibration at natural_frequency [rad/s], and the smallest worst one within +-band around it.

    duration in s. Raises ComponentError when no such command of this duration was found.
    """
    _check(natural_frequency, damping_ratio, duration=duration, minimum_pulse_width=minimum_pulse_width)
    if not 0.0 < band < 1.0:
        raise ComponentError(f"band = {band} must be greater than 0 and less than 1")
    times = [0.0] * 5
    if minimax_switches(times, duration, natural_frequency, damping_ratio, band) >= NONE:
        period = 2.0 * half_damped_period(natural_frequency, damping_ratio)
        shortest = unity_magnitude_pulses("zv", natural_frequency, damping_ratio).travel_time
        raise ComponentError(
            f"no five-switch command without vibration takes {duration:g} s; possible are about {shortest:.6g} s "
            f"to {period:.6g} s, the damped period"
        )
    certificate = switch_residual(times, 5, duration, natural_frequency, damping_ratio)
    count = enforce_minimum_width(times, 5, minimum_pulse_width)
    return _on_off(times[:count], duration, certificate)


def unity_magnitude_pulses(
    kind: Literal["zv", "zvd"], natural_frequency: float, damping_ratio: float = 0.0, *, minimum_pulse_width: float = 0.0
) -> PulseSequence:
    """UM-ZV or UM-ZVD switch times, exact for the damping given (Singhose, Singer and Seering 1997).

    natural_frequency in rad/s. Raises ComponentError for an unknown kind, or when the equations were not solved.
    """
    _check(natural_frequency, damping_ratio, minimum_pulse_width=minimum_pulse_width)
    if kind not in ("zv", "zvd"):
        raise ComponentError(f"kind = {kind!r} is neither 'zv' nor 'zvd'")
    sequence = shaper(f"um_{kind}", natural_frequency, damping_ratio)
    times = list(sequence.delays)
    count = enforce_minimum_width(times, len(times), minimum_pulse_width)
    return _on_off(times[:count], sequence.duration, sequence.certificate)


def zv_carrier_pulses(
    natural_frequency: float, damping_ratio: float, frequency_ratio: float, *, minimum_pulse_width: float = 0.0
) -> PulseSequence:
    """A ZV shaper's staircase against the triangle carrier, the comparison of Taskin, Kilic and Kapucu 2019."""
    _check(natural_frequency, damping_ratio, frequency_ratio=frequency_ratio, minimum_pulse_width=minimum_pulse_width)
    frequency = carrier_frequency(natural_frequency, damping_ratio, frequency_ratio)
    duration = half_damped_period(natural_frequency, damping_ratio)
    times = [0.0] * _room(frequency, duration)
    count = zv_carrier_switches(times, len(times), natural_frequency, damping_ratio, frequency)
    count = enforce_minimum_width(times, count, minimum_pulse_width)
    return _on_off(times[:count], duration)


def _on_off(times: list[float], travel_time: float, certificate: float = math.nan) -> PulseSequence:
    levels = tuple(1.0 - i % 2 for i in range(len(times)))
    return PulseSequence(tuple(times), levels, travel_time, certificate)


def _carrier(
    duration: float, natural_frequency: float, damping_ratio: float, frequency_ratio: float, minimum_pulse_width: float
) -> tuple[list[float], int]:
    _check(
        natural_frequency,
        damping_ratio,
        duration=duration,
        frequency_ratio=frequency_ratio,
        minimum_pulse_width=minimum_pulse_width,
    )
    frequency = carrier_frequency(natural_frequency, damping_ratio, frequency_ratio)
    times = [0.0] * _room(frequency, duration)
    return times, carrier_switches(times, len(times), duration, natural_frequency, damping_ratio, frequency)


def _room(frequency: float, duration: float) -> int:
    """Enough room for all switches: at most three in each half period of the carrier."""
    halves = 2.0 * frequency * duration
    if not halves < MOST_SWITCHES:
        raise ComponentError(f"a carrier of {frequency:g} Hz over {duration:g} s gives more than {MOST_SWITCHES} switches")
    return 3 * (int(halves) + 3)


def _check(natural_frequency: float, damping_ratio: float, **values: float) -> None:
    """Raise ComponentError for the first value outside its domain; a width may be zero, everything else is positive."""
    for name, value in {"natural_frequency": natural_frequency, **values}.items():
        least = "at least 0" if name == "minimum_pulse_width" else "greater than 0"
        if not math.isfinite(value) or value < 0.0 or (value == 0.0 and name != "minimum_pulse_width"):
            raise ComponentError(f"{name} = {value} must be a finite number {least}")
    if not 0.0 <= damping_ratio < 1.0:
        raise ComponentError(f"damping_ratio = {damping_ratio} must be at least 0 and less than 1")
