"""Double-pendulum crane: a hook on a hoisted rope, and a load on a sling below the hook, nonlinear."""

from __future__ import annotations

import math
from typing import ClassVar

from shaper_fmu.component import Calculated, Input, Local, Output, Parameter, State, Variable
from shaper_fmu.integration import MARGIN_SPENT, Integrated, integrate
from shaper_fmu.plants.hoist import gained, most_hoisted, travelled
from shaper_fmu.variable import Array

ROPE_SPENT = 1
ROPE_PUSHES = 2
SLING_PUSHES = 3


class DoublePendulumCrane(Integrated):
    """Hook of mass m_h on a rope l1 under a trolley of acceleration a, load of mass m_p on a sling l2 below the hook, nonlinear.

    With the angles theta1 of the rope and theta2 of the sling from the vertical, D = theta1 - theta2 and mu = m_p / (m_h + m_p):

    - u1 = l1 theta1' + mu l2 theta2' cos D, speed of hook and load's centre of mass across the rope,
    - u2 = l2 theta2' + l1 theta1' cos D + l1' sin D, speed of the load across the sling, both against the trolley,
    - u1' = -g sin theta1 - a cos theta1 - theta1' (l1' + mu l2 theta2' sin D) - damping,
    - u2' = -g sin theta2 - a cos theta2 - theta2' (l1' cos D - l1 theta1' sin D) - damping.

    These are Lagrange's equations with u1 and u2 for the momenta: they go on where the hoisting speed l1' = -hoist_speed jumps. The
    damping gives both modes of small swings the damping ratio at the initial rope length. From rest, hanging straight down.
    Trolley and rope follow inputs that are held or linear over a step exactly; the swing is integrated with a local error below
    1e-10 (rad, m/s). Neither rope can push: both tensions must stay positive.
    """

    messages: ClassVar[dict[int, str]] = {
        ROPE_SPENT: "hoisting at {hoist_speed} m/s leaves no rope (rope length {rope_length} m)",
        ROPE_PUSHES: "the rope would have to push: its tension is {rope_tension} N and must be greater than 0 N (rope angle "
        "{hook_angle} rad, trolley acceleration {trolley_acceleration} m/s2); a real one goes slack. Move or lower more gently",
        SLING_PUSHES: "the sling would have to push: its tension is {sling_tension} N and must be greater than 0 N (sling angle "
        "{load_angle} rad, trolley acceleration {trolley_acceleration} m/s2); a real one goes slack. Move or lower more gently",
    }
    default_stop_time: ClassVar[float] = 30.0
    continuous_states: ClassVar[tuple[str, ...] | None] = (
        "trolley_position",
        "trolley_speed",
        "rope_length",
        "hook_angle",
        "load_angle",
        "rope_cross_speed",
        "sling_cross_speed",
    )
    terminals: ClassVar[dict[str, dict[str, str]]] = {
        "command": {"acceleration": "trolley_acceleration", "hoist_speed": "hoist_speed"},
        "plant": {
            "trolley_position": "trolley_position",
            "rope_length": "rope_length",
            "hook_angle": "hook_angle",
            "load_angle": "load_angle",
            "hook_position": "hook_position",
            "load_position": "load_position",
        },
    }

    trolley_acceleration: Variable[float] = Input("m/s2", "acceleration of the trolley", slope="trolley_acceleration_slope")
    hoist_speed: Variable[float] = Input("m/s", "speed at which the hook is hoisted: the rope shortens", slope="hoist_speed_slope")
    initial_rope_length: Variable[float] = Parameter(
        5.0, "m", "length of the rope from trolley to hook at the start", min=0.0, exclusive=True, published=(1e-6, None)
    )
    sling_length: Variable[float] = Parameter(
        2.0, "m", "distance of the load's centre below the hook", min=0.0, exclusive=True, published=(1e-6, None)
    )
    hook_mass: Variable[float] = Parameter(200.0, "kg", "mass of the hook", min=0.0, exclusive=True, published=(1e-3, None))
    load_mass: Variable[float] = Parameter(500.0, "kg", "mass of the load", min=0.0, exclusive=True, published=(1e-3, None))
    damping_ratio: Variable[float] = Parameter(
        0.0, "", "damping ratio of both modes of small swings at the initial rope length", min=0.0
    )
    gravity: Variable[float] = Parameter(9.81, "m/s2", "acceleration of gravity", min=0.0, exclusive=True, published=(1e-6, None))
    natural_frequency: Variable[list[float]] = Calculated(
        "rad/s", "frequencies of small undamped swings at the initial rope length", size=2
    )
    trolley_position: Variable[float] = Output(
        "m", "position of the trolley", depends=(), derivative="trolley_speed", nominal="usual_position"
    )
    rope_length: Variable[float] = Output(
        "m", "length of the rope from trolley to hook", depends=(), derivative="rope_speed", nominal="initial_rope_length"
    )
    hook_angle: Variable[float] = Output(
        "rad",
        "angle of the rope, positive when the hook is ahead of the trolley",
        depends=(),
        display_unit="deg",
        derivative="hook_rate",
        nominal="usual_angle",
    )
    load_angle: Variable[float] = Output(
        "rad",
        "angle of the sling from the vertical, positive when the load is ahead of the hook",
        depends=(),
        display_unit="deg",
        derivative="load_rate",
        nominal="usual_angle",
    )
    hook_offset: Variable[float] = Output("m", "horizontal distance of the hook from the trolley", depends=())
    load_offset: Variable[float] = Output("m", "horizontal distance of the load from the trolley", depends=())
    hook_position: Variable[float] = Output("m", "horizontal position of the hook", depends=())
    load_position: Variable[float] = Output("m", "horizontal position of the load", depends=())
    mode_frequency: Variable[list[float]] = Output(
        "rad/s", "frequencies of small undamped swings at the present rope length", size=2, depends=()
    )
    rope_tension: Variable[float] = Output("N", "tension of the rope, which must stay positive")
    sling_tension: Variable[float] = Output("N", "tension of the sling, which must stay positive")
    trolley_speed: Variable[float] = Local("m/s", "speed of the trolley", derivative="trolley_speed_rate", nominal="usual_speed")
    trolley_speed_rate: Variable[float] = Local("m/s2", "acceleration of the trolley")
    rope_speed: Variable[float] = Local("m/s", "speed at which the rope gets longer")
    hook_rate: Variable[float] = Local("rad/s", "rate of the rope's angle", display_unit="deg/s")
    load_rate: Variable[float] = Local("rad/s", "rate of the sling's angle", display_unit="deg/s")
    rope_cross_speed: Variable[float] = Local(
        "m/s",
        "speed of hook and load's centre of mass across the rope, against the trolley",
        derivative="rope_cross_acceleration",
        nominal="usual_speed",
    )
    sling_cross_speed: Variable[float] = Local(
        "m/s",
        "speed of the load across the sling, against the trolley",
        derivative="sling_cross_acceleration",
        nominal="usual_speed",
    )
    rope_cross_acceleration: Variable[float] = Local("m/s2", "rate of rope_cross_speed")
    sling_cross_acceleration: Variable[float] = Local("m/s2", "rate of sling_cross_speed")

    usual_position: Variable[float] = State(1.0)  # under 0.1 m/s2
    usual_speed: Variable[float] = State(1.0)
    usual_angle: Variable[float] = State(1.0)
    drag: Variable[float] = State(0.0)  # damping in proportion to the masses [1/s]
    friction: Variable[float] = State(0.0)  # damping in proportion to the stiffnesses [s]
    trolley_acceleration_slope: Variable[float] = State(0.0)
    hoist_speed_slope: Variable[float] = State(0.0)

    def start(self) -> None:
        low, high = mode_frequencies(self, self.initial_rope_length)
        self.natural_frequency[0] = low
        self.natural_frequency[1] = high
        self.friction = 2.0 * self.damping_ratio / (low + high)
        self.drag = self.friction * low * high
        self.usual_angle = 0.1 / self.gravity
        self.usual_position = 0.1 / (low * low)
        self.usual_speed = 0.1 / low
        self.rope_length = self.initial_rope_length

    def step(self, t: float, h: float) -> int:
        if h > 0.0:
            status = advance(self, h)
            if status:
                return status
        if self.rope_length <= 0.0:
            return ROPE_SPENT
        gather(self)
        derivatives(self, 0.0, self.x, self.slope)
        self.hook_rate = self.slope[0]
        self.load_rate = self.slope[1]
        self.rope_cross_acceleration = self.slope[2]
        self.sling_cross_acceleration = self.slope[3]
        self.trolley_speed_rate = self.trolley_acceleration
        self.rope_speed = -self.hoist_speed
        self.hook_offset = self.rope_length * math.sin(self.hook_angle)
        self.load_offset = self.hook_offset + self.sling_length * math.sin(self.load_angle)
        self.hook_position = self.trolley_position + self.hook_offset
        self.load_position = self.trolley_position + self.load_offset
        self.mode_frequency[0], self.mode_frequency[1] = mode_frequencies(self, self.rope_length)
        return 0 if self.margin > 0.0 else which_pushes(self)


