"""Compares the modes of an experiment with those of the FMU's linearization."""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from scipy.optimize import linear_sum_assignment

from shaper_fmu.analysis.identification import Identification, Mode, OtherPole
from shaper_fmu.analysis.identification.classify import FEWEST_PERIODS, FEWEST_SAMPLES_PER_PERIOD
from shaper_fmu.tune.identify.excitation import Excitation
from shaper_fmu.tune.identify.linear_modes import Linearization, LinearMode

_AGREES = 1e-3
"""Relative difference of poles that is small: an amplitude of some degrees shifts a pendulum's frequency by that."""
_SURE = 4.0
"""Standard deviations within which a pole is called the same."""
_FARTHEST = 0.5
_FORBIDDEN = 1e6
_LISTED = 5

Found = Mode | OtherPole


@dataclass(frozen=True)
class LinearComparison:
    """The comparison of the linearization's modes with those found.

    Attributes:
        linearization: at the experiment's operating point.
        pairs: modes of the linearization, each with the mode or other pole found there.
        worst: the largest |found pole - linear pole| / |linear pole| among the pairs of modes; 0 if there are none.
        hidden: modes of the linearization that this input and these outputs show with less than the smallest share.
        differences: sentences; none if all agrees.
    """

    linearization: Linearization
    pairs: tuple[tuple[LinearMode, Found], ...]
    worst: float
    hidden: tuple[LinearMode, ...]
    differences: tuple[str, ...]

    @property
    def agrees(self) -> bool:
        """Whether each mode that should be seen was found where it should be, and no other."""
        return not self.differences

    @property
    def text(self) -> str:
        """The comparison as a sentence."""
        where = f"linearized by {self.linearization.origin}, the FMU"
        result = " has no mode that should be seen, and none was found"
        if self.pairs:
            modes = f"{len(self.pairs)} modes agree" if len(self.pairs) > 1 else "mode agrees"
            result = f"'s {modes} with the experiment: poles differ by {self.worst:.1e} of them at most"
        if self.differences:
            result = f" differs from the experiment: {'; '.join(self.differences)}"
        unseen = f". Not excited by this input, or not seen in these outputs: {_listed(self.hidden)}" if self.hidden else ""
        return f"{where}{result}{unseen}"


def compare(
    linearization: Linearization, found: Identification, excitation: Excitation, nonlinearity: float, smallest_share: float
) -> LinearComparison:
    """Compare a linearization at rest with the modes identified from the free response after an excitation.

    `nonlinearity` is the share of the response that does not scale: a pole may differ by as much.
    """
    linear = linearization.modes
    shares = _shares(linear, excitation, found.step)
    others = [one for one in found.others if one.pole.imag > 0.0 and one.kind != "harmonic"]
    parts: list[Found] = [*found.modes, *others]
    pairs: list[tuple[LinearMode, Found]] = []
    differences: list[str] = []
    hidden: list[LinearMode] = []
    for mode, share, part in zip(linear, shares, _paired(linear, parts), strict=True):
        near = part is not None and _is_near(mode, part, nonlinearity)
        if part is not None and (near or share >= smallest_share):
            pairs.append((mode, part))
            if not near:
                differences.append(
                    f"its mode of {_pole_text(mode.pole)} was found at {_pole_text(part.pole)}, {_apart(mode, part):.1e} apart"
                )
        elif share < smallest_share:
            hidden.append(mode)
        elif not any(_is_near(mode, one, nonlinearity) for one in parts):  # else it coincides with another one
            differences.append(
                f"its mode of {_pole_text(mode.pole)}, {share:.1%} of the vibration, was not found{_why(mode, found)}"
            )
    known = [id(part) for _, part in pairs]
    differences += [f"it has no mode of {_pole_text(one.pole)}, which was found" for one in found.modes if id(one) not in known]
    worst = max((_apart(mode, part) for mode, part in pairs if isinstance(part, Mode)), default=0.0)
    return LinearComparison(linearization, tuple(pairs), worst, tuple(hidden), tuple(differences))


def _apart(mode: LinearMode, part: Found) -> float:
    return abs(part.pole - mode.pole) / abs(mode.pole)


def _is_near(mode: LinearMode, part: Found, nonlinearity: float) -> bool:
    """Whether both are the same, as far as they are known."""
    return _apart(mode, part) <= max(_AGREES, _SURE * _deviation(part), nonlinearity, mode.error)


def _shares(linear: Sequence[LinearMode], excitation: Excitation, step: float) -> list[float]:
    """Of each mode in the vibration at the first free sample, in the output that shows it best, as `Mode.share` is."""
    moment = excitation.end + step
    sizes = np.array([np.abs(mode.residues * excitation.transform(mode.pole, moment)) for mode in linear])
    total = sizes.sum(axis=0) if len(linear) else np.zeros(0)
    return [float(np.max(size / np.where(total > 0.0, total, 1.0))) for size in sizes]


def _paired(linear: Sequence[LinearMode], parts: Sequence[Found]) -> list[Found | None]:
    """For each mode the part found that is nearest, by the least sum of relative distances, none farther than half; or None."""
    if not linear or not parts:
        return [None] * len(linear)
    cost = np.array([[_apart(mode, part) for part in parts] for mode in linear])
    cost = np.where(cost > _FARTHEST, _FORBIDDEN, cost)
    rows, columns = linear_sum_assignment(cost)
    pairs = {int(i): parts[int(j)] for i, j in zip(rows, columns, strict=True) if cost[i, j] < _FORBIDDEN}
    return [pairs.get(i) for i in range(len(linear))]


def _deviation(part: Found) -> float:
    """Standard deviation of a pole over its magnitude."""
    if isinstance(part, Mode):
        return math.hypot(part.natural_frequency_std / part.natural_frequency, part.damping_ratio_std)
    return part.pole_std / abs(part.pole)


def _why(mode: LinearMode, found: Identification) -> str:
    """Why a mode may not have been found, as the end of a sentence."""
    duration = found.step * found.samples
    if mode.pole.imag * found.step > 2.0 * math.pi / FEWEST_SAMPLES_PER_PERIOD:
        return f": samples {found.step:.3g} s apart do not show it"
    if mode.pole.imag * duration < 2.0 * math.pi * FEWEST_PERIODS:
        return f": the record of {duration:.3g} s is too short for it"
    return ""


def _pole_text(pole: complex) -> str:
    return f"{abs(pole):.4g} rad/s (damping ratio {-pole.real / abs(pole):.3g})"


def _listed(modes: Sequence[LinearMode]) -> str:
    shown = [f"{mode.natural_frequency:.4g}" for mode in modes[:_LISTED]]
    more = f" and {len(modes) - _LISTED} more" if len(modes) > _LISTED else ""
    return f"{', '.join(shown)} rad/s{more}"
