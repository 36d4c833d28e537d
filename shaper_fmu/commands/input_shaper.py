"""The input shaper: convolves any incoming command with a designed impulse sequence."""

from __future__ import annotations

from typing import ClassVar

from shaper_fmu.component import MEAN, NO_EVENT, Calculated, Input, Output, Parameter, State, Variable, time_tolerance
from shaper_fmu.kinds.all_modes import (
    DESIGN_MESSAGES,
    IMPULSES,
    MODE_IMPULSES,
    MODES,
    ShapedModes,
    design,
)
from shaper_fmu.kinds.shapers import FURTHER_PARAMETERS, LIST, PARAMETERS, Shaper
from shaper_fmu.methods.record import declare

EDGES = 4096
UNDER_WAY = 4096

HISTORY_FULL = 1
TOO_MUCH_UNDER_WAY = 5
BAD_TUNING = 6


class InputShaper(ShapedModes):
    __doc__ = f"""Convolves any incoming command with a designed impulse sequence, so that flexible modes are not excited.

    shaped(t) = sum_i A_i command(t - t_i), with the impulses A_i, t_i of the chosen shaper for each shaped mode,
    convolved over the modes. The command is piecewise constant (held between communication points), and so is the
    output; its jumps are placed in time exactly, whatever the communication step: `next_event_time` announces them.
    A master that can only hold inputs over fixed steps wires `shaped_mean`, the mean over the step just done: it puts
    every impulse where it belongs, all with the same delay of a step (none, if the plant steps after the shaper).

    Before the start the command is taken to have been `initial_command` for ever. Frequencies and damping ratios may be
    changed while running: what is under way completes as it was designed, changes of the command from then on are shaped
    by the new design, and the output does not jump.

    Shapers:

    - none: the command itself;
    {LIST};
    - custom: impulses of your own, whose amplitudes must add up to 1 and are divided by their sum.

    Damped designs are solved, not fitted: `certificate` is the largest residual of the equations that define them.
    """

    messages: ClassVar[dict[int, str]] = {
        HISTORY_FULL: f"the command has changed more than {EDGES - 1} times within the shaper duration {{duration}} s; "
        "use a larger communication step",
        **DESIGN_MESSAGES,
        TOO_MUCH_UNDER_WAY: f"at the change of frequency or damping more than {UNDER_WAY} jumps were under way; "
        "change it while the command rests, or use a larger communication step",
        BAD_TUNING: "natural_frequency must be greater than 0 rad/s and damping_ratio in 0 <= . < 1",
    }

    continuous_states: ClassVar[tuple[str, ...] | None] = ()
    sampled: ClassVar[bool] = True
    terminals: ClassVar[dict[str, dict[str, str]]] = {
        "command": {"value": "command"},
        "shaped": {"value": "shaped", "mean": "shaped_mean"},
    }

    command: Variable[float] = Input("", "command to be shaped")
    shaper: Variable[int] = Parameter(Shaper.zv, "", "kind of shaper")
    modes: Variable[int] = Parameter(1, "", "number of modes", min=1, max=MODES)
    natural_frequency: Variable[list[float]] = Parameter(
        10.0,
        "rad/s",
        "undamped natural frequency of each mode",
        size=MODES,
        min=0.0,
        exclusive=True,
        published=(1e-9, None),
        tunable=True,
    )
    damping_ratio: Variable[list[float]] = Parameter(
        0.0, "", "damping ratio of each mode", size=MODES, min=0.0, max=1.0, exclusive="max", published=(0.0, 0.999), tunable=True
    )
    shape_mode: Variable[list[bool]] = Parameter(True, "", "whether each mode is shaped", size=MODES)
    vibration_tolerance: Variable[float] = Parameter(
        0.05, "", "tolerated residual vibration V", min=0.0, max=1.0, exclusive=True, published=(1e-6, 0.999)
    )
    declare(locals(), PARAMETERS)
    custom_impulses: Variable[int] = Parameter(2, "", "number of impulses of the custom shaper", min=1, max=MODE_IMPULSES)
    custom_amplitude: Variable[list[float]] = Parameter(
        [0.5, 0.5] + [0.0] * 14, "", "amplitudes of the custom shaper", size=MODE_IMPULSES
    )
    custom_delay: Variable[list[float]] = Parameter(
        [0.0, 0.3] + [0.0] * 14, "s", "delays of the custom shaper", size=MODE_IMPULSES, min=0.0
    )
    initial_command: Variable[float] = Parameter(0.0, "", "value of the command before the start")
    duration: Variable[float] = Calculated("s", "shaper duration: delay of the last impulse", tunable=True)
    impulses: Variable[int] = Calculated("", "number of impulses", start=0, tunable=True)
    insensitivity: Variable[float] = Calculated(
        "", "width of the band of w/wn of the first shaped mode in which V <= vibration_tolerance", tunable=True
    )
    certificate: Variable[float] = Calculated("", "largest residual of the equations that define the shaper", tunable=True)
    shaped: Variable[float] = Output("", "shaped command")
    shaped_mean: Variable[float] = Output("", MEAN.format("shaped"))
    next_event_time: Variable[float] = Output("s", "time of the next jump of an output, 1e300 if none", start=NO_EVENT)
    settled: Variable[bool] = Output("", "true when nothing more is pending", start=True)

    amplitude: Variable[list[float]] = State(size=IMPULSES)
    delay: Variable[list[float]] = State(size=IMPULSES)
    edge_time: Variable[list[float]] = State(size=EDGES)  # ring buffer of the command's changes
    edge_value: Variable[list[float]] = State(size=EDGES)
    newest: Variable[int] = State(0)  # number of the newest edge
    reached: Variable[list[int]] = State(0, size=IMPULSES)  # number of the newest edge that each impulse has reached

    tuned_frequency: Variable[list[float]] = State(size=MODES)  # what the impulses were designed for
    tuned_damping: Variable[list[float]] = State(size=MODES)
    jumps: Variable[int] = State(0)  # jumps of former designs that are under way, in no order
    jump_time: Variable[list[float]] = State(size=UNDER_WAY)
    jump_size: Variable[list[float]] = State(size=UNDER_WAY)
    offset: Variable[float] = State(0.0)  # what is still missing of former designs
    moved: Variable[bool] = State(False)  # whether an edge or a jump has been passed in this step
    declare(locals(), FURTHER_PARAMETERS)

    def start(self) -> int:
        self.edge_value[0] = self.initial_command
        self.shaped = self.initial_command
        self.shaped_mean = self.initial_command
        return design(self)

    def step(self, t: float, h: float) -> int:
        unchanged = True
        if is_retuned(self):
            unchanged = False
            status = retune(self)
            if status:
                return status
        if self.command != self.edge_value[self.newest % EDGES]:
            unchanged = False
            if self.newest - self.reached[self.impulses - 1] >= EDGES - 1:
                return HISTORY_FULL
            record_edge(self, t)
        if unchanged and self.next_event_time > t + h + time_tolerance(self, t, h):  # most steps: all stays as it is
            if h > 0.0:
                self.shaped_mean = self.shaped
            return 0
        self.moved = False
        self.shaped = 0.0
        self.next_event_time = NO_EVENT
        mean = pass_jumps(self, t, h)
        for i in range(self.impulses):
            mean += self.amplitude[i] * pass_edges(self, i, t, h)
            self.shaped += self.amplitude[i] * self.edge_value[self.reached[i] % EDGES]
        unmoved = self.reached[self.impulses - 1] == self.newest
        if unmoved:  # the amplitudes' sum may miss 1 by rounding; the final value may not
            self.shaped = self.edge_value[self.newest % EDGES]
        self.shaped += self.offset
        self.settled = unmoved and self.jumps == 0
        if h > 0.0:
            self.shaped_mean = mean if self.moved else self.shaped
        return 0


