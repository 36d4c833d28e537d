"""The shaped stop: an operator's speed commands and stops, within a drive's limits, so that the load hangs still afterwards."""

from __future__ import annotations

import math
from enum import IntEnum
from typing import ClassVar

from shaper_fmu.component import MEAN, NO_EVENT, Input, Output, Parameter, State, Variable, time_tolerance
from shaper_fmu.speed_plan import PIECES, SpeedPlan, plan_braking, plan_change, plan_travel, swung

TOO_MUCH_SWING = 1
TOO_FAST = 2


class StopCriterion(IntEnum):
    """Items:

    - time: the least time until drive and load rest; the drive may accelerate in between;
    - braking: the least time without accelerating; if the swing cannot be taken away so, `time`;
    - travel: the drive brakes at once, as hard as it may, and moves back a little to take the swing away.
    """

    time = 1
    braking = 2
    travel = 3


class SwingSource(IntEnum):
    """Items:

    - model: the linear pendulum that the component carries along, from the initial swing on;
    - measured: the inputs swing_angle and swing_rate, when a plan begins; what they show after its end begins another.
    """

    model = 1
    measured = 2


class ShapedStop(SpeedPlan):
    """Turns an operator's speed commands into a drive's speed that keeps its limits and leaves the load at rest.

    Whenever the commanded speed changes, or `stop` does, the component plans the change from its present speed and the load's
    present swing: a few pieces of constant acceleration, after which the drive has the commanded speed and the load hangs
    still; exactly, for the linear pendulum theta'' + 2 zeta w theta' + w^2 theta = -a/l, w = sqrt(g/l). The speed stays within
    max_speed, the acceleration within max_acceleration, while `stop` is true within stop_deceleration. Plans take the least
    time; stops have least of what `criterion` says. One by `travel` goes no farther than v^2/(2 stop_deceleration).

    The rope's length counts when a plan begins. The pieces are exact in time, and `next_event_time` announces them; a master
    that can only hold inputs over fixed steps wires `acceleration_mean`.

    Criteria:

    - time: the least time until drive and load rest; the drive may accelerate in between;
    - braking: the least time without accelerating; if the swing cannot be taken away so, `time`;
    - travel: the drive brakes at once, as hard as it may, and moves back a little to take the swing away.

    Sources of the swing:

    - model: the linear pendulum that the component carries along, from the initial swing on;
    - measured: the inputs swing_angle and swing_rate, when a plan begins; what they show after its end begins another.
    """

    messages: ClassVar[dict[int, str]] = {
        TOO_MUCH_SWING: "no acceleration within the limits takes a swing of {begin_angle} rad and {begin_rate} rad/s away "
        "within 16 swings on a rope of {rope_length} m; check the units of the swing, or raise the limits "
        "(max_speed = {max_speed} m/s, max_acceleration = {max_acceleration} m/s2, stop_deceleration = {stop_deceleration} m/s2)",
        TOO_FAST: "initial_speed = {initial_speed} m/s is beyond max_speed = {max_speed} m/s",
    }

    continuous_states: ClassVar[tuple[str, ...] | None] = ()
    sampled: ClassVar[bool] = True
    default_stop_time: ClassVar[float] = 30.0
    terminals: ClassVar[dict[str, dict[str, str]]] = {
        "command": {"speed": "target_speed", "stop": "stop"},
        "plant": {"rope_length": "rope_length", "swing_angle": "swing_angle", "swing_rate": "swing_rate"},
        "shaped": {"speed": "speed", "acceleration": "acceleration", "acceleration_mean": "acceleration_mean"},
    }

    target_speed: Variable[float] = Input("m/s", "speed that the operator commands; beyond max_speed it counts as that")
    stop: Variable[bool] = Input("", "true while the drive is to stop and stay, whatever target_speed is", start=False)
    rope_length: Variable[float] = Input("m", "length of the rope", start=5.0, min=0.0, exclusive=True, published=(1e-9, None))
    swing_angle: Variable[float] = Input("rad", "measured swing angle, positive when the load is ahead", display_unit="deg")
    swing_rate: Variable[float] = Input("rad/s", "measured rate of the swing angle", display_unit="deg/s")
    max_speed: Variable[float] = Parameter(
        1.0, "m/s", "speed never to be exceeded", min=0.0, exclusive=True, published=(1e-9, None)
    )
    max_acceleration: Variable[float] = Parameter(
        0.3, "m/s2", "acceleration never to be exceeded", min=0.0, exclusive=True, published=(1e-9, None)
    )
    stop_deceleration: Variable[float] = Parameter(
        0.3, "m/s2", "the same while stop is true", min=0.0, exclusive=True, published=(1e-9, None)
    )
    criterion: Variable[int] = Parameter(StopCriterion.braking, "", "what a stop has least of")
    overshoot: Variable[float] = Parameter(
        0.0,
        "m/s",
        "by how much the speed may leave the range from its present value to the target; more if a swing faster",
        min=0.0,
    )
    swing_source: Variable[int] = Parameter(SwingSource.model, "", "where the load's swing is known from")
    swing_tolerance: Variable[float] = Parameter(
        0.002, "rad", "measured amplitude from which on a swing that is left is taken away", min=0.0, display_unit="deg"
    )
    damping_ratio: Variable[float] = Parameter(
        0.0, "", "damping ratio of small swings", min=0.0, max=1.0, exclusive="max", published=(0.0, 0.999)
    )
    gravity: Variable[float] = Parameter(9.81, "m/s2", "acceleration of gravity", min=0.0, exclusive=True, published=(1e-9, None))
    initial_speed: Variable[float] = Parameter(0.0, "m/s", "speed at the start")
    initial_angle: Variable[float] = Parameter(0.0, "rad", "the model's swing angle at the start", display_unit="deg")
    initial_rate: Variable[float] = Parameter(0.0, "rad/s", "its rate at the start", display_unit="deg/s")
    speed: Variable[float] = Output("m/s", "speed of the drive")
    acceleration: Variable[float] = Output("m/s2", "its acceleration")
    acceleration_mean: Variable[float] = Output("m/s2", MEAN.format("acceleration"))
    model_angle: Variable[float] = Output("rad", "swing angle of the linear pendulum of the present plan", display_unit="deg")
    model_rate: Variable[float] = Output("rad/s", "its rate", display_unit="deg/s")
    rest_time: Variable[float] = Output("s", "time at which the present plan ends: the speed is reached and the load rests")
    next_event_time: Variable[float] = Output("s", "time of the next jump of an output, 1e300 if none", start=NO_EVENT)
    settled: Variable[bool] = Output("", "true from rest_time on", start=True)

    begun: Variable[bool] = State(False)  # whether there is a plan
    begin: Variable[float] = State(0.0)  # time at which the present plan began [s], and the state then
    begin_speed: Variable[float] = State(0.0)
    begin_angle: Variable[float] = State(0.0)
    begin_rate: Variable[float] = State(0.0)
    planned_rope: Variable[float] = State(1.0)  # what the plan was made for [m]
    planned_target: Variable[float] = State(0.0)
    planned_stop: Variable[bool] = State(False)
    planned_angle: Variable[float] = State(0.0)
    planned_rate: Variable[float] = State(0.0)
    piece_from: Variable[list[float]] = State(size=PIECES)  # time at which each piece of the plan begins, and the state then
    speed_from: Variable[list[float]] = State(size=PIECES)
    x_from: Variable[list[float]] = State(size=PIECES)
    y_from: Variable[list[float]] = State(size=PIECES)

    def start(self) -> int:
        if abs(self.initial_speed) > self.max_speed:
            return TOO_FAST
        self.largest_speed = self.max_speed
        self.speed = self.initial_speed
        self.model_angle = self.initial_angle
        self.model_rate = self.initial_rate
        return 0

    def step(self, t: float, h: float) -> int:
        target = 0.0 if self.stop else max(-self.max_speed, min(self.max_speed, self.target_speed))
        if self.begun:
            look(self, t, time_tolerance(self, t, 0.0))
        if is_new(self, t, target):
            if not (self.begun and t == self.begin):
                self.begin_speed = self.speed
                self.begin_angle = self.model_angle
                self.begin_rate = self.model_rate
            if not plan(self, t, target):
                return TOO_MUCH_SWING
            look(self, t, time_tolerance(self, t, 0.0))
        if h > 0.0:
            before = self.speed
            look(self, t + h, time_tolerance(self, t, h))
            self.acceleration_mean = (self.speed - before) / h
        return 0


