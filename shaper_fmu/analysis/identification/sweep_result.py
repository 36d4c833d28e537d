"""The modes of a response to a swept excitation that was not recorded, as other identifications give them."""

from __future__ import annotations

import math
from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray
from scipy.signal import decimate

from shaper_fmu.analysis.identification.forced import Forced
from shaper_fmu.analysis.identification.record import FreeResponse, IdentificationError
from shaper_fmu.analysis.identification.result import Finding, Identification, Mode, OtherPole
from shaper_fmu.analysis.identification.sweep_law import SweepLaw, law_of
from shaper_fmu.analysis.identification.sweep_modes import MOST_MODES, TOO_DAMPED, Fit, Spectrum
from shaper_fmu.analysis.identification.swept import Sweep

_SAMPLES_PER_PERIOD = 4.0
_NARROW = 4.0
"""Times the edges of the band that are not looked at: its least width."""
_FIRST_MODES = 4
"""Modes with which the laws are compared."""
_DRAWN_PER_PERIOD = 6.0
_TAPERED = 2.0
"""Length of the ends of the band over which its spectrum rises and falls [Hz]."""
_UNEXPLAINED = 0.05
"""Share of the largest peak of the frequency response that the fit may leave somewhere."""
_SMOOTHED = 9
_PEAK, _AROUND, _BESIDE = 3.0, 24, 2.0
"""A line: a bin so many times above the median, and the largest, of those around it."""


@dataclass(frozen=True)
class Swept:
    """The result.

    Attributes:
        forced: modes, whose residues are those of the response to a unit step of the excitation; its band; the impulse response.
        time: of the impulse response [s], from the impulse on, shape (n,).
        law: of the sweep.
    """

    forced: Forced
    time: np.ndarray
    law: SweepLaw


def identify_swept(response: FreeResponse, found: Sweep, smallest_share: float = 1e-3) -> Swept | None:
    """The modes from a response that sweeps; None if its frequency is no straight line over time.

    Raises IdentificationError for a band that is too narrow.
    """
    response = _thinned(response, max(found.first, found.last))
    known = law_of(response, found)
    if known is None:
        return None
    law, _ = known
    low, high = law.band
    edge = law.seen[0] - low
    if high - low < _NARROW * edge:
        raise IdentificationError(
            f"the sweep from {low:.3g} to {high:.3g} Hz with {abs(law.rate):.3g} Hz/s is too narrow; sweep over "
            f"{_NARROW * edge:.3g} Hz at least, or more slowly"
        )
    lines = _without_lines(response, law)
    laws = [replace(law, stepped=stepped, growing=growing) for stepped, growing in ((True, True), (False, True), (False, False))]
    begun = [(spectrum, spectrum.found(most=_FIRST_MODES)) for spectrum in (Spectrum(lines[0], one) for one in laws)]
    spectrum, fit = min(begun, key=lambda one: one[1].criterion)
    return _result(spectrum, spectrum.found(fit), response, lines[1], smallest_share)


def driven_column(response: FreeResponse, found: Sweep) -> int | None:
    """The column that moves most along the sweep; None if its frequency is no straight line over time."""
    known = law_of(_thinned(response, max(found.first, found.last)), found)
    return known[1] if known is not None else None


def _thinned(response: FreeResponse, highest: float) -> FreeResponse:
    """As many samples as the sweep needs."""
    every = int(1.0 / (_SAMPLES_PER_PERIOD * highest * response.step))
    if every < 2:
        return response
    values = np.column_stack([decimate(column - column.mean(), every, ftype="fir") for column in response.values.T])
    return replace(response, values=values, step=response.step * every, floor=response.floor / math.sqrt(every))


