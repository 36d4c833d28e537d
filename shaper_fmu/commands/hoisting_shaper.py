"""The hoisting shaper: shapes commands to a crane while its rope changes, without knowing beforehand how it will."""

from __future__ import annotations

import math
from enum import IntEnum
from typing import ClassVar

from shaper_fmu.component import MEAN, NO_EVENT, Input, Output, Parameter, State, Variable, time_tolerance
from shaper_fmu.hoisted_pendulum import NEARLY_CRITICAL, HoistedPendulum, carried, time_to_zero

PAIRS = 8192
MOST_RADIANS = 1e5
FARTHEST = 1e11  # radians of the swing from time zero

TOO_MANY_PAIRS = 1
ROPE_SPENT = 2
TOO_DAMPED = 3
TOO_MANY_SWINGS = 4
TOO_FAR = 5


class HoistingForm(IntEnum):
    """Items:

    - zv: pairs of impulses, zero vibration;
    - zvd: two pairs, three impulses: zero derivative besides, which tolerates errors of the rope's length and of gravity.
    """

    zv = 1
    zvd = 2


class HoistingShaper(HoistedPendulum):
    """Shapes a crane's speed command so that the load does not swing afterwards, while the rope's length changes.

    Each jump v of the command becomes a pair of impulses, A1 v at once and A1 r v when a small swing begun by the first
    next passes straight down, where it stops it: r is the swing's rate times the rope's length there, for a jump of 1 m/s.
    The swing, l theta'' + 2 l' theta' + 2 zeta w0 l theta' + g theta = 0, is carried along with the rope's length, an input;
    nothing else need be known. A1 = 1/(1 + r) takes r as the rope's present speed foretells it; what is then missing of v
    begins a pair of its own, until remainder_tolerance of the jump is left, which is passed on. So the linear pendulum comes
    to rest whatever the hoist does.

    The command is held over a step, the rope's length held or linear in time; the impulses are exact in time, and
    `next_event_time` foretells the next one for a rope that goes on as it does. A master that can only hold inputs over
    fixed steps wires `shaped_mean`. Before the start the command is taken to have been `initial_command` for ever.

    Shapers:

    - zv: pairs of impulses, zero vibration;
    - zvd: two pairs, three impulses: zero derivative besides, which tolerates errors of the rope's length and of gravity.
    """

    messages: ClassVar[dict[int, str]] = {
        TOO_MANY_PAIRS: f"more than {PAIRS} pairs of impulses are still to come, since the command has changed too often within "
        "a swing; use a larger communication step or a larger remainder_tolerance",
        ROPE_SPENT: "the slope {rope_length_slope} m/s of rope_length leaves no rope at the end of the step",
        TOO_DAMPED: "on a rope of {rope_length} m a load with damping_ratio {damping_ratio} at {damping_rope_length} m creeps back "
        "without a swing; there is nothing to shape",
        TOO_MANY_SWINGS: f"a communication step spans more than {MOST_RADIANS:g} rad of the swing on a rope of {{rope_length}} m; "
        "use smaller steps, or check the unit of rope_length",
        TOO_FAR: "time zero is so far away that the impulses on a rope of {rope_length} m cannot be told apart any more",
    }

    continuous_states: ClassVar[tuple[str, ...] | None] = ()
    sampled: ClassVar[bool] = True
    default_stop_time: ClassVar[float] = 30.0
    terminals: ClassVar[dict[str, dict[str, str]]] = {
        "command": {"value": "command"},
        "plant": {"rope_length": "rope_length"},
        "shaped": {"value": "shaped", "mean": "shaped_mean"},
    }

    command: Variable[float] = Input("", "command to be shaped: the speed of the trolley")
    rope_length: Variable[float] = Input(
        "m",
        "length of the rope, measured",
        start=5.0,
        min=0.0,
        exclusive=True,
        published=(1e-9, None),
        slope="rope_length_slope",
    )
    shaper: Variable[int] = Parameter(HoistingForm.zv, "", "kind of shaper")
    damping_ratio: Variable[float] = Parameter(
        0.0,
        "",
        "damping ratio of small swings at damping_rope_length",
        min=0.0,
        max=1.0,
        exclusive="max",
        published=(0.0, 0.999),
    )
    damping_rope_length: Variable[float] = Parameter(
        5.0, "m", "rope length that damping_ratio belongs to", min=0.0, exclusive=True, published=(1e-9, None)
    )
    remainder_tolerance: Variable[float] = Parameter(
        1e-6, "", "share of a jump of the command that is passed on without a pair", min=1e-15, max=1.0
    )
    initial_command: Variable[float] = Parameter(0.0, "", "value of the command before the start")
    shaped: Variable[float] = Output("", "shaped command")
    shaped_mean: Variable[float] = Output("", MEAN.format("shaped"))
    pending: Variable[float] = Output("", "what is still to come: command - shaped")
    next_event_time: Variable[float] = Output("s", "time of the next jump of an output, 1e300 if none", start=NO_EVENT)
    settled: Variable[bool] = Output("", "true when nothing more is pending", start=True)

    rope_length_slope: Variable[float] = State(0.0)
    served: Variable[float] = State(0.0)  # the command whose jumps are in pairs
    now: Variable[float] = State(-NO_EVENT)  # time of the states below [s]
    first_time: Variable[float] = State(0.0)
    smoothed: Variable[float] = State(0.0)  # the rope's length, smoothed [m]
    lag: Variable[float] = State(1.0)  # time constant of that: a sixth of a swing on the first rope [s]
    foretold: Variable[float] = State(NO_EVENT)  # time of the oldest pair's second impulse
    foretold_length: Variable[float] = State(0.0)  # the rope's length and slope that it was computed with
    foretold_slope: Variable[float] = State(0.0)
    mean: Variable[float] = State(0.0)  # of `shaped` over the step
    newest: Variable[int] = State(0)  # number of the newest pair
    oldest: Variable[int] = State(1)  # number of the oldest one; pairs end in the order in which they begin
    angle: Variable[list[float]] = State(size=PAIRS)  # the swing of each pair, in a ring
    momentum: Variable[list[float]] = State(size=PAIRS)
    begun: Variable[list[float]] = State(size=PAIRS)  # time of the first impulse
    first: Variable[list[float]] = State(size=PAIRS)  # its size
    due: Variable[list[float]] = State(size=PAIRS)  # what this pair and those that follow from it are to add up to
    jump: Variable[list[float]] = State(size=PAIRS)  # size of the command's jump that it comes from
    further: Variable[list[int]] = State(0, size=PAIRS)  # pairs that follow by design

    def start(self) -> None:
        self.decay = self.damping_ratio * math.sqrt(self.gravity / self.damping_rope_length)
        self.served = self.initial_command
        self.shaped = self.initial_command
        self.shaped_mean = self.initial_command

    def step(self, t: float, h: float) -> int:
        if not self.rope_length + self.rope_length_slope * h > 0.0:
            return ROPE_SPENT
        if self.now == -NO_EVENT:
            self.now = t
            self.first_time = t
        if t == self.first_time:  # importers set inputs during the initialization, or only after it
            self.smoothed = self.rope_length
            self.lag = math.sqrt(self.rope_length / self.gravity)
        take_rope(self, t)
        self.mean = self.shaped
        if self.command != self.served:
            jump = self.command - self.served
            self.served = self.command
            status = begin(self, jump, jump, 1 if self.shaper == HoistingForm.zvd else 0)
            if status:
                return status
            self.mean = self.shaped
        status = serve(self, t, h)
        if status:
            return status
        self.settled = self.oldest > self.newest
        if self.settled:  # the impulses' sum may miss the command by rounding; the final value may not
            self.shaped = self.command
        self.pending = self.command - self.shaped
        if h > 0.0:
            self.shaped_mean = self.mean
        return 0