def mode_frequencies(m: DoublePendulumCrane, rope_length: float) -> tuple[float, float]:
    """Frequencies of small swings [rad/s], the lower one first, with R = m_p / m_h.

    w^2 = g/2 (1 + R) (s -+ sqrt(s^2 - 4 / ((1 + R) l1 l2))), s = 1/l1 + 1/l2; the root is that of
    (1/l1 - 1/l2)^2 + 4 R / ((1 + R) l1 l2), and the lower w^2 is g^2 (1 + R) / (l1 l2) by the upper one.
    """
    share = m.load_mass / (m.hook_mass + m.load_mass)
    whole = 1.0 + m.load_mass / m.hook_mass
    above = 1.0 / rope_length
    below = 1.0 / m.sling_length
    spread = math.sqrt((above - below) * (above - below) + 4.0 * share * above * below)
    high = 0.5 * m.gravity * whole * (above + below + spread)
    return m.gravity * math.sqrt(whole * above * below / high), math.sqrt(high)


def advance(m: DoublePendulumCrane, h: float) -> int:
    """Advance all states by h > 0; returns 0 or a status."""
    if m.rope_length - most_hoisted(m.hoist_speed, m.hoist_speed_slope, h) <= 0.0:
        return ROPE_SPENT
    gather(m)
    derivatives(m, 0.0, m.x, m.slope)
    status = MARGIN_SPENT
    if m.margin > 0.0:
        status = integrate(m, derivatives, 4, h)
    m.hook_angle = m.x[0]
    m.load_angle = m.x[1]
    m.rope_cross_speed = m.x[2]
    m.sling_cross_speed = m.x[3]
    if status == MARGIN_SPENT:
        return which_pushes(m)
    if status:
        return status
    m.trolley_position += travelled(m.trolley_speed, m.trolley_acceleration, m.trolley_acceleration_slope, h)
    m.trolley_speed += gained(m.trolley_acceleration, m.trolley_acceleration_slope, h)
    m.rope_length -= gained(m.hoist_speed, m.hoist_speed_slope, h)
    m.trolley_acceleration += m.trolley_acceleration_slope * h
    m.hoist_speed += m.hoist_speed_slope * h
    return 0


