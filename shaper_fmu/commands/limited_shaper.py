"""The limited shaper: keeps a drive's limits and the shaper's zeros, for commands that nobody knows beforehand."""

from __future__ import annotations

from enum import IntEnum
from typing import ClassVar

from shaper_fmu.component import NO_EVENT, Calculated, Input, Output, Parameter, State, Variable, time_tolerance
from shaper_fmu.kinds.all_modes import DESIGN_MESSAGES, IMPULSES, MODE_IMPULSES, MODES, ShapedModes, design
from shaper_fmu.kinds.shapers import FURTHER_PARAMETERS, LIST, PARAMETERS, Shaper
from shaper_fmu.limited_motion import quickest
from shaper_fmu.methods.record import declare

SEGMENTS = 4096

HISTORY_FULL = 1


class LimitedCommand(IntEnum):
    """Items:

    - position: where to go;
    - speed: how fast to go.
    """

    position = 1
    speed = 2


class LimitedShaper(ShapedModes):
    __doc__ = f"""Brings a drive wherever the command is, within limits of speed, acceleration and jerk, and excites no shaped mode.

    The command may jump at any time, and need not be known beforehand. The quickest motion to it within the limits, from
    wherever the motion is (constant acceleration, cruise, constant deceleration, exact in time), is convolved with the
    shaper's impulses, as InputShaper does with a command. Impulses of the sum 1 keep every limit, if none is negative; if
    some are, the motion is given the limits divided by the sum of their sizes. A limit of the jerk is kept by averaging
    over `smoothing` = 2 max_acceleration / max_jerk, which takes no zero away. So the limits hold always, and the modes
    are at rest once the command has been reached: a shaped command that is cut off at a limit afterwards loses its zeros.

    As `speed`, the command is the speed to reach; one above max_velocity counts as max_velocity, and where impulses are
    negative, one above max_velocity divided by the sum of their sizes as that. As `position`, the motion begins at rest at
    initial_position, as `speed`, too.

    Shapers:

    - none: the quickest motion itself;
    {LIST};
    - custom: impulses of your own, whose amplitudes must add up to 1 and are divided by their sum.
    """

    messages: ClassVar[dict[int, str]] = {
        HISTORY_FULL: f"the command has changed so often within {{duration}} s that more than {SEGMENTS - 6} pieces of the motion "
        "are under way; use a larger communication step",
        **DESIGN_MESSAGES,
    }

    continuous_states: ClassVar[tuple[str, ...] | None] = ()
    sampled: ClassVar[bool] = True
    terminals: ClassVar[dict[str, dict[str, str]]] = {
        "command": {"value": "command"},
        "shaped": {"position": "position", "velocity": "velocity", "acceleration": "acceleration"},
    }

    command: Variable[float] = Input("", "where to go [m], or how fast [m/s]")
    command_is: Variable[int] = Parameter(LimitedCommand.position, "", "what the command is")
    max_velocity: Variable[float] = Parameter(
        1.0, "m/s", "speed never to be exceeded", min=0.0, exclusive=True, published=(1e-9, None)
    )
    max_acceleration: Variable[float] = Parameter(
        1.0, "m/s2", "acceleration never to be exceeded", min=0.0, exclusive=True, published=(1e-9, None)
    )
    max_jerk: Variable[float] = Parameter(
        NO_EVENT, "m/s3", "jerk never to be exceeded, 1e300 for no limit", min=0.0, exclusive=True, published=(None, None)
    )
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
    )
    damping_ratio: Variable[list[float]] = Parameter(
        0.0, "", "damping ratio of each mode", size=MODES, min=0.0, max=1.0, exclusive="max", published=(0.0, 0.999)
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
    initial_position: Variable[float] = Parameter(0.0, "m", "where the motion begins, at rest")
    duration: Variable[float] = Calculated("s", "shaper duration: delay of the last impulse")
    impulses: Variable[int] = Calculated("", "number of impulses", start=0)
    insensitivity: Variable[float] = Calculated(
        "", "width of the band of w/wn of the first shaped mode in which V <= vibration_tolerance"
    )
    certificate: Variable[float] = Calculated("", "largest residual of the equations that define the shaper")
    smoothing: Variable[float] = Calculated("s", "time over which the motion is averaged to limit its jerk, 0 without")
    position: Variable[float] = Output("m", "shaped position", depends=(), derivative="velocity")
    velocity: Variable[float] = Output("m/s", "shaped speed", depends=(), derivative="acceleration")
    acceleration: Variable[float] = Output("m/s2", "shaped acceleration")
    next_event_time: Variable[float] = Output("s", "time of the next jump of an output, 1e300 if none", start=NO_EVENT)
    settled: Variable[bool] = Output("", "true when the command has been reached and nothing more is pending", start=True)

    amplitude: Variable[list[float]] = State(size=IMPULSES)
    delay: Variable[list[float]] = State(size=IMPULSES)
    tuned_frequency: Variable[list[float]] = State(size=MODES)
    tuned_damping: Variable[list[float]] = State(size=MODES)
    quick_velocity: Variable[float] = State(1.0)  # limits of the quickest motion
    quick_acceleration: Variable[float] = State(1.0)
    served: Variable[float] = State(0.0)  # the command that the motion leads to
    newest: Variable[int] = State(0)  # number of the last segment of the motion
    begin: Variable[list[float]] = State(size=SEGMENTS)  # ring buffer of its segments: since when [s]
    begin_position: Variable[list[float]] = State(size=SEGMENTS)
    begin_velocity: Variable[list[float]] = State(size=SEGMENTS)
    segment_acceleration: Variable[list[float]] = State(size=SEGMENTS)
    reached: Variable[list[int]] = State(0, size=IMPULSES)  # the segment in which each impulse is,
    left: Variable[list[int]] = State(0, size=IMPULSES)  # and the one in which its smoothing begins
    next_kink_time: Variable[float] = State(NO_EVENT)
    declare(locals(), FURTHER_PARAMETERS)

    def start(self) -> int:
        status = design(self)
        if status:
            return status
        sizes = 0.0
        for i in range(self.impulses):
            sizes += abs(self.amplitude[i])
        self.quick_velocity = self.max_velocity / max(1.0, sizes)
        self.quick_acceleration = self.max_acceleration / max(1.0, sizes)
        self.smoothing = 2.0 * self.max_acceleration / self.max_jerk
        if self.smoothing < 1e-12 * self.max_velocity / self.max_acceleration:
            self.smoothing = 0.0
        self.served = self.initial_position if self.command_is == LimitedCommand.position else 0.0
        self.begin_position[0] = self.initial_position
        self.position = self.initial_position
        return 0

    def step(self, t: float, h: float) -> int:
        if self.command != self.served:
            if self.newest - oldest(self) >= SEGMENTS - 6:
                return HISTORY_FULL
            self.served = self.command
            lead(self, t)
        until = t + h + time_tolerance(self, t, h)
        self.position = 0.0
        self.velocity = 0.0
        self.acceleration = 0.0
        self.next_event_time = NO_EVENT
        self.next_kink_time = NO_EVENT
        for i in range(self.impulses):
            if self.smoothing > 0.0:
                add_smoothed(self, i, t + h, until)
            else:
                add(self, i, t + h, until)
        if oldest(self) == self.newest:  # the impulses' sum may miss 1 by rounding; the final value may not
            k = self.newest % SEGMENTS
            self.velocity = self.begin_velocity[k]
            self.acceleration = 0.0
            if self.velocity == 0.0:
                self.position = self.begin_position[k]
        self.settled = oldest(self) == self.newest
        return 0


def oldest(m: LimitedShaper) -> int:
    """Number of the oldest segment that is still needed."""
    return m.left[m.impulses - 1] if m.smoothing > 0.0 else m.reached[m.impulses - 1]


def lead(m: LimitedShaper, t: float) -> None:
    """Lay the motion anew from t on, so that it leads to the command."""
    if oldest(m) >= SEGMENTS:  # numbers stay small
        m.newest -= SEGMENTS
        for i in range(m.impulses):
            m.reached[i] -= SEGMENTS
            m.left[i] -= SEGMENTS
    first = oldest(m)
    while m.newest > first and m.begin[m.newest % SEGMENTS] >= t:
        m.newest -= 1
    for i in range(m.impulses):
        m.reached[i] = min(m.reached[i], m.newest)
        m.left[i] = min(m.left[i], m.newest)
    position, velocity = motion_at(m, m.newest, t)
    a = m.quick_acceleration
    if m.command_is == LimitedCommand.speed:
        wanted = max(-m.quick_velocity, min(m.quick_velocity, m.served))
        side = 1.0 if wanted >= velocity else -1.0
        span = abs(wanted - velocity) / a
        append(m, t, position, velocity, side * a)
        append(m, t + span, position + 0.5 * (velocity + wanted) * span, wanted, 0.0)
        return
    side, peak, rising, cruise, falling = quickest(m.served - position, velocity, m.quick_velocity, a)
    if rising > 0.0:
        append(m, t, position, velocity, side * a)
    position += 0.5 * (velocity + side * peak) * rising
    if cruise > 0.0:
        append(m, t + rising, position, side * peak, 0.0)
    position += side * peak * cruise
    if falling > 0.0:
        append(m, t + rising + cruise, position, side * peak, -side * a)
    append(m, t + rising + cruise + falling, m.served, 0.0, 0.0)


def append(m: LimitedShaper, begin: float, position: float, velocity: float, acceleration: float) -> None:
    """One more segment of constant acceleration."""
    m.newest += 1
    k = m.newest % SEGMENTS
    m.begin[k] = begin
    m.begin_position[k] = position
    m.begin_velocity[k] = velocity
    m.segment_acceleration[k] = acceleration


def motion_at(m: LimitedShaper, number: int, t: float) -> tuple[float, float]:
    """Position and speed at t in a segment."""
    k = number % SEGMENTS
    s = max(0.0, t - m.begin[k])
    a = m.segment_acceleration[k]
    return m.begin_position[k] + (m.begin_velocity[k] + 0.5 * a * s) * s, m.begin_velocity[k] + a * s


def passed(m: LimitedShaper, number: int, delay: float, until: float) -> int:
    """The segment in which the motion is that has been delayed so long, from a number that it has reached on."""
    while number < m.newest and m.begin[(number + 1) % SEGMENTS] + delay <= until:
        number += 1
    return number


def following(m: LimitedShaper, number: int, delay: float) -> float:
    """When the delayed motion's next segment begins."""
    return m.begin[(number + 1) % SEGMENTS] + delay if number < m.newest else NO_EVENT


def add(m: LimitedShaper, i: int, now: float, until: float) -> None:
    """Add what impulse i makes of the motion."""
    m.reached[i] = passed(m, m.reached[i], m.delay[i], until)
    m.next_event_time = min(m.next_event_time, following(m, m.reached[i], m.delay[i]))
    position, velocity = motion_at(m, m.reached[i], now - m.delay[i])
    m.position += m.amplitude[i] * position
    m.velocity += m.amplitude[i] * velocity
    m.acceleration += m.amplitude[i] * m.segment_acceleration[m.reached[i] % SEGMENTS]


def add_smoothed(m: LimitedShaper, i: int, now: float, until: float) -> None:
    """Add what impulse i makes of the motion's mean over the smoothing."""
    m.reached[i] = passed(m, m.reached[i], m.delay[i], until)
    m.left[i] = passed(m, m.left[i], m.delay[i] + m.smoothing, until)
    m.next_kink_time = min(m.next_kink_time, following(m, m.reached[i], m.delay[i]))
    m.next_kink_time = min(m.next_kink_time, following(m, m.left[i], m.delay[i] + m.smoothing))
    end = now - m.delay[i]
    begin = end - m.smoothing
    way = 0.0
    since = begin
    for number in range(m.left[i], m.reached[i] + 1):
        until_here = min(end, m.begin[(number + 1) % SEGMENTS]) if number < m.reached[i] else end
        span = max(0.0, until_here - since)
        position, velocity = motion_at(m, number, since)
        a = m.segment_acceleration[number % SEGMENTS]
        way += (position + (0.5 * velocity + a * span / 6.0) * span) * span
        since += span
    first_position, first_velocity = motion_at(m, m.left[i], begin)
    last_position, last_velocity = motion_at(m, m.reached[i], end)
    m.position += m.amplitude[i] * way / m.smoothing
    m.velocity += m.amplitude[i] * (last_position - first_position) / m.smoothing
    m.acceleration += m.amplitude[i] * (last_velocity - first_velocity) / m.smoothing
