"""Designs on/off commands in Python, with the functions of the PulseTrain component, and checks them."""

from __future__ import annotations

import contextlib
import math
from typing import Any, Literal

from shaper_fmu.commands.pulse_train import NO_DESIGN, SWITCHES, PulseTrain
from shaper_fmu.component import Variable
from shaper_fmu.design.pulse_sequence import PulseSequence
from shaper_fmu.errors import ArgumentError, NoSolutionError, nearest
from shaper_fmu.kinds.pulses import FURTHER_PARAMETERS, PULSES, switches_of
from shaper_fmu.pulses.minimax import BAND, NONE, minimax_switches
from shaper_fmu.pulses.minimum_width import enforce_minimum_width
from shaper_fmu.pulses.residual import switch_residual
from shaper_fmu.pulses.zv_carrier import half_damped_period

MOST_SWITCHES = 100_000
_ROUNDING = 1e-12
_LONGEST = 4.0
"""Damped periods up to which the shortest duration within a limit of the deflection is looked for, and in how many steps."""
_DURATIONS = 800
OPTIONS: dict[str, Variable[Any]] = dict(FURTHER_PARAMETERS)
"""The designs' own parameters, by name."""


def pulses(
    kind: str,
    natural_frequency: float,
    damping_ratio: float = 0.0,
    *,
    duration: float | None = None,
    frequency_ratio: float = 13.0,
    minimum_pulse_width: float = 0.0,
    deflection_limit: float | None = None,
    **parameters: float,
) -> PulseSequence:
    """The on/off command of a design of PulseTrain, such as "minimax", for a mode of natural_frequency [rad/s].

    Args:
        duration: travel time [s], where the design leaves it open; with a deflection_limit the shortest one by default.
        frequency_ratio: frequency of the carrier over the damped one, where there is a carrier.
        minimum_pulse_width: pulses and gaps shorter than this [s] are left out.
        deflection_limit: the mode's deflection, during the command and after it, over the static one with the command on, is
            never larger; 1 or more.
        parameters: those that the designs declare.

    Raises ArgumentError for values outside their domains, NoSolutionError where there is no such command.
    """
    if kind not in PULSES:
        raise ArgumentError(f"there is no pulse design {kind!r}.{nearest(kind, PULSES)}")
    if deflection_limit is not None:
        options = {"frequency_ratio": frequency_ratio, "minimum_pulse_width": minimum_pulse_width, **parameters}
        return _within(deflection_limit, kind, natural_frequency, damping_ratio, duration, options)
    if duration is None and PULSES[kind].timed:
        raise ArgumentError(f"{kind} needs a duration")
    given = {"frequency_ratio": frequency_ratio} if duration is None else {"duration": duration, "frequency_ratio": frequency_ratio}
    _check(natural_frequency, damping_ratio, **given, minimum_pulse_width=minimum_pulse_width)
    m = PulseTrain(
        design=kind,
        natural_frequency=natural_frequency,
        damping_ratio=damping_ratio,
        minimum_pulse_width_limit=minimum_pulse_width,
        **given,
        **parameters,
    )
    m.check_values("parameter")
    m.damped_period = 2.0 * half_damped_period(natural_frequency, damping_ratio)
    m.travel_time = m.duration
    m.certificate_left = math.nan
    count = switches_of(m.design, m, SWITCHES)
    if count < 0:
        m.switch_time, m.original_time = [0.0] * MOST_SWITCHES, [0.0] * MOST_SWITCHES
        count = switches_of(m.design, m, MOST_SWITCHES)
    if count < 0:
        raise ArgumentError(f"a frequency_ratio of {frequency_ratio:g} gives more than {MOST_SWITCHES} switches")
    if count == 0:
        raise NoSolutionError(m.explain(NO_DESIGN + m.design))
    if not PULSES[kind].keeps_width:
        count = enforce_minimum_width(m.switch_time, count, minimum_pulse_width)
    return _on_off(m.switch_time[:count], m.travel_time, m.certificate_left)


