"""The fastest change of a drive's speed that brings a swinging load to rest: switches of the acceleration, right to rounding.

The load's deflection q from where it hangs obeys q'' + 2 zeta w q' + w^2 q = -a under the drive's acceleration a. With the pole
p = w (-zeta + j sqrt(1 - zeta^2)) and z = q' - conj(p) q it reads z' = p z - a, so that rest at T asks for two things:

    int_0^T a exp(-p t) dt = z(0),        int_0^T a dt = the change of the speed.

What accelerations between two limits can make of the first integral, with the second one given, is a convex set. The farthest
point of it in a direction is reached by the higher limit where exp(zeta w t) cos(wd t + phase) exceeds a level, and the lower one
elsewhere (Pontryagin). For a time T the ray from the point of the constant acceleration through the wanted point leaves
the set at such a point. If that lies beyond the wanted one, the acceleration is blended with the constant one by just as
much. So each time T from the shortest on has an exact solution, and that of the shortest switches between the limits alone.

Where the speed would leave its range it is held at its end for as long. That set is convex, too, so that the blend keeps the range.
With held speeds not all points are the farthest there are: the time may be longer than the shortest; limits and rest are exact.
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
COARSE = 1e-13
FINE = 4e-16
"""Shares to which searches go on while the shortest time is looked for, and for that time."""
SHORTEST = 1e-8
"""Share to which the shortest time is found."""
SPARE = 2.0
"""Swings that a change may take beside the ramp and what the swing asks for."""
GROWTH = 150.0
"""Most that a wave's exponent grows by in the shortest time of a change; searches go to twice that: its square is a number."""
OUT_OF_REACH = 2.0
NONE = -1.0
NEVER = 1e300


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


def change_speed(m: SpeedChange, target: float, longest: float) -> float:
    """The time [s] of the fastest change from `from_speed` to the target that takes the swing away, NONE if it takes too long.

    It keeps the acceleration between `low` <= 0 and `high` >= 0, the speed between `lowest` and `highest`.
    """
    m.change = target - m.from_speed
    limit = m.high if m.change > 0.0 else m.low
    if limit == 0.0:
        return NONE
    shortest = m.change / limit
    if shortest > most_growth(m, 2.0 * GROWTH):  # what is left after a ramp so long that numbers do not tell its end
        return NONE
    m.precision = COARSE
    share = missing(m, shortest)
    if share <= 1.0:
        blend(m, shortest, share)
        return shortest
    longest = min(longest, shortest + most_swings(m) * 2.0 * math.pi / m.pole_frequency, most_growth(m, 2.0 * GROWTH))
    inside = shortest
    outside = shortest
    while share > 1.0:
        if inside >= longest:
            return NONE
        outside = inside
        inside = min(longest, inside + 0.25 * math.pi / m.pole_frequency)
        share = missing(m, inside)
    inside = narrowed(m, outside, inside, share)
    m.precision = FINE
    share = missing(m, inside)
    step = SHORTEST * inside
    while share > 1.0:
        inside += step
        step *= 4.0
        if inside > longest:
            return NONE
        share = missing(m, inside)
    blend(m, inside, share)
    return inside


def most_growth(m: SpeedChange, growth: float) -> float:
    """The time [s] in which exp(sigma t) grows to exp(growth). What is heavily damped is forgotten long before, and numbers end at
    exp(709)."""
    return growth / m.pole_decay if m.pole_decay > 0.0 else NEVER


def most_swings(m: SpeedChange) -> float:
    """Swings within which a change is looked for, beside the shortest time: twice those in which the swing can be taken away."""
    swing = math.sqrt(m.swing_x * m.swing_x + m.swing_y * m.swing_y)
    each = min(2.0 * (m.high - m.low) / m.pole_frequency, 4.0 * (m.highest - m.lowest))
    if each <= 0.0:
        return 0.0
    return min(0.25 * HALF_SWINGS, SPARE + 2.0 * swing / each)


