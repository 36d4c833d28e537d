"""The pulse train: a unity-magnitude on/off command designed ahead."""

from __future__ import annotations

from enum import IntEnum

from shaper_fmu.component import MEAN, NO_EVENT, Calculated, Output, Parameter, State, time_tolerance
from shaper_fmu.profiles.cycloid_versine_ramp import cycloid_versine_ramp
from shaper_fmu.pulses.carrier import carrier_frequency, carrier_switches, triangle
from shaper_fmu.pulses.carrier_polished import polish_until_wide
from shaper_fmu.pulses.minimax import BAND, NONE, minimax_switches
from shaper_fmu.pulses.minimum_width import enforce_minimum_width
from shaper_fmu.pulses.residual import shortest_width, switch_residual
from shaper_fmu.pulses.zv_carrier import half_damped_period, staircase_level, zv_carrier_switches
from shaper_fmu.shapers.unity_magnitude import unity_magnitude_zv, unity_magnitude_zvd
from shaper_fmu.shapers.workspace import DesignWorkspace

SWITCHES = 1024

TOO_MANY_SWITCHES = 1
NOT_POLISHED = 2
NO_MINIMAX = 3
NO_UNITY_MAGNITUDE = 4


class Design(IntEnum):
    """Kinds of designs; the numbers are those of the FMU's enumeration and never change."""

    carrier = 1
    carrier_polished = 2
    minimax = 3
    um_zv = 4
    um_zvd = 5
    zv_carrier = 6


class PulseTrain(DesignWorkspace):
    """A command that is only ever on or off, and moves a flexible machine with little or no residual vibration.

    carrier: on where the cycloid + ramped versine + ramp profile of `duration` is above a triangle carrier of
    `frequency_ratio` times the damped frequency (Taskin, Kilic and Kapucu 2019). carrier_polished: its switches shifted
    as little as leaves no vibration. minimax: five switches that leave none, and the least within 20 % of the frequency.
    um_zv, um_zvd: the shortest switching that leaves none, and the one that is flat besides (Singhose, Singer and Seering
    1997). zv_carrier: a ZV shaper's staircase against the carrier. The last three take the time that they need, whatever
    `duration` is. The switches are exact in time, whatever the communication step: `next_event_time` announces them.
    """

    messages = {
        TOO_MANY_SWITCHES: f"a frequency_ratio of {{frequency_ratio}} gives more than {SWITCHES} switches; use a smaller one",
        NOT_POLISHED: "no shift of the switches leaves no vibration with frequency_ratio = {frequency_ratio}, duration = "
        "{duration} s and minimum_pulse_width_limit = {minimum_pulse_width_limit} s; use a larger frequency_ratio",
        NO_MINIMAX: "no five-switch command without vibration takes {duration} s; use between a third of the damped period and "
        "the whole one, here {damped_period} s",
        NO_UNITY_MAGNITUDE: "no unity magnitude switch times were found for damping_ratio = {damping_ratio}",
    }

    continuous_states = ()

    design = Parameter(Design.carrier, "", "kind of design")
    amplitude = Parameter(1.0, "", "value of the command when on; reference and carrier have the same scale")
    duration = Parameter(
        0.4, "s", "travel time of carrier, carrier_polished and minimax", min=0.0, exclusive=True, published=(1e-3, None)
    )
    start_time = Parameter(0.0, "s", "time at which the command begins")
    natural_frequency = Parameter(
        10.0, "rad/s", "undamped natural frequency of the mode to leave at rest", min=0.0, exclusive=True, published=(1e-3, None)
    )
    damping_ratio = Parameter(0.0, "", "damping ratio of that mode", min=0.0, max=1.0, exclusive="max", published=(0.0, 0.999))
    frequency_ratio = Parameter(
        13.0, "", "frequency of the carrier over the mode's damped frequency", min=0.0, exclusive=True, published=(1e-3, None)
    )
    minimum_pulse_width_limit = Parameter(0.0, "s", "pulses and gaps shorter than this are left out, 0 for none", min=0.0)
    pulses = Calculated("", "number of rising edges", start=0)
    switches = Calculated("", "number of switches", start=0)
    minimum_pulse_width = Calculated("s", "shortest pulse or gap between two switches, 1e300 if there is only one switch")
    residual_vibration = Calculated("", "V: residual envelope at the end of the travel over that of a step at the start")
    travel_time = Calculated("s", "time from the start of the command to its arrival")
    pulse = Output("", "the on/off command")
    pulse_mean = Output("", MEAN.format("pulse"))
    reference = Output("", "what the carrier modulates; without a carrier, a step at the start")
    carrier = Output("", "the triangle carrier; 0 in designs without one")
    next_event_time = Output("s", "time of the next jump of an output, 1e300 if none", start=NO_EVENT)

    next_kink_time = State(NO_EVENT)  # of the reference; the carrier's kinks are not told
    switch_time = State(size=SWITCHES)  # since the start of the command
    original_time = State(size=SWITCHES)
    frequency = State()  # of the carrier [Hz], 0 without one
    damped_period = State()

    def start(self):
        self.damped_period = 2.0 * half_damped_period(self.natural_frequency, self.damping_ratio)
        self.frequency = 0.0
        self.travel_time = self.duration
        count = design_switches(self)
        if count <= 0:
            return -count
        if self.design != Design.carrier_polished:
            count = enforce_minimum_width(self.switch_time, count, self.minimum_pulse_width_limit)
        self.switches = count
        self.pulses = (count + 1) // 2
        self.minimum_pulse_width = shortest_width(self.switch_time, count)
        self.residual_vibration = switch_residual(
            self.switch_time, count, self.travel_time, self.natural_frequency, self.damping_ratio
        )
        return 0

    def step(self, t, h):
        tolerance = time_tolerance(self, t, h)
        s = t + h - self.start_time
        passed = passed_switches(self, s + tolerance)
        self.pulse = self.amplitude if passed % 2 else 0.0
        if h > 0.0:
            self.pulse_mean = self.amplitude * on_share(self, t - self.start_time, h)
        self.reference = self.amplitude * unit_reference(self, s, tolerance)
        self.carrier = self.amplitude * triangle(s, self.frequency) if self.frequency > 0.0 else 0.0
        due = self.switch_time[passed] if passed < self.switches else NO_EVENT
        if self.design >= Design.minimax:  # the reference jumps, too
            if s < -tolerance:
                due = 0.0
            elif self.design == Design.zv_carrier and s < self.travel_time - tolerance:
                due = min(due, self.travel_time)
        self.next_kink_time = NO_EVENT
        if self.frequency > 0.0 and s < self.travel_time - tolerance:
            self.next_kink_time = self.start_time + (0.0 if s < -tolerance else self.travel_time)
        self.next_event_time = self.start_time + due if due < NO_EVENT else NO_EVENT


