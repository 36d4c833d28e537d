"""The survey: a first, broad experiment that finds the time scales of a plant."""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np

from shaper_fmu.analysis.identification import Identification, IdentificationError, free_response, identify, unexplained
from shaper_fmu.tune.identify.excitation import ExcitationKind
from shaper_fmu.tune.identify.response import Experiment, Response

LEVELS = (256, 2048, 8192)
"""Samples of a record: more are taken where so few do not show all, or not by poles alone."""
_PULSE = 4
_FEWEST = 256
_SMALLEST = 1e-3
_FACTOR = 6.0
_ROUNDS = 8
_FEWEST_PERIODS = 4.0
_ALIAS_STEP = 1.29
_UNEXPLAINED = 0.3
_EXPLAINED = 1e-3
"""The same where more samples may still be taken: the step matters, or a fast mode is seen as a slow one."""
_NONLINEAR = 5.0
_NARROW = 1.5
_SETTLED = 0.02
_GROWN = 1e4
_CLEAR = 3.0
_OVER = 0.01
_OVER_SHARE = 60


@dataclass(frozen=True)
class Survey:
    """The result of a survey: an identification, its duration [s], and the response."""

    found: Identification
    duration: float
    response: Response


def survey(experiment: Experiment, kind: ExcitationKind, amplitude: float, duration: float) -> Survey:
    """Find a duration at which the modes are visible, from `duration` [s] on; raises IdentificationError if there is none.

    Shorter where the response has content that the samples do not resolve, or aliases; longer where there are too few periods.
    It begins with few samples, and is content with these if they show vibration, all of it, and the same at another step.
    """
    seen: Survey | None = None
    for samples in LEVELS:
        last = samples == LEVELS[-1]
        try:
            seen, enough = _survey(experiment, kind, amplitude, seen.duration if seen is not None else duration, samples, duration)
        except IdentificationError:
            if last:
                raise
            continue
        if enough and (last or seen.found.vibrates or _is_unstable(seen)):
            return seen
    assert seen is not None  # else the error was raised
    return seen


def _survey(
    experiment: Experiment, kind: ExcitationKind, amplitude: float, duration: float, most: int, first: float
) -> tuple[Survey, bool]:
    """The best record of so many samples, and whether it shows all that is slow; raises IdentificationError if there is none."""
    best: Survey | None = None
    low, high = 0.0, math.inf  # durations known to be too short, too long
    begun = duration
    for _ in range(_ROUNDS):
        step = experiment.on_grid(duration / most)
        samples = most if step == duration / most else max(_FEWEST, round(duration / step))
        width = _PULSE * step if kind != "chirp" else 0.25 * duration
        response = experiment.respond(experiment.excitation(kind, amplitude, width, step), step, samples)
        too_long = _grows(response.values) or _stride(response) == 0 or _is_over(response.values)
        found = None if too_long else _identified(experiment, response)
        if found is not None:
            too_long = found.has("too_fast") or (found.vibrates and _aliased(experiment, response, found, most))
            if not too_long:
                best = Survey(found, duration, response)
                if _is_enough(best, first):
                    return best, True
        low, high = (low, duration) if too_long else (duration, high)
        if low > 0.0 and high < math.inf:
            duration = math.sqrt(low * high)
            if high < _NARROW * low:
                break
        else:
            duration = duration / _FACTOR if too_long else duration * _FACTOR
    if best is None:
        beside = (
            f"down to {high:.2g} s" if low == 0.0 else f"up to {low:.2g} s" if high == math.inf else f"{low:.2g} s to {high:.2g} s"
        )
        raise IdentificationError(
            f"no time scale was found at which the response shows vibration (tried: {begun:.3g} s, and {beside}): the "
            "outputs may follow the input at once, only integrate it, or stick. If they do vibrate, give as `duration` how long a "
            "few periods of the slowest mode take"
        )
    return best, False


