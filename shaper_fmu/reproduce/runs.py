"""Runs that several papers share: the residual vibration of a command's FMUs on an oscillator's FMU."""

from __future__ import annotations

import math
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np

from shaper_fmu.export.build import fmu_path
from shaper_fmu.master.simulation import Simulation
from shaper_fmu.master.system import System
from shaper_fmu.metrics.final import Final


@dataclass(frozen=True)
class Residuals:
    """The residual vibration of a command, as shares of 1.

    Attributes:
        relative: envelope over that of a step, both at the end of the run (and so at any time after the command).
        vibration: V, the envelope at the command's end over that of a step at the start (Singer and Seering 1990).
        duration: the command's [s].
        kept: the values at the end of the variables that were asked for.
    """

    relative: float
    vibration: float
    duration: float
    kept: dict[str, float]


def plant_values(stiffness: float, natural_frequency: float, damping_ratio: float, name: str = "plant") -> dict[str, float]:
    """Start values of a MassSpringDamper [kg, N/m, N.s/m]; equal stiffness keeps the static displacement."""
    mass = stiffness / (natural_frequency * natural_frequency)
    damping = 2.0 * damping_ratio * stiffness / natural_frequency
    return {f"{name}.mass": mass, f"{name}.stiffness": stiffness, f"{name}.damping": damping}


class OscillatorBench:
    """A command on a MassSpringDamper FMU whose static displacement is the command; use it in a with statement.

    `build` adds the command's FMUs to the system and returns the output that is the command. The force is this output times
    the `stiffness` [N/m]. A run ends at `stop_time` [s], after the command's end; its communication step is `step` [s].
    `keep` names variables whose last values are wanted.
    """

    def __init__(
        self, build: Callable[[System], str], stop_time: float, step: float, stiffness: float = 1.0, keep: Sequence[str] = ()
    ):
        self.stop_time: float = stop_time
        self.step: float = step
        self.stiffness: float = stiffness
        self.keep: list[str] = list(keep)
        system, alone = System("bench"), System("step")
        for one in (system, alone):
            one.add("plant", fmu_path("MassSpringDamper"), stiffness=stiffness)
        system.connect(build(system), "plant.force", gain=stiffness)
        alone.set("plant.force", stiffness)
        wanted = {name: Final(name) for name in ("plant.position", "plant.velocity")}
        self._simulation = Simulation(system, record=[], metrics={**wanted, **{name: Final(name) for name in keep}})
        self._step = Simulation(alone, record=[], metrics=wanted)
        self._known: dict[tuple[float, float], float] = {}

    def __enter__(self) -> OscillatorBench:
        return self

    def __exit__(self, *error: object) -> None:
        self._simulation.close()
        self._step.close()

    def residuals(
        self,
        values: Mapping[str, Any],
        natural_frequency: float,
        damping_ratio: float,
        duration: float | str,
        *,
        exact: bool | None = None,
        step: float | None = None,
    ) -> Residuals:
        """Run with start `values` of the command on a plant of this mode.

        `duration` is the command's [s], or the kept variable that contains it; `exact` as in `Simulation.run`.
        """
        mode = natural_frequency, damping_ratio
        plant = plant_values(self.stiffness, *mode)
        found = self._simulation.run(self.stop_time, step or self.step, start_values={**values, **plant}, exact=exact).metrics
        if mode not in self._known:
            self._known[mode] = envelope(self._step.run(self.stop_time, self.stop_time, start_values=plant).metrics, *mode)
        relative = envelope(found, *mode) / self._known[mode]
        end = found[duration] if isinstance(duration, str) else duration
        kept = {name: found[name] for name in self.keep}
        return Residuals(relative, relative * math.exp(-damping_ratio * natural_frequency * end), end, kept)


def envelope(state: Mapping[str, float], natural_frequency: float, damping_ratio: float, rest: float = 1.0) -> float:
    """Envelope of the free vibration about `rest`, at the time of the state (position [m], velocity [m/s] of the plant) [m]."""
    decay = damping_ratio * natural_frequency
    damped = natural_frequency * math.sqrt(1.0 - damping_ratio * damping_ratio)
    deviation = state["plant.position"] - rest
    return math.hypot(deviation, (state["plant.velocity"] + decay * deviation) / damped)


def last_crossing(x: np.ndarray, y: np.ndarray, level: float) -> float:
    """Where y(x) falls below the level for good, between neighbours by a straight line; nan if it does not. Shapes (n,)."""
    above = np.flatnonzero(y >= level)
    if len(above) == 0:
        return float(x[0])
    i = int(above[-1])
    if i + 1 == len(x):
        return math.nan
    return float(x[i] + (x[i + 1] - x[i]) * (y[i] - level) / (y[i] - y[i + 1]))


def band_below(x: np.ndarray, y: np.ndarray, level: float, centre: float) -> tuple[float, float]:
    """The ends of the band round `centre` in which y(x) is below the level; both `centre` if it is not there. Shapes (n,)."""
    if np.interp(centre, x, y) >= level:
        return centre, centre
    right, left = x >= centre, x <= centre
    ends = []
    for side, order in ((left, -1), (right, 1)):
        at, value = np.append(centre, x[side][::order]), np.append(np.interp(centre, x, y), y[side][::order])
        above = np.flatnonzero(value >= level)
        if len(above) == 0:
            ends.append(float(at[-1]))
        else:
            i = int(above[0])
            ends.append(float(at[i - 1] + (at[i] - at[i - 1]) * (level - value[i - 1]) / (value[i] - value[i - 1])))
    return ends[0], ends[1]
