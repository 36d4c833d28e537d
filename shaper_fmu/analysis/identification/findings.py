"""Writes the findings of an identification, and decides which of them contradict it."""

from __future__ import annotations

import math

import numpy as np
from scipy.stats import f as fisher

from shaper_fmu.analysis.identification.classify import FEWEST_SAMPLES_PER_PERIOD, Parts
from shaper_fmu.analysis.identification.projection import Fit
from shaper_fmu.analysis.identification.record import Data
from shaper_fmu.analysis.identification.result import Finding, Mode

CONTRADICTING = (
    "unstable", "growth", "too_slow", "too_fast", "poor", "not_converged", "coloured", "not_free", "assumed_free",
    "not_decaying",
)  # fmt: skip
"""Findings with which the modes of a fit prove nothing."""
_POOR = 0.1
_ABOVE_FLOOR = 3.0
"""Residuals below this many times the floor are ignored."""
_CORRELATED = 0.3
_BENT = 0.15
"""Distance of the cumulative periodogram from white noise's straight line, from which on residuals are not white..."""
_CERTAIN = 2.8
"""... and that times the root of the number of frequencies: by chance in 3e-7 of all cases (2 exp(-2 x^2))."""
_WHITE = 0.25
"""Correlation from sample to sample up to which a motion at rest is noise."""
_RESOLVED = 1e-6
"""Residuals below this share of the response are rounding."""
_FIRST = 8
"""Samples of the shortest beginning that is compared with the rest."""
_CHANCE = 1e-7


def findings_of(parts: Parts, found: Fit, data: Data, smallest_share: float) -> list[Finding]:
    """The findings of an identification, the most important first."""
    findings = [Finding("poor", _poor(mode)) for mode in parts.modes if mode.natural_frequency_std > _POOR * mode.natural_frequency]
    texts = {
        "unstable": "unstable: a pair of poles at {pole:.4g} rad/s grows; no shaper helps, stabilise it first",
        "growth": "unstable: a real pole at {pole.real:.4g} 1/s grows; no shaper helps, stabilise it first",
        "drift": "it moves on at constant speed after the excitation: there is also a rigid-body mode (two poles at 0)",
        "acceleration": "it accelerates further after the excitation (three poles at 0)",
        "overdamped": "a pair of poles at {pole:.4g} rad/s decays before it swings, and needs no shaping",
        "harmonic": "a pole at {pole:.4g} rad/s, {share:.2g} of the response, is a sum of other poles: taken for a slight "
        "nonlinearity, not for a mode",
        "too_slow": "a motion at {pole.imag:.3g} rad/s has too few periods in the record to be identified; take a longer one",
    }
    for other in parts.others:
        if other.kind in texts:
            findings.append(Finding(other.kind, texts[other.kind].format(pole=other.pole, share=other.share)))
        elif other.kind == "too_fast":
            findings.append(Finding("too_fast", too_coarse(other.pole, data)))
    minor = [other for other in parts.others if other.kind == "minor"]
    if minor:
        findings.append(
            Finding("minor", f"{len(minor)} poles are not listed: they have less than the smallest share of the response")
        )
    if not found.converged:
        findings.append(Finding("not_converged", "the fit has not converged; its numbers are an estimate"))
    findings += _of_residual(found, data, smallest_share)
    if not parts.modes and not any(one.code in CONTRADICTING for one in findings):
        findings.append(Finding("no_vibration", "it does not vibrate: no pair of poles oscillates; no shaper is needed"))
    return findings


def too_coarse(pole: complex, data: Data) -> str:
    """The reason why a pole cannot be distinguished from its aliases."""
    samples = 2.0 * np.pi / (pole.imag * data.step)
    return (
        f"the samples are too coarse: the motion at {pole.imag:.4g} rad/s has {samples:.3g} samples per period, and may be the "
        f"alias of a faster one; at least {FEWEST_SAMPLES_PER_PERIOD:g} are needed, better 20: sample every "
        f"{data.step * samples / 20.0:.2g} s"
    )


def _poor(mode: Mode) -> str:
    return (
        f"the mode at {mode.natural_frequency:.4g} rad/s is poorly known, +-{mode.natural_frequency_std:.2g} rad/s; "
        "excite it more, or measure for longer"
    )


def _of_residual(found: Fit, data: Data, smallest_share: float) -> list[Finding]:
    """Findings if the residual of the fit is not white noise of constant size, if that matters for the smallest share."""
    columns = zip(found.residual, found.noise, data.floor, strict=True)
    seen = [residual for residual, noise, floor in columns if noise > max(_ABOVE_FLOOR * floor, smallest_share)]
    findings = []
    worst = max((float(one[1:] @ one[:-1] / (one @ one)) for one in seen), default=0.0)
    if worst > _CORRELATED or any(is_bent(one) for one in seen):
        detail = f"correlation {worst:.2f} from sample to sample"
        text = (
            f"the fit's residual is not white noise ({detail}): the modes do not explain all, and the uncertainties are too small"
        )
        findings.append(Finding("coloured", text))
    late = max((disturbed(one) for one in seen), default=0)
    if late:
        text = (
            f"the fit leaves more in the first {late * data.step:.3g} s than later: the response is not free from its beginning "
            "on, or was disturbed there"
        )
        findings.append(Finding("not_free", text))
    return findings


def is_steady(residual: np.ndarray) -> bool:
    """Whether both halves of white noise have the same variance (F test)."""
    half = len(residual) // 2
    powers = [float(np.mean(part * part)) for part in (residual[:half], residual[half:])]
    return max(powers) <= float(fisher.isf(_CHANCE, half, half)) * min(powers)


def is_bent(residual: np.ndarray) -> bool:
    """Bartlett's test for white noise: the cumulative periodogram is a straight line (Kolmogorov and Smirnov's bounds)."""
    power = np.cumsum(np.abs(np.fft.rfft(residual)[1:]) ** 2)
    count = len(power)
    apart = float(np.abs(power / power[-1] - np.arange(1, count + 1) / count).max())
    return apart > max(_BENT, _CERTAIN / math.sqrt(count))


def noise_of(record: np.ndarray) -> np.ndarray:
    """Standard deviation of the white noise that each output is at rest, shape (m,); 0 where it moves otherwise.

    A straight line is taken away first. White is what passes Bartlett's test, with next to no correlation between neighbours, and
    as much power in the first half as in the second: a few coarse samples of a swing that grows or decays quickly pass the others.
    """
    found = np.zeros(record.shape[1])
    u = np.linspace(-1.0, 1.0, len(record))
    for j, column in enumerate(record.T):
        rest = column - np.polyval(np.polyfit(u, column, 1), u)
        power = float(rest @ rest)
        if power > 0.0 and abs(float(rest[1:] @ rest[:-1])) < _WHITE * power and is_steady(rest) and not is_bent(rest):
            found[j] = math.sqrt(power / (len(rest) - 2))
    return found


def disturbance(found: Fit) -> int:
    """How many of the first samples are explained worse than the rest, in any column; 0 for none."""
    return max((disturbed(one) for one in found.residual if np.abs(one).max() > _RESOLVED), default=0)


def disturbed(residual: np.ndarray) -> int:
    """How many of the first samples have a larger variance than the rest (F test), 0 for none."""
    squares, longest, n = np.cumsum(residual * residual), 0, len(residual)
    count = _FIRST
    while count <= n // 4:
        ratio = (squares[count - 1] / count) / ((squares[-1] - squares[count - 1]) / (n - count))
        if ratio > fisher.isf(_CHANCE, count, n - count):
            longest = count
        count *= 2
    return longest
