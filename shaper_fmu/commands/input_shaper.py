"""The input shaper: convolves any incoming command with a designed impulse sequence."""

from __future__ import annotations

from enum import IntEnum

from shaper_fmu.component import NO_EVENT, Calculated, Component, Input, Output, Parameter, State, time_tolerance
from shaper_fmu.shapers.convolution import convolve
from shaper_fmu.shapers.sensitivity import insensitivity
from shaper_fmu.shapers.zero_derivative import zero_derivative

MODES = 4
CUSTOM_IMPULSES = 16
IMPULSES = 256
EDGES = 4096

HISTORY_FULL = 1
CUSTOM_ORDER = 2
CUSTOM_SUM = 3


class Shaper(IntEnum):
    """Kinds of shapers; the numbers are those of the FMU's enumeration and never change."""

    none = 1
    zv = 2
    zvd = 3
    zvdd = 4
    custom = 13


class InputShaper(Component):
    """Convolves any incoming command with a designed impulse sequence, so that flexible modes are not excited.

    shaped(t) = sum_i A_i command(t - t_i), with the impulses A_i, t_i of the chosen shaper for each shaped mode,
    convolved over the modes. The command is piecewise constant (held between communication points), and so is the
    output; its jumps are placed in time exactly, whatever the communication step: `next_event_time` announces them.
    A master that can only hold inputs over fixed steps wires `shaped_mean`, the mean over the step just done: it puts
    every impulse where it belongs, all with the same delay of a step (none, if the plant steps after the shaper).

    Before the start the command is taken to have been `initial_command` for ever. Impulses: ZV (Smith 1958), ZVD and
    ZVDD (Singer and Seering 1990), or custom ones, whose amplitudes must add up to 1 and are divided by their sum.
    """

    messages = {
        HISTORY_FULL: f"the command has changed more than {EDGES - 1} times within the shaper duration {{duration}} s; "
        "use a larger communication step",
        CUSTOM_ORDER: "custom_delay must begin with 0 s and not decrease over the first {custom_impulses} elements",
        CUSTOM_SUM: "the first {custom_impulses} elements of custom_amplitude must add up to 1 within 1e-6, so that the "
        "command's final value is reached",
    }

    command = Input("", "command to be shaped")
    shaper = Parameter(Shaper.zv, "", "kind of shaper")
    modes = Parameter(1, "", "number of modes", min=1, max=MODES)
    natural_frequency = Parameter(10.0, "rad/s", "undamped natural frequency of each mode", size=MODES, min=0.0, exclusive=True)
    damping_ratio = Parameter(0.0, "", "damping ratio of each mode", size=MODES, min=0.0, max=1.0, exclusive="max")
    shape_mode = Parameter(True, "", "whether each mode is shaped", size=MODES)
    vibration_tolerance = Parameter(0.05, "", "tolerated residual vibration V", min=0.0, max=1.0, exclusive=True)
    custom_impulses = Parameter(2, "", "number of impulses of the custom shaper", min=1, max=CUSTOM_IMPULSES)
    custom_amplitude = Parameter([0.5, 0.5] + [0.0] * 14, "", "amplitudes of the custom shaper", size=CUSTOM_IMPULSES)
    custom_delay = Parameter([0.0, 0.3] + [0.0] * 14, "s", "delays of the custom shaper", size=CUSTOM_IMPULSES, min=0.0)
    initial_command = Parameter(0.0, "", "value of the command before the start")
    duration = Calculated("s", "shaper duration: delay of the last impulse")
    impulses = Calculated("", "number of impulses", start=0)
    insensitivity = Calculated("", "width of the band of w/wn of the first shaped mode in which V <= vibration_tolerance")
    shaped = Output("", "shaped command")
    shaped_mean = Output("", "mean of `shaped` over the last step, for masters that hold inputs")
    next_event_time = Output("s", "time of the next jump of an output, 1e300 if none", start=NO_EVENT)
    settled = Output("", "true when nothing more is pending", start=True)

    amplitude = State(size=IMPULSES)
    delay = State(size=IMPULSES)
    factor_amplitude = State(size=CUSTOM_IMPULSES)
    factor_delay = State(size=CUSTOM_IMPULSES)
    edge_time = State(size=EDGES)  # ring buffer of the command's changes
    edge_value = State(size=EDGES)
    newest = State(0)  # number of the newest edge
    reached = State(0, size=IMPULSES)  # number of the newest edge that each impulse has reached

    def start(self):
        status = design(self)
        if status:
            return status
        self.duration = self.delay[self.impulses - 1]
        mode = first_shaped_mode(self)
        self.insensitivity = insensitivity(
            self.amplitude,
            self.delay,
            self.impulses,
            self.natural_frequency[mode],
            self.damping_ratio[mode],
            self.vibration_tolerance,
        )
        self.edge_value[0] = self.initial_command
        self.shaped = self.initial_command
        self.shaped_mean = self.initial_command
        return 0

    def step(self, t, h):
        if self.command != self.edge_value[self.newest % EDGES]:
            if self.newest - self.reached[self.impulses - 1] >= EDGES - 1:
                return HISTORY_FULL
            record_edge(self, t)
        shaped_before = self.shaped
        self.shaped = 0.0
        self.next_event_time = NO_EVENT
        mean = 0.0
        for i in range(self.impulses):
            mean += self.amplitude[i] * pass_edges(self, i, t, h)
            self.shaped += self.amplitude[i] * self.edge_value[self.reached[i] % EDGES]
        self.settled = self.reached[self.impulses - 1] == self.newest
        if self.settled:  # the amplitudes' sum may miss 1 by rounding; the final value may not
            self.shaped = self.edge_value[self.newest % EDGES]
        if h > 0.0:
            self.shaped_mean = self.shaped if self.shaped == shaped_before else mean
        return 0