def is_retuned(m: InputShaper) -> bool:
    """Whether a frequency or damping ratio differs from what the impulses were designed for."""
    for mode in range(m.modes):
        if m.natural_frequency[mode] != m.tuned_frequency[mode] or m.damping_ratio[mode] != m.tuned_damping[mode]:
            return True
    return False


def retune(m: InputShaper) -> int:
    """Design anew; what the old design has under way goes on as single jumps, on top of the new one, which starts at rest."""
    for mode in range(m.modes):
        if not (0.0 < m.natural_frequency[mode] < NO_EVENT and 0.0 <= m.damping_ratio[mode] < 1.0):
            return BAD_TUNING
    command = m.edge_value[m.newest % EDGES]
    m.offset = m.shaped - command
    for i in range(m.impulses):
        value = m.edge_value[m.reached[i] % EDGES]
        while m.reached[i] < m.newest:
            m.reached[i] += 1
            edge = m.reached[i] % EDGES
            if m.jumps == UNDER_WAY:
                return TOO_MUCH_UNDER_WAY
            m.jump_time[m.jumps] = m.edge_time[edge] + m.delay[i]
            m.jump_size[m.jumps] = m.amplitude[i] * (m.edge_value[edge] - value)
            m.jumps += 1
            value = m.edge_value[edge]
    status = design(m)
    m.newest = 0
    m.edge_value[0] = command
    for i in range(m.impulses):
        m.reached[i] = 0
    return status


def pass_jumps(m: InputShaper, t: float, h: float) -> float:
    """Let the jumps of former designs due until t + h happen; returns the mean of their offset over [t, t + h]."""
    until = t + h + time_tolerance(m, t, h)
    mean = m.offset
    k = 0
    while k < m.jumps:
        due = m.jump_time[k]
        if due > until:
            m.next_event_time = min(m.next_event_time, due)
            k += 1
        else:
            m.offset += m.jump_size[k]
            m.moved = True
            if h > 0.0:
                mean += m.jump_size[k] * max(0.0, min(1.0, (t + h - due) / h))
            m.jumps -= 1
            m.jump_time[k] = m.jump_time[m.jumps]
            m.jump_size[k] = m.jump_size[m.jumps]
    if m.jumps == 0:  # the jumps' sum may miss by rounding
        m.offset = 0.0
    return mean


def record_edge(m: InputShaper, t: float) -> None:
    """Enter the command's change at t; edge numbers are reduced by a ring's length when all are past it."""
    if m.reached[m.impulses - 1] >= EDGES:
        m.newest -= EDGES
        for i in range(m.impulses):
            m.reached[i] -= EDGES
    if m.newest == 0 or m.edge_time[m.newest % EDGES] != t:  # else the command was set again at the same time
        m.newest += 1
        m.edge_time[m.newest % EDGES] = t
    m.edge_value[m.newest % EDGES] = m.command


def pass_edges(m: InputShaper, i: int, t: float, h: float) -> float:
    """Let impulse i pass the edges due until t + h, and note the next one; returns the mean over [t, t + h] of what it sees."""
    until = t + h + time_tolerance(m, t, h)
    value = m.edge_value[m.reached[i] % EDGES]
    mean = value
    while m.reached[i] < m.newest:
        due = m.edge_time[(m.reached[i] + 1) % EDGES] + m.delay[i]
        if due > until:
            m.next_event_time = min(m.next_event_time, due)
            break
        m.reached[i] += 1
        m.moved = True
        if h > 0.0:
            share = max(0.0, min(1.0, (t + h - due) / h))
            mean += share * (m.edge_value[m.reached[i] % EDGES] - value)
        value = m.edge_value[m.reached[i] % EDGES]
    return mean
