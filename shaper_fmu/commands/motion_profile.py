"""The motion profile: a rest-to-rest reference in closed form."""

from __future__ import annotations

from typing import ClassVar

from shaper_fmu.component import NO_EVENT, Calculated, Component, Output, Parameter, State, Variable, time_tolerance
from shaper_fmu.kinds.profiles import (
    FURTHER_PARAMETERS,
    JUMPING,
    LIST,
    PARAMETERS,
    ProfileKind,
    inner_event,
    inner_events,
    inner_kink,
    inner_kinks,
    least_duration,
    ramp_time,
    shortest_within,
    span_of,
    unit_move,
)
from shaper_fmu.methods.record import declare
from shaper_fmu.profiles.fastest import (
    MOST_SEGMENTS,
    NO_SEGMENTS,
    SEGMENT_ORDER,
    SEGMENTS_MISS,
    SEGMENTS_TOO_FAST,
    fault_of_segments,
)
from shaper_fmu.profiles.limits import NO_LIMIT, unit_limit
from shaper_fmu.profiles.workspace import SegmentWorkspace

TOO_SHORT = 1
NEVER = 2
IN_GAP = 3
BELOW_PERIOD = 8

BEFORE = 1.0 - 2.0**-53
"""Factor that gives the number before a positive one, on the left of an event."""