def is_new(m: ShapedStop, t: float, target: float) -> bool:
    """Whether a plan is to begin at t."""
    if not m.begun or target != m.planned_target or m.stop != m.planned_stop:
        return True
    measured = m.swing_source == SwingSource.measured
    if t == m.begin:  # importers set inputs one after the other, and after the initialization
        return m.rope_length != m.planned_rope or (
            measured and (m.swing_angle != m.planned_angle or m.swing_rate != m.planned_rate)
        )
    return measured and m.settled and swings(m)


def swings(m: ShapedStop) -> bool:
    """Whether the measured swing is more than is tolerated."""
    rate = m.swing_rate * math.sqrt(m.rope_length / m.gravity)
    return m.swing_angle * m.swing_angle + rate * rate > m.swing_tolerance * m.swing_tolerance


def plan(m: ShapedStop, t: float, target: float) -> bool:
    """Plan from the state at t; whether there is a plan."""
    if m.swing_source == SwingSource.measured:
        m.begin_angle = m.swing_angle
        m.begin_rate = m.swing_rate
        if m.begin_speed == target and not swings(m):  # nothing to be done
            m.begin_angle = 0.0
            m.begin_rate = 0.0
    m.begun = True
    m.begin = t
    m.planned_rope = m.rope_length
    m.planned_target = target
    m.planned_stop = m.stop
    m.planned_angle = m.swing_angle
    m.planned_rate = m.swing_rate
    frequency = math.sqrt(m.gravity / m.rope_length)
    m.pole_decay = m.damping_ratio * frequency
    m.pole_frequency = frequency * math.sqrt(1.0 - m.damping_ratio * m.damping_ratio)
    m.pull = m.stop_deceleration if m.stop else m.max_acceleration
    x = m.rope_length * (m.begin_rate + m.pole_decay * m.begin_angle)
    y = m.rope_length * m.pole_frequency * m.begin_angle
    found = False
    if m.stop and m.criterion == StopCriterion.travel:
        found = plan_travel(m, m.begin_speed, x, y)
    elif m.stop and m.criterion == StopCriterion.braking:
        found = plan_braking(m, m.begin_speed, x, y)
    if not found:
        found = plan_change(m, m.begin_speed, x, y, target, m.overshoot)
    enter(m, x, y)
    return found


