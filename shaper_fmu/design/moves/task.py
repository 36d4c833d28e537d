"""What a move must keep, in its own units: the distance is 1, and so is the time of the fastest move with vibration."""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np

from shaper_fmu.design.lp.layout import Band
from shaper_fmu.design.moves.deflection import Deflection


@dataclass(frozen=True)
class Task:
    """Limits of speed, acceleration and jerk, infinite for none, bands of frequencies with the tolerated residual V, and modes
    whose deflection on the way is limited (with the acceleration as control only).

    The control is the jerk if it is limited, else the acceleration; it is constant between switches.
    """

    limits: tuple[float, float, float]
    bands: tuple[Band, ...]
    deflections: tuple[Deflection, ...] = ()

    @property
    def order(self) -> int:
        """Which derivative of the position the control is: 3 for the jerk, 2 for the acceleration."""
        return 3 if math.isfinite(self.limits[2]) else 2

    @property
    def largest_control(self) -> float:
        """The control's limit."""
        return self.limits[self.order - 1]

    def levels(self) -> np.ndarray:
        """What the control is along limits: its own, 0, and with an acceleration as control those that hold a deflection."""
        top = self.largest_control
        held = [one.holding for one in self.deflections if one.holding < top]
        return np.array(sorted({0.0, *(sign * value for value in (top, *held) for sign in (-1.0, 1.0))}))

    def nearest_level(self, control: np.ndarray) -> np.ndarray:
        """The level nearest to each of these values."""
        levels = self.levels()
        return levels[np.argmin(np.abs(np.subtract.outer(control, levels)), axis=-1)]

    def gentle(self) -> float:
        """Duration of the fastest move whose acceleration could hold no deflection above its limit."""
        speed, acceleration, jerk = self.limits
        held = min((one.holding for one in self.deflections), default=acceleration)
        return duration_with_vibration(1.0, speed, min(acceleration, held), jerk)

    def limited(self) -> list[int]:
        """The derivatives below the control that have a limit: 1 for the speed, 2 for the acceleration."""
        return [k for k in range(1, self.order) if math.isfinite(self.limits[k - 1])]


def duration_with_vibration(distance: float, max_velocity: float, max_acceleration: float, max_jerk: float) -> float:
    """Shortest rest-to-rest time [s] over a distance > 0 within limits, whatever vibrates; infinite limits are none.

    The acceleration is a trapezoid up to the speed and its mirror image down, each cut where a limit is not reached
    (Biagiotti and Melchiorri 2008, section 3.4).
    """
    ramp = _time_to_speed(max_velocity, max_acceleration, max_jerk) if math.isfinite(max_velocity) else math.inf
    if max_velocity * ramp <= distance:
        return ramp + distance / max_velocity
    if math.isinf(max_jerk):
        return 2.0 * math.sqrt(distance / max_acceleration)
    rise = max_acceleration / max_jerk
    if distance >= 2.0 * max_acceleration * rise * rise:
        return rise + math.sqrt(rise * rise + 4.0 * distance / max_acceleration)
    return 4.0 * (0.5 * distance / max_jerk) ** (1.0 / 3.0)


def _time_to_speed(velocity: float, acceleration: float, jerk: float) -> float:
    """Shortest time [s] from rest to a speed without acceleration."""
    if math.isinf(jerk):
        return velocity / acceleration
    if velocity * jerk >= acceleration * acceleration:
        return acceleration / jerk + velocity / acceleration
    return 2.0 * math.sqrt(velocity / jerk)