def _without_lines(response: FreeResponse, law: SweepLaw) -> tuple[FreeResponse, list[float]]:
    """The response without lines, whose amplitude stays over the record, and their frequencies [Hz].

    A Hann window leaves a line within two bins of its frequency.
    """
    n = len(response.values)
    spectrum = np.fft.rfft(response.values * np.hanning(n)[:, None], axis=0)
    size = np.sqrt(np.sum(np.abs(spectrum) ** 2, axis=1))
    low, high = (round(f * n * response.step) for f in law.band)
    found = []
    for i in range(max(low, _AROUND + 1), min(high, len(size) - _AROUND - 1)):
        if size[i] >= max(size[i - 1], size[i + 1]):
            around = np.concatenate([size[i - _AROUND : i - 2], size[i + 3 : i + _AROUND + 1]])
            if size[i] > _PEAK * float(np.median(around)) and size[i] > _BESIDE * float(around.max()):
                left, right = np.log(size[i - 1] / size[i]), np.log(size[i + 1] / size[i])
                found.append((i + 0.5 * float((left - right) / (left + right))) / (n * response.step))
    if not found:
        return response, found
    time = response.step * np.arange(n)
    waves = [f(2.0 * math.pi * line * time) for line in found for f in (np.cos, np.sin)]
    basis = np.column_stack([*waves, np.ones(n)])
    fitted = basis[:, :-1] @ np.linalg.lstsq(basis, response.values, rcond=None)[0][:-1]
    return replace(response, values=response.values - fitted), found


def _result(spectrum: Spectrum, fit: Fit, response: FreeResponse, lines: list[float], smallest_share: float) -> Swept:
    modes = _modes(spectrum, fit)
    total = sum((np.abs(mode.residues[0]) for mode in modes if mode.damping_ratio < TOO_DAMPED), np.zeros(len(spectrum.scale)))
    kept, others = [], []
    for mode in sorted(modes, key=lambda one: one.natural_frequency):
        share = float(np.max(np.abs(mode.residues[0]) / np.where(total > 0.0, total, 1.0)))
        kind = "overdamped" if mode.damping_ratio > 0.999 * TOO_DAMPED else "minor" if share < smallest_share else None
        if kind is None:
            kept.append(replace(mode, share=share))
        else:
            others.append(OtherPole(kind, mode.pole, mode.natural_frequency_std, mode.residues, share))
    none = np.zeros((1, len(spectrum.scale)), complex)
    others += [OtherPole("line", 2j * math.pi * line, 0.0, none, 0.0) for line in lines]
    time, impulse, fitted = _impulse_responses(spectrum, fit)
    residual = impulse - fitted
    noise = np.maximum(np.std(residual, axis=0), 1e-300)
    findings = _findings(spectrum, fit, kept, lines)
    identification = Identification(
        tuple(kept), tuple(others), noise[None, :], 2 * len(fit.poles) + 2 * len(lines), tuple(findings), response.names,
        float(time[1]), len(time), np.std(impulse, axis=0)[None, :], residual[:, None, :],
    )  # fmt: skip
    band = float(spectrum.frequency[0]), float(spectrum.frequency[-1])
    shown = replace(response, values=impulse, step=float(time[1]), floor=np.zeros(len(noise)))
    return Swept(Forced(identification, band, _weakest(spectrum, fit, kept, noise), shown), time, spectrum.law)


def _modes(spectrum: Spectrum, fit: Fit) -> list[Mode]:
    covariance, count, modes = spectrum.covariance(fit), len(fit.poles), []
    for k, pole in enumerate(fit.poles):
        p = complex(pole)
        w, zeta = abs(p), -p.real / abs(p)
        a, b = fit.coefficients[2 + 2 * k : 4 + 2 * k] * spectrum.scale
        per_step = 2.0 / (p * 2j * p.imag)  # residue of (a w^2 + b w s) / (s^2 + 2 zeta w s + w^2) / s at p, twice
        spread = np.hypot(*fit.deviations[2 + 2 * k : 4 + 2 * k]) * fit.noise * spectrum.scale
        modes.append(
            Mode(
                w,
                w * math.sqrt(covariance[k, k]),
                zeta,
                zeta * math.sqrt(covariance[count + k, count + k]),
                ((a * w * w + b * w * p) * per_step)[None, :],
                (spread * w * w * abs(per_step))[None, :],
                0.0,
                p,
            )
        )
    return modes


