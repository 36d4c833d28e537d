"""The fastest move that leaves no vibration: rest to rest within limits of speed, acceleration and jerk.

For a given duration all conditions are linear in the control, the acceleration or the jerk: the limits, rest and distance at the
end, and for each frequency of a band the residual vibration against a polygon. So the farthest move in that time is a linear
programme (shaper_fmu.design.moves.programme), and the shortest duration that reaches the distance is found by secants. Its
multipliers prove that no move is faster (certificate); the control's switches are then made exact by Newton's method (polish).
The deflection on the way is linear in the acceleration, too, and can be limited (deflection), with on/off commands alone (on_off).
"""

from __future__ import annotations

import json
import math
from collections.abc import Sequence
from dataclasses import asdict, dataclass
from functools import cached_property
from typing import Any

import numpy as np
from numpy.typing import ArrayLike

from shaper_fmu.analysis.vibration import relative_residual
from shaper_fmu.design.lp.layout import Band
from shaper_fmu.design.moves.control import Control
from shaper_fmu.design.moves.deflection import Deflection
from shaper_fmu.design.moves.on_off import on_off
from shaper_fmu.design.moves.polish import polished, with_ramps
from shaper_fmu.design.moves.problem import Mode, Problem
from shaper_fmu.design.moves.search import shortest_on_grid
from shaper_fmu.design.moves.task import Task
from shaper_fmu.errors import ArgumentError, NoSolutionError

MOST_PULSES = 12
"""Most on/off pulses in place of a held deflection."""

_WIDE = 1e-3
"""Share by which a move may be above its bound before a hard jerk is looked at from the move without a limit of it."""


@dataclass(frozen=True)
class Segment:
    """A part of a move with constant jerk: when it begins [s], how long it lasts [s], and the motion at its begin.

    position [m], velocity [m/s], acceleration [m/s2], jerk [m/s3].
    """

    start: float
    duration: float
    position: float
    velocity: float
    acceleration: float
    jerk: float


