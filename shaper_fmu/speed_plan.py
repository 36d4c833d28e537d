"""Plans of a drive's speed within its limits, after which a swinging load hangs still: what precedes the fastest change."""

from __future__ import annotations

import math

from shaper_fmu.component import State, Variable
from shaper_fmu.speed_change import GROWTH, NEVER, NONE, change_speed, most_growth
from shaper_fmu.speed_pieces import CUTS, HALF_SWINGS, SpeedChange

PIECES = 2 * CUTS + 2


class SpeedPlan(SpeedChange):
    """A component with a plan: accelerations, one after the other."""

    largest_speed: Variable[float] = State(1.0)  # [m/s]
    pull: Variable[float] = State(1.0)  # largest acceleration [m/s2]
    planned: Variable[int] = State(0)
    plan_time: Variable[list[float]] = State(size=PIECES)  # how long each piece lasts [s]
    plan_level: Variable[list[float]] = State(size=PIECES)  # its acceleration [m/s2]


def plan_change(m: SpeedPlan, speed: float, x: float, y: float, target: float, overshoot: float) -> bool:
    """The plan from a speed and a swing z = x + j y to another speed without a swing; whether there is one.

    The speed leaves the range between the two by no more than overshoot, unless that takes a swing longer.
    """
    begin_plan(m, speed, x, y)
    add_excess(m, target)
    before = m.planned
    time = change_speed(m, target, NEVER)
    if time == NONE:
        return False
    add_pieces(m)
    m.lowest = max(-m.largest_speed, min(speed, target) - overshoot)
    m.highest = min(m.largest_speed, max(speed, target) + overshoot)
    longest = time + 2.0 * math.pi / m.pole_frequency
    if m.highest - m.lowest < 2.0 * m.largest_speed and change_speed(m, target, longest) != NONE:
        m.planned = before
        add_pieces(m)
    return True


def plan_braking(m: SpeedPlan, speed: float, x: float, y: float) -> bool:
    """The fastest plan of a stop that never accelerates; whether there is one."""
    begin_plan(m, speed, x, y)
    if speed > 0.0:
        m.high = 0.0
    else:
        m.low = 0.0
    add_excess(m, 0.0)
    if change_speed(m, 0.0, NEVER) == NONE:
        return False
    add_pieces(m)
    return True


def plan_travel(m: SpeedPlan, speed: float, x: float, y: float) -> bool:
    """The plan of a stop that brakes at once, as hard as it may, and takes the swing away by moving back; whether there is one."""
    begin_plan(m, speed, x, y)
    if speed > 0.0:
        m.highest = 0.0
    elif speed < 0.0:
        m.lowest = 0.0
    if speed != 0.0:
        add_ramp(m, abs(speed) / m.pull, -math.copysign(m.pull, speed))
        m.from_speed = 0.0
    if change_speed(m, 0.0, NEVER) == NONE:
        return False
    add_pieces(m)
    return True


def begin_plan(m: SpeedPlan, speed: float, x: float, y: float) -> None:
    """A plan with nothing in it yet, and what the change is to start from."""
    m.planned = 0
    m.from_speed = speed
    m.swing_x = x
    m.swing_y = y
    m.low = -m.pull
    m.high = m.pull
    m.lowest = -m.largest_speed
    m.highest = m.largest_speed


def add_excess(m: SpeedPlan, target: float) -> None:
    """A ramp, as far as a change to the target would span too many swings."""
    change = target - m.from_speed
    time = abs(change) / m.pull - min(0.5 * HALF_SWINGS * math.pi / m.pole_frequency, most_growth(m, GROWTH))
    if time > 0.0:
        add_ramp(m, time, math.copysign(m.pull, change))


def add_ramp(m: SpeedPlan, time: float, level: float) -> None:
    """One more piece of the plan; the change starts after it."""
    m.plan_time[m.planned] = time
    m.plan_level[m.planned] = level
    m.planned += 1
    m.from_speed += time * level
    m.swing_x, m.swing_y = swung(m, m.swing_x, m.swing_y, level, time)


def add_pieces(m: SpeedPlan) -> None:
    """The change that was found, as the end of the plan."""
    for i in range(m.pieces):
        m.plan_time[m.planned] = m.piece_time[i]
        m.plan_level[m.planned] = m.piece_level[i]
        m.planned += 1


def swung(m: SpeedPlan, x: float, y: float, level: float, time: float) -> tuple[float, float]:
    """The swing z after a time under a constant acceleration: exp(p t) z - a (exp(p t) - 1) / p."""
    left = math.exp(-m.pole_decay * time)
    cosine = left * math.cos(m.pole_frequency * time)
    sine = left * math.sin(m.pole_frequency * time)
    size = m.pole_decay * m.pole_decay + m.pole_frequency * m.pole_frequency
    u = (m.pole_frequency * sine - m.pole_decay * (cosine - 1.0)) / size
    v = (-m.pole_decay * sine - m.pole_frequency * (cosine - 1.0)) / size
    return cosine * x - sine * y - level * u, sine * x + cosine * y - level * v
