"""Figures of designed commands: a staircase, a move, the sensitivity to a wrong frequency."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Protocol

import numpy as np
from numpy.typing import ArrayLike

from shaper_fmu.analysis.vibration import Command, sensitivity_curve, tolerated_band
from shaper_fmu.page.figures import Figure, Line

_RATIOS = (0.02, 2.0, 991)


class Motion(Protocol):
    """A move as functions of time."""

    @property
    def duration(self) -> float:
        """Time from start to rest [s]."""
        ...

    def position(self, t: ArrayLike, /) -> np.ndarray:
        """Position [m]."""
        ...

    def velocity(self, t: ArrayLike, /) -> np.ndarray:
        """Velocity [m/s]."""
        ...

    def acceleration(self, t: ArrayLike, /) -> np.ndarray:
        """Acceleration [m/s2]."""
        ...


def move_figures(name: str, law: Motion) -> list[Figure]:
    """Position, velocity and acceleration over time."""
    t = np.linspace(-0.1 * law.duration, 1.15 * law.duration or 1.0, 1001)
    curves = {"position [m]": law.position(t), "velocity [m/s]": law.velocity(t), "acceleration [m/s2]": law.acceleration(t)}
    return [
        Figure(what.split()[0], f"{name}: {what.split()[0]}", "time [s]", what, [Line(name, t, values)])
        for what, values in curves.items()
    ]


def staircase(title: str, name: str, times: Sequence[float], levels: Sequence[float], duration: float) -> Figure:
    """A command that is 0 before the first of `times` [s], and has a level after each."""
    ends = np.repeat([0.0, *times, 1.15 * duration or 1.0], 2)[1:-1]
    return Figure("command", title, "time [s]", "command", [Line(name, ends, np.repeat([0.0, *levels], 2))])


def sensitivity_figure(command: Command, natural_frequency: float, damping_ratio: float, tolerance: float) -> Figure:
    """V in percent over the ratio of the actual natural frequency to the given one [rad/s], the tolerated band marked."""
    band = tolerated_band(command, natural_frequency, damping_ratio, tolerance) or ()
    edges = [edge for edge in band if edge < _RATIOS[1]]
    ratios = np.unique(np.concatenate([np.linspace(*_RATIOS), edges]))
    curve = 100.0 * sensitivity_curve(command, natural_frequency, damping_ratio, ratios)
    levels, marks = [(100.0 * tolerance, f"{tolerance:.0%}")], [(edge, f"{edge:.3f}") for edge in edges]
    title = f"Residual vibration, designed for {natural_frequency:.6g} rad/s"
    axis = "actual / design frequency"
    return Figure("sensitivity", title, axis, "residual vibration V [%]", [Line("V", ratios, curve)], levels, marks)
