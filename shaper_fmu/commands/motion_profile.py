"""The motion profile: a rest-to-rest reference in closed form."""

from __future__ import annotations

from enum import IntEnum

from shaper_fmu.component import NO_EVENT, Component, Output, Parameter, time_tolerance
from shaper_fmu.profiles.cycloid import cycloid
from shaper_fmu.profiles.cycloid_versine_ramp import cycloid_versine_ramp
from shaper_fmu.profiles.two_part import two_part


class Profile(IntEnum):
    """Kinds of profiles; the numbers are those of the FMU's enumeration and never change."""

    step = 1
    cycloid = 3
    cycloid_versine_ramp = 5
    two_part = 6


class MotionProfile(Component):
    """A rest-to-rest reference: from 0 to `distance` in `duration`, beginning at `start_time`.

    step: at once, at start_time. cycloid: y = L (s/T - sin(2 pi s/T)/(2 pi)). cycloid_versine_ramp and two_part leave
    no residual vibration of a mode with `natural_frequency` and `damping_ratio` (Taskin, Kilic and Kapucu 2019; Kilic
    and Kapucu 2011); their velocity jumps at the ends, and in the middle of two_part. Where a position or velocity
    jumps, its derivative's impulse is not part of the velocity or acceleration output.
    """

    profile = Parameter(Profile.cycloid, "", "kind of profile")
    distance = Parameter(1.0, "m", "distance to move, negative for the other way")
    duration = Parameter(1.0, "s", "time from start to rest (a step needs none)", min=0.0, exclusive=True)
    start_time = Parameter(0.0, "s", "time at which the move begins")
    natural_frequency = Parameter(10.0, "rad/s", "undamped natural frequency of the mode to leave at rest", min=0.0, exclusive=True)
    damping_ratio = Parameter(0.0, "", "damping ratio of that mode", min=0.0, max=1.0, exclusive="max")
    position = Output("m", "reference position")
    velocity = Output("m/s", "reference velocity")
    acceleration = Output("m/s2", "reference acceleration")
    moving = Output("", "true from the start of the move to its end", start=False)
    next_event_time = Output("s", "time of the next jump of an output, 1e300 if none", start=NO_EVENT)

    def step(self, t, h):
        now = t + h
        tolerance = time_tolerance(t, h)
        span = 0.0 if self.profile == Profile.step else self.duration
        self.position = 0.0
        self.velocity = 0.0
        self.acceleration = 0.0
        self.moving = False
        if now < self.start_time - tolerance:
            self.next_event_time = self.start_time
        elif now >= self.start_time + span - tolerance:
            self.position = self.distance
            self.next_event_time = NO_EVENT
        else:
            self.moving = True
            self.next_event_time = self.start_time + span
            middle = self.start_time + 0.5 * span
            s = max(0.0, now - self.start_time)
            if self.profile == Profile.two_part:
                if now < middle - tolerance:
                    self.next_event_time = middle
                else:
                    s = max(0.5 * span, s)
            position, velocity, acceleration = unit_move(self, s)
            self.position = self.distance * position
            self.velocity = self.distance * velocity
            self.acceleration = self.distance * acceleration


def unit_move(m, s):
    """Position, velocity and acceleration over the unit distance, at s within the move."""
    if m.profile == Profile.cycloid:
        return cycloid(s, m.duration)
    if m.profile == Profile.cycloid_versine_ramp:
        return cycloid_versine_ramp(s, m.duration, m.natural_frequency, m.damping_ratio)
    return two_part(s, m.duration, m.natural_frequency, m.damping_ratio)