def serve(m: HoistingShaper, t: float, h: float) -> int:
    """Advance to t + h, with the impulses that are due until then."""
    end = t + h
    until = end + time_tolerance(m, t, h)
    while m.oldest <= m.newest:
        if damped_out(m, end - m.now):
            return TOO_DAMPED
        if too_fast(m, end - m.now):
            return TOO_MANY_SWINGS
        if not m.gravity * until * until <= FARTHEST * FARTHEST * m.rope_length:
            return TOO_FAR
        foretell(m, end - m.now)
        if m.foretold > until:
            break
        at = max(m.now, min(m.foretold, end))
        swing(m, at - m.now, m.rope_length_slope)
        share = (end - at) / h if h > 0.0 else 0.0
        before = m.shaped
        status = finish(m)
        if status:
            return status
        m.mean += share * (m.shaped - before)
    swing(m, end - m.now, m.rope_length_slope)
    m.now = end
    m.next_event_time = m.foretold if m.oldest <= m.newest else NO_EVENT
    return 0


def take_rope(m: HoistingShaper, t: float) -> None:
    """Go on at t with the rope's length given now, which is that of pairs begun at this time, too."""
    if t - m.now > 64.0 * 2.220446049250313e-16 * abs(t):  # looked at between events, with the rope held
        swing(m, t - m.now, 0.0)
    number = m.newest
    while number >= m.oldest and m.begun[number % PAIRS] == m.now:
        m.momentum[number % PAIRS] = -m.rope_length
        number -= 1


def damped_out(m: HoistingShaper, span: float) -> bool:
    """Whether a rope of the time span ahead is so long that the damped load does not swing."""
    longest = max(m.rope_length, m.rope_length + m.rope_length_slope * span)
    return m.decay * m.decay * longest >= NEARLY_CRITICAL * m.gravity


