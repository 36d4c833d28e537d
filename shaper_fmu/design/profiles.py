"""Motion profiles as Python objects: the results of `profile` and the arguments of analysis."""

from __future__ import annotations

import math
import re
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from functools import cached_property, lru_cache
from itertools import pairwise
from types import SimpleNamespace
from typing import Any

import numpy as np
from numpy.typing import ArrayLike

from shaper_fmu.analysis.vibration import relative_residual
from shaper_fmu.commands.motion_profile import MotionProfile
from shaper_fmu.errors import ArgumentError, ComponentError, nearest
from shaper_fmu.kinds.profiles import (
    FURTHER_PARAMETERS,
    PARAMETERS,
    PROFILES,
    ProfileKind,
    cruise_time,
    inner_event,
    inner_events,
    inner_kink,
    inner_kinks,
    span_of,
    unit_move,
    unit_peaks,
)  # fmt: skip
from shaper_fmu.profiles.limits import NO_LIMIT

_NODES, _WEIGHTS = (values.tolist() for values in np.polynomial.legendre.leggauss(24))
_REST = 1e-6  # share of the peak acceleration below which a fastest move begins and ends at rest
_PANEL = 2.0  # radians of the fastest oscillation, and nepers of the decay, per panel of the quadrature

SEGMENTS = ("segments", "segment_end", "segment_acceleration", "segment_jerk")
OPTIONS = {**PARAMETERS, **FURTHER_PARAMETERS, **{name: MotionProfile.variables[name] for name in SEGMENTS}}
"""The profiles' own parameters, by name."""


