"""PD gains and an input shaper for a mass, designed at once or one after the other.

After Kenison and Singhose 2002, "Concurrent design of input shaping and proportional plus derivative feedback control": its title
and task were at hand, not its equations. A mass m follows the shaped reference r by F = Kp (r - x) - Kd x', as
PositionController does. For the nominal mass, w = sqrt(Kp/m) and zeta = Kd/(2 sqrt(Kp m)); over the time w t everything
depends on zeta, the shaper and the mass ratio alone, and F is proportional to Kp. So the largest Kp within the limit of the
force follows for each zeta, and the fastest design is a search over zeta for each shaper.

One after the other, the gains are those that settle a step first within the same limits; then the shaper is chosen. Its first
impulse takes a part of the step, so that the force is not used up; gains and shaper that are chosen together use it.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np

from shaper_fmu.design.impulse_sequence import ImpulseSequence
from shaper_fmu.design.shapers import shaper
from shaper_fmu.errors import ArgumentError, ComponentError, NoSolutionError

SHAPERS = ("none", "zv", "zvd")
_MASSES = 7
_STEP, _AFTER = 0.02, 15.0
"""Of the scaled time w t: the step, and how long after the last impulse settling is looked for."""
_RATIOS, _SCANS = 31, 3
_HIGHEST = 1.2
_ROOM = 0.02
"""Share of the tolerance kept free: the fastest design has a swing that just touches the band, and would leave it for anything."""


@dataclass(frozen=True)
class PdDesign:
    """Gains and a shaper for a mass.

    Attributes:
        proportional_gain, derivative_gain: [N/m, N.s/m].
        natural_frequency, damping_ratio: of the closed loop with the nominal mass; the shaper is designed for them [rad/s].
        shaper: its name, "none" for a step.
        sequence: its impulses.
        settling_time: after which the position stays within the tolerance, the longest over the range of masses [s].
        nominal_settling_time: with the nominal mass [s].
        peak_force: the largest magnitude over the range of masses [N].
        overshoot: the largest over the range of masses, as a share of the distance.
    """

    proportional_gain: float
    derivative_gain: float
    natural_frequency: float
    damping_ratio: float
    shaper: str
    sequence: ImpulseSequence
    settling_time: float
    nominal_settling_time: float
    peak_force: float
    overshoot: float

    def start_values(self, controller: str = "controller", shaper: str = "shaper") -> dict[str, Any]:
        """Start values of a PositionController and an InputShaper in a system, by the instances' names."""
        return {
            f"{controller}.proportional_gain": self.proportional_gain,
            f"{controller}.derivative_gain": self.derivative_gain,
            f"{shaper}.shaper": self.shaper,
            f"{shaper}.natural_frequency": [self.natural_frequency],
            f"{shaper}.damping_ratio": [self.damping_ratio],
        }


@dataclass(frozen=True)
class _Seen:
    """A design in scaled time: settling (longest, nominal), largest force over Kp L, overshoot."""

    settling: float
    nominal: float
    force: float
    overshoot: float


def design_pd_and_shaper(
    mass: float,
    distance: float,
    max_force: float,
    *,
    mass_range: tuple[float, float] | None = None,
    tolerance: float = 0.02,
    max_overshoot: float = 0.05,
    shapers: Sequence[str] = SHAPERS,
    min_damping_ratio: float = 0.0,
    concurrent: bool = True,
) -> PdDesign:
    """The PD gains and the shaper with which a mass settles first after a step of the reference.

    Args:
        mass: nominal mass [kg].
        distance: of the step [m].
        max_force: never to be exceeded [N].
        mass_range: lowest and highest mass; the settling time is the longest over it, the limits hold for all [kg].
        tolerance: share of the distance within which the position must stay.
        max_overshoot: as a share of the distance.
        shapers: names that are tried, "none" for none.
        min_damping_ratio: of the closed loop with the nominal mass, against disturbances, which a shaper does not see.
        concurrent: False designs the gains for a step first, and chooses the shaper for them.

    Raises ArgumentError for impossible arguments, NoSolutionError where nothing settles within the limits.
    """
    _check(mass, distance, max_force, mass_range, tolerance, max_overshoot, shapers, min_damping_ratio)
    low, high = mass_range or (mass, mass)
    masses = np.unique([mass, *np.linspace(low, high, _MASSES)]) / mass
    task = _Task(masses, tolerance * (1.0 - _ROOM), max_overshoot)
    scale = mass * abs(distance) / max_force

    def best(names: Sequence[str], ratios: tuple[float, float]) -> tuple[str, float]:
        found = {name: task.fastest(name, *ratios) for name in names}
        name = min(found, key=lambda one: found[one][0])
        if not math.isfinite(found[name][0]):
            raise NoSolutionError(
                "nothing settles within the limits over this range of masses; allow more overshoot, or a wider band"
            )
        return name, found[name][1]

    if concurrent:
        name, ratio = best(shapers, (min_damping_ratio, _HIGHEST))
        square = 1.0 / (scale * task.seen(name, ratio).force)
    else:
        _, ratio = best(["none"], (min_damping_ratio, _HIGHEST))
        square = 1.0 / (scale * task.seen("none", ratio).force)
        name, _ = best(shapers, (ratio, ratio))
    task = _Task(masses, tolerance, max_overshoot)
    return _design(task, name, ratio, math.sqrt(square), mass, abs(distance))


def _design(task: _Task, name: str, ratio: float, w: float, mass: float, distance: float) -> PdDesign:
    seen, gain = task.seen(name, ratio), mass * w * w
    return PdDesign(
        gain, 2.0 * ratio * w * mass, w, ratio, name, _sequence(name, w, ratio),
        seen.settling / w, seen.nominal / w, seen.force * gain * distance, seen.overshoot,
    )  # fmt: skip