def which_pushes(m: DoublePendulumCrane) -> int:
    """The status of the rope that would have to push."""
    return ROPE_PUSHES if m.rope_tension <= 0.0 else SLING_PUSHES


def gather(m: DoublePendulumCrane) -> None:
    """The swing's states, for the integration."""
    m.x[0] = m.hook_angle
    m.x[1] = m.load_angle
    m.x[2] = m.rope_cross_speed
    m.x[3] = m.sling_cross_speed


def derivatives(m: DoublePendulumCrane, s: float, x: Array, slope: Array) -> None:
    """Slopes of the swing's states, s after the start of the step; the smaller tension per kg is the margin."""
    push = m.trolley_acceleration + m.trolley_acceleration_slope * s
    length = m.rope_length - gained(m.hoist_speed, m.hoist_speed_slope, s)
    growth = -(m.hoist_speed + m.hoist_speed_slope * s)
    sine = math.sin(x[0] - x[1])
    cosine = math.cos(x[0] - x[1])
    own = m.hook_mass / (m.hook_mass + m.load_mass)
    share = m.load_mass / (m.hook_mass + m.load_mass)
    swung = x[3] - growth * sine
    determinant = own + share * sine * sine
    hook_speed = (x[2] - share * cosine * swung) / determinant  # l1 theta1'
    load_speed = (swung - cosine * x[2]) / determinant  # l2 theta2'
    rope_loss = m.drag * (hook_speed + share * load_speed * cosine) + m.friction * m.gravity / m.initial_rope_length * hook_speed
    sling_loss = m.drag * swung + m.friction * m.gravity / m.sling_length * load_speed
    slope[0] = hook_speed / length
    slope[1] = load_speed / m.sling_length
    first_sine = math.sin(x[0])
    first_cosine = math.cos(x[0])
    slope[2] = -m.gravity * first_sine - push * first_cosine - slope[0] * (growth + share * load_speed * sine) - rope_loss
    slope[3] = -m.gravity * math.sin(x[1]) - push * math.cos(x[1]) - slope[1] * (growth * cosine - hook_speed * sine) - sling_loss
    # along the rope, and along the sling, between hook and load; the hook's damping force acts across the rope
    hook_pull = hook_speed * slope[0] + m.hoist_speed_slope + m.gravity * first_cosine - push * first_sine
    hook_loss = (rope_loss - share * sling_loss * cosine) / own
    sling_pull = own * (load_speed * slope[1] + hook_pull * cosine - hook_loss * sine) / determinant
    m.sling_tension = m.load_mass * sling_pull
    m.rope_tension = m.sling_tension * cosine + m.hook_mass * hook_pull
    m.margin = min(sling_pull, m.rope_tension / m.hook_mass)