@dataclass(frozen=True, repr=False)
class Profile:
    """A rest-to-rest motion from 0 to `distance`, as the component MotionProfile gives it from time 0 on.

    Attributes:
        kind: the profile.
        distance: distance moved [m].
        duration: time from start to rest [s], 0 for a step.
        natural_frequency: undamped natural frequency of the mode that the profile leaves at rest, where it does [rad/s].
        damping_ratio: damping ratio of that mode.
        max_velocity, max_acceleration: limits [m/s, m/s2], 1e300 for none.
        shortest_duration: shortest duration that the limits permit [s], 0 without limits.
        ramp: time of a trapezoid's ramp, a pulse of acceleration or an S-curve's segment [s], 0 for the others.
        parameters: the profiles' own parameters, names and values.
    """

    kind: ProfileKind
    distance: float
    duration: float
    natural_frequency: float
    damping_ratio: float
    max_velocity: float
    max_acceleration: float
    shortest_duration: float
    ramp: float
    parameters: tuple[tuple[str, float | tuple[float, ...]], ...] = ()

    def start_values(self) -> dict[str, Any]:
        """Start values with which the component MotionProfile makes this motion; what is its default is left out."""
        names = ("distance", "duration", "natural_frequency", "damping_ratio", "max_velocity", "max_acceleration")
        values = {name: getattr(self, name) for name in names} | dict(self.parameters)
        given = {name: list(value) if isinstance(value, tuple) else value for name, value in values.items()}
        if not self.duration:  # of a step, which has none
            given.pop("duration")
        changed = {name: value for name, value in given.items() if value != _start(name)}
        return {"profile": self.kind.name, **changed}

    @cached_property
    def _record(self) -> SimpleNamespace:
        return SimpleNamespace(**dict(self.parameters))

    def _unit(self, s: float) -> tuple[float, float, float]:
        return unit_move(self.kind, self._record, s, self.duration, self.ramp, self.natural_frequency, self.damping_ratio)

    def _sampled(self, t: ArrayLike, which: int, after: float) -> np.ndarray:
        times = np.asarray(t, dtype=float)
        values = np.where(times >= self.duration, after, 0.0)
        inside = (times >= 0.0) & (times < self.duration)
        values[inside] = [self._unit(s)[which] for s in times[inside].tolist()]
        return self.distance * values

    def position(self, t: ArrayLike) -> np.ndarray:
        """Position [m] at the times t [s], from the right where it jumps."""
        return self._sampled(t, 0, 1.0)

    def velocity(self, t: ArrayLike) -> np.ndarray:
        """Velocity [m/s] at the times t [s], from the right where it jumps."""
        return self._sampled(t, 1, 0.0)

    def acceleration(self, t: ArrayLike) -> np.ndarray:
        """Acceleration [m/s2] at the times t [s], from the right where it jumps."""
        return self._sampled(t, 2, 0.0)

    @property
    def jumps(self) -> tuple[float, ...]:
        """Times at which position, velocity or acceleration jumps [s], rising."""
        method = PROFILES[self.kind.name]
        ends = {0.0, self.duration} if method.jumps_at_ends else {0.0} if method.jumps_at_start else set()
        if self.kind == ProfileKind.fastest:
            ends = {t for t in ends if abs(self._unit(min(t, math.nextafter(self.duration, 0.0)))[2]) > _REST * self._peak(1)}
        count = inner_events(self.kind, self._record)
        inner = {inner_event(self.kind, self._record, i, self.duration, self.ramp) for i in range(count)} - {self.duration}
        return tuple(sorted(ends | inner))

    @property
    def pieces(self) -> tuple[float, ...]:
        """Ends of the pieces on which the motion is smooth [s], rising."""
        count = inner_kinks(self.kind, self._record)
        kinks = {inner_kink(self.kind, self._record, i, self.duration, self.ramp) for i in range(count)}
        return tuple(sorted({0.0, *self.jumps, *kinks, self.duration}))

    @property
    def peak_velocity(self) -> float:
        """Largest speed [m/s], infinite for a step."""
        return self._peak(0)

    @property
    def peak_acceleration(self) -> float:
        """Largest magnitude of the acceleration [m/s2], infinite where the velocity jumps."""
        return self._peak(1)

    def _peak(self, which: int) -> float:
        if self.distance == 0.0:
            return 0.0
        found = unit_peaks(self.kind, self._record, self.duration, self.ramp, self.natural_frequency, self.damping_ratio)
        return abs(self.distance) * found[which]

    def residual_vibration(self, natural_frequency: float, damping_ratio: float = 0.0) -> float:
        """V on a mode [rad/s]: residual envelope at the end of the move over that of a step of its distance, at time 0.

        V = |integral_0^T y' exp(p (T - t)) dt| / L with p = -zeta w + j w sqrt(1 - zeta^2) (Singer and Seering 1990), by
        Gauss-Legendre quadrature on the smooth pieces, exact to rounding.
        """
        if not natural_frequency > 0.0 or not 0.0 <= damping_ratio < 1.0:
            raise ArgumentError(f"a mode needs w > 0 and 0 <= zeta < 1, not w = {natural_frequency}, zeta = {damping_ratio}")
        if self.duration == 0.0:
            return 1.0
        pole = natural_frequency * complex(-damping_ratio, math.sqrt(1.0 - damping_ratio * damping_ratio))
        times, moves = self._quadrature(natural_frequency)
        return float(abs(np.sum(moves * np.exp(pole * (self.duration - times)))))

    def relative_residual(self, natural_frequency: float, damping_ratio: float = 0.0) -> float:
        """Residual envelope over that of a step of the same distance at time 0, both at the same instant: V exp(zeta w T)."""
        return relative_residual(self, natural_frequency, damping_ratio)

    def _quadrature(self, natural_frequency: float) -> tuple[np.ndarray, np.ndarray]:
        """Nodes [s] and the unit move's velocity times the weights there; the same ones for neighbouring frequencies."""
        lengths = [end - begin for begin, end in pairwise(self.pieces)]
        wanted = [max(4, math.ceil(natural_frequency * length / _PANEL)) for length in lengths]
        return _nodes(self, tuple(1 << (panels - 1).bit_length() for panels in wanted))

    @cached_property
    def cruise_velocity(self) -> float:
        """Speed between acceleration and deceleration of a trapezoid or S-curve [m/s], else 0.

        An S-curve with segments shorter than about 0.24 Tn gets faster than this within them.
        """
        time = cruise_time(self.kind, self._record, self.duration, self.ramp)
        return abs(self.distance) / time if time > 0.0 else 0.0

    def plot(self, axes: Any = None) -> Any:
        """Draw position, velocity and acceleration over time; see `Results.plot` for axes, what is returned, and errors."""
        from shaper_fmu.design.figures import move_figures
        from shaper_fmu.notebook.plots import plot

        return plot(move_figures(self.kind.name, self), axes)

    def __repr__(self) -> str:
        return f"<Profile {self.kind.name}: {self.distance:g} m in {self.duration:.6g} s>"

    def _repr_html_(self) -> str:
        from shaper_fmu.notebook.html import page
        from shaper_fmu.notebook.texts import limit, listed

        facts = {
            "distance": f"{self.distance:g} m",
            "duration": f"{self.duration:.9g} s",
            "shortest within the limits": f"{self.shortest_duration:.9g} s" if self.shortest_duration else "",
            "largest speed": f"{self.peak_velocity:.6g} m/s, limit: {limit(self.max_velocity, 'm/s', NO_LIMIT)}",
            "largest acceleration": f"{self.peak_acceleration:.6g} m/s2, limit: {limit(self.max_acceleration, 'm/s2', NO_LIMIT)}",
            "jumps at": listed([f"{t:.6g} s" for t in self.jumps]) or "none",
        }
        return page(f"Profile {self.kind.name}", facts)


