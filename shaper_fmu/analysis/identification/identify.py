"""Identification of modes from free responses."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from shaper_fmu.analysis.identification.basis import model
from shaper_fmu.analysis.identification.classify import (
    FEWEST_PERIODS,
    FEWEST_SAMPLES_PER_PERIOD,
    Parts,
    parts_of,
    placed,
)
from shaper_fmu.analysis.identification.order import find_model
from shaper_fmu.analysis.identification.projection import Fit, fit
from shaper_fmu.analysis.identification.record import Data, FreeResponse, IdentificationError, check_clipping, scaled
from shaper_fmu.analysis.identification.result import Finding, Identification, Mode

MOST_POLES = 24
SMALLEST_SHARE = 1e-4
RESOLUTION = 1e-7
_COLOURED = 0.3
_POOR = 0.1


def identify(
    responses: FreeResponse | Sequence[FreeResponse],
    *,
    smallest_share: float = SMALLEST_SHARE,
    resolution: float = RESOLUTION,
    most_poles: int = MOST_POLES,
) -> Identification:
    """The modes of one or several free responses (experiments with the same outputs and step, which share their poles).

    Args:
        responses: from `free_response`.
        smallest_share: modes with less of the amplitude than this, in each output, are not told.
        resolution: what is below this share of an output's RMS is not looked at: the residual need not be smaller.
        most_poles: that are looked for, beside those at 0.

    Poles come from a subspace method, are polished to greatest likelihood for white noise, of each output its own, and are kept
    by the Bayesian information criterion. Raises IdentificationError where the data do not support an answer.
    """
    experiments = [responses] if isinstance(responses, FreeResponse) else list(responses)
    if not experiments:
        raise IdentificationError("there is no response to identify")
    for one in experiments:
        check_clipping(one)
    data = scaled(experiments, resolution)
    found = find_model(data, most_poles)
    parts = parts_of(found, data, smallest_share)
    _check_support(parts, found, data)
    residual = np.zeros((data.samples, *data.shape))
    for c, (experiment, output) in enumerate(data.column):
        residual[:, experiment, output] = found.residual[c] * data.scale[c]
    return Identification(
        parts.modes, parts.others, placed(found.noise * data.scale, data), found.model.order, tuple(_findings(parts, found, data)),
        experiments[0].names, data.step, data.samples, placed(data.scale, data), residual,
    )  # fmt: skip


def unexplained(response: FreeResponse, found: Identification) -> float:
    """What the poles found in another record leave of this one: RMS of the residual over that of the response, 0 to 1."""
    data = scaled([response], RESOLUTION)
    poles = [part.pole for part in (*found.modes, *found.others)]
    pairs, reals = [p for p in poles if p.imag > 0.0], [p.real for p in poles if p.imag == 0.0 and p.real != 0.0]
    left = fit(model(pairs, reals), data).residual
    return float(np.sqrt(np.mean(left * left)))


def _check_support(parts: Parts, found: Fit, data: Data) -> None:
    """Raise IdentificationError where nothing can be said, and why."""
    if parts.modes:
        return
    kinds = {other.kind: other for other in parts.others}
    if "too_slow" in kinds and kinds["too_slow"].share > 0.5:
        slow = kinds["too_slow"]
        period = 2.0 * np.pi / slow.pole.imag
        raise IdentificationError(
            f"the record is too short: {data.duration:g} s are {data.duration / period:.2g} periods of a motion that seems to "
            f"swing with a period of {period:.3g} s; at least {FEWEST_PERIODS:g} are needed, better 5"
        )
    if "too_fast" in kinds:
        raise IdentificationError(_too_coarse(kinds["too_fast"].pole, data))
    if not len(found.model.pairs) + len(found.model.reals) and (found.noise > 2.0 * data.floor).all():
        raise IdentificationError(
            "nothing but noise: no mode stands out from it; excite more, measure for longer, or look at other outputs"
        )


def _too_coarse(pole: complex, data: Data) -> str:
    samples = 2.0 * np.pi / (pole.imag * data.step)
    return (
        f"the samples are too coarse: the motion at {pole.imag:.4g} rad/s has {samples:.3g} samples per period, and may be the "
        f"alias of a faster one; at least {FEWEST_SAMPLES_PER_PERIOD:g} are needed, better 20: sample every "
        f"{data.step * samples / 20.0:.2g} s"
    )


def _findings(parts: Parts, found: Fit, data: Data) -> list[Finding]:
    """What the user should know, the weightiest first."""
    findings = [Finding("poor", _poor(mode)) for mode in parts.modes if _is_poor(mode)]
    texts = {
        "unstable": "unstable: a pair of poles at {pole:.4g} rad/s grows; no shaper helps, stabilise it first",
        "growth": "unstable: a real pole at {pole.real:.4g} 1/s grows; no shaper helps, stabilise it first",
        "drift": "it goes on moving at constant speed after the excitation: a rigid-body mode (two poles at 0), beside the rest",
        "acceleration": "it goes on accelerating after the excitation (three poles at 0)",
        "overdamped": "a pair of poles at {pole:.4g} rad/s decays before it swings, and needs no shaping",
        "harmonic": "a pole at {pole:.4g} rad/s, {share:.2g} of the response, is a sum of other poles: a slight nonlinearity",
        "too_slow": "a motion at {pole.imag:.3g} rad/s has too few periods in the record to be told; take a longer one",
    }
    for other in parts.others:
        if other.kind in texts:
            findings.append(Finding(other.kind, texts[other.kind].format(pole=other.pole, share=other.share)))
        elif other.kind == "too_fast":
            findings.append(Finding("too_fast", _too_coarse(other.pole, data)))
    minor = [other for other in parts.others if other.kind == "minor"]
    if minor:
        findings.append(Finding("minor", f"{len(minor)} poles have less than the smallest share of the response, and are not told"))
    if not parts.modes and not any(other.kind == "unstable" for other in parts.others):
        findings.append(Finding("no_vibration", "it does not vibrate: there is no pair of poles that swings; no shaper is needed"))
    if not found.converged:
        findings.append(Finding("not_converged", "the fit has not converged; its numbers are an estimate"))
    return findings + _coloured(found, data)


def _is_poor(mode: Mode) -> bool:
    return mode.natural_frequency_std > _POOR * mode.natural_frequency


def _poor(mode: Mode) -> str:
    return (
        f"the mode at {mode.natural_frequency:.4g} rad/s is poorly known, +-{mode.natural_frequency_std:.2g} rad/s; "
        "excite it more, or measure for longer"
    )


def _coloured(found: Fit, data: Data) -> list[Finding]:
    """A finding if residuals above the floor follow each other: then they are no white noise, and uncertainties are too small."""
    worst = 0.0
    for residual, noise, floor in zip(found.residual, found.noise, data.floor, strict=True):
        if noise > 3.0 * floor:
            worst = max(worst, float(residual[1:] @ residual[:-1] / (residual @ residual)))
    if worst < _COLOURED:
        return []
    text = f"what the fit leaves is no white noise (correlation {worst:.2f} from sample to sample): the uncertainties are too small"
    return [Finding("coloured", text)]
