"""The range of each mode over operating points and amplitudes."""

from __future__ import annotations

import itertools
import math
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np
from scipy.optimize import linear_sum_assignment

from shaper_fmu.analysis.identification import Finding, Mode
from shaper_fmu.errors import ModelError
from shaper_fmu.master.fmu import Fmu
from shaper_fmu.master.system import System
from shaper_fmu.tune.identify.experiment import PlantIdentification
from shaper_fmu.tune.identify.points import experiments, point_text
from shaper_fmu.tune.plant import Plant

_FARTHEST = math.log(2.0)
"""Modes whose frequencies differ by more than a factor of 2 are not taken for the same one, if others remain to choose from."""
UNCOVERED = ("failed", "lost", "left_out")
"""Findings of points that the modes' ranges do not contain."""
_SHAPE_WEIGHT = 0.3
_FORBIDDEN = 1e6


@dataclass(frozen=True)
class Range:
    """Least, nominal and largest value."""

    low: float
    nominal: float
    high: float


@dataclass(frozen=True)
class ModeRange:
    """A mode over all experiments.

    Attributes:
        natural_frequency: [rad/s].
        damping_ratio: of 1.
        modes: the mode in each experiment, in their order; None where it was not found.
    """

    natural_frequency: Range
    damping_ratio: Range
    modes: tuple[Mode | None, ...]


@dataclass(frozen=True, repr=False)
class PlantModes:
    """The result of experiments at several operating points and amplitudes.

    Attributes:
        experiments: the nominal one first.
        ranges: of the nominal experiment's modes, by rising natural frequency.
        findings: of the nominal experiment, and of the others as far as they differ.
    """

    experiments: tuple[PlantIdentification, ...]
    ranges: tuple[ModeRange, ...]
    findings: tuple[Finding, ...]

    @property
    def uncovered(self) -> tuple[Finding, ...]:
        """The findings of points that the ranges do not contain: where the plant failed, or a mode was not found."""
        return tuple(one for one in self.findings if one.code in UNCOVERED)

    @property
    def nominal(self) -> PlantIdentification:
        """The experiment at the first operating point."""
        return self.experiments[0]

    def __repr__(self) -> str:
        modes = ", ".join(
            f"{w.nominal:.4g} rad/s ({w.low:.4g} to {w.high:.4g}), damping ratio {one.damping_ratio.nominal:.3g}"
            for one in self.ranges
            for w in (one.natural_frequency,)
        )
        many = f"{len(self.experiments)} experiments" if len(self.experiments) > 1 else "one experiment"
        return f"<PlantModes: {many}; {modes or 'no modes'}>"


def operating_points(values: Mapping[str, Sequence[Any]]) -> list[dict[str, Any]]:
    """All combinations of the values by name; the first of each are the nominal ones, and give the first point."""
    if any(not len(found) for found in values.values()):
        raise ModelError([f"{name}: there are no values" for name, found in values.items() if not len(found)])
    return [dict(zip(values, chosen, strict=True)) for chosen in itertools.product(*values.values())]


def identify_plant(
    source: Plant | System | Fmu | Path | str,
    input: str = "",
    outputs: Sequence[str] | None = None,
    *,
    points: Sequence[Mapping[str, Any]] = ({},),
    amplitude_factors: Sequence[float] = (),
    start_values: Mapping[str, Any] | None = None,
    **options: Any,
) -> PlantModes:
    """Identify the modes at each operating point, the first being the nominal one, and each mode's range.

    Args:
        source, input, outputs, start_values: see `Plant`.
        points: start values of each operating point (see `operating_points`).
        amplitude_factors: further experiments at each point, at these multiples of the amplitude that was found there.
        options: of `experiment`.

    An experiment that fails at another point than the nominal one is a finding, and so is one for which the budget does not do.
    Raises as `experiment` does.
    """
    plant = Plant.of(source, input, outputs, start_values)
    found, failed = experiments(plant, points, amplitude_factors, options)
    ranges = _ranges(found)
    return PlantModes(tuple(found), tuple(ranges), (*found[0].findings, *failed, *_lost(found, ranges), *_differences(found)))