@dataclass(frozen=True)
class FastestMove:
    """A rest-to-rest move with few segments of constant acceleration, or constant jerk where the jerk is limited.

    Attributes:
        distance: distance moved [m], negative for the other way.
        max_velocity, max_acceleration, max_jerk: limits [m/s, m/s2, m/s3], infinite for none.
        modes: the bands of natural frequencies, with the residual V that is tolerated, 0 for a single frequency without any.
        lower_bound: it is proven that no move within the limits and tolerances is shorter [s].
        duration_with_vibration: duration of the fastest move within the limits, whatever vibrates [s].
        switch_times: where the control switches [s], from 0 to the end.
        controls: the acceleration [m/s2] between the switches, or the jerk [m/s3], if that is limited.
        deflection_limits: for each of the modes, the largest deflection from the base on the way [m], infinite for none.
    """

    distance: float
    max_velocity: float
    max_acceleration: float
    max_jerk: float
    modes: tuple[Band, ...]
    lower_bound: float
    duration_with_vibration: float
    switch_times: tuple[float, ...]
    controls: tuple[float, ...]
    deflection_limits: tuple[float, ...] = ()

    @property
    def duration(self) -> float:
        """Time from start to rest [s]."""
        return self.switch_times[-1]

    @property
    def order(self) -> int:
        """Which derivative of the position `controls` is: 2 for the acceleration, 3 for the jerk."""
        return 3 if math.isfinite(self.max_jerk) else 2

    @cached_property
    def _control(self) -> Control:
        return Control(np.array(self.switch_times), np.array(self.controls), self.order)

    @cached_property
    def segments(self) -> tuple[Segment, ...]:
        """The segments, in their order."""
        begins = self._control.times[:-1]
        position, velocity = self._control.state(0, begins), self._control.state(1, begins)
        values = self._control.values
        acceleration, jerk = (self._control.state(2, begins), values) if self.order == 3 else (values, np.zeros(len(values)))
        columns = (begins, np.diff(self._control.times), position, velocity, acceleration, jerk)
        return tuple(Segment(*row) for row in np.array(columns).T.tolist())

    def position(self, t: ArrayLike) -> np.ndarray:
        """Position [m] at the times t [s], exact."""
        return self._motion(t)[0]

    def velocity(self, t: ArrayLike) -> np.ndarray:
        """Velocity [m/s] at the times t [s], exact."""
        return self._motion(t)[1]

    def acceleration(self, t: ArrayLike) -> np.ndarray:
        """Acceleration [m/s2] at the times t [s], exact, from the right where it jumps."""
        return self._motion(t)[2]

    def _motion(self, t: ArrayLike) -> np.ndarray:
        times = np.asarray(t, dtype=float)
        table = np.array([[s.start, s.position, s.velocity, s.acceleration, s.jerk] for s in self.segments])
        which = np.clip(np.searchsorted(table[:, 0], times, side="right") - 1, 0, None)
        start, p, v, a, j = np.moveaxis(table[which], -1, 0)
        h = times - start
        moving = np.array([p + h * (v + h * (a / 2.0 + h * j / 6.0)), v + h * (a + h * j / 2.0), a + h * j])
        rest = np.array([self.distance, 0.0, 0.0]).reshape((3,) + (1,) * times.ndim)
        return np.where(times < 0.0, 0.0, np.where(times >= self.duration, rest, moving))

    @property
    def peak_velocity(self) -> float:
        """Largest speed [m/s]."""
        return self._largest(1, np.concatenate((self._control.times, self._control.turns())))

    @property
    def peak_acceleration(self) -> float:
        """Largest magnitude of the acceleration [m/s2]."""
        return self._largest(2, self._control.times) if self.order == 3 else max(map(abs, self.controls))

    @property
    def peak_jerk(self) -> float:
        """Largest magnitude of the jerk [m/s3], infinite where the acceleration jumps."""
        return max(map(abs, self.controls)) if self.order == 3 else math.inf

    def _largest(self, k: int, t: np.ndarray) -> float:
        return float(np.abs(self._control.state(k, t)).max())

    def residual_vibration(self, natural_frequency: float, damping_ratio: float = 0.0) -> float:
        """V on a mode [rad/s] at the end of the move, as that of a `Profile` (Singer and Seering 1990), in closed form."""
        _check_mode(natural_frequency, damping_ratio)
        return abs(self._control.residual(natural_frequency, damping_ratio) / self.distance)

    def relative_residual(self, natural_frequency: float, damping_ratio: float = 0.0) -> float:
        """Residual envelope over that of a step of the same distance at time 0, both at the same instant: V exp(zeta w T)."""
        return relative_residual(self, natural_frequency, damping_ratio)

    def peak_deflection(self, natural_frequency: float, damping_ratio: float = 0.0) -> float:
        """Largest |q| of a mode [rad/s] at any time [m], exact: q'' + 2 zeta w q' + w^2 q = -a, the deflection from the base."""
        _check_mode(natural_frequency, damping_ratio)
        return Deflection(natural_frequency, damping_ratio, math.inf).peak(self._control)

    @cached_property
    def residuals(self) -> tuple[float, ...]:
        """The largest V over each of the modes' bands."""
        found = []
        for band in self.modes:
            v = [self.residual_vibration(band.low, band.damping_ratio)]
            if band.high > band.low:
                v = self._control.peaks(band)[1] / abs(self.distance)
            found.append(float(max(v)))
        return tuple(found)

    def start_values(self) -> dict[str, Any]:
        """Start values with which the component MotionProfile makes this move."""
        from shaper_fmu.profiles.fastest import MOST_SEGMENTS  # what FMUs carry, which this package does not need otherwise

        if len(self.segments) > MOST_SEGMENTS:
            raise ArgumentError(f"the move has {len(self.segments)} segments; MotionProfile takes {MOST_SEGMENTS}")
        return {
            "profile": "fastest",
            "distance": self.distance,
            "segments": len(self.segments),
            "segment_end": list(self.switch_times[1:]),
            "segment_acceleration": [one.acceleration for one in self.segments],
            "segment_jerk": [one.jerk for one in self.segments],
        }

    def to_dict(self) -> dict[str, Any]:
        """All numbers, as JSON can hold them: a limit that is none is null."""
        limits = {name: getattr(self, name) for name in ("max_velocity", "max_acceleration", "max_jerk")}
        return {
            "distance": self.distance,
            "duration": self.duration,
            "lower_bound": self.lower_bound,
            "duration_with_vibration": self.duration_with_vibration,
            **{name: limit if math.isfinite(limit) else None for name, limit in limits.items()},
            "modes": [
                {**asdict(band), "residual": v, **self._deflection(k)}
                for k, (band, v) in enumerate(zip(self.modes, self.residuals, strict=True))
            ],
            "segments": [asdict(one) for one in self.segments],
        }

    def _deflection(self, k: int) -> dict[str, float]:
        """Limit and peak of the deflection of mode k, where it is limited."""
        if k >= len(self.deflection_limits) or math.isinf(self.deflection_limits[k]):
            return {}
        band = self.modes[k]
        peak = self.peak_deflection(band.low, band.damping_ratio)
        return {"deflection_limit": self.deflection_limits[k], "peak_deflection": peak}

    def to_json(self) -> str:
        """The text of `to_dict`, every number to its last digit."""
        return json.dumps(self.to_dict(), indent=2) + "\n"

    def to_csv(self) -> str:
        """The segments as a table: a line for each, numbers to their last digit, units in the header."""
        header = "start [s],duration [s],position [m],velocity [m/s],acceleration [m/s2],jerk [m/s3]"
        rows = [",".join(map(repr, asdict(one).values())) for one in self.segments]
        return "\n".join([header, *rows]) + "\n"


