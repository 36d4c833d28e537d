"""Fastest move: given segments of constant jerk, from rest to rest.

`fastest_move` (shaper_fmu/design/fastest.py) designs them so that the modes rest at the end and no move within the limits is
faster. The position is a polynomial in each segment, so that nothing depends on the communication step.
"""

from __future__ import annotations

import math

from shaper_fmu.profiles.limits import NO_LIMIT
from shaper_fmu.profiles.method import ProfileMethod
from shaper_fmu.profiles.workspace import SegmentWorkspace

MOST_SEGMENTS = 32

NO_SEGMENTS = 4
SEGMENT_ORDER = 5
SEGMENTS_MISS = 6
SEGMENTS_TOO_FAST = 7

SHARE = 1e-6
"""By how much segments may miss the distance and rest at its end, and exceed limits, as a share: they may be rounded numbers."""
JUMP = 1e-9
"""A change of the acceleration is a jump from this share of the largest one nearby on."""


def fastest(m: SegmentWorkspace, s: float) -> tuple[float, float, float]:
    """Position [-], velocity [1/s] and acceleration [1/s2] at s of the segments' move, over the distance that they make."""
    position, velocity, acceleration = segments_until(m, s)
    if s >= fastest_span(m):
        return 1.0, 0.0, 0.0
    length = segments_length(m)
    return position / length, velocity / length, acceleration / length


def segments_until(m: SegmentWorkspace, s: float) -> tuple[float, float, float]:
    """Position [m], velocity [m/s] and acceleration [m/s2] at s, from the right where it jumps."""
    position = 0.0
    velocity = 0.0
    acceleration = 0.0
    begin = 0.0
    for i in range(m.segments):
        if i > 0 and s < begin:
            break
        jerk = m.segment_jerk[i]
        h = min(s, m.segment_end[i]) - begin
        start = m.segment_acceleration[i]
        position += h * (velocity + h * (0.5 * start + h * jerk / 6.0))
        velocity += h * (start + 0.5 * h * jerk)
        acceleration = start + h * jerk
        begin = m.segment_end[i]
    return position, velocity, acceleration


def segments_length(m: SegmentWorkspace) -> float:
    """The distance that the segments make [m]."""
    position, _, _ = segments_until(m, fastest_span(m))
    return position


def fastest_span(m: SegmentWorkspace) -> float:
    """When the last segment ends [s]."""
    return m.segment_end[m.segments - 1] if m.segments > 0 else 0.0


def segment_peaks(m: SegmentWorkspace) -> tuple[float, float]:
    """Peak speed [m/s] and peak acceleration [m/s2] of the segments."""
    fastest_speed = 0.0
    largest = 0.0
    velocity = 0.0
    begin = 0.0
    for i in range(m.segments):
        h = m.segment_end[i] - begin
        start = m.segment_acceleration[i]
        jerk = m.segment_jerk[i]
        end = start + h * jerk
        largest = max(largest, abs(start), abs(end))
        if start * end < 0.0:
            turn = -start / jerk
            fastest_speed = max(fastest_speed, abs(velocity + turn * (start + 0.5 * turn * jerk)))
        velocity += h * (start + 0.5 * h * jerk)
        fastest_speed = max(fastest_speed, abs(velocity))
        begin = m.segment_end[i]
    return fastest_speed, largest


def fastest_peaks(m: SegmentWorkspace) -> tuple[float, float]:
    """Peak speed [1/s] and peak acceleration [1/s2] of the unit move."""
    speed, acceleration = segment_peaks(m)
    length = abs(segments_length(m))
    return speed / length, acceleration / length


def fastest_shortest(m: SegmentWorkspace, max_velocity: float, max_acceleration: float) -> tuple[float, float, float]:
    """0, since the segments tell the duration; a time that is not reached if they exceed the limits."""
    speed, acceleration = fastest_peaks(m)
    if speed > max_velocity * (1.0 + SHARE) or acceleration > max_acceleration * (1.0 + SHARE):
        return NO_LIMIT, 0.0, 0.0
    return 0.0, 0.0, 0.0


def segment_count(m: SegmentWorkspace) -> int:
    """How many ends of segments there can be within the move."""
    return max(0, m.segments - 1)


def jumps_after(m: SegmentWorkspace, i: int) -> bool:
    """Whether the acceleration jumps at the end of the i-th segment, which is not the last."""
    begin = m.segment_end[i - 1] if i > 0 else 0.0
    middle = m.segment_end[i]
    before = m.segment_acceleration[i] + m.segment_jerk[i] * (middle - begin)
    after = m.segment_acceleration[i + 1]
    last = after + m.segment_jerk[i + 1] * (m.segment_end[i + 1] - middle)
    return abs(after - before) > JUMP * max(abs(m.segment_acceleration[i]), abs(before), abs(after), abs(last))


def fastest_event(m: SegmentWorkspace, i: int, duration: float) -> float:
    """When the acceleration jumps at the end of the i-th segment [s], else the end of the move."""
    return m.segment_end[i] if i + 1 < m.segments and jumps_after(m, i) else duration


def fastest_kink(m: SegmentWorkspace, i: int, duration: float) -> float:
    """When the acceleration has a kink at the end of the i-th segment [s], else the end of the move."""
    return duration if i + 1 >= m.segments or jumps_after(m, i) else m.segment_end[i]


def fault_of_segments(m: SegmentWorkspace, distance: float) -> int:
    """A status of MotionProfile where the segments are none, or do not end at rest at the distance [m]; else 0."""
    if m.segments == 0:
        return NO_SEGMENTS
    begin = 0.0
    for i in range(m.segments):
        if not m.segment_end[i] > begin or not math.isfinite(m.segment_end[i]):
            return SEGMENT_ORDER
        begin = m.segment_end[i]
    position, velocity, _ = segments_until(m, begin)
    speed, _ = segment_peaks(m)
    if distance == 0.0 or abs(position - distance) > SHARE * abs(distance) or abs(velocity) > SHARE * speed:
        return SEGMENTS_MISS
    return 0


FASTEST = ProfileMethod(
    name="fastest",
    number=8,
    move=fastest,
    peaks=fastest_peaks,
    shortest=fastest_shortest,
    event=fastest_event,
    events=segment_count,
    kink=fastest_kink,
    kinks=segment_count,
    span=fastest_span,
    jumps_at_ends=True,
    summary="the fastest move that leaves no vibration, within limits of speed, acceleration and jerk: segments of constant "
    "acceleration or jerk, from `shaper-fmu design fastest` or `fastest_move`",
)
