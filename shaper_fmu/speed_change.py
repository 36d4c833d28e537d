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

from shaper_fmu.speed_pieces import CLOSE, HALF_SWINGS, SECANTS, STEPS, SpeedChange, add_piece, find_pieces

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


def blend(m: SpeedChange, time: float, share: float) -> None:
    """Blend the pieces with the constant acceleration."""
    level = m.change / time if time > 0.0 else 0.0
    if m.pieces == 0:
        add_piece(m, time, level)
    for i in range(m.pieces):
        m.piece_level[i] = level + share * (m.piece_level[i] - level)