def enter(m: ShapedStop, x: float, y: float) -> None:
    """When each piece of the plan begins, and the state then."""
    t = m.begin
    speed = m.begin_speed
    for i in range(m.planned):
        m.plan_level[i] = max(-m.pull, min(m.pull, m.plan_level[i]))
        m.piece_from[i] = t
        m.speed_from[i] = speed
        m.x_from[i] = x
        m.y_from[i] = y
        x, y = swung(m, x, y, m.plan_level[i], m.plan_time[i])
        speed += m.plan_level[i] * m.plan_time[i]
        t += m.plan_time[i]
    m.rest_time = t


def look(m: ShapedStop, now: float, tolerance: float) -> None:
    """The outputs at a time of the present plan."""
    m.next_event_time = NO_EVENT
    m.settled = False
    if m.planned == 0 or now >= m.rest_time - tolerance:
        m.settled = True
        m.speed = m.planned_target
        m.acceleration = 0.0
        m.model_angle = 0.0
        m.model_rate = 0.0
        return
    m.next_event_time = m.rest_time
    last = 0
    for i in range(1, m.planned):
        if now >= m.piece_from[i] - tolerance:
            last = i
        else:
            m.next_event_time = m.piece_from[i]
            break
    s = max(0.0, now - m.piece_from[last])
    m.acceleration = m.plan_level[last]
    m.speed = max(-m.max_speed, min(m.max_speed, m.speed_from[last] + s * m.acceleration))
    x, y = swung(m, m.x_from[last], m.y_from[last], m.acceleration, s)
    m.model_angle = y / (m.planned_rope * m.pole_frequency)
    m.model_rate = x / m.planned_rope - m.pole_decay * m.model_angle