def narrowed(m: SpeedChange, outside: float, inside: float, share: float) -> float:
    """The shortest time between one that is too short and one that is not, for which a share is missing."""
    side = 0
    above = OUT_OF_REACH - 1.0
    below = share - 1.0
    for _ in range(STEPS):
        if inside - outside <= SHORTEST * inside:
            break
        middle = inside - (inside - outside) * below / (below - above)
        middle = max(middle, outside + 0.02 * (inside - outside))
        middle = min(middle, inside - 0.25 * SHORTEST * inside)
        share = missing(m, middle)
        if share <= 1.0:
            inside = middle
            below = share - 1.0
            if side < 0:
                above *= 0.5
            side = -1
        else:
            outside = middle
            above = share - 1.0
            if side > 0:
                below *= 0.5
            side = 1
    return inside


def missing(m: SpeedChange, time: float) -> float:
    """The share of the farthest acceleration that is wanted in this time: above 1 the wanted point is out of reach."""
    m.pieces = 0
    level = m.change / time if time > 0.0 else 0.0
    cx, cy = effect(m, 0.0, time)
    dx = m.swing_x - level * cx
    dy = m.swing_y - level * cy
    distance = math.sqrt(dx * dx + dy * dy)
    room = (m.high - m.low) / m.pole_frequency * math.exp(min(600.0, m.pole_decay * time))
    if distance <= 1e-15 * room:
        return 0.0
    on = (m.change - m.low * time) / (m.high - m.low)
    if not 1e-13 * time < on < time * (1.0 - 1e-13):
        return OUT_OF_REACH
    direction = math.atan2(dy, dx)
    left = direction - 0.5 * math.pi
    right = direction + 0.5 * math.pi
    below, _ = farthest(m, left, time, dx / distance, dy / distance)
    above, _ = farthest(m, right, time, dx / distance, dy / distance)
    if not below < 0.0 < above:
        return OUT_OF_REACH
    side = 0
    reach = 0.0
    across = room
    for i in range(STEPS):
        phase = (left * above - right * below) / (above - below) if i < SECANTS else 0.5 * (left + right)
        if not left < phase < right:
            phase = 0.5 * (left + right)
        across, reach = farthest(m, phase, time, dx / distance, dy / distance)
        if abs(across) <= m.precision * room or right - left <= 1e-15:
            break
        if across < 0.0:
            left = phase
            below = across
            if side < 0:
                above *= 0.5
            side = -1
        else:
            right = phase
            above = across
            if side > 0:
                below *= 0.5
            side = 1
    if abs(across) > CLOSE * room or reach <= 0.5 * distance:  # with held speeds there may be a gap
        return OUT_OF_REACH
    if abs(m.piece_speed - m.from_speed - m.change) > CLOSE * (m.high - m.low) * time:  # too short for numbers
        return OUT_OF_REACH
    return distance / reach


def farthest(m: SpeedChange, phase: float, time: float, ux: float, uy: float) -> tuple[float, float]:
    """The farthest point in a direction, seen from that of the constant acceleration: across and along the unit vector u."""
    find_pieces(m, phase, time)
    cx, cy = effect(m, 0.0, time)
    x = -m.change / time * cx
    y = -m.change / time * cy
    t = 0.0
    for i in range(m.pieces):
        end = t + m.piece_time[i]
        if m.piece_level[i] != 0.0:
            ex, ey = effect(m, t, end)
            x += m.piece_level[i] * ex
            y += m.piece_level[i] * ey
        t = end
    return y * ux - x * uy, x * ux + y * uy


def effect(m: SpeedChange, begin: float, end: float) -> tuple[float, float]:
    """int exp(-p t) dt from begin to end: (exp(-p begin) - exp(-p end)) / p."""
    a = math.exp(m.pole_decay * begin)
    b = math.exp(m.pole_decay * end)
    re = a * math.cos(m.pole_frequency * begin) - b * math.cos(m.pole_frequency * end)
    im = b * math.sin(m.pole_frequency * end) - a * math.sin(m.pole_frequency * begin)
    size = m.pole_decay * m.pole_decay + m.pole_frequency * m.pole_frequency
    return (im * m.pole_frequency - re * m.pole_decay) / size, (-re * m.pole_frequency - im * m.pole_decay) / size


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


def blend(m: SpeedChange, time: float, share: float) -> None:
    """Blend the pieces with the constant acceleration."""
    level = m.change / time if time > 0.0 else 0.0
    if m.pieces == 0:
        add_piece(m, time, level)
    for i in range(m.pieces):
        m.piece_level[i] = level + share * (m.piece_level[i] - level)
