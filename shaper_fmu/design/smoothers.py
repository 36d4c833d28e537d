"""Designs shapers without jumps in Python, with the same kernels as the FMU; returns a `SmoothKernel`."""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass, field
from functools import cached_property, lru_cache
from typing import Any

import numpy as np

from shaper_fmu.component import Parameter, Variable
from shaper_fmu.design.floor import distance_to_floor
from shaper_fmu.design.impulse_sequence import ImpulseSequence
from shaper_fmu.design.quadrature import as_masses
from shaper_fmu.errors import ArgumentError, NoSolutionError, nearest
from shaper_fmu.kinds.smoothed_modes import MODES, SmoothedModes, design_smoother
from shaper_fmu.kinds.smoothers import FURTHER_PARAMETERS, PARAMETERS, Smoother
from shaper_fmu.methods.record import declare
from shaper_fmu.smoothers.response import mean_delay, piece_at, ramp_response, step_response, step_slope

_IMPULSE = 1e-12
"""Of the step response: smaller jumps are rounding."""
_HIGHEST_RATIO = 10.0
"""Frequency ratio up to which insensitivities are looked for."""
_PEAK_POINTS = 33
"""In each piece, at which its slope is looked at: a polynomial of a degree of five at most."""


class _Workspace(SmoothedModes):
    """The record in which the kernels design for `smoother`, with the parameters of all methods."""

    smoother = Parameter(Smoother.ramped_zv, "", "kind of smoother")
    modes = Parameter(1, "", "number of modes", min=1, max=MODES)
    natural_frequency = Parameter(10.0, "rad/s", "of each mode", size=MODES, min=0.0, exclusive=True)
    damping_ratio = Parameter(0.0, "", "of each mode", size=MODES, min=0.0, max=1.0, exclusive="max")
    certificate = Parameter(0.0, "", "largest residual")
    declare(locals(), PARAMETERS)
    declare(locals(), FURTHER_PARAMETERS)


OPTIONS: dict[str, Variable[Any]] = {**PARAMETERS, **FURTHER_PARAMETERS}
"""What `smoother` takes beside modes: the methods' own parameters, by name."""


@dataclass(frozen=True)
class SmoothKernel:
    """A shaper with distributed delays: its response to a unit step is made of polynomials.

    Attributes:
        breakpoints: where the polynomials begin [s], the first one at 0; after the last one the response is 1.
        certificate: largest residual of the equations that define it.
    """

    breakpoints: tuple[float, ...]
    certificate: float
    _record: Any = field(repr=False, compare=False)

    @property
    def duration(self) -> float:
        """How long the response to a step takes [s]."""
        return self.breakpoints[-1]

    @property
    def mean_delay(self) -> float:
        """How much later a ramp is behind it [s]."""
        return mean_delay(self._record)

    @cached_property
    def impulses(self) -> tuple[tuple[float, float], ...]:
        """Times [s] and sizes of the jumps of the step response; empty for what has none."""
        found, before = [], 0.0
        for piece, begin in enumerate(self.breakpoints):
            size = step_response(self._record, piece, begin) - before
            if abs(size) > _IMPULSE:
                found.append((begin, size))
            if begin < self.duration:
                before = step_response(self._record, piece, self.breakpoints[piece + 1])
        return tuple(found)

    def step_response(self, t: np.ndarray | float) -> np.ndarray:
        """The response to a unit step at 0, at the times t [s], from the right where it jumps."""
        return self._each(step_response, t)

    def step_slope(self, t: np.ndarray | float) -> np.ndarray:
        """Its derivative [1/s], without impulses: the kernel's density."""
        return self._each(step_slope, t)

    def ramp_response(self, t: np.ndarray | float) -> np.ndarray:
        """The integral of the response to a unit step [s]."""
        return self._each(ramp_response, t)

    @cached_property
    def peak_slope(self) -> float:
        """The steepest slope of the step response [1/s]; infinite if it jumps."""
        if self.impulses:
            return math.inf
        return max(float(np.abs(values).max()) for values in self._slopes())

    @cached_property
    def peak_curvature(self) -> float:
        """The largest second derivative of the step response [1/s2]; infinite if its slope jumps."""
        if self.impulses:
            return math.inf
        slopes, largest, before = self._slopes(), 0.0, 0.0
        for piece, values in enumerate(slopes):
            if abs(values[0] - before) > 1e-9 * self.peak_slope:
                return math.inf
            span = self.breakpoints[piece + 1] - self.breakpoints[piece]
            largest = max(largest, float(np.abs(np.diff(values)).max()) / span * (_PEAK_POINTS - 1))
            before = values[-1]
        return largest if abs(before) <= 1e-9 * self.peak_slope else math.inf

    def _slopes(self) -> list[np.ndarray]:
        """The density at points of each piece but the last one, with both of its ends."""
        ends = zip(self.breakpoints[:-1], self.breakpoints[1:], strict=True)
        return [
            np.array([step_slope(self._record, piece, t) for t in np.linspace(begin, end, _PEAK_POINTS).tolist()])
            for piece, (begin, end) in enumerate(ends)
        ]

    def as_impulses(self, highest: float) -> ImpulseSequence:
        """Impulses with the same V on all modes up to `highest` [rad/s], to rounding: for figures of merit, no shaper."""
        return _as_impulses(self, highest)

    def residual_vibration(self, natural_frequency: float, damping_ratio: float = 0.0) -> float:
        """V of Singer and Seering 1990 on a mode: envelope at the kernel's end over that of one unit impulse at time 0."""
        return self.as_impulses(natural_frequency).residual_vibration(natural_frequency, damping_ratio)

    def insensitivity(self, natural_frequency: float, damping_ratio: float = 0.0, tolerance: float = 0.05) -> float:
        """Width of the band of w / natural_frequency around 1 in which V <= tolerance, exact crossings."""
        sequence = self.as_impulses(_HIGHEST_RATIO * natural_frequency)
        return sequence.insensitivity(natural_frequency, damping_ratio, tolerance)

    def distance_to_floor(self, natural_frequency: float, tolerance: float = 0.05, damping_ratio: float = 0.0) -> float | None:
        """How much longer it is than the shortest positive shaper of the same insensitivity; see `distance_to_floor`."""
        sequence = self.as_impulses(_HIGHEST_RATIO * natural_frequency)
        return distance_to_floor(sequence, natural_frequency, tolerance, damping_ratio)

    def _each(self, function: Any, t: np.ndarray | float) -> np.ndarray:
        times = np.asarray(t, float)
        values = [function(self._record, piece_at(self._record, s), s) if s >= 0.0 else 0.0 for s in times.ravel().tolist()]
        return np.array(values).reshape(times.shape)