@lru_cache(maxsize=64)
def _nodes(law: Profile, panels: tuple[int, ...]) -> tuple[np.ndarray, np.ndarray]:
    """Gauss-Legendre nodes [s] of all pieces, and the unit move's velocity times the weights there."""
    nodes, moves = [], []
    for (begin, end), count in zip(pairwise(law.pieces), panels, strict=True):
        width = (end - begin) / count
        for i in range(count):
            for node, weight in zip(_NODES, _WEIGHTS, strict=True):
                nodes.append(begin + width * (i + 0.5 + 0.5 * node))
                moves.append(0.5 * width * weight * law._unit(nodes[-1])[1])
    return np.array(nodes), np.array(moves)


def profile(
    kind: ProfileKind | str | int,
    distance: float,
    duration: float | None = None,
    natural_frequency: float = 10.0,
    damping_ratio: float = 0.0,
    max_velocity: float = NO_LIMIT,
    max_acceleration: float = NO_LIMIT,
    max_jerk: float = NO_LIMIT,
    **parameters: float | Sequence[float],
) -> Profile:
    """The motion of a kind over a distance [m] in a duration [s]; without one, in the shortest that the limits permit.

    natural_frequency [rad/s] and damping_ratio are those of the mode that the profile shall leave at rest, where it can.
    Limits in m/s and m/s2; `parameters` are those that the profiles declare. Raises ArgumentError for impossible input; it names
    the shortest possible duration. The kind "fastest" takes the time that it needs, and max_jerk [m/s3], which no other kind keeps;
    it is designed by `fastest_move`, unless segments are given.
    """
    if kind in ("fastest", ProfileKind.fastest):
        limits = {"max_velocity": max_velocity, "max_acceleration": max_acceleration, "max_jerk": max_jerk}
        parameters |= _segments(distance, duration, (natural_frequency, damping_ratio), limits, parameters)
        duration = 1.0  # its segments tell how long it takes
    elif max_jerk < NO_LIMIT:
        raise ArgumentError(f"max_jerk = {max_jerk} m/s3: only the profile fastest keeps a limit of the jerk")
    for name in parameters:
        if name not in OPTIONS:
            raise ArgumentError(f"a profile has no parameter {name!r}.{nearest(name, OPTIONS)}")
    component = MotionProfile(
        profile=kind,
        distance=distance,
        duration=math.inf if duration is None else duration,
        natural_frequency=natural_frequency,
        damping_ratio=damping_ratio,
        max_velocity=min(max_velocity, NO_LIMIT),
        max_acceleration=min(max_acceleration, NO_LIMIT),
        **parameters,
    )
    if duration is None:
        component.duration = _shortest(component)
    try:
        component.initialize()
    except ComponentError as error:  # the FMU's words; its number for no limit is none of the caller's
        raise type(error)(re.sub(r"1e\+300 [\w/]+", "no limit", str(error))) from None
    given = {name: getattr(component, name) for name in Profile.__dataclass_fields__ if name in MotionProfile.variables}
    span = span_of(component.profile, component, component.duration)
    own = tuple((name, _kept(getattr(component, name))) for name in OPTIONS)
    return Profile(**{**given, "kind": ProfileKind(component.profile), "duration": span, "parameters": own})


def _segments(
    distance: float,
    duration: float | None,
    mode: tuple[float, float],
    limits: Mapping[str, float],
    given: Mapping[str, object],
) -> dict[str, Any]:
    """The segments of the fastest move for one mode, none if they are given."""
    if duration is not None:
        raise ArgumentError(f"duration = {duration} s: the fastest move takes the time that it needs; leave the duration out")
    if "segments" in given:
        return {}
    from shaper_fmu.design.fastest import fastest_move  # takes long to load, and is needed here alone

    speed, acceleration = limits["max_velocity"], limits["max_acceleration"]
    values = fastest_move(
        distance, max_velocity=speed, max_acceleration=acceleration, max_jerk=limits["max_jerk"], modes=[mode]
    ).start_values()
    return {name: values[name] for name in SEGMENTS}


def _start(name: str) -> Any:
    """A parameter's start value in MotionProfile."""
    variable = MotionProfile.variables[name]
    return variable.starts[0] if variable.size is None else list(variable.starts)


def _kept(value: float | Sequence[float]) -> float | tuple[float, ...]:
    return tuple(value) if isinstance(value, Sequence) else value


def _shortest(component: MotionProfile) -> float:
    """The shortest duration [s] that the component's limits permit; any positive number for a step."""
    component.duration = NO_LIMIT
    component.initialize()
    if component.shortest_duration == 0.0 and span_of(component.profile, component, 1.0) > 0.0:
        if component.distance == 0.0:
            raise ArgumentError("a move over no distance has no shortest duration; give a duration")
        raise ArgumentError("without max_velocity and max_acceleration there is no shortest duration; give them, or a duration")
    return component.shortest_duration or 1.0