def _check_mode(natural_frequency: float, damping_ratio: float) -> None:
    if not natural_frequency > 0.0 or not 0.0 <= damping_ratio < 1.0:
        raise ArgumentError(f"a mode needs w > 0 and 0 <= zeta < 1, not w = {natural_frequency}, zeta = {damping_ratio}")


def fastest_move(
    distance: float,
    *,
    max_velocity: float = math.inf,
    max_acceleration: float = math.inf,
    max_jerk: float = math.inf,
    modes: Sequence[Mode] = (),
    tolerance: float = 0.0,
    deflection_limit: float | Sequence[float] = math.inf,
    on_off_pulses: int = 0,
) -> FastestMove:
    """The fastest move from rest to rest that leaves no vibration on the given modes, with the proof that none is faster.

    Args:
        distance: distance to move [m], negative for the other way.
        max_velocity, max_acceleration, max_jerk: limits [m/s, m/s2, m/s3]; one of the last two is needed.
        modes: natural frequencies [rad/s], pairs of frequency and damping ratio, or bands (`Band`) with tolerances of their own.
        tolerance: the residual V that is tolerated where a mode has none of its own; 0 for none at all.
        deflection_limit: the largest deflection of the modes from the base at any time [m], one for all or one for each of them;
            q'' + 2 zeta w q' + w^2 q = -a, so that q rests at -a/w^2. For modes of one frequency, without a limit of the jerk.
        on_off_pulses: where a deflection is held at its limit by an acceleration below its own limit, at most so many on/off
            pulses do it instead, so that the acceleration is always 0 or its limit; 0: it is held.

    The acceleration (with max_jerk the jerk) is constant between a few switches. `lower_bound` is proven by linear programming;
    the duration is above it by some 1e-4 at most places, and it is told. Raises ArgumentError for impossible arguments, and
    NoSolutionError where no exact switches are found.
    """
    if isinstance(on_off_pulses, bool) or not 0 <= on_off_pulses <= MOST_PULSES:
        raise ArgumentError(f"on_off_pulses = {on_off_pulses}: must be 0 (none) to {MOST_PULSES}")
    problem = Problem(distance, (max_velocity, max_acceleration, max_jerk), modes, tolerance, deflection_limit)
    if on_off_pulses and not problem.task.deflections:
        raise ArgumentError(f"on_off_pulses = {on_off_pulses}: this needs a deflection_limit")
    found = shortest_on_grid(problem.task)
    control, proven, unit = polished(problem.task, found.move), found.proven, problem.unit
    wide = control is None or control.duration > proven * (1.0 + _WIDE)
    if wide and problem.task.order == 3 and math.isfinite(problem.limits[1]):
        other, more = _by_ramps(problem.task)
        proven = max(proven, more)
        if other is not None and (control is None or other.duration < control.duration):
            control = other
    if control is None:
        raise NoSolutionError(
            f"no exact switches were found near the move of {found.move.control.duration * unit:.6g} s that a grid shows; "
            "tolerate a little vibration, or change a limit"
        )
    if on_off_pulses:
        control = _switched(problem.task, control, on_off_pulses)
    times = (control.times * unit).tolist()
    top = problem.limits[control.order - 1]
    values = (np.clip(control.values * (distance / unit**control.order), -top, top) + 0.0).tolist()  # no -0.0
    return FastestMove(
        float(distance), *problem.limits, problem.bands, float(proven * unit), unit, tuple(times), tuple(values),
        problem.deflection_limits,
    )  # fmt: skip


def _switched(task: Task, control: Control, most: int) -> Control:
    found = on_off(task, control, most)
    if found is None:
        raise NoSolutionError(
            f"no exact on/off switches were found with up to {most} pulses in place of each held deflection; "
            "permit more pulses (on_off_pulses) or a larger deflection_limit"
        )
    return found


def _by_ramps(task: Task) -> tuple[Control | None, float]:
    """The move with limited jerk from that whose acceleration jumps, for ramps that are too short for a grid; and the proven
    duration of the latter, below which there is none with one more limit."""
    jumping = Task((*task.limits[:2], math.inf), task.bands)
    found = shortest_on_grid(jumping)
    control = polished(jumping, found.move)
    return (with_ramps(task, control) if control is not None else None), found.proven


def shortest_move(
    distance: float,
    *,
    max_velocity: float = math.inf,
    max_acceleration: float = math.inf,
    max_jerk: float = math.inf,
    modes: Sequence[Mode] = (),
    tolerance: float = 0.0,
    deflection_limit: float | Sequence[float] = math.inf,
) -> float:
    """The proven lower bound [s] alone: no move is shorter. The arguments are those of `fastest_move`."""
    problem = Problem(distance, (max_velocity, max_acceleration, max_jerk), modes, tolerance, deflection_limit)
    return float(shortest_on_grid(problem.task).proven * problem.unit)
