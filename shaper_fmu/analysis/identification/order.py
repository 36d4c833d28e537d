"""Selects the poles of a response: singular values bound their number, the Bayesian information criterion decides.

A pole stays if leaving it out makes the criterion worse; what the residual still shows is added, as long as that makes it better.
"""

from __future__ import annotations

import math
from collections.abc import Iterator
from dataclasses import replace

import numpy as np

from shaper_fmu.analysis.identification.basis import Model, model
from shaper_fmu.analysis.identification.projection import Fit, covariance, fit, polish
from shaper_fmu.analysis.identification.record import Data
from shaper_fmu.analysis.identification.subspace import poles, subspace

_PATIENCE = 4
_SHARES = (1.0, 0.25, 0.0625)
_FEWEST_SAMPLES = 200
_ALIKE = 0.25
"""Correlation from sample to sample up to which nothing is left that the beginning could show."""
_MOST_GROWTH = 6
_TRIALS = 2
_TRIAL_STEPS = 12
_HOPE = 2.0
"""A further pole is worth a polish if the criterion is worse with it by less than this times log(values)."""
_CERTAIN = 400.0
"""Squares of coefficients over their variances above which the presence of a pole is certain."""
_HARDLY = 0.2
_SLOW = 4.0
_BETTER = 2.0
"""A change of the criterion by less than this is none."""


def find_model(data: Data, most: int) -> Fit:
    """The fit of the model with the least criterion that the search meets; at most `most` poles that are not at 0."""
    found = _pruned(_split(polish(_first(data, most), data), data), data)
    for _ in range(_MOST_GROWTH):
        if (found.noise <= 1.5 * data.floor).all():
            break
        grown = _grown(found, data, most)
        if grown is None:
            break
        found = _pruned(_split(grown, data), data)
    return found


def _first(data: Data, most: int) -> Model:
    """The best order by the subspace alone: of the whole record, and of its beginning, where fast modes have not decayed."""
    best = fit(model(), data)
    for share in _SHARES:
        best = _by_subspace(data, most, share, best)
        if (best.noise <= 1.5 * data.floor).all() or _looks_white(best.residual):
            break
    return best.model


def _looks_white(residual: np.ndarray) -> bool:
    """Whether neighbouring samples of each row hardly depend on each other."""
    alike = np.abs(np.sum(residual[:, 1:] * residual[:, :-1], axis=1))
    return bool((alike <= _ALIKE * np.sum(residual * residual, axis=1)).all())


def _by_subspace(data: Data, most: int, share: float, best: Fit) -> Fit:
    """The best order by the subspace of this share of the record, if it is better than `best`."""
    samples = int(share * data.samples)
    if samples < _FEWEST_SAMPLES and share < 1.0:
        return best
    found = subspace(data.y[:, :samples], data.step, share * data.duration, np.ones(len(data.y)))
    most = min(found.order + 2, most + 2, found.first.shape[1], found.first.shape[0])
    standing_out = min(found.order, most)  # with many modes smaller orders explain nothing
    worse = 0
    for order in range(1 if share == 1.0 else max(1, standing_out), most + 1):
        if worse > _PATIENCE and (order != standing_out or _looks_white(best.residual)):
            continue
        trial = min((fit(m, data) for m in _models(*poles(found, order), data.duration)), key=lambda f: f.criterion)
        best, worse = (trial, 0) if trial.criterion < best.criterion else (best, worse + 1)
        if (best.noise <= 1.5 * data.floor).all():
            break
    return best


def _models(pairs: np.ndarray, reals: np.ndarray, at_zero: int, duration: float) -> Iterator[Model]:
    """The model of these poles; and, where slow ones may stand for three poles at 0, that with these in their place."""
    yield model(pairs, reals)
    slow_pairs, slow_reals = np.abs(pairs) * duration < _SLOW, np.abs(reals) * duration < _SLOW
    if at_zero + 2 * np.count_nonzero(slow_pairs) + np.count_nonzero(slow_reals) > 2:
        yield model(pairs[~slow_pairs], reals[~slow_reals], 2)


def _grown(found: Fit, data: Data, most: int) -> Fit | None:
    """A better fit with further poles that the residual shows; None if there is none."""
    if found.model.order - found.model.degree - 1 >= most:
        return None
    hope = found.criterion + _HOPE * math.log(data.y.size)
    trials = [found.model.joined(*more) for more in _seen_in(found, data)]
    trials = sorted((trial for trial in (fit(m, data) for m in trials) if trial.criterion < hope), key=lambda f: f.criterion)
    best: Fit | None = None
    for trial in trials[:_TRIALS]:
        polished = polish(trial.model, data, rounds=1, steps=_TRIAL_STEPS)
        if polished.criterion < (best or found).criterion - _BETTER:
            best = polished
    return best and polish(best.model, data)


def _split(found: Fit, data: Data) -> Fit:
    """The fit with two real poles instead of a strongly damped pair, if it is as good."""
    for k, pair in enumerate(found.model.pairs):
        if pair.imag < _HARDLY * abs(pair.real):
            apart = max(pair.imag, _HARDLY * abs(pair.real))
            reals = np.array([pair.real - apart, pair.real + apart])
            split = polish(replace(found.model, pairs=np.delete(found.model.pairs, k)).joined(np.zeros(0), reals), data)
            if split.criterion < found.criterion + _BETTER:
                return _split(split, data)
    return found


def _seen_in(found: Fit, data: Data) -> Iterator[tuple[np.ndarray, np.ndarray]]:
    """Pairs and real poles that the residual may hold: by the subspace, and at the peak of the periodogram."""
    none = np.zeros(0)
    rest = subspace(found.residual, data.step, data.duration, found.noise)
    for order in (1, 2, 3, 4):
        pairs, reals, _ = poles(rest, order)
        yield from ((np.array([pair]), none) for pair in pairs)
        yield from ((none, np.array([real])) for real in reals)
    spectrum = np.fft.rfft(found.residual, 2 * data.samples) / found.noise[:, None]
    power = np.sum(np.abs(spectrum) ** 2, axis=0)
    peak = 1 + int(np.argmax(power[1:-1]))
    frequency = math.pi * peak / (data.samples * data.step)
    for decay in (0.5, 2.0, 8.0, 32.0):
        yield np.array([complex(-decay / data.duration, frequency)]), none


def _pruned(found: Fit, data: Data) -> Fit:
    """The fit without those poles whose absence the criterion does not mind, as they are or with the others moved a little."""
    while True:
        smaller = list(_smaller(found, data))
        trials = [fit(m, data) for m in smaller]
        if not any(trial.criterion <= found.criterion + _BETTER for trial in trials):
            trials = [polish(m, data, rounds=1, steps=_TRIAL_STEPS) for m in smaller]
        best = min(trials, key=lambda f: f.criterion, default=found)
        if best is found or best.criterion > found.criterion + _BETTER:
            return found
        found = polish(best.model, data)


def _smaller(found: Fit, data: Data) -> Iterator[Model]:
    """Models with one pair, real pole or power less, as far as its presence is doubtful."""
    m = found.model
    certainty = np.sum((found.coefficients / covariance(found, data).coefficients) ** 2, axis=1)
    p = len(m.pairs)
    for k in range(p):
        if certainty[2 * k] + certainty[2 * k + 1] < _CERTAIN:
            yield replace(m, pairs=np.delete(m.pairs, k))
    for i in range(len(m.reals)):
        if certainty[2 * p + i] < _CERTAIN:
            yield replace(m, reals=np.delete(m.reals, i))
    if m.degree >= 0 and certainty[-1] < _CERTAIN:
        yield replace(m, degree=m.degree - 1)