class _Task:
    """Responses to the unit step over the scaled time, for masses over the nominal one, shape (n,)."""

    def __init__(self, masses: np.ndarray, tolerance: float, max_overshoot: float):
        self._masses, self._tolerance, self._overshoot = masses, tolerance, max_overshoot
        self._known: dict[tuple[str, float], _Seen] = {}

    def fastest(self, name: str, low: float, high: float) -> tuple[float, float]:
        """The shortest settling time over sqrt(m L/F), and its damping ratio: scans about the best of each scan."""
        least, best = math.inf, low
        for _ in range(_SCANS):
            ratios = np.linspace(low, high, _RATIOS) if high > low else np.array([low])
            times = [self._time(name, float(ratio)) for ratio in ratios]
            i = int(np.argmin(times))
            if times[i] < least:
                least, best = times[i], float(ratios[i])
            low, high = float(ratios[max(0, i - 1)]), float(ratios[min(len(ratios) - 1, i + 1)])
        return least, best

    def _time(self, name: str, ratio: float) -> float:
        try:
            seen = self.seen(name, ratio)
        except ComponentError:  # no such shaper at this damping ratio
            return math.inf
        return seen.settling * math.sqrt(seen.force) if self.allowed(seen) else math.inf

    def allowed(self, seen: _Seen) -> bool:
        """Whether it settles, and does not overshoot too far."""
        return math.isfinite(seen.settling) and seen.overshoot <= self._overshoot

    def seen(self, name: str, ratio: float) -> _Seen:
        """A design's measures, by sampling."""
        key = name, ratio
        if key not in self._known:
            self._known[key] = self._look(_sequence(name, 1.0, ratio), ratio)
        return self._known[key]

    def _look(self, sequence: ImpulseSequence, ratio: float) -> _Seen:
        end = sequence.duration + _AFTER
        delays = np.array(sequence.delays)
        t = np.unique(np.concatenate([np.arange(0.0, end, _STEP), delays, delays[1:] - 1e-9]))  # before and after each jump
        after = t - delays[:, None, None]
        position, speed = _step(after, self._masses[:, None], ratio)
        amplitudes = np.array(sequence.amplitudes)[:, None, None]
        x, v = (amplitudes * position).sum(axis=0), (amplitudes * speed).sum(axis=0)
        reference = (amplitudes * (after >= 0.0)).sum(axis=0)
        force = float(np.abs(reference - x - 2.0 * ratio * v).max())
        settled = [_settled(t, np.abs(row - 1.0), self._tolerance) for row in x]
        nominal = settled[int(np.argmin(np.abs(self._masses - 1.0)))]
        return _Seen(max(settled), nominal, force, max(0.0, float(x.max()) - 1.0))


def _sequence(name: str, natural_frequency: float, damping_ratio: float) -> ImpulseSequence:
    if name == "none":
        return ImpulseSequence((1.0,), (0.0,), 0.0)
    return shaper(name, natural_frequency, damping_ratio)


def _step(t: np.ndarray, masses: np.ndarray, ratio: float) -> tuple[np.ndarray, np.ndarray]:
    """Position and speed of mu x'' + 2 zeta x' + x = 1 from rest at scaled times t, 0 before 0; shapes (k, n, m)."""
    decay = ratio / masses
    root = np.sqrt((decay * decay - 1.0 / masses).astype(complex))
    root = np.where(np.abs(root) < 1e-6, 1e-6, root)  # critically damped
    since = np.maximum(t, 0.0)
    growth, fall = np.exp(since * (root - decay)), np.exp(-since * (root + decay))
    position = 1.0 - ((root + decay) * growth + (root - decay) * fall) / (2.0 * root)
    speed = (growth - fall) / (2.0 * root * masses)
    started = t >= 0.0
    return np.where(started, position.real, 0.0), np.where(started, speed.real, 0.0)


def _settled(t: np.ndarray, deviation: np.ndarray, tolerance: float) -> float:
    """When the deviation falls below the tolerance for good, between samples by a straight line; infinite if it does not."""
    above = np.flatnonzero(deviation > tolerance)
    i = int(above[-1])
    if i + 1 == len(t):
        return math.inf
    return float(t[i] + (t[i + 1] - t[i]) * (deviation[i] - tolerance) / (deviation[i] - deviation[i + 1]))


def _check(
    mass: float,
    distance: float,
    max_force: float,
    mass_range: tuple[float, float] | None,
    tolerance: float,
    max_overshoot: float,
    shapers: Sequence[str],
    min_damping_ratio: float,
) -> None:
    if not (0.0 < mass < math.inf and 0.0 < max_force < math.inf and math.isfinite(distance) and distance != 0.0):
        raise ArgumentError("mass and max_force must be positive and finite, distance finite and not 0")
    if mass_range is not None and not 0.0 < mass_range[0] <= mass <= mass_range[1] < math.inf:
        raise ArgumentError(f"mass_range = {mass_range} kg: must be positive, finite and contain mass = {mass} kg")
    if not 0.0 < tolerance < 1.0 or not max_overshoot >= 0.0:
        raise ArgumentError("tolerance must be between 0 and 1, and max_overshoot not negative")
    if not 0.0 <= min_damping_ratio < 1.0:
        raise ArgumentError(f"min_damping_ratio = {min_damping_ratio}: must be at least 0 and less than 1")
    if not shapers:
        raise ArgumentError("give at least one shaper, or 'none'")
    for name in shapers:
        if name != "none" and min(shaper(name, 1.0, 0.1).amplitudes) < 0.0:
            raise ArgumentError(f"{name} has negative impulses: a step through it is none")