@lru_cache(maxsize=256)
def _as_impulses(kernel: SmoothKernel, highest: float) -> ImpulseSequence:
    times, masses = as_masses(kernel.breakpoints, kernel.step_slope, highest)
    at, sizes = zip(*kernel.impulses, strict=True) if kernel.impulses else ((), ())
    times, masses = np.concatenate([[0.0], at, times, [kernel.duration]]), np.concatenate([[0.0], sizes, masses, [0.0]])
    order = np.argsort(times, kind="stable")
    return ImpulseSequence(tuple(masses[order]), tuple(times[order]), kernel.certificate)


def smoother(
    kind: str | Smoother,
    natural_frequency: float | Sequence[float],
    damping_ratio: float | Sequence[float] = 0.0,
    **parameters: float,
) -> SmoothKernel:
    """The kernel of a smoother, convolved over the modes if several are given.

    Args:
        kind: a name of `Smoother`, such as "dzv" or "smoother".
        natural_frequency: undamped natural frequency of each mode [rad/s], three at most.
        damping_ratio: of each mode, or one for all; 0 <= zeta < 1.
        parameters: those that the kinds declare: box_share of dzv and dzvd, ramp_periods of ramped_zv and ramped_zvd.

    Raises ArgumentError for a value outside its domain, and when no such smoother exists.
    """
    names = {item.name: item for item in Smoother}
    name = kind.name if isinstance(kind, Smoother) else kind
    if not isinstance(name, str) or name not in names:
        raise ArgumentError(f"there is no smoother {name!r}.{nearest(str(name), names)}")
    frequencies, ratios = (np.atleast_1d(np.asarray(one, float)).tolist() for one in (natural_frequency, damping_ratio))
    ratios = ratios * len(frequencies) if len(ratios) == 1 else ratios
    if not 1 <= len(frequencies) <= MODES or len(ratios) != len(frequencies):
        raise ArgumentError(
            f"{len(frequencies)} natural frequencies and {len(ratios)} damping ratios; there are 1 to {MODES} modes, each with both"
        )
    for one in parameters:
        if one not in OPTIONS:
            raise ArgumentError(f"a smoother has no parameter {one!r}.{nearest(one, OPTIONS)}")
    record: Any = _Workspace(
        smoother=names[name], modes=len(frequencies), natural_frequency=frequencies, damping_ratio=ratios, **parameters
    )
    record.check_values("parameter")
    if not design_smoother(record):
        raise NoSolutionError(f"no {name} smoother was found at the damping ratio {record.damping:g}")
    return SmoothKernel(tuple(record.piece_begin[: record.pieces]), record.certificate, record)
