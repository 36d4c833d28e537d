"""The accelerations of a drive that change its speed as wanted, at a wave's crossings of a level: see `speed_change.py`.

The wave is exp(zeta w t) cos(wd t + phase). Where it exceeds the level the acceleration is the higher limit, elsewhere the lower
one, and the level is the one at which the speed changes as wanted. Where the speed would leave its range it is held at its end.
"""

from __future__ import annotations

import math

from shaper_fmu.component import Component, State, Variable

HALF_SWINGS = 64
"""Most half swings that one change may span."""
CUTS = HALF_SWINGS + 6
STEPS = 80
"""Most steps of a search in a bracket; some ten are needed."""
SECANTS = 20
"""Steps after which a search halves its bracket instead: where what it looks for jumps."""
CLOSE = 1e-13
"""Share of what there is that speeds and swings may be missed by."""


class SpeedChange(Component):
    """A component with the search for one change: what is wanted, and the accelerations found, in order."""

    pole_decay: Variable[float] = State(0.0)  # zeta w [1/s]
    pole_frequency: Variable[float] = State(1.0)  # wd [rad/s]
    low: Variable[float] = State(-1.0)  # limits of the acceleration [m/s2]
    high: Variable[float] = State(1.0)
    change: Variable[float] = State(0.0)  # of the speed [m/s]
    swing_x: Variable[float] = State(0.0)  # z [m/s]
    swing_y: Variable[float] = State(0.0)
    from_speed: Variable[float] = State(0.0)  # [m/s]
    lowest: Variable[float] = State(-1.0)  # limits of the speed [m/s]
    highest: Variable[float] = State(1.0)
    extremes: Variable[int] = State(0)
    extreme_time: Variable[list[float]] = State(size=CUTS)
    extreme_value: Variable[list[float]] = State(size=CUTS)
    precision: Variable[float] = State(0.0)  # share of what there is to which searches go on
    pieces: Variable[int] = State(0)
    piece_time: Variable[list[float]] = State(size=2 * CUTS)  # how long each lasts [s]
    piece_level: Variable[list[float]] = State(size=2 * CUTS)  # its acceleration [m/s2]
    piece_speed: Variable[float] = State(0.0)  # after them [m/s]


def find_pieces(m: SpeedChange, phase: float, time: float) -> None:
    """The accelerations in this direction: high where the wave exceeds a level, which is so that the speed changes as wanted."""
    lowest, highest = set_extremes(m, phase, time)
    middle = 0.5 * (highest + lowest)
    half = 0.5 * (highest - lowest)
    left = 0.0
    right = math.pi
    below = m.low * time - m.change
    above = m.high * time - m.change
    side = 0
    for i in range(STEPS):
        angle = (left * above - right * below) / (above - below) if i < SECANTS else 0.5 * (left + right)
        excess = cut(m, phase, middle + half * math.cos(angle))
        if abs(excess) <= 0.5 * m.precision * (m.high - m.low) * time or right - left <= 4e-16:
            break
        if excess < 0.0:
            left = angle
            below = excess
            if side < 0:
                above *= 0.5
            side = -1
        else:
            right = angle
            above = excess
            if side > 0:
                below *= 0.5
            side = 1
    if abs(m.piece_speed - m.from_speed - m.change) > CLOSE * (m.high - m.low) * time:  # it jumps there: only one side is right
        cut(m, phase, middle + half * math.cos(left))
        if abs(m.piece_speed - m.from_speed - m.change) > CLOSE * (m.high - m.low) * time:
            cut(m, phase, middle + half * math.cos(right))


def wave(m: SpeedChange, phase: float, t: float) -> float:
    """exp(sigma t) cos(wd t + phase)."""
    return math.exp(m.pole_decay * t) * math.cos(m.pole_frequency * t + phase)


