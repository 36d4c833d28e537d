"""Impulse sequences as Python objects: the results of design functions and the arguments of analysis."""

from __future__ import annotations

import itertools
import math
from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any

from shaper_fmu.errors import ArgumentError
from shaper_fmu.shapers.convolution import convolve
from shaper_fmu.shapers.sensitivity import insensitivity, residual_vibration


@dataclass(frozen=True, repr=False)
class ImpulseSequence:
    """Impulses of an input shaper.

    Attributes:
        amplitudes: the impulses' amplitudes [-], which add up to 1.
        delays: their times [s], rising, the first one 0.
        certificate: largest residual of the equations that define the design; 0 for a closed form, NaN if unknown.
    """

    amplitudes: tuple[float, ...]
    delays: tuple[float, ...]
    certificate: float = math.nan

    def __post_init__(self) -> None:
        object.__setattr__(self, "amplitudes", tuple(float(a) for a in self.amplitudes))
        object.__setattr__(self, "delays", tuple(float(t) for t in self.delays))
        if len(self.amplitudes) != len(self.delays) or not self.delays:
            raise ArgumentError(f"{len(self.amplitudes)} amplitudes for {len(self.delays)} delays: each impulse needs both")
        if not all(map(math.isfinite, self.amplitudes + self.delays)):
            raise ArgumentError("amplitudes and delays must be finite numbers")
        if self.delays[0] != 0.0 or any(a > b for a, b in zip(self.delays, self.delays[1:], strict=False)):
            raise ArgumentError("delays must begin with 0 s and not decrease")

    @property
    def duration(self) -> float:
        """Delay of the last impulse [s]."""
        return self.delays[-1]

    def residual_vibration(self, natural_frequency: float, damping_ratio: float = 0.0) -> float:
        """V of Singer and Seering 1990 on a mode: envelope at the last impulse over that of one unit impulse at time 0."""
        return residual_vibration(self.amplitudes, self.delays, len(self.delays), natural_frequency, damping_ratio)

    def insensitivity(self, natural_frequency: float, damping_ratio: float = 0.0, tolerance: float = 0.05) -> float:
        """Width of the band of w / natural_frequency around 1 in which V <= tolerance, exact crossings."""
        return insensitivity(self.amplitudes, self.delays, len(self.delays), natural_frequency, damping_ratio, tolerance)

    def convolved(self, other: ImpulseSequence) -> ImpulseSequence:
        """Both sequences one after the other: all products of amplitudes at all sums of delays; coinciding ones merged."""
        room = [0.0] * (len(self.delays) * len(other.delays) - len(self.delays))
        amplitudes, delays = [*self.amplitudes, *room], [*self.delays, *room]
        count = convolve(amplitudes, delays, len(self.delays), other.amplitudes, other.delays, len(other.delays))
        certificate = max(self.certificate, other.certificate)
        return ImpulseSequence(tuple(amplitudes[:count]), tuple(delays[:count]), certificate)

    def plot(self, axes: Any = None) -> Any:
        """Draw a unit step through the shaper; see `Results.plot` for axes, what is returned, and errors."""
        from shaper_fmu.design.figures import staircase
        from shaper_fmu.notebook.plots import plot

        levels = tuple(itertools.accumulate(self.amplitudes))
        return plot([staircase("A unit step through the shaper", "shaped step", self.delays, levels, self.duration)], axes)

    def plot_sensitivity(
        self, natural_frequency: float, damping_ratio: float = 0.0, tolerance: float = 0.05, axes: Any = None
    ) -> Any:
        """Draw V over the ratio of the actual natural frequency to the given one [rad/s], with the tolerance; see `plot`."""
        from shaper_fmu.design.figures import sensitivity_figure
        from shaper_fmu.notebook.plots import plot

        return plot([sensitivity_figure(self, natural_frequency, damping_ratio, tolerance)], axes)

    def __repr__(self) -> str:
        from shaper_fmu.notebook.texts import counted, numbers

        times, sizes = numbers(self.delays), numbers(self.amplitudes)
        return f"<ImpulseSequence: {counted(len(self.delays), 'impulse')} in {self.duration:.5g} s, {sizes} at {times} s>"

    def _repr_html_(self) -> str:
        from shaper_fmu.notebook.html import page
        from shaper_fmu.page.blocks import Table

        levels = itertools.accumulate(self.amplitudes)
        rows = [[f"{t:.10g}", f"{a:.10g}", f"{n:.10g}"] for t, a, n in zip(self.delays, self.amplitudes, levels, strict=True)]
        facts = {"impulses": str(len(rows)), "duration": f"{self.duration:.9g} s", "certificate": f"{self.certificate:.1e}"}
        return page("ImpulseSequence", facts, [Table("", ["delay [s]", "amplitude", "level of a step"], rows)])


def convolve_all(sequences: Sequence[ImpulseSequence]) -> ImpulseSequence:
    """The convolution of all sequences; one unit impulse if there are none."""
    result = ImpulseSequence((1.0,), (0.0,), 0.0)
    for sequence in sequences:
        result = result.convolved(sequence)
    return result
