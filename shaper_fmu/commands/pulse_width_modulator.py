"""The pulse width modulator: turns an incoming reference into an on/off command while running."""

from __future__ import annotations

import math
from typing import ClassVar

from shaper_fmu.component import MEAN, NO_EVENT, Component, Input, Output, Parameter, State, Variable, time_tolerance

MOST_PERIODS = 1e5
FARTHEST_EDGE = 1e12
SAME_TIME = 1e-3  # in periods

TOO_MANY_PERIODS = 1
TOO_WIDE = 2
TOO_FAR = 3


class PulseWidthModulator(Component):
    """On where the reference is above a triangle carrier: pulse = 1 where reference > |1 - 2 frac(f t + phase/(2 pi))|.

    This is natural sampling (Taskin, Kilic and Kapucu 2019), on line. The reference holds over a communication step; its
    crossings with the carrier, and so the switches, are exact in time: `next_event_time` announces them. A reference of
    0 or less is always off, of 1 or more always on. A master that can only hold inputs over fixed steps wires
    `pulse_mean`, the mean over the step just done.

    Of a held reference, pulses shorter than `minimum_pulse_width` are left out and gaps shorter than it are closed; and
    where the reference changes, a switch waits until that time has passed since the last one.
    """

    messages: ClassVar[dict[int, str]] = {
        TOO_MANY_PERIODS: f"a communication step spans more than {MOST_PERIODS:g} periods of the carrier_frequency "
        "{carrier_frequency} Hz; use smaller steps",
        TOO_FAR: f"more than {FARTHEST_EDGE:g} periods of the carrier_frequency {{carrier_frequency}} Hz lie between time zero and "
        "now; its edges cannot be told apart any more",
        TOO_WIDE: "minimum_pulse_width = {minimum_pulse_width} s must be at most half a period of carrier_frequency = "
        "{carrier_frequency} Hz: a pulse and a gap of this width do not fit in",
    }

    continuous_states: ClassVar[tuple[str, ...] | None] = ()
    sampled: ClassVar[bool] = True
    terminals: ClassVar[dict[str, dict[str, str]]] = {
        "command": {"value": "reference"},
        "pulse": {"value": "pulse", "mean": "pulse_mean"},
    }

    reference: Variable[float] = Input("", "share of the time to be on, 0 to 1")
    carrier_frequency: Variable[float] = Parameter(
        20.0, "Hz", "frequency of the carrier", min=0.0, exclusive=True, published=(1e-9, None)
    )
    carrier_phase: Variable[float] = Parameter(
        0.0, "rad", "phase of the carrier at time zero; 0 is at its peak, falling", display_unit="deg"
    )
    minimum_pulse_width: Variable[float] = Parameter(0.0, "s", "shortest time between two switches", min=0.0)
    pulse: Variable[float] = Output("", "the on/off command, 0 or 1")
    pulse_mean: Variable[float] = Output("", MEAN.format("pulse"))
    next_event_time: Variable[float] = Output("s", "time of the next jump of an output, 1e300 if none", start=NO_EVENT)

    last_switch: Variable[float] = State(-NO_EVENT)
    done_until: Variable[float] = State(-NO_EVENT)  # edges up to this time are done

    def start(self) -> int:
        if 2.0 * self.minimum_pulse_width * self.carrier_frequency > 1.0:
            return TOO_WIDE
        return 0

    def step(self, t: float, h: float) -> int:
        if not self.carrier_frequency * h <= MOST_PERIODS:
            return TOO_MANY_PERIODS
        if not self.carrier_frequency * (abs(t) + h) + abs(self.carrier_phase) < FARTHEST_EDGE:
            return TOO_FAR
        until = t + h + time_tolerance(self, t, h)
        share = served_share(self)
        follows = self.carrier_frequency * (t - self.done_until) < SAME_TIME  # else the first step, or one after a gap
        edge = first_edge(self, share, self.done_until if follows else t)
        now = t
        on_time = 0.0
        due, edge = next_switch(self, share, now, edge)
        while due <= until:
            if self.pulse > 0.5:
                on_time += max(0.0, min(due, t + h) - now)
            now = max(now, min(due, t + h))
            self.pulse = 1.0 - self.pulse
            if self.done_until > -NO_EVENT:  # the value at the start is no switch
                self.last_switch = min(due, t + h)
            due, edge = next_switch(self, share, due, edge)
        if self.pulse > 0.5:
            on_time += max(0.0, t + h - now)
        self.next_event_time = due
        self.done_until = until
        if h > 0.0:
            self.pulse_mean = min(1.0, on_time / h)
        return 0


def served_share(m: PulseWidthModulator) -> float:
    """The share of the time to be on for the reference held: 0 or 1 where pulses or gaps would be too short."""
    shortest = m.minimum_pulse_width * m.carrier_frequency
    if m.reference <= 0.0 or m.reference < shortest:
        return 0.0
    if m.reference >= 1.0 or 1.0 - m.reference < shortest:
        return 1.0
    return m.reference


def edge_time(m: PulseWidthModulator, share: float, edge: float) -> float:
    """Time of the crossing of number `edge`: even ones switch on, odd ones off, two in each period of the carrier."""
    period = math.floor(0.5 * edge)
    side = share if edge - 2.0 * period > 0.5 else -share
    return (period + 0.5 * (1.0 + side) - m.carrier_phase / (2.0 * math.pi)) / m.carrier_frequency


def first_edge(m: PulseWidthModulator, share: float, after: float) -> float:
    """Number of the first crossing after this time, a whole number; 0 if the reference does not cross the carrier."""
    if share <= 0.0 or share >= 1.0:
        return 0.0
    edge = 2.0 * math.floor(m.carrier_frequency * after + m.carrier_phase / (2.0 * math.pi)) - 2.0
    while edge_time(m, share, edge) <= after:
        edge += 1.0
    return edge


def next_switch(m: PulseWidthModulator, share: float, now: float, edge: float) -> tuple[float, float]:
    """Time of the next switch at `now` or later, and the number of the first crossing after it.

    `edge` is the number of the first crossing after `now`. A switch waits until minimum_pulse_width has passed since the
    last one, and is left out if the next crossing comes before.
    """
    free = m.last_switch + m.minimum_pulse_width
    on = m.pulse > 0.5
    if share <= 0.0 or share >= 1.0:
        return (max(now, free), edge) if on != (share >= 1.0) else (NO_EVENT, edge)
    wanted = edge - 2.0 * math.floor(0.5 * edge) > 0.5  # before an odd crossing the command is on
    time = now
    for _ in range(8):
        following = edge_time(m, share, edge)
        if wanted != on and max(time, free) < following:
            return max(time, free), edge
        time = following
        wanted = not wanted
        edge += 1.0
    return NO_EVENT, edge
