"""The pulse train: a unity-magnitude on/off command designed ahead."""

from __future__ import annotations

from typing import ClassVar

from shaper_fmu.component import MEAN, NO_EVENT, Calculated, Output, Parameter, State, Variable, time_tolerance
from shaper_fmu.kinds.pulses import (
    FAILURES,
    FURTHER_PARAMETERS,
    LIST,
    TIMED,
    Design,
    jumps_at_end,
    jumps_at_start,
    keeps_width,
    reference_of,
    switches_of,
)
from shaper_fmu.methods.record import declare
from shaper_fmu.pulses.carrier import triangle
from shaper_fmu.pulses.minimum_width import enforce_minimum_width
from shaper_fmu.pulses.residual import shortest_width, switch_residual
from shaper_fmu.pulses.workspace import PulseWorkspace
from shaper_fmu.pulses.zv_carrier import half_damped_period

SWITCHES = 1024

TOO_MANY_SWITCHES = 1
NO_DESIGN = 10
"""The status where there is no such command, to which the design's number is added."""


class PulseTrain(PulseWorkspace):
    __doc__ = f"""A command that is only ever on or off, and moves a flexible machine with little or no residual vibration.

    {LIST}.

    Designs for which `duration` tells nothing take the time that they need. The switches are exact in time, whatever the
    communication step: `next_event_time` announces them.
    """

    messages: ClassVar[dict[int, str]] = {
        TOO_MANY_SWITCHES: f"a frequency_ratio of {{frequency_ratio}} gives more than {SWITCHES} switches; use a smaller one",
        **{NO_DESIGN + number: text for number, text in FAILURES.items()},
    }

    continuous_states: ClassVar[tuple[str, ...] | None] = ()
    terminals: ClassVar[dict[str, dict[str, str]]] = {
        "command": {"value": "pulse", "mean": "pulse_mean"},
    }

    design: Variable[int] = Parameter(Design.carrier, "", "kind of design")
    amplitude: Variable[float] = Parameter(1.0, "", "value of the command when on; reference and carrier have the same scale")
    duration: Variable[float] = Parameter(0.4, "s", f"travel time of {TIMED}", min=0.0, exclusive=True, published=(1e-3, None))
    start_time: Variable[float] = Parameter(0.0, "s", "time at which the command begins")
    natural_frequency: Variable[float] = Parameter(
        10.0, "rad/s", "undamped natural frequency of the mode to leave at rest", min=0.0, exclusive=True, published=(1e-3, None)
    )
    damping_ratio: Variable[float] = Parameter(
        0.0, "", "damping ratio of that mode", min=0.0, max=1.0, exclusive="max", published=(0.0, 0.999)
    )
    frequency_ratio: Variable[float] = Parameter(
        13.0, "", "frequency of the carrier over the mode's damped frequency", min=0.0, exclusive=True, published=(1e-3, None)
    )
    minimum_pulse_width_limit: Variable[float] = Parameter(
        0.0, "s", "pulses and gaps shorter than this are left out, 0 for none", min=0.0
    )
    pulses: Variable[int] = Calculated("", "number of rising edges", start=0)
    switches: Variable[int] = Calculated("", "number of switches", start=0)
    minimum_pulse_width: Variable[float] = Calculated(
        "s", "shortest pulse or gap between two switches, 1e300 if there is only one switch"
    )
    residual_vibration: Variable[float] = Calculated(
        "", "V: residual envelope at the end of the travel over that of a step at the start"
    )
    travel_time: Variable[float] = Calculated("s", "time from the start of the command to its arrival")
    pulse: Variable[float] = Output("", "the on/off command")
    pulse_mean: Variable[float] = Output("", MEAN.format("pulse"))
    reference: Variable[float] = Output("", "what the carrier modulates; without a carrier, a step at the start")
    carrier: Variable[float] = Output("", "the triangle carrier; 0 in designs without one")
    next_event_time: Variable[float] = Output("s", "time of the next jump of an output, 1e300 if none", start=NO_EVENT)

    next_kink_time: Variable[float] = State(NO_EVENT)  # of the reference; the carrier's kinks are not told
    switch_time: Variable[list[float]] = State(size=SWITCHES)  # since the start of the command
    original_time: Variable[list[float]] = State(size=SWITCHES)
    frequency: Variable[float] = State()  # of the carrier [Hz], 0 without one
    damped_period: Variable[float] = State()
    declare(locals(), FURTHER_PARAMETERS)

    def start(self) -> int:
        self.damped_period = 2.0 * half_damped_period(self.natural_frequency, self.damping_ratio)
        self.frequency = 0.0
        self.travel_time = self.duration
        count = switches_of(self.design, self, SWITCHES)
        if count < 0:
            return TOO_MANY_SWITCHES
        if count == 0:
            return NO_DESIGN + self.design
        if not keeps_width(self.design):
            count = enforce_minimum_width(self.switch_time, count, self.minimum_pulse_width_limit)
        self.switches = count
        self.pulses = (count + 1) // 2
        self.minimum_pulse_width = shortest_width(self.switch_time, count)
        self.residual_vibration = switch_residual(
            self.switch_time, count, self.travel_time, self.natural_frequency, self.damping_ratio
        )
        return 0

    def step(self, t: float, h: float) -> None:
        tolerance = time_tolerance(self, t, h)
        s = t + h - self.start_time
        passed = passed_switches(self, s + tolerance)
        self.pulse = self.amplitude if passed % 2 else 0.0
        if h > 0.0:
            self.pulse_mean = self.amplitude * on_share(self, t - self.start_time, h)
        self.reference = self.amplitude * unit_reference(self, s, tolerance)
        self.carrier = self.amplitude * triangle(s, self.frequency) if self.frequency > 0.0 else 0.0
        due = self.switch_time[passed] if passed < self.switches else NO_EVENT
        if s < -tolerance:
            if jumps_at_start(self.design):
                due = 0.0
        elif jumps_at_end(self.design) and s < self.travel_time - tolerance:
            due = min(due, self.travel_time)
        self.next_kink_time = NO_EVENT
        if self.frequency > 0.0 and s < self.travel_time - tolerance:
            self.next_kink_time = self.start_time + (0.0 if s < -tolerance else self.travel_time)
        self.next_event_time = self.start_time + due if due < NO_EVENT else NO_EVENT


def passed_switches(m: PulseTrain, s: float) -> int:
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


def on_share(m: PulseTrain, s: float, h: float) -> float:
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


def unit_reference(m: PulseTrain, s: float, tolerance: float) -> float:
    """The reference of amplitude 1 at s since the start of the command, from the right where it jumps."""
    if s < -tolerance:
        return 0.0
    if s >= m.travel_time - tolerance:
        return 1.0
    return reference_of(m.design, m, s)