def too_fast(m: HoistingShaper, span: float) -> bool:
    """Whether the time span ahead has more radians of a swing than can be followed."""
    shortest = min(m.rope_length, m.rope_length + m.rope_length_slope * span)
    return not span * span * m.gravity <= MOST_RADIANS * MOST_RADIANS * shortest


def swing(m: HoistingShaper, span: float, speed: float) -> None:
    """Carry the pairs' swings, and the rope, over the time span [s]; all swings are sums of the same two."""
    if span <= 0.0:
        return
    smooth(m, span, speed)
    if m.oldest <= m.newest:
        by_angle, by_angle_momentum = carried(m, 1.0, 0.0, m.rope_length, speed, span)
        scale = m.rope_length * math.sqrt(m.gravity * m.rope_length)  # so that both swings are of one size
        by_momentum, by_momentum_momentum = carried(m, 0.0, scale, m.rope_length, speed, span)
        for number in range(m.oldest, m.newest + 1):
            k = number % PAIRS
            x = m.angle[k]
            y = m.momentum[k] / scale
            m.angle[k] = by_angle * x + by_momentum * y
            m.momentum[k] = by_angle_momentum * x + by_momentum_momentum * y
    m.rope_length += speed * span
    m.now += span


def smooth(m: HoistingShaper, span: float, speed: float) -> None:
    """Carry the smoothed length, which lags behind the rope; exact for a rope that is linear in time."""
    kept = math.exp(-span / m.lag) if span < 700.0 * m.lag else 0.0
    m.smoothed = m.rope_length + speed * (span - m.lag) + (m.smoothed - m.rope_length + speed * m.lag) * kept


def foreseen_ratio(m: HoistingShaper) -> float:
    """The second impulse over the first, for a rope that goes on at its smoothed speed, to the first order of that speed.

    The invariant of slow changes is energy over frequency, so that rate times length goes with l^(-1/4).
    """
    root = math.sqrt(m.rope_length)
    speed = (m.rope_length - m.smoothed) / m.lag
    later = root + 0.5 * math.pi * speed / math.sqrt(m.gravity)  # root of the length half a swing later
    later = max(0.5 * root, min(2.0 * root, later))
    frequency = 2.0 * math.sqrt(m.gravity) / (root + later)
    slowed = frequency * frequency - m.decay * m.decay
    left = math.exp(-math.pi * m.decay / math.sqrt(slowed)) if slowed > 0.01 * frequency * frequency else 0.0
    return left * math.sqrt(root / later)


def begin(m: HoistingShaper, due: float, jump: float, further: int) -> int:
    """The first impulse of a pair now, of which `further` pairs follow by design."""
    share = 1.0 / (1.0 + foreseen_ratio(m))
    first = due * share * share if further > 0 else due * share
    m.shaped += first
    k = m.newest % PAIRS
    if m.newest >= m.oldest and m.begun[k] == m.now and m.further[k] == further:
        m.first[k] += first  # the command was set again at the same time
        m.due[k] += due
        m.jump[k] += abs(jump)
        if m.first[k] == 0.0 and m.due[k] == 0.0:
            m.newest -= 1
            m.foretold_length = 0.0
        return 0
    if m.newest - m.oldest + 1 >= PAIRS:
        return TOO_MANY_PAIRS
    if m.oldest > PAIRS:  # numbers stay small
        m.oldest -= PAIRS
        m.newest -= PAIRS
    if m.oldest > m.newest:
        m.foretold_length = 0.0
    m.newest += 1
    k = m.newest % PAIRS
    m.angle[k] = 0.0
    m.momentum[k] = -m.rope_length
    m.begun[k] = m.now
    m.first[k] = first
    m.due[k] = due
    m.jump[k] = abs(jump)
    m.further[k] = further
    return 0


def finish(m: HoistingShaper) -> int:
    """The second impulse of the oldest pair now, and what is missing then."""
    k = m.oldest % PAIRS
    second = m.first[k] * m.momentum[k] / m.rope_length
    m.shaped += second
    rest = m.due[k] - m.first[k] - second
    m.oldest += 1
    m.foretold_length = 0.0
    if m.further[k] == 0 and abs(rest) <= m.remainder_tolerance * m.jump[k]:
        m.shaped += rest
        return 0
    return begin(m, rest, m.jump[k], 0)


def foretell(m: HoistingShaper, left: float) -> None:
    """Time of the oldest pair's second impulse, if the rope goes on as it does in the `left` seconds of the step."""
    slope = m.rope_length_slope
    if m.foretold_length == m.rope_length and m.foretold_slope == 0.0 and slope == 0.0:
        return
    m.foretold_length = m.rope_length
    m.foretold_slope = slope
    k = m.oldest % PAIRS
    m.foretold = m.now + time_to_zero(m, m.angle[k], m.momentum[k], m.rope_length, slope, left)