class MotionProfile(SegmentWorkspace):
    __doc__ = f"""A rest-to-rest reference: from 0 to `distance` in exactly `duration`, beginning at `start_time`.

    {LIST}.

    No profile exceeds max_velocity and max_acceleration: a duration that is too short for them is an error, which names
    the shortest possible one. Where a velocity jumps, no acceleration limit can be kept, nor any limit by a step. Where a
    position or velocity jumps, its derivative's impulse is not part of the velocity or acceleration output.
    """

    messages: ClassVar[dict[int, str]] = {
        TOO_SHORT: "duration = {duration} s is too short to move {distance} m within max_velocity = {max_velocity} m/s and "
        "max_acceleration = {max_acceleration} m/s2; the shortest possible duration is {possible_duration} s",
        NEVER: "no duration is long enough for max_velocity = {max_velocity} m/s and max_acceleration = {max_acceleration} m/s2: "
        f"a step keeps to no limit, and where the velocity jumps ({JUMPING}) no acceleration limit is kept",
        IN_GAP: "with duration = {duration} s the profile exceeds max_velocity = {max_velocity} m/s; the shortest possible "
        "duration is {shortest_duration} s, but its speed rises again, and longer ones are possible from {possible_duration} s on",
        BELOW_PERIOD: "duration = {duration} s is too short: this profile leaves the mode at rest only if it takes longer than "
        "{possible_duration} s",
        NO_SEGMENTS: "the profile fastest is made of segments, and there are none: `shaper-fmu design fastest` and fastest_move "
        "design them for a mode and limits",
        SEGMENT_ORDER: "segment_end must rise from 0 over its first {segments} elements",
        SEGMENTS_MISS: "the {segments} segments do not end at rest at distance = {distance} m within a millionth of it; "
        "give the numbers as they were designed",
        SEGMENTS_TOO_FAST: "the {segments} segments exceed max_velocity = {max_velocity} m/s or max_acceleration = "
        "{max_acceleration} m/s2; design them for these limits",
    }

    continuous_states: ClassVar[tuple[str, ...] | None] = ()
    terminals: ClassVar[dict[str, dict[str, str]]] = {
        "command": {"position": "position", "velocity": "velocity", "acceleration": "acceleration"},
    }

    profile: Variable[int] = Parameter(ProfileKind.cycloid, "", "kind of profile")
    distance: Variable[float] = Parameter(1.0, "m", "distance to move, negative for the other way")
    duration: Variable[float] = Parameter(
        1.0, "s", "time from start to rest (a step needs none)", min=0.0, exclusive=True, published=(1e-9, None)
    )
    start_time: Variable[float] = Parameter(0.0, "s", "time at which the move begins")
    natural_frequency: Variable[float] = Parameter(
        10.0, "rad/s", "undamped natural frequency of the mode to leave at rest", min=0.0, exclusive=True, published=(1e-9, None)
    )
    damping_ratio: Variable[float] = Parameter(
        0.0, "", "damping ratio of that mode", min=0.0, max=1.0, exclusive="max", published=(0.0, 0.999)
    )
    max_velocity: Variable[float] = Parameter(
        NO_LIMIT, "m/s", "speed never to be exceeded, 1e300 for no limit", min=0.0, exclusive=True, published=(None, None)
    )
    max_acceleration: Variable[float] = Parameter(
        NO_LIMIT, "m/s2", "acceleration never to be exceeded, 1e300 for no limit", min=0.0, exclusive=True, published=(None, None)
    )
    declare(locals(), PARAMETERS)
    segments: Variable[int] = Parameter(0, "", "number of segments of the profile fastest", min=0, max=MOST_SEGMENTS)
    segment_end: Variable[list[float]] = Parameter(
        0.0, "s", "time since the start at which each segment ends", size=MOST_SEGMENTS, min=0.0
    )
    segment_acceleration: Variable[list[float]] = Parameter(
        0.0, "m/s2", "acceleration at the begin of each segment", size=MOST_SEGMENTS
    )
    segment_jerk: Variable[list[float]] = Parameter(0.0, "m/s3", "jerk in each segment", size=MOST_SEGMENTS)
    shortest_duration: Variable[float] = Calculated("s", "shortest duration that the limits permit, 0 without limits")
    position: Variable[float] = Output("m", "reference position", derivative="velocity")
    velocity: Variable[float] = Output("m/s", "reference velocity", derivative="acceleration")
    acceleration: Variable[float] = Output("m/s2", "reference acceleration")
    moving: Variable[bool] = Output("", "true from the start of the move to its end", start=False)
    next_event_time: Variable[float] = Output("s", "time of the next jump of an output, 1e300 if none", start=NO_EVENT)

    next_kink_time: Variable[float] = State(NO_EVENT)
    ramp: Variable[float] = State(0.0)
    possible_duration: Variable[float] = State(0.0)
    declare(locals(), FURTHER_PARAMETERS)

    def start(self) -> int:
        if self.profile == ProfileKind.fastest:
            fault = fault_of_segments(self, self.distance)
            if fault:
                return fault
        velocity = unit_limit(self.max_velocity, self.distance)
        acceleration = unit_limit(self.max_acceleration, self.distance)
        shortest, gap_start, gap_end = shortest_duration(
            self.profile, self, velocity, acceleration, self.natural_frequency, self.damping_ratio
        )
        self.shortest_duration = shortest
        if shortest >= NO_LIMIT:
            return SEGMENTS_TOO_FAST if self.profile == ProfileKind.fastest else NEVER
        self.possible_duration = rounded_up(shortest)
        if self.duration < shortest:
            return TOO_SHORT
        if gap_start < self.duration < gap_end:
            self.possible_duration = rounded_up(gap_end)
            return IN_GAP
        self.possible_duration = least_duration(self.profile, self, self.natural_frequency, self.damping_ratio)
        if self.duration <= self.possible_duration:
            return BELOW_PERIOD
        self.ramp = ramp_time(self.profile, self, self.duration, velocity, acceleration, self.natural_frequency, self.damping_ratio)
        return 0

    def step(self, t: float, h: float) -> None:
        now = t + h
        tolerance = time_tolerance(self, t, h)
        span = span_of(self.profile, self, self.duration)
        self.position = 0.0
        self.velocity = 0.0
        self.acceleration = 0.0
        self.moving = False
        self.next_kink_time = NO_EVENT
        if now < self.start_time - tolerance:
            self.next_event_time = self.start_time
        elif now >= self.start_time + span - tolerance:
            self.position = self.distance
            self.next_event_time = NO_EVENT
        else:
            self.moving = True
            self.next_event_time = self.start_time + span
            s = max(0.0, min(span, now - self.start_time))
            for i in range(inner_events(self.profile, self)):
                event = inner_event(self.profile, self, i, span, self.ramp)
                if now >= self.start_time + event - tolerance:
                    s = max(s, event)
                else:
                    self.next_event_time = min(self.next_event_time, self.start_time + event)
                    s = min(s, event * BEFORE)
            s = min(s, span * BEFORE)
            for i in range(inner_kinks(self.profile, self)):
                kink = self.start_time + inner_kink(self.profile, self, i, span, self.ramp)
                if now < kink - tolerance:
                    self.next_kink_time = min(self.next_kink_time, kink)
            position, velocity, acceleration = unit_move(
                self.profile, self, s, self.duration, self.ramp, self.natural_frequency, self.damping_ratio
            )
            self.position = self.distance * position
            self.velocity = self.distance * velocity
            self.acceleration = self.distance * acceleration


def shortest_duration(
    kind: int, m: Component, max_velocity: float, max_acceleration: float, natural_frequency: float, damping_ratio: float
) -> tuple[float, float, float]:
    """Shortest duration [s] for limits of the unit move [1/s, 1/s2], and the ends of a gap of forbidden longer ones [s].

    0 without limits; NO_LIMIT if no duration will do: a step breaks any limit, a jump of the velocity any of the acceleration.
    """
    if max_velocity >= NO_LIMIT and max_acceleration >= NO_LIMIT:
        return 0.0, 0.0, 0.0
    return shortest_within(kind, m, max_velocity, max_acceleration, natural_frequency, damping_ratio)


def rounded_up(duration: float) -> float:
    """A duration [s] rounded up to nine digits, as many as messages show: so what they name is permitted."""
    if duration <= 0.0:
        return 0.0
    scale = 1.0
    while duration * scale < 1e8:
        scale *= 10.0
    while duration * scale >= 1e9:
        scale *= 0.1
    digits = int(duration * scale)
    if digits / scale < duration:
        digits += 1
    return digits / scale