def design_switches(m):
    """The design's switches into m.switch_time; returns their number, or minus a status number."""
    if m.design == Design.minimax:
        worst = minimax_switches(m.switch_time, m.duration, m.natural_frequency, m.damping_ratio, BAND)
        return 5 if worst < NONE else -NO_MINIMAX
    if m.design == Design.um_zv or m.design == Design.um_zvd:
        count = unity_magnitude_zv(m, m.damping_ratio) if m.design == Design.um_zv else unity_magnitude_zvd(m, m.damping_ratio)
        if count == 0:
            return -NO_UNITY_MAGNITUDE
        for i in range(count):
            m.switch_time[i] = m.factor_delay[i] / m.natural_frequency
        m.travel_time = m.switch_time[count - 1]
        return count
    m.frequency = carrier_frequency(m.natural_frequency, m.damping_ratio, m.frequency_ratio)
    if m.design == Design.zv_carrier:
        m.travel_time = 0.5 * m.damped_period
        count = zv_carrier_switches(m.switch_time, SWITCHES, m.natural_frequency, m.damping_ratio, m.frequency)
    else:
        count = carrier_switches(m.switch_time, SWITCHES, m.duration, m.natural_frequency, m.damping_ratio, m.frequency)
    if count < 0:
        return -TOO_MANY_SWITCHES
    if m.design == Design.carrier_polished:
        count = polish_until_wide(
            m.switch_time,
            m.original_time,
            count,
            m.duration,
            m.natural_frequency,
            m.damping_ratio,
            m.minimum_pulse_width_limit,
        )
        return count if count > 0 else -NOT_POLISHED
    return count


def passed_switches(m, s):
    """How many switches lie at s, since the start of the command, or before."""
    low = 0
    high = m.switches
    while low < high:
        middle = (low + high) // 2
        if m.switch_time[middle] <= s:
            low = middle + 1
        else:
            high = middle
    return low


def on_share(m, s, h):
    """The share of the time from s to s + h, since the start of the command, in which it is on."""
    first = passed_switches(m, s)
    i = first
    begin = s
    on = 0.0
    while i < m.switches and m.switch_time[i] < s + h:
        if i % 2:
            on += m.switch_time[i] - begin
        begin = m.switch_time[i]
        i += 1
    if i == first:
        return float(i % 2)
    if i % 2:
        on += s + h - begin
    return on / h


def unit_reference(m, s, tolerance):
    """The reference of amplitude 1 at s since the start of the command, from the right where it jumps."""
    if s < -tolerance:
        return 0.0
    if m.frequency == 0.0 or s >= m.travel_time - tolerance:
        return 1.0
    if m.design == Design.zv_carrier:
        return staircase_level(m.damping_ratio)
    position, _, _ = cycloid_versine_ramp(max(0.0, min(m.travel_time, s)), m.duration, m.natural_frequency, m.damping_ratio)
    return position
