"""Classifies fitted poles as modes or other poles, each with its uncertainty."""

from __future__ import annotations

import math
from dataclasses import dataclass, replace

import numpy as np

from shaper_fmu.analysis.decaying_sum import SHAPEABLE
from shaper_fmu.analysis.identification.basis import growth
from shaper_fmu.analysis.identification.projection import Fit, covariance
from shaper_fmu.analysis.identification.record import Data
from shaper_fmu.analysis.identification.result import Kind, Mode, OtherPole

FEWEST_PERIODS = 1.5
FEWEST_SAMPLES_PER_PERIOD = 4.0
_STRENGTH = 0.1
"""Most that slight forces of a second or third order make of modes, in units of the whole response. What is larger is a mode of its
own that lies at a sum of others by chance, as frequencies that are round numbers often do."""
_SURE = 4.0
"""Standard deviations by which a pole must lie beyond the imaginary axis to be called unstable."""
_GROWN = 5e-3
"""Growth over the whole record up to which a pair counts as undamped: solvers of others grow as much by their errors."""


@dataclass(frozen=True)
class Parts:
    """Modes by rising frequency, and other poles."""

    modes: tuple[Mode, ...]
    others: tuple[OtherPole, ...]


def parts_of(found: Fit, data: Data, smallest_share: float) -> Parts:
    """Separate modes from other poles."""
    m, spread = found.model, covariance(found, data)
    size = growth(m, data.duration)
    swinging = [_pair(found, data, spread.parameters, spread.coefficients, k, size[k]) for k in range(len(m.pairs))]
    total = sum((np.abs(one.residues) for one in swinging if one.damping_ratio < SHAPEABLE), np.zeros(data.shape))
    swinging = [replace(one, share=_share(one.residues, np.maximum(total, np.abs(one.residues)))) for one in swinging]
    modes: list[Mode] = []
    others: list[OtherPole] = []
    for one in sorted(swinging, key=lambda mode: -mode.share):
        kind = _kind(one, modes, data, smallest_share)
        if kind is None:
            modes.append(one)
        else:
            others.append(OtherPole(kind, one.pole, one.natural_frequency_std, one.residues, one.share))
    others += _reals(found, data, spread.parameters, total, size, smallest_share, modes)
    return Parts(tuple(sorted(modes, key=lambda mode: mode.natural_frequency)), (*others, *_polynomial(found, data)))


def _pair(found: Fit, data: Data, parameters: np.ndarray, deviations: np.ndarray, k: int, growing: float) -> Mode:
    """Frequency and damping ratio with standard deviations by linear propagation from real and imaginary part."""
    s = complex(found.model.pairs[k])
    w = abs(s)
    zeta = -s.real / w
    block = parameters[2 * k : 2 * k + 2, 2 * k : 2 * k + 2]
    of_frequency = np.array([s.real, s.imag]) / w
    of_damping = np.array([-s.imag, s.real]) * s.imag / w**3
    rows = found.coefficients[2 * k : 2 * k + 2] * data.scale * growing
    spread = np.hypot(*(deviations[2 * k : 2 * k + 2] * data.scale * growing))
    return Mode(
        w, _deviation(block, of_frequency), max(0.0, zeta), _deviation(block, of_damping),
        placed(rows[0] + 1j * rows[1], data), placed(spread, data), 0.0, s,
    )  # fmt: skip


def _deviation(block: np.ndarray, gradient: np.ndarray) -> float:
    return math.sqrt(max(0.0, float(gradient @ block @ gradient)))


def placed(values: np.ndarray, data: Data) -> np.ndarray:
    """Values of the columns as an array (experiments, outputs), 0 where an output does not move."""
    table = np.zeros(data.shape, values.dtype)
    for value, (experiment, output) in zip(values, data.column, strict=True):
        table[experiment, output] = value
    return table


def _share(residues: np.ndarray, total: np.ndarray) -> float:
    return float(np.max(np.abs(residues) / np.where(total > 0.0, total, 1.0), initial=0.0))


def _kind(one: Mode, modes: list[Mode], data: Data, smallest_share: float) -> Kind | None:
    """The kind of a pair, given the modes with larger shares; None for a mode."""
    if one.pole.imag * data.duration < 2.0 * math.pi * FEWEST_PERIODS and one.damping_ratio < SHAPEABLE:
        return "too_slow"
    if one.share < smallest_share:
        return "minor"
    if one.pole.imag * data.step > 2.0 * math.pi / FEWEST_SAMPLES_PER_PERIOD:
        return "too_fast"
    if one.pole.real * data.duration > max(_GROWN, _SURE * one.damping_ratio_std * one.natural_frequency * data.duration):
        return "unstable"
    if one.damping_ratio >= SHAPEABLE:
        return "overdamped"
    return "harmonic" if _is_sum(one.pole, one.natural_frequency_std, one.share, modes) else None


def _is_sum(pole: complex, spread: float, share: float, modes: list[Mode]) -> bool:
    """Whether it is a sum of two or three poles of these modes, and no larger than quadratic and cubic forces make it."""
    known = [(p, mode.share) for mode in modes for p in (mode.pole, mode.pole.conjugate())]
    sums = [(a + b, one * other) for a, one in known for b, other in known]
    sums += [(a + b, one * other) for a, one in sums for b, other in known]
    near = [
        abs(pole - s)
        for s, size in sums
        if share <= _STRENGTH * size and abs(s - pole) < 0.1 * abs(pole) and not any(abs(s - p) < 1e-9 * abs(p) for p, _ in known)
    ]
    return min(near, default=math.inf) < 3.0 * spread + 2e-3 * abs(pole)


def _reals(
    found: Fit, data: Data, parameters: np.ndarray, total: np.ndarray, size: np.ndarray, smallest_share: float, modes: list[Mode]
) -> list[OtherPole]:
    """The real poles; those that are twice a mode's decay are harmonics."""
    m, first = found.model, 2 * len(found.model.pairs)
    others = []
    for i, rate in enumerate(m.reals):
        spread = math.sqrt(max(0.0, float(parameters[first + i, first + i])))
        residues = placed(found.coefficients[first + i] * data.scale * size[len(m.pairs) + i] + 0j, data)
        share = _share(residues, total + np.abs(residues))
        kind: Kind = "growth" if rate > 0.0 else "decay"
        if share < smallest_share:
            kind = "minor"
        elif _is_sum(complex(rate), spread, share, modes):
            kind = "harmonic"
        others.append(OtherPole(kind, complex(rate), spread, residues, share))
    return others


def _polynomial(found: Fit, data: Data) -> list[OtherPole]:
    """The poles at 0: coefficients of 1, t, t^2 from those of Legendre's polynomials over the record."""
    degree = found.model.degree
    if degree < 0:
        return []
    legendre = np.zeros((3, len(data.y)))
    legendre[: degree + 1] = found.coefficients[-(degree + 1) :] * data.scale
    a, b, c = legendre
    powers = [a - b + c, (2.0 * b - 6.0 * c) / data.duration, 6.0 * c / data.duration**2]
    kinds: tuple[Kind, ...] = ("offset", "drift", "acceleration")
    return [OtherPole(kinds[i], 0j, 0.0, placed(powers[i] + 0j, data), 0.0) for i in range(degree + 1)]
