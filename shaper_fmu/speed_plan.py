"""Plans of a drive's speed within its limits, after which a swinging load hangs still: what precedes the fastest change."""

from __future__ import annotations

import math

from shaper_fmu.component import State, Variable
from shaper_fmu.speed_change import CUTS, HALF_SWINGS, NONE, SpeedChange, change_speed

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

    The speed leaves the range between the two by no more than overshoot, unless the swing cannot be taken away within that.
    """
    lowest = max(-m.largest_speed, min(speed, target) - overshoot)
    highest = min(m.largest_speed, max(speed, target) + overshoot)
    if add_change(m, speed, x, y, target, lowest, highest):
        return True
    return add_change(m, speed, x, y, target, -m.largest_speed, m.largest_speed)


def add_change(m: SpeedPlan, speed: float, x: float, y: float, target: float, lowest: float, highest: float) -> bool:
    """The plan of the fastest change within a range of the speed; whether there is one.

    What would span too many swings begins with a ramp.
    """
    m.planned = 0
    begin_change(m, speed, x, y, lowest, highest)
    return add_found(m, target)


def add_found(m: SpeedPlan, target: float) -> bool:
    """The fastest change as it was begun, as the end of the plan; whether there is one."""
    change = target - m.from_speed
    time = abs(change) / m.pull - 0.5 * HALF_SWINGS * math.pi / m.pole_frequency
    if time > 0.0:
        add_ramp(m, time, math.copysign(m.pull, change))
    if change_speed(m, target) == NONE:
        return False
    for i in range(m.pieces):
        m.plan_time[m.planned] = m.piece_time[i]
        m.plan_level[m.planned] = m.piece_level[i]
        m.planned += 1
    return True


def plan_braking(m: SpeedPlan, speed: float, x: float, y: float) -> bool:
    """The fastest plan of a stop that never accelerates; whether there is one."""
    m.planned = 0
    begin_change(m, speed, x, y, min(speed, 0.0), max(speed, 0.0))
    if speed > 0.0:
        m.high = 0.0
    else:
        m.low = 0.0
    return add_found(m, 0.0)


def plan_travel(m: SpeedPlan, speed: float, x: float, y: float) -> bool:
    """The plan of a stop that brakes at once, as hard as it may, and takes the swing away by moving back; whether there is one."""
    m.planned = 0
    lowest = 0.0 if speed < 0.0 else -m.largest_speed
    highest = 0.0 if speed > 0.0 else m.largest_speed
    begin_change(m, speed, x, y, lowest, highest)
    if speed != 0.0:
        add_ramp(m, abs(speed) / m.pull, -math.copysign(m.pull, speed))
        m.from_speed = 0.0
    return add_found(m, 0.0)


def begin_change(m: SpeedPlan, speed: float, x: float, y: float, lowest: float, highest: float) -> None:
    """What the change is to start from, and its limits."""
    m.from_speed = speed
    m.swing_x = x
    m.swing_y = y
    m.low = -m.pull
    m.high = m.pull
    m.lowest = lowest
    m.highest = highest


def add_ramp(m: SpeedPlan, time: float, level: float) -> None:
    """One more piece of the plan; the change starts after it."""
    m.plan_time[m.planned] = time
    m.plan_level[m.planned] = level
    m.planned += 1
    m.from_speed += time * level
    m.swing_x, m.swing_y = swung(m, m.swing_x, m.swing_y, level, time)


def swung(m: SpeedPlan, x: float, y: float, level: float, time: float) -> tuple[float, float]:
    """The swing z after a time under a constant acceleration: exp(p t) z - a (exp(p t) - 1) / p."""
    left = math.exp(-m.pole_decay * time)
    cosine = left * math.cos(m.pole_frequency * time)
    sine = left * math.sin(m.pole_frequency * time)
    size = m.pole_decay * m.pole_decay + m.pole_frequency * m.pole_frequency
    u = (m.pole_frequency * sine - m.pole_decay * (cosine - 1.0)) / size
    v = (-m.pole_decay * sine - m.pole_frequency * (cosine - 1.0)) / size
    return cosine * x - sine * y - level * u, sine * x + cosine * y - level * v