def design(m):
    """Impulses of all shaped modes into m.amplitude, m.delay, m.impulses."""
    m.amplitude[0] = 1.0
    m.delay[0] = 0.0
    m.impulses = 1
    if m.shaper == Shaper.custom:
        return design_custom(m)
    if m.shaper == Shaper.none:
        return 0
    for mode in range(m.modes):
        if m.shape_mode[mode]:
            order = 0
            if m.shaper == Shaper.zvd:
                order = 1
            if m.shaper == Shaper.zvdd:
                order = 2
            count = zero_derivative(m.factor_amplitude, m.factor_delay, order, m.natural_frequency[mode], m.damping_ratio[mode])
            m.impulses = convolve(m.amplitude, m.delay, m.impulses, m.factor_amplitude, m.factor_delay, count)
    return 0


def design_custom(m):
    """The user's impulses, checked and normalised to the sum 1."""
    total = 0.0
    last = 0.0
    for i in range(m.custom_impulses):
        if m.custom_delay[i] < last or (i == 0 and m.custom_delay[i] > 0.0):
            return CUSTOM_ORDER
        last = m.custom_delay[i]
        total += m.custom_amplitude[i]
    if abs(total - 1.0) > 1e-6:
        return CUSTOM_SUM
    for i in range(m.custom_impulses):
        m.amplitude[i] = m.custom_amplitude[i] / total
        m.delay[i] = m.custom_delay[i]
    m.impulses = m.custom_impulses
    return 0


def first_shaped_mode(m):
    """Index of the first mode that is shaped; 0 if none is."""
    for mode in range(m.modes):
        if m.shape_mode[mode]:
            return mode
    return 0


def record_edge(m, t):
    """Enter the command's change at t; edge numbers are reduced by a ring's length when all are past it."""
    if m.reached[m.impulses - 1] >= EDGES:
        m.newest -= EDGES
        for i in range(m.impulses):
            m.reached[i] -= EDGES
    if m.newest == 0 or m.edge_time[m.newest % EDGES] != t:  # else the command was set again at the same time
        m.newest += 1
        m.edge_time[m.newest % EDGES] = t
    m.edge_value[m.newest % EDGES] = m.command


def pass_edges(m, i, t, h):
    """Let impulse i pass the edges due until t + h, and note the next one; returns the mean over [t, t + h] of what it sees."""
    until = t + h + time_tolerance(t, h)
    value = m.edge_value[m.reached[i] % EDGES]
    mean = value
    while m.reached[i] < m.newest:
        due = m.edge_time[(m.reached[i] + 1) % EDGES] + m.delay[i]
        if due > until:
            m.next_event_time = min(m.next_event_time, due)
            break
        m.reached[i] += 1
        if h > 0.0:
            share = max(0.0, min(1.0, (t + h - due) / h))
            mean += share * (m.edge_value[m.reached[i] % EDGES] - value)
        value = m.edge_value[m.reached[i] % EDGES]
    return mean