def _ranges(found: list[PlantIdentification]) -> list[ModeRange]:
    nominal = found[0].modes
    followed = [match_modes(nominal, other.modes, other.identification.signal[0]) for other in found[1:]]
    ranges = []
    for k, mode in enumerate(nominal):
        modes = (mode, *(matched[k] for matched in followed))
        there = [one for one in modes if one is not None]
        frequencies, dampings = ([getattr(m, name) for m in there] for name in ("natural_frequency", "damping_ratio"))
        ranges.append(
            ModeRange(
                Range(min(frequencies), mode.natural_frequency, max(frequencies)),
                Range(min(dampings), mode.damping_ratio, max(dampings)),
                modes,
            )
        )
    return ranges


def match_modes(nominal: Sequence[Mode], others: Sequence[Mode], scale: np.ndarray) -> list[Mode | None]:
    """For each nominal mode the one among the others that is nearest in frequency and shape; None for none.

    `scale`, shape (m,), makes outputs of different units comparable. The assignment minimises the sum over all modes of
    |log frequency ratio| + 0.3 (1 - modal assurance criterion). As many as there are on both sides are the same ones, however far
    apart: those that remain are paired in their order.
    """
    if not nominal or not others:
        return [None] * len(nominal)
    cost = np.array([[_distance(mode, other, scale) for other in others] for mode in nominal])
    rows, columns = linear_sum_assignment(cost)
    pairs = {int(i): others[int(j)] for i, j in zip(rows, columns, strict=True) if cost[i, j] < _FORBIDDEN}
    if len(nominal) == len(others):
        rest = [i for i in range(len(nominal)) if i not in pairs]
        left = [one for one in others if not any(one is taken for taken in pairs.values())]
        pairs |= dict(zip(rest, left, strict=True))
    return [pairs.get(i) for i in range(len(nominal))]


def _distance(mode: Mode, other: Mode, scale: np.ndarray) -> float:
    apart = abs(math.log(mode.natural_frequency / other.natural_frequency))
    if apart > _FARTHEST:
        return _FORBIDDEN
    size = np.where(scale > 0.0, scale, 1.0)
    a, b = mode.residues[0] / size, other.residues[0] / size
    assurance = abs(np.vdot(a, b)) ** 2 / max(1e-300, float(np.vdot(a, a).real * np.vdot(b, b).real))
    return apart + _SHAPE_WEIGHT * (1.0 - assurance)


def _lost(found: list[PlantIdentification], ranges: list[ModeRange]) -> list[Finding]:
    """A finding for each mode and experiment in which it was not found: its range does not contain that point."""
    findings = []
    for one in ranges:
        for other, mode in zip(found, one.modes, strict=True):
            if mode is None:
                seen = " and ".join(f"{m.natural_frequency:.4g}" for m in other.modes) or "none"
                nominal = one.natural_frequency.nominal
                text = (
                    f"at {point_text(other.start_values)} no mode corresponds to the one at {nominal:.4g} rad/s "
                    f"(found there: {seen}): its range does not contain this point"
                )
                findings.append(Finding("lost", text))
    return findings


def _differences(found: list[PlantIdentification]) -> list[Finding]:
    """Findings on modes that appear or disappear, and findings that the nominal experiment does not have."""
    findings, known = [], {finding.code for finding in found[0].findings}
    for other in found[1:]:
        where = f"at {point_text(other.start_values)}, amplitude {other.excitation.amplitude:.3g} {other.input_unit}"
        if len(other.modes) != len(found[0].modes):
            findings.append(
                Finding("modes_differ", f"{where}: {len(other.modes)} modes, where the nominal point has {len(found[0].modes)}")
            )
        differs = other.linear is not None and not other.linear.agrees
        worth = [one for one in other.findings if one.code not in known or (one.code == "linearized" and differs)]
        findings += [Finding(one.code, f"{where}: {one.text}") for one in worth]
    return findings
