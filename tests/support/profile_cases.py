"""What the tests of the profiles share: the beam of Ozokutan et al. 2025, and random profiles."""

from __future__ import annotations

import math
from itertools import pairwise

import numpy as np
from compiled_kernels import record_of
from hypothesis import strategies as st
from scipy.optimize import brentq

from shaper_fmu.commands.motion_profile import MotionProfile, ProfileKind
from shaper_fmu.component import NO_EVENT
from shaper_fmu.design.profiles import Profile, profile
from shaper_fmu.kinds.profiles import PROFILES

FREQUENCY = 22.048710
"""First mode of the beam of Ozokutan, Karadag, Kapucu and Kutuk 2025 [rad/s]."""
PERIOD = 2 * math.pi / FREQUENCY
FORMULAS = [kind for kind in ProfileKind if kind != ProfileKind.fastest]
"""The profiles that are formulas of their duration; that of segments has tests of its own."""
SMOOTH = [kind for kind in FORMULAS if kind != ProfileKind.step]

JUMPING = {
    ProfileKind[name] for name in ("cycloid_versine_ramp", "two_part", "ramp", "cycloid_ramp", "versine_ramp", "exponential")
}
"""Those whose velocity jumps: they keep no limit of the acceleration."""
BY_LIMITS = {kind for kind in SMOOTH if PROFILES[kind.name].ramp is not None}
"""Those whose form depends on the limits, too."""


def law_of(kind: ProfileKind, distance: float, duration: float, w: float, zeta: float, **limits: float) -> Profile:
    """A profile; where a mode must have a shorter period than the duration, it has."""
    least = PROFILES[kind.name].least is not None
    return profile(kind, distance, duration, max(w, 2.2 * math.pi / duration) if least else w, zeta, **limits)


laws = st.builds(
    law_of,
    st.sampled_from(SMOOTH),
    st.floats(0.01, 20.0) | st.floats(-20.0, -0.01),
    st.floats(0.3, 5.0),
    st.floats(5.0, 40.0),
    st.floats(0.0, 0.9),
)

W, ZETA, DISTANCE, DURATION, START = 22.9476, 0.0891, 0.4, 0.3, 0.1


def profile_at(times, **values):
    """Columns position, velocity, acceleration at these times, reached by one step each."""
    rows = []
    for t in times:
        component = MotionProfile(
            **{
                "distance": DISTANCE,
                "duration": DURATION,
                "start_time": START,
                "natural_frequency": W,
                "damping_ratio": ZETA,
                **values,
            }
        )
        component.initialize(0.0)
        component.do_step(0.0, t)
        rows.append((component.position, component.velocity, component.acceleration))
    return np.array(rows).T


def paper_cycloid_versine_ramp(s, distance, duration, w, zeta):
    """Taskin, Kilic and Kapucu 2019, part by part: ramp L1, cycloid L2, ramped versine L3."""
    rate = 2 * math.pi / duration
    r = rate / w
    cycloid, versine = distance * (1 - r**2), distance * 2 * zeta * r
    ramp = distance - cycloid - versine
    angle = rate * s
    return (ramp * angle + cycloid * (angle - np.sin(angle)) + versine * (angle + 1 - np.cos(angle))) / (2 * math.pi)


def events(component):
    """All event times that a component announces, stepping from each to the next, with a step of no length at each."""
    component.initialize(0.0)
    t, found = 0.0, []
    while component.next_event_time < NO_EVENT:
        found.append(component.next_event_time)
        component.do_step(t, component.next_event_time - t)
        t = found[-1]
        before = record_of(component)
        component.do_step(t, 0.0)
        assert record_of(component) == before
    return found


def pieces(law):
    return list(pairwise(law.pieces))


def root(function, low, high) -> float:
    return float(brentq(function, low, high, xtol=1e-14))  # pyright: ignore[reportArgumentType]