def _grows(values: np.ndarray) -> bool:
    """Whether the response grows so much that its beginning cannot be seen beside its end."""
    early, late = (np.abs(part).max(axis=0) for part in (values[: len(values) // 8], values[-len(values) // 8 :]))
    return bool((late > _GROWN * early)[early > 0.0].any())


def _is_over(values: np.ndarray) -> bool:
    """Whether all has happened in the first few samples: the rest of each output is a straight line."""
    n = len(values)
    few, moves = n // _OVER_SHARE, False
    for rest in (_without_last_line(column) for column in values.T):
        size = np.abs(rest).max()
        if size > 1e-9 * np.abs(values).max():
            moves = True
            if np.abs(rest[few:]).max() > _OVER * size:
                return False
    return moves


def _is_enough(seen: Survey, first: float) -> bool:
    """Whether a record shows all that is slow; what does not vibrate but drifts may do so later."""
    found = seen.found
    if _is_unstable(seen):
        return True
    if found.has("too_slow"):
        return False
    if found.vibrates:
        return seen.duration >= _FEWEST_PERIODS * max(mode.period for mode in found.modes)
    drifts = found.has("drift") or found.has("acceleration")
    return seen.duration >= _FACTOR**3 * first or (not drifts and _has_settled(seen.response.values))


def _is_unstable(seen: Survey) -> bool:
    others = seen.found.others
    return any(one.kind in ("unstable", "growth") and one.pole.real * seen.duration > _CLEAR for one in others)


def _stride(response: Response) -> int:
    """Every how many-th sample resolves the response; 0 if not even every one does."""
    values, n = response.values, len(response.values)
    window = np.hanning(n)[:, None]
    u = np.linspace(-1.0, 1.0, n)[:, None]
    centred = values - values.mean(axis=0)
    centred = centred - u * (np.sum(u * centred, axis=0) / np.sum(u * u))
    spectrum = np.abs(np.fft.rfft(window * centred, axis=0))
    peak = spectrum.max(axis=0)
    noise = np.hypot(response.error, response.noise) * math.sqrt(float(np.sum(window * window)))
    level = np.where(peak > 20.0 * noise, np.maximum(_SMALLEST * peak, 8.0 * noise), np.inf)
    highest = int(np.max(np.flatnonzero(np.any(spectrum > level, axis=1)), initial=1))
    if n < 8.0 * highest:
        return 0
    return max(1, min(n // (12 * highest), n // 512))


def _identified(experiment: Experiment, response: Response) -> Identification | None:
    """By every few samples, or all where these are too few; None if the record does not support an answer."""
    stride = _stride(response)
    while stride:
        try:
            step = stride * float(response.time[1])
            record = free_response(response.values[::stride], step, experiment.plant.outputs, response.error)
            found = identify(record, smallest_share=_SMALLEST, resolution=1e-5)
        except IdentificationError:
            found = None
        if stride == 1 or (found is not None and not found.has("too_fast")):
            return found
        stride = max(1, stride // 3)
    return None


def _aliased(experiment: Experiment, response: Response, found: Identification, most: int) -> bool:
    """Whether the poles do not explain the response at other sample times; strictly where more samples may be taken."""
    excitation, known = response.excitation, float(response.time[1])
    step = experiment.on_grid(_ALIAS_STEP * known)
    again = experiment.excitation(excitation.kind, excitation.amplitude, excitation.width * step / known, step)
    samples = len(response.time) if most == LEVELS[-1] else len(response.time) // 2
    values = experiment.difference(again, step, samples)
    left = unexplained(free_response(values, step, experiment.plant.outputs, response.error), found, response.noise)
    return left > (_UNEXPLAINED if most == LEVELS[-1] else max(_EXPLAINED, _NONLINEAR * response.nonlinearity))


def _has_settled(values: np.ndarray) -> bool:
    """Whether the motion at the end is small compared with the whole, without a straight line."""
    for column in values.T:
        rest = _without_last_line(column)
        if np.ptp(rest[-len(rest) // 4 :]) > _SETTLED * np.ptp(rest) + 1e-12 * np.abs(column).max():
            return False
    return True


def _without_last_line(column: np.ndarray) -> np.ndarray:
    """A column less the straight line through its last quarter."""
    u = np.arange(len(column)) / len(column)
    late = slice(-len(column) // 4, None)
    return column - np.polyval(np.polyfit(u[late], column[late], 1), u)