def set_extremes(m: SpeedChange, phase: float, time: float) -> tuple[float, float]:
    """Times 0, of the extremes between, and the end, with the wave's values there; returns the lowest and the highest."""
    lean = math.atan2(m.pole_decay, m.pole_frequency)
    k = math.ceil((phase - lean) / math.pi)
    m.extreme_time[0] = 0.0
    m.extremes = 1
    t = (lean + k * math.pi - phase) / m.pole_frequency
    while t < time and m.extremes < CUTS - 1:
        if t > 0.0:
            m.extreme_time[m.extremes] = t
            m.extremes += 1
        k += 1
        t = (lean + k * math.pi - phase) / m.pole_frequency
    m.extreme_time[m.extremes] = time
    m.extremes += 1
    lowest = wave(m, phase, 0.0)
    highest = lowest
    for i in range(m.extremes):
        value = wave(m, phase, m.extreme_time[i])
        m.extreme_value[i] = value
        lowest = min(lowest, value)
        highest = max(highest, value)
    return lowest, highest


def cut(m: SpeedChange, phase: float, level: float) -> float:
    """The pieces, high where the wave exceeds the level, and held where the speed would leave its range; returns how much the
    speed misses the target, were the last one not held."""
    m.pieces = 0
    m.piece_speed = m.from_speed
    high = m.extreme_value[0] > level
    begin = 0.0
    for i in range(m.extremes - 1):
        after = m.extreme_value[i + 1] > level
        if after != high:
            t = crossing(m, phase, level, i)
            add_kept(m, t - begin, m.high if high else m.low)
            begin = t
            high = after
    time = m.extreme_time[m.extremes - 1] - begin
    level = m.high if high else m.low
    missed = m.piece_speed + time * level - m.from_speed - m.change
    add_kept(m, time, level)
    return missed


def add_kept(m: SpeedChange, time: float, level: float) -> None:
    """A piece that ends where the speed would leave its range, and is held from there on."""
    if level == 0.0:
        add_piece(m, time, level)
        return
    room = ((m.highest if level > 0.0 else m.lowest) - m.piece_speed) / level
    moved = max(0.0, min(time, room))
    add_piece(m, moved, level)
    add_piece(m, time - moved, 0.0)


def add_piece(m: SpeedChange, time: float, level: float) -> None:
    """One more piece, if it lasts."""
    if time > 0.0:
        m.piece_time[m.pieces] = time
        m.piece_level[m.pieces] = level
        m.pieces += 1
        m.piece_speed += time * level


def crossing(m: SpeedChange, phase: float, level: float, i: int) -> float:
    """Where the wave passes the level between two extremes: Newton's method in a bracket."""
    left = m.extreme_time[i]
    right = m.extreme_time[i + 1]
    falls = m.extreme_value[i] > level
    t = 0.5 * (left + right)
    angle = math.acos(max(-1.0, min(1.0, level * math.exp(-m.pole_decay * t))))
    half = math.floor((m.pole_frequency * t + phase) / math.pi)
    odd = half % 2
    guess = ((half + 1.0) * math.pi - angle if odd == 1 else half * math.pi + angle) - phase
    t = guess / m.pole_frequency
    if not left < t < right:
        t = 0.5 * (left + right)
    for _ in range(STEPS):
        grown = math.exp(m.pole_decay * t)
        argument = m.pole_frequency * t + phase
        cosine = math.cos(argument)
        above = grown * cosine - level
        if (above > 0.0 and falls) or (above <= 0.0 and not falls):
            left = t
        else:
            right = t
        slope = grown * (m.pole_decay * cosine - m.pole_frequency * math.sin(argument))
        tried = t - above / slope if slope != 0.0 else left
        if not left <= tried <= right:
            tried = 0.5 * (left + right)
        step = abs(tried - t)
        left_over = step * step * grown * m.pole_frequency * m.pole_frequency  # twice what the next step would correct, in the wave
        if left_over <= 4e-16 * abs(slope) / m.pole_frequency or step <= 2e-16 * abs(t):
            return tried
        t = tried
    return t
