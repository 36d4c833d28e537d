"""All profiles: the enumeration, and functions that dispatch to the profile of a kind; generated from the methods' records."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

from shaper_fmu.component import Component
from shaper_fmu.methods.discovery import find_methods
from shaper_fmu.methods.dispatch import module_text, run_text
from shaper_fmu.methods.record import Question
from shaper_fmu.profiles.method import ProfileMethod

_MODE = "natural_frequency, damping_ratio"
_QUESTIONS = (
    Question("unit_move", f"kind, m, s, duration, ramp, {_MODE}", "move", "0.0, 0.0, 0.0", "Position and derivatives at s."),
    Question("unit_peaks", f"kind, m, duration, ramp, {_MODE}", "peaks", "0.0, 0.0", "Peak speed and acceleration."),
    Question(
        "shortest_within",
        f"kind, m, max_velocity, max_acceleration, {_MODE}",
        "shortest",
        "0.0, 0.0, 0.0",
        "Shortest duration within limits, and the ends of a gap of forbidden longer ones.",
    ),
    Question(
        "ramp_time",
        f"kind, m, duration, max_velocity, max_acceleration, {_MODE}",
        "ramp",
        "0.0",
        "A time that the limits or the mode decide.",
    ),
    Question("least_duration", f"kind, m, {_MODE}", "least", "0.0", "What the duration must exceed."),
    Question("inner_event", "kind, m, i, duration, ramp", "event", "duration", "Time of the i-th jump within the move."),
    Question("inner_events", "kind, m", "events", "2", "How many of these there can be."),
    Question("inner_kink", "kind, m, i, duration, ramp", "kink", "duration", "Time of the i-th kink within the move."),
    Question("inner_kinks", "kind, m", "kinks", "4", "How many of these there can be."),
    Question("span_of", "kind, m, duration", "span", "duration", "What the move takes of the duration."),
    Question("cruise_time", "kind, m, duration, ramp", "cruise_time", "0.0", "Distance over cruise speed, 0 without cruise."),
)
_HOST = (("shaper_fmu.commands.motion_profile",), Component)
_found = find_methods("shaper_fmu.profiles", "shaper_fmu.profiles", ProfileMethod, _QUESTIONS, _HOST)

PROFILES = {one.record.name: one.record for one in _found}
"""The methods' records by name, by rising number."""
_jumping = [
    name
    for name, record in PROFILES.items()
    if record.jumps_at_start or (record.jumps_at_ends and record.span is None and record.event is None)
]
PACKED_SOURCE = module_text(
    "ProfileKind",
    {},
    _found,
    _QUESTIONS,
    {"LIST": ";\n    ".join(record.item for record in PROFILES.values()), "JUMPING": ", ".join(_jumping)},
)
"""What this module becomes, and is in an FMU that carries Python."""
run_text(PACKED_SOURCE, globals())

if TYPE_CHECKING:
    from collections.abc import Mapping
    from enum import IntEnum
    from typing import Any

    from shaper_fmu.component import Variable

    class ProfileKind(IntEnum):
        step = 1
        trapezoid = 2
        cycloid = 3
        polynomial_345 = 4
        cycloid_versine_ramp = 5
        two_part = 6
        s_curve = 7
        fastest = 8
        ramp = 9
        cycloid_ramp = 10
        versine_ramp = 11
        cycloid_cruise = 12
        constant_acceleration = 13
        trapezoidal_acceleration = 14
        exponential = 15
        s_curve_modes = 16

    PARAMETERS: Mapping[str, Variable[Any]]
    FURTHER_PARAMETERS: Mapping[str, Variable[Any]]
    LIST: str
    JUMPING: str
    Three = tuple[float, float, float]

    def unit_move(
        kind: int, m: Any, s: float, duration: float, ramp: float, natural_frequency: float, damping_ratio: float
    ) -> Three: ...

    def unit_peaks(
        kind: int, m: Any, duration: float, ramp: float, natural_frequency: float, damping_ratio: float
    ) -> tuple[float, float]: ...

    def shortest_within(
        kind: int, m: Any, max_velocity: float, max_acceleration: float, natural_frequency: float, damping_ratio: float
    ) -> Three: ...

    def ramp_time(
        kind: int,
        m: Any,
        duration: float,
        max_velocity: float,
        max_acceleration: float,
        natural_frequency: float,
        damping_ratio: float,
    ) -> float: ...

    def least_duration(kind: int, m: Any, natural_frequency: float, damping_ratio: float) -> float: ...

    def inner_event(kind: int, m: Any, i: int, duration: float, ramp: float) -> float: ...

    def inner_events(kind: int, m: Any) -> int: ...

    def inner_kink(kind: int, m: Any, i: int, duration: float, ramp: float) -> float: ...

    def inner_kinks(kind: int, m: Any) -> int: ...

    def span_of(kind: int, m: Any, duration: float) -> float: ...

    def cruise_time(kind: int, m: Any, duration: float, ramp: float) -> float: ...
