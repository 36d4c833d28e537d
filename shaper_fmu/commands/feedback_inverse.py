"""The inverse of a shaper in a loop's feedback path, so that neither set points nor disturbances excite the mode."""

from __future__ import annotations

import math
from typing import ClassVar

from shaper_fmu.component import (
    NO_EVENT,
    Calculated,
    Component,
    Input,
    Output,
    Parameter,
    State,
    Variable,
    time_rounding,
    time_tolerance,
)
from shaper_fmu.smoothers.sampled import FEWEST_SAMPLES, MOST_SAMPLES, largest_gain, sampled_dzv, samples_of

RING = MOST_SAMPLES + 4  # the sampled shaper may take a few more samples than that of a continuous command

WRONG_SAMPLES = 1
NOT_STABLE = 2
TOO_MANY = 3
TOO_FAR = 4
MOST_IN_A_STEP = 1_000_000
LAST_SAMPLE = 1e15
"""The largest number of a sample: up to here the next one is a number of its own."""


class FeedbackInverse(Component):
    """Passes a measurement through the inverse of a shaper, on its way to a controller.

    With 1/S in the feedback path, u = C (reference - y/S), the sum of control and disturbance is S (C reference +
    disturbance)/(S + C G): it has the zeros of the shaper S, whatever moves the plant G (Vyhlidal, Hromcik, Kucera and Anderle
    2016). The shaper is DZV for a sampled command, exact for the mode: y_k = A u_k + c (u_(k-1) + ... + u_(k-N+1)) +
    c' u_(k-N); the output is u_k, held until the next sample. Samples are taken at the multiples of `sample_period`, which may be
    shorter or longer than the communication step; a measurement that is held over longer steps is sampled as it is held.

    A jump of the measurement passes enlarged by 1/A at once, noise near the mode by `peak_gain`. Wherever the controller takes
    several measurements, each has an inverse of its own. Before the start the measurement is taken to have been
    `initial_measurement` for ever. With `inverse` false it is sampled only, for a comparison.
    """

    messages: ClassVar[dict[int, str]] = {
        WRONG_SAMPLES: f"sample_period = {{sample_period}} s: the shaper takes {{duration}} s; it must be {FEWEST_SAMPLES} to "
        f"{MOST_SAMPLES} samples",
        NOT_STABLE: "no stable inverse: the share at once is {direct_share}, that of each sample after it {sample_share}, and the "
        "first must be larger; sample faster than every {sample_period} s, or damp the mode (damping_ratio = {damping_ratio})",
        TOO_MANY: f"more than {MOST_IN_A_STEP} samples in one communication step, with a sample_period of {{sample_period}} s; "
        "use shorter steps",
        TOO_FAR: "the time is too large to count samples of {sample_period} s",
    }
    continuous_states: ClassVar[tuple[str, ...] | None] = ()
    sampled: ClassVar[bool] = True
    terminals: ClassVar[dict[str, dict[str, str]]] = {
        "measurement": {"value": "measurement"},
        "feedback": {"value": "feedback"},
    }

    measurement: Variable[float] = Input("", "measurement of what the loop controls", slope="measurement_slope")
    natural_frequency: Variable[float] = Parameter(
        5.0,
        "rad/s",
        "undamped natural frequency of the mode; the shaper must take 4 to 4096 samples",
        min=0.0,
        exclusive=True,
        published=(None, None),
    )
    damping_ratio: Variable[float] = Parameter(
        0.1, "", "damping ratio of the mode; without damping there is no inverse", min=0.0, max=1.0, exclusive=True,
        published=(0.01, 0.999),
    )  # fmt: skip
    sample_period: Variable[float] = Parameter(
        0.01, "s", "time between samples; the shaper must take 4 to 4096 of them", min=0.0, exclusive=True, published=(None, None)
    )
    inverse: Variable[bool] = Parameter(True, "", "whether the inverse is applied; otherwise the measurement is sampled as it is")
    initial_measurement: Variable[float] = Parameter(0.0, "", "value of the measurement before the start")
    samples: Variable[int] = Calculated("", "number N of samples of the shaper", start=0)
    duration: Variable[float] = Calculated("s", "how long the shaper takes")
    direct_share: Variable[float] = Calculated("", "A, the shaper's share at once: the inverse passes jumps on by 1/A")
    sample_share: Variable[float] = Calculated("", "c, that of each sample after it; it must be smaller than A")
    last_share: Variable[float] = Calculated("", "c', that of the last sample")
    peak_gain: Variable[float] = Calculated("", "the most by which the inverse amplifies a sine, near the mode")
    feedback: Variable[float] = Output("", "what the controller is to see")
    next_event_time: Variable[float] = Output("s", "time of the next sample", start=NO_EVENT)

    measurement_slope: Variable[float] = State(0.0)
    begun: Variable[bool] = State(False)
    next_sample: Variable[float] = State(0.0)  # its number: it is due at this multiple of sample_period
    sampled_now: Variable[bool] = State(False)  # the newest sample is due at the present time: an input set again replaces it
    newest: Variable[int] = State(0)  # where the newest sample is in the ring
    former: Variable[list[float]] = State(size=RING)
    between: Variable[float] = State(0.0)  # sum of the former samples that have the share c
    past: Variable[float] = State(0.0)  # what all former samples add to the shaper's output

    def start(self) -> int:
        length = samples_of(self.natural_frequency, self.damping_ratio, self.sample_period)
        self.duration = length * self.sample_period
        if not FEWEST_SAMPLES <= length <= MOST_SAMPLES:
            return WRONG_SAMPLES
        n, a, c, last = sampled_dzv(self.natural_frequency, self.damping_ratio, self.sample_period)
        self.samples, self.direct_share, self.sample_share, self.last_share = n, a, c, last
        if not c < a:
            return NOT_STABLE
        self.duration = n * self.sample_period
        self.peak_gain = largest_gain(n, a, c, last)
        for k in range(RING):
            self.former[k] = self.initial_measurement
        self.between = (n - 1) * self.initial_measurement
        self.feedback = self.initial_measurement
        return 0

    def step(self, t: float, h: float) -> int:
        period = self.sample_period
        if not (abs(t) + h) / period < LAST_SAMPLE:
            return TOO_FAR
        if not self.begun:
            self.begun = True
            self.next_sample = first_sample(t, period)
        if self.sampled_now:
            put_sample(self, self.measurement)
            if h > 0.0:
                self.sampled_now = False
        until = t + h + time_tolerance(self, t, h)
        if until / period - self.next_sample > MOST_IN_A_STEP:
            return TOO_MANY
        while self.next_sample * period <= until:
            due = self.next_sample * period
            make_room(self)
            put_sample(self, self.measurement + self.measurement_slope * max(0.0, min(h, due - t)))
            if due >= t + h - time_rounding(t, h):
                self.sampled_now = True
            self.next_sample += 1.0
        self.next_event_time = self.next_sample * period
        self.measurement += self.measurement_slope * h
        return 0


def first_sample(t: float, period: float) -> float:
    """The number of the first sample at t or later."""
    return float(math.ceil((t - time_rounding(t, 0.0)) / period))


def make_room(m: FeedbackInverse) -> None:
    """A new sample begins: all before it are former ones. Their sum goes along with them, and is added up anew once in a ring."""
    oldest = m.former[(m.newest - m.samples + 1) % RING]
    if m.newest == 0:
        m.between = 0.0
        for k in range(m.samples - 1):
            m.between += m.former[(m.newest - k) % RING]
    else:
        m.between += m.former[m.newest] - oldest
    m.past = m.sample_share * m.between + m.last_share * oldest
    m.newest = (m.newest + 1) % RING


def put_sample(m: FeedbackInverse, value: float) -> None:
    """The newest sample is of this measurement: solve the shaper's equation for what goes into it."""
    m.feedback = (value - m.past) / m.direct_share if m.inverse else value
    m.former[m.newest] = m.feedback