def _impulse_responses(spectrum: Spectrum, fit: Fit) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """Times [s], shape (n,), and the impulse response within the band, measured and fitted, shape (n, m)."""
    frequency, every = spectrum.frequency, float(spectrum.frequency[1] - spectrum.frequency[0])
    first = round(float(frequency[0]) / every)
    count = 2 * math.ceil(0.5 * _DRAWN_PER_PERIOD * float(frequency[-1]) / every)
    edge = np.clip(np.minimum(frequency - frequency[0], frequency[-1] - frequency) / _TAPERED, 0.0, 1.0)
    back = np.exp(-1j * spectrum.turn(fit.phase)) / spectrum.weight * np.sin(0.5 * math.pi * edge) ** 2
    both = []
    for values in (spectrum.values, spectrum.model(fit)):
        half = np.zeros((len(values), count // 2 + 1), complex)
        half[:, first : first + len(frequency)] = values * back
        both.append(np.fft.irfft(half, count, axis=1).T * every * count)
    return np.arange(count) / (every * count), both[0], both[1]


def _weakest(spectrum: Spectrum, fit: Fit, modes: list[Mode], noise: np.ndarray) -> float:
    """Least energy of a mode of amplitude 1 after a unit step, over the band, in units of `noise` of the impulse response."""
    zeta = float(np.median([mode.damping_ratio for mode in modes])) if modes else 0.02
    s, energies = 2j * math.pi * spectrum.frequency, []
    for hertz in np.geomspace(spectrum.frequency[0], spectrum.frequency[-1], 16):
        w = 2.0 * math.pi * hertz
        energies.append(float(np.sum(np.abs(w * w / (s * s + 2.0 * zeta * w * s + w * w) * spectrum.weight) ** 2)))
    left = np.sqrt(np.mean(fit.residual**2, axis=1)) * spectrum.scale
    units = float(np.min((noise / np.maximum(left, 1e-300)) ** 2))
    return max(1e-300, min(energies) * units)


def _findings(spectrum: Spectrum, fit: Fit, modes: list[Mode], lines: list[float]) -> list[Finding]:
    law, (low, high) = spectrum.law, spectrum.law.band
    growing = "an amplitude proportional to its frequency" if law.growing else "a constant amplitude"
    stepped = ", each frequency for half a period," if law.stepped else ""
    findings = [
        Finding(
            "sweep",
            f"the command was not recorded: it is taken for a sweep from {law.first:.4g} to {law.last:.4g} Hz with "
            f"{law.rate:.5g} Hz/s{stepped} and {growing}, which the response shows from {law.begin:.4g} to {law.end:.4g} s "
            "after its first sample",
        ),
        Finding("band", f"the sweep excites from {low:.3g} to {high:.3g} Hz: modes outside of that are not seen"),
    ]
    if lines:
        told = " and ".join(f"{line:.5g}" for line in lines)
        findings.append(Finding("hum", f"lines at {told} Hz, which last as long as the record, were excluded"))
    findings += [
        Finding("poor", f"the mode at {mode.natural_frequency:.4g} rad/s is poorly known, +-{mode.natural_frequency_std:.2g} rad/s")
        for mode in modes
        if mode.natural_frequency_std > 0.1 * mode.natural_frequency
    ]
    left, place = _left(spectrum, fit)
    if left > _UNEXPLAINED:
        findings.append(
            Finding(
                "coloured",
                f"the modes do not explain all of the response to the sweep: up to {100.0 * left:.2g} % of the largest peak is "
                f"left, at {place:.4g} Hz"
                + (f" ({MOST_MODES} modes are looked for at most)" if len(fit.poles) == MOST_MODES else ""),
            )
        )
    if not modes and left <= _UNEXPLAINED:
        findings.append(Finding("no_vibration", "the sweep excites no mode of vibration"))
    return findings


def _left(spectrum: Spectrum, fit: Fit) -> tuple[float, float]:
    """The largest part of the frequency response that the fit leaves, but for noise, over its largest peak; and where [Hz]."""
    n = len(spectrum.frequency)
    worst = (0.0, 0.0)
    weights = np.hanning(_SMOOTHED + 2)[1:-1]
    for residual, whole, scale in zip(fit.residual, spectrum.values, spectrum.scale, strict=True):
        parts: NDArray[np.complex128] = (residual[:n] + 1j * residual[n:]) * scale / spectrum.weight
        smooth = np.abs(np.convolve(parts, weights / weights.sum(), "same"))
        i = int(np.argmax(smooth))
        worst = max(worst, (float(smooth[i] / np.abs(whole / spectrum.weight).max()), float(spectrum.frequency[i])))
    return worst
