"""Separates the vibration in an output from its slow part and from noise, by the poles that the experiments have shown.

A drive's lag decays after a command, and is no vibration. The unshaped response at a point gives the poles there, by maximum
likelihood from the nominal ones (see `analysis/identification/projection.py`); the shaped response is then a linear fit with these
poles. Without noise the vibration is all that is left when the slow part is taken away, and so includes what no pole explains. In
noise it is the modes' part; what else may swing there is bounded by the largest line in the fit's residual.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from shaper_fmu.analysis.identification.basis import Model, basis, model
from shaper_fmu.analysis.identification.projection import Fit, covariance, fit, polish
from shaper_fmu.analysis.identification.record import Data
from shaper_fmu.tune.identify.range import PlantModes
from shaper_fmu.tune.verification.peaks import peak_to_peak

VISIBLE = 1e-5
"""Share of the modes' amplitudes after a step below which a decay is not separated."""
_SURE = 2.0
_HIDDEN = 2.33
"""Standard deviations: of what is known, and of a line that noise may hide in one of a hundred records."""
_FIRST_PERIODS = 2.0
_FASTER = 2.0
"""A pole is taken for the nominal one up to this factor of its frequency or rate."""


@dataclass(frozen=True)
class SlowPart:
    """Poles at the nominal point.

    Attributes:
        modes: of vibration, those with Im > 0 [rad/s].
        calm: of pairs that decay before they swing.
        reals: real ones [1/s], all below 0.
    """

    modes: tuple[complex, ...]
    calm: tuple[complex, ...] = ()
    reals: tuple[float, ...] = ()

    @property
    def moves(self) -> bool:
        """Whether there is a slow part."""
        return bool(self.calm or self.reals)

    @property
    def text(self) -> str:
        """The slow part's poles, for a sentence."""
        rates = [f"{-rate:.3g}" for rate in self.reals] + [f"{abs(pole):.3g}" for pole in self.calm]
        return f"decay at {' and '.join(rates)} 1/s"


@dataclass(frozen=True)
class Swing:
    """The vibration in a record.

    Attributes:
        half: half the peak-to-peak value of each output, shape (m,).
        later: the same in the rest of the record.
        doubt: what noise may hide of it, shape (m,).
        poles: of the fit.
    """

    half: np.ndarray
    later: np.ndarray
    doubt: np.ndarray
    poles: Model


def slow_part(modes: PlantModes, outputs: Sequence[str]) -> SlowPart:
    """The poles of the nominal experiment, with those decays that these outputs show after a step."""
    nominal = modes.nominal
    places = [nominal.outputs.index(name) for name in outputs]
    swinging = np.sum([np.abs(nominal.step_residues(mode))[places] for mode in nominal.modes], axis=0)
    calm, reals = [], []
    for other in nominal.identification.others:
        size = np.abs(nominal.step_residues(other))[places] if other.pole.real < 0.0 else np.zeros(len(places))
        if not (size > VISIBLE * swinging).any():
            continue
        if other.kind == "overdamped":
            calm.append(other.pole)
        elif other.pole.imag == 0.0 and other.kind in ("decay", "minor", "harmonic"):
            reals.append(other.pole.real)
    return SlowPart(tuple(mode.pole for mode in nominal.modes), tuple(calm), tuple(reals))


def swing_of(
    record: np.ndarray, step: float, slow: SlowPart, window: float, noise: np.ndarray, known: Model | None = None
) -> Swing:
    """The vibration in a record of shape (n, m), over its first `window` [s] and over the rest.

    `noise` is the standard deviation of each output's noise, shape (m,); `known` are the poles, found in another record.
    """
    data = _data(record, step, noise)
    poles = known if known is not None else _poles(data, slow)
    found = fit(poles, data)
    functions = basis(poles, data.time)
    swinging = 2 * len(slow.modes)
    part = found.coefficients[:swinging].T @ functions[:swinging]
    slowly = found.coefficients[swinging:].T @ functions[swinging:]
    noisy = noise > 0.0
    vibration = np.where(noisy[:, None], part, data.y - slowly)
    doubt = np.where(noisy, _doubt(found, data, swinging, -min(pole.real for pole in poles.pairs)), 0.0)
    until = max(2, round(window / step) + 1)
    half = np.array([0.5 * peak_to_peak(data.time[:until], column[:until]) for column in vibration])
    later = 0.5 * np.ptp(vibration[:, until:], axis=1) if vibration.shape[1] > until else half
    return Swing(half, later, doubt, poles)


def _data(record: np.ndarray, step: float, noise: np.ndarray) -> Data:
    """All outputs as they are, weighted by their noise or their size in the fit of the poles."""
    m = record.shape[1]
    floor = np.maximum(noise, 1e-9 * np.maximum(np.ptp(record, axis=0), 1e-300))
    return Data(record.T.copy(), np.ones(m), floor, step, tuple((0, j) for j in range(m)), (1, m))


def _poles(data: Data, slow: SlowPart) -> Model:
    """The poles of a record: polished from the nominal ones, in ever longer parts of it, so that no period is skipped."""
    start = model([*slow.modes, *slow.calm], slow.reals, 0)
    best, periods = start, _FIRST_PERIODS
    slowest = 2.0 * math.pi / min(pole.imag for pole in slow.modes)
    while True:
        samples = min(data.samples, math.ceil(periods * slowest / data.step))
        if samples >= min(data.samples, 8 * best.order):
            moved = polish(best, _first(data, samples)).model
            best = moved if _is_near(moved, start) else best
        if samples == data.samples:
            return best
        periods *= 2.0


def _first(data: Data, samples: int) -> Data:
    return Data(data.y[:, :samples], data.scale, data.floor, data.step, data.column, data.shape)


def _is_near(found: Model, start: Model) -> bool:
    """Whether each pole is still the one that it was."""
    now, then = np.concatenate([found.pairs, found.reals]), np.concatenate([start.pairs, start.reals])
    ratio = np.abs(now) / np.abs(then)
    return bool((found.reals < 0.0).all() and (ratio < _FASTER).all() and (ratio > 1.0 / _FASTER).all())


def _doubt(found: Fit, data: Data, swinging: int, rate: float) -> np.ndarray:
    """What noise may hide of the vibration: of the modes' amplitudes, and of any other line that decays as the modes do.

    A line A exp(-rate t) cos(w t + phi) in white noise of deviation s is found with the deviation s sqrt(2 / E) of both its
    components, E = sum exp(-2 rate t). The largest one found in the residual, and what noise may have hidden of it, is the bound.
    """
    known = np.sqrt(np.sum(covariance(found, data).coefficients[:swinging] ** 2, axis=0))
    envelope = np.exp(-max(0.0, rate) * data.time)
    energy = float(envelope @ envelope)
    lines = np.abs(np.fft.rfft(found.residual * envelope, axis=1)).max(axis=1) * 2.0 / energy
    return _SURE * known + lines + _HIDDEN * found.noise * math.sqrt(2.0 / energy)
