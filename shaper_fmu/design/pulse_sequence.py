"""On/off commands as Python objects: the results of the design functions."""

from __future__ import annotations

import cmath
import math
from dataclasses import dataclass
from typing import Any

from shaper_fmu.analysis.deflection import peak_deflection
from shaper_fmu.analysis.vibration import relative_residual
from shaper_fmu.errors import ArgumentError


@dataclass(frozen=True, repr=False)
class PulseSequence:
    """A piecewise constant command that starts from 0.

    Attributes:
        switch_times: when the command switches [s], rising, from 0 on.
        levels: the command after each switch [-]; the last one is where it ends.
        travel_time: when the command has arrived [s]; not before the last switch.
        certificate: largest residual of the equations that define the design; NaN where there are none.
    """

    switch_times: tuple[float, ...]
    levels: tuple[float, ...]
    travel_time: float
    certificate: float = math.nan

    def __post_init__(self) -> None:
        object.__setattr__(self, "switch_times", tuple(float(t) for t in self.switch_times))
        object.__setattr__(self, "levels", tuple(float(level) for level in self.levels))
        if len(self.switch_times) != len(self.levels) or not self.levels:
            raise ArgumentError(f"{len(self.levels)} levels for {len(self.switch_times)} switch times: each switch needs both")
        if not all(map(math.isfinite, (*self.switch_times, *self.levels, self.travel_time))):
            raise ArgumentError("switch times, levels and the travel time must be finite numbers")
        if any(b < a for a, b in zip((0.0, *self.switch_times), (*self.switch_times, self.travel_time), strict=True)):
            raise ArgumentError("switch times must not be negative nor decrease, and not lie after the travel time")
        if self.levels[-1] == 0.0:
            raise ArgumentError("the command must end at a level other than 0")

    @property
    def duration(self) -> float:
        """The travel time [s], under the name that all commands have."""
        return self.travel_time

    @property
    def switches(self) -> int:
        """Number of switches."""
        return len(self.switch_times)

    @property
    def pulses(self) -> int:
        """Number of rising edges."""
        return sum(after > before for before, after in zip((0.0, *self.levels), self.levels, strict=False))

    @property
    def minimum_pulse_width(self) -> float:
        """Shortest time between two switches, of a pulse or of a gap [s]; infinite for a single switch."""
        return min((b - a for a, b in zip(self.switch_times, self.switch_times[1:], strict=False)), default=math.inf)

    def residual_vibration(self, natural_frequency: float, damping_ratio: float = 0.0) -> float:
        """V = |exp(p tau) S|/L of Singer and Seering 1990, on a mode of natural_frequency [rad/s].

        The residual envelope at the travel time tau over the envelope, at time 0, of a step to the same level L;
        S = sum_i A_i exp(-p t_i) over the jumps, p = -zeta w + j wd.
        """
        pole = _pole(natural_frequency, damping_ratio)
        jumps = zip((0.0, *self.levels), self.levels, self.switch_times, strict=False)
        total = sum((after - before) * cmath.exp(pole * (self.travel_time - t)) for before, after, t in jumps)
        return abs(total) / abs(self.levels[-1])

    def relative_residual(self, natural_frequency: float, damping_ratio: float = 0.0) -> float:
        """|S|/L = V exp(zeta w tau): the residual envelope over that of a step at time 0, both at the same instant."""
        return relative_residual(self, natural_frequency, damping_ratio)

    def peak_deflection(self, natural_frequency: float, damping_ratio: float = 0.0) -> float:
        """The mode's largest deflection at any time, during the command or after it, over the static one at the final level."""
        _pole(natural_frequency, damping_ratio)
        return peak_deflection(self.switch_times, self.levels, natural_frequency, damping_ratio) / abs(self.levels[-1])

    def plot(self, axes: Any = None) -> Any:
        """Draw the command over time; see `Results.plot` for axes, what is returned, and errors."""
        from shaper_fmu.design.figures import staircase
        from shaper_fmu.notebook.plots import plot

        return plot([staircase("The on/off command", "command", self.switch_times, self.levels, self.travel_time)], axes)

    def plot_sensitivity(
        self, natural_frequency: float, damping_ratio: float = 0.0, tolerance: float = 0.05, axes: Any = None
    ) -> Any:
        """Draw V over the ratio of the actual natural frequency to the given one [rad/s], with the tolerance; see `plot`."""
        from shaper_fmu.design.figures import sensitivity_figure
        from shaper_fmu.notebook.plots import plot

        return plot([sensitivity_figure(self, natural_frequency, damping_ratio, tolerance)], axes)

    def __repr__(self) -> str:
        from shaper_fmu.notebook.texts import counted, numbers

        times = numbers(self.switch_times)
        return f"<PulseSequence: {counted(self.pulses, 'pulse')} in {self.travel_time:.5g} s, switched at {times} s>"

    def _repr_html_(self) -> str:
        from shaper_fmu.notebook.html import page
        from shaper_fmu.page.blocks import Table

        facts = {
            "pulses": str(self.pulses),
            "travel time": f"{self.travel_time:.9g} s",
            "shortest pulse or gap": f"{self.minimum_pulse_width:.6g} s" if self.switches > 1 else "",
            "certificate": "" if math.isnan(self.certificate) else f"{self.certificate:.1e}",
        }
        rows = [[f"{t:.10g}", f"{level:g}"] for t, level in zip(self.switch_times, self.levels, strict=True)]
        return page("PulseSequence", facts, [Table("", ["switch at [s]", "level after it"], rows)])


def _pole(natural_frequency: float, damping_ratio: float) -> complex:
    if not (natural_frequency > 0.0 and math.isfinite(natural_frequency)):
        raise ArgumentError(f"natural_frequency = {natural_frequency} rad/s must be a finite number greater than 0 rad/s")
    if not 0.0 <= damping_ratio < 1.0:
        raise ArgumentError(f"damping_ratio = {damping_ratio} must be at least 0 and less than 1")
    return natural_frequency * complex(-damping_ratio, math.sqrt(1.0 - damping_ratio * damping_ratio))