def _within(
    limit: float, kind: str, natural_frequency: float, damping_ratio: float, duration: float | None, options: dict[str, float]
) -> PulseSequence:
    """The command, if it keeps the deflection's limit; without a duration the shortest one on a grid that does."""
    if not 1.0 <= limit < math.inf:
        raise ArgumentError(f"deflection_limit = {limit:g}: with the command on, the static deflection is 1, so give 1 or more")
    if duration is not None or not PULSES[kind].timed:
        command = pulses(kind, natural_frequency, damping_ratio, duration=duration, **options)
        peak = command.peak_deflection(natural_frequency, damping_ratio)
        if peak > limit + _ROUNDING:
            raise NoSolutionError(f"the mode is deflected by {peak:.6g} of its static deflection, the limit is {limit:g}")
        return command
    _check(natural_frequency, damping_ratio)
    period = 2.0 * half_damped_period(natural_frequency, damping_ratio)
    for k in range(1, _DURATIONS + 1):
        with contextlib.suppress(NoSolutionError):
            return _within(limit, kind, natural_frequency, damping_ratio, k * _LONGEST * period / _DURATIONS, options)
    raise NoSolutionError(f"no {kind} command within {_LONGEST:g} damped periods keeps to a deflection of {limit:g}")


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
    gaps shorter than minimum_pulse_width [s] are left out. Raises ArgumentError for values outside their domains.
    """
    options = {"frequency_ratio": frequency_ratio, "minimum_pulse_width": minimum_pulse_width}
    return pulses("carrier", natural_frequency, damping_ratio, duration=duration, **options)


def polished_pulses(
    duration: float,
    natural_frequency: float,
    damping_ratio: float,
    frequency_ratio: float,
    *,
    minimum_pulse_width: float = 0.0,
) -> PulseSequence:
    """`carrier_pulses` with the smallest shifts of its switches that leave no vibration at all.

    Raises ArgumentError when no shift that keeps the switches in order and within the duration does that.
    """
    options = {"frequency_ratio": frequency_ratio, "minimum_pulse_width": minimum_pulse_width}
    return pulses("carrier_polished", natural_frequency, damping_ratio, duration=duration, **options)


def minimax_pulses(
    duration: float,
    natural_frequency: float,
    damping_ratio: float = 0.0,
    *,
    band: float = BAND,
    minimum_pulse_width: float = 0.0,
) -> PulseSequence:
    """Five switches: no vibration at natural_frequency [rad/s], and the smallest worst one within +-band around it.

    duration in s. Raises ArgumentError when no such command of this duration was found.
    """
    _check(natural_frequency, damping_ratio, duration=duration, minimum_pulse_width=minimum_pulse_width)
    if not 0.0 < band < 1.0:
        raise ArgumentError(f"band = {band} must be greater than 0 and less than 1")
    times = [0.0] * 5
    if minimax_switches(times, duration, natural_frequency, damping_ratio, band) >= NONE:
        period = 2.0 * half_damped_period(natural_frequency, damping_ratio)
        shortest = unity_magnitude_pulses("zv", natural_frequency, damping_ratio).travel_time
        raise ArgumentError(
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

    natural_frequency in rad/s. Raises ArgumentError for an unknown kind, or when the equations were not solved.
    """
    if kind not in ("zv", "zvd"):
        raise ArgumentError(f"kind = {kind!r} is neither 'zv' nor 'zvd'")
    return pulses(f"um_{kind}", natural_frequency, damping_ratio, minimum_pulse_width=minimum_pulse_width)


def zv_carrier_pulses(
    natural_frequency: float, damping_ratio: float, frequency_ratio: float, *, minimum_pulse_width: float = 0.0
) -> PulseSequence:
    """A ZV shaper's staircase against the triangle carrier, the comparison of Taskin, Kilic and Kapucu 2019."""
    options = {"frequency_ratio": frequency_ratio, "minimum_pulse_width": minimum_pulse_width}
    return pulses("zv_carrier", natural_frequency, damping_ratio, **options)


def _on_off(times: list[float], travel_time: float, certificate: float = math.nan) -> PulseSequence:
    levels = tuple(1.0 - i % 2 for i in range(len(times)))
    return PulseSequence(tuple(times), levels, travel_time, certificate)


def _check(natural_frequency: float, damping_ratio: float, **values: float) -> None:
    """Raise ComponentError for the first value outside its domain; a width may be zero, everything else is positive."""
    for name, value in {"natural_frequency": natural_frequency, **values}.items():
        least = "at least 0" if name == "minimum_pulse_width" else "greater than 0"
        if not math.isfinite(value) or value < 0.0 or (value == 0.0 and name != "minimum_pulse_width"):
            raise ArgumentError(f"{name} = {value} must be a finite number {least}")
    if not 0.0 <= damping_ratio < 1.0:
        raise ArgumentError(f"damping_ratio = {damping_ratio} must be at least 0 and less than 1")
