"""Modes from a command and the response to it, such as a swept-sine test: maximum likelihood of the poles of a driven sum of modes.

    y = sum_k Re(r_k q_k + c_k exp(p_k t)) + d u + e int u + f int int u + a + b t + lines,     q_k' = p_k q_k + u

Residues and all other coefficients are linear and drop out (variable projection); u is a straight line between samples, for which
q is exact. Poles are added where the transfer function from the command to what is left has its peak, lines (which the command does
not excite) where its spectrum has, as long as the Bayesian information criterion improves.
"""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray
from scipy.optimize import least_squares
from scipy.signal import csd, decimate, lfilter, welch

from shaper_fmu.analysis.decaying_sum import SHAPEABLE
from shaper_fmu.analysis.identification.findings import is_bent
from shaper_fmu.analysis.identification.projection import mixed, orthonormal, products
from shaper_fmu.analysis.identification.record import FreeResponse, IdentificationError
from shaper_fmu.analysis.identification.result import Finding, Identification, Mode, OtherPole

_MOST_SAMPLES = 6000
_MOST_POLES = 12
_DAMPINGS = (0.003, 0.02, 0.1)
_EXCITED = 1e-2
"""Share of the command's largest power density down to which it excites."""
_PER_PERIOD = 10.0
_BETTER = 8.0


@dataclass(frozen=True)
class Forced:
    """The result.

    Attributes:
        identification: residues are those of the response to a unit step of the command.
        band: that the command excites [Hz].
        weakest: least energy in the record of a mode of amplitude 1 after a unit step, in the band: sum of its squares.
        response: as it was fitted.
    """

    identification: Identification
    band: tuple[float, float]
    weakest: float
    response: FreeResponse


@dataclass(frozen=True)
class _Fit:
    poles: NDArray[np.complex128]
    lines: np.ndarray
    coefficients: np.ndarray
    deviations: np.ndarray
    residual: np.ndarray
    noise: np.ndarray
    criterion: float


def identify_forced(response: FreeResponse, command: np.ndarray, smallest_share: float = 1e-3) -> Forced:
    """The modes that a command excites, from all of the record. Raises IdentificationError where it does not support an answer."""
    response, command = _thinned(response, command)
    record = _Record(response, command)
    found = record.found()
    return _result(record, found, smallest_share)


def _thinned(response: FreeResponse, command: np.ndarray) -> tuple[FreeResponse, np.ndarray]:
    """Fewer samples, of both through the same filter, as many as the command's band needs."""
    _, high = _band(command, response.step)
    every = min(math.ceil(len(command) / _MOST_SAMPLES), int(1.0 / (_PER_PERIOD * high * response.step)))
    if every < 2:
        return response, command
    values = np.column_stack([decimate(column, every, ftype="fir") for column in response.values.T])
    less = FreeResponse(values, response.step * every, response.names, response.floor / math.sqrt(every))
    return less, np.asarray(decimate(command, every, ftype="fir"))


def _band(command: np.ndarray, step: float) -> tuple[float, float]:
    """The frequencies between which a command excites [Hz]."""
    frequency, power = welch(command - command.mean(), 1.0 / step, nperseg=max(64, len(command) // 8))
    if not power.max() > 0.0:
        raise IdentificationError("the command does not change: it excites nothing")
    excited = frequency[power > _EXCITED * power.max()]
    return float(max(excited[0], frequency[1])), float(excited[-1])


def driven(pole: complex, u: np.ndarray, step: float) -> NDArray[np.complex128]:
    """q' = pole q + u from rest, u linear between samples."""
    z = pole * step
    grown = np.exp(z)
    first = (grown - 1.0) / z
    second = (first - 1.0) / z
    drive = np.zeros(len(u), complex)
    drive[1:] = step * ((first - second) * u[:-1] + second * u[1:])
    return np.asarray(lfilter([1.0], [1.0, -grown], drive), np.complex128)


class _Record:
    """A response and its command, and fits of models to them."""

    def __init__(self, response: FreeResponse, command: np.ndarray):
        self.response, self.u, self.step = response, command / np.abs(command).max(), response.step
        self.size = float(np.abs(command).max())
        self.band = _band(command, response.step)
        self.time = response.step * np.arange(len(command))
        self.scale = np.maximum(np.std(response.values, axis=0), 1e-300)
        self.y = (response.values / self.scale).T
        self.floor = np.maximum(response.floor / self.scale, 1e-7)
        once = np.cumsum(self.u) * self.step
        self._static = np.array([self.u, once, np.cumsum(once) * self.step, np.ones_like(self.time), self.time])

    def found(self) -> _Fit:
        """The fit of the model with the least criterion that the search meets."""
        best = self.fit(np.zeros(0, complex), np.zeros(0))
        while len(best.poles) + len(best.lines) < _MOST_POLES and (best.noise > 1.5 * self.floor).any():
            trials = [self.fit(np.append(best.poles, pole), best.lines) for pole in self._candidates(best)]
            trials += [self.fit(best.poles, np.append(best.lines, line)) for line in self._lines(best)]
            trials = sorted(trials, key=lambda one: one.criterion)[:2]
            better = min((self.polished(one) for one in trials), key=lambda one: one.criterion, default=best)
            if not better.criterion < best.criterion - _BETTER:
                break
            best = better
        return best

    def fit(self, poles: NDArray[np.complex128], lines: np.ndarray) -> _Fit:
        """The best coefficients for given poles and lines [rad/s]."""
        rows: list[np.ndarray] = []
        for pole in poles:
            q, free = driven(complex(pole), self.u, self.step), np.asarray(np.exp(complex(pole) * self.time), np.complex128)
            rows += [q.real, -q.imag, free.real, -free.imag]
        for line in lines:
            rows += [np.cos(line * self.time), -np.sin(line * self.time)]
        functions = np.array([*rows, *self._static])
        span, change = orthonormal(functions)
        inside = products(span, self.y)
        residual = self.y - mixed(inside.T, span)
        n, unknowns = self.y.shape[1], 4 * len(poles) + 2 * len(lines) + len(functions) * len(self.y)
        squares = np.einsum("ij,ij->i", residual, residual)
        deviation = np.sqrt(np.maximum(squares / n, self.floor**2))
        noise = np.maximum(np.sqrt(squares / max(1.0, n - len(functions) - 2.0 * len(poles))), self.floor)
        criterion = 2.0 * n * float(np.log(deviation).sum()) + unknowns * math.log(n * len(self.y))
        spread = np.sqrt(np.einsum("ij,ij->j", change, change))
        return _Fit(poles, lines, change.T @ inside, spread, residual, noise, criterion)

    def polished(self, begun: _Fit) -> _Fit:
        """Poles and lines of greatest likelihood near those of a fit."""
        if not len(begun.poles) + len(begun.lines):
            return begun
        done = least_squares(
            lambda values: self._weighted(values, len(begun.poles), begun.noise), self.parameters(begun), x_scale=1e-2, max_nfev=30
        )
        return self.fit(*self._parts(done.x, len(begun.poles)))

    def covariance(self, found: _Fit) -> np.ndarray:
        """Of the parameters, from the Jacobian."""
        x = self.parameters(found)
        base = self._weighted(x, len(found.poles), found.noise)
        moves = 1e-6 * np.eye(len(x))
        jacobian = np.array([(self._weighted(x + move, len(found.poles), found.noise) - base) / 1e-6 for move in moves]).T
        return np.linalg.pinv(jacobian.T @ jacobian)

    @staticmethod
    def parameters(found: _Fit) -> np.ndarray:
        """Logarithms of decay rates and of frequencies, so that poles stay stable."""
        return np.concatenate([np.log(-found.poles.real), np.log(found.poles.imag), np.log(found.lines)])

    def _weighted(self, values: np.ndarray, count: int, noise: np.ndarray) -> np.ndarray:
        return (self.fit(*self._parts(values, count)).residual / noise[:, None]).ravel()

    def _parts(self, values: np.ndarray, count: int) -> tuple[NDArray[np.complex128], np.ndarray]:
        fastest = math.pi / self.step
        values = np.clip(values, -30.0, math.log(fastest))
        return -np.exp(values[:count]) + 1j * np.exp(values[count : 2 * count]), np.exp(values[2 * count :])

    def _candidates(self, found: _Fit) -> list[complex]:
        """Poles at the peak of the transfer function from the command to what is left, within the band."""
        best = []
        for residual, noise in zip(found.residual, found.noise, strict=True):
            length = min(len(residual), max(256, len(residual) // 2))
            frequency, cross = csd(self.u, residual, 1.0 / self.step, nperseg=length)
            power = welch(self.u, 1.0 / self.step, nperseg=length)[1]
            inside = (frequency >= self.band[0]) & (frequency <= self.band[1]) & (power > 0.0)
            if inside.any():
                size = np.where(inside, np.abs(cross) / np.sqrt(np.where(power > 0.0, power, 1.0)), 0.0) / noise
                best += [float(frequency[int(np.argmax(size))])]
                gain = np.where(inside, np.abs(cross) / np.where(power > _EXCITED * power.max(), power, np.inf), 0.0)
                best += [float(frequency[int(np.argmax(gain))])]
        w = 2.0 * math.pi * np.array(sorted(set(best)))
        return [complex(-zeta * x, x * math.sqrt(1.0 - zeta * zeta)) for x in w[w > 0.0] for zeta in _DAMPINGS]

    def _lines(self, found: _Fit) -> list[float]:
        """The peak of the spectrum of what is left."""
        power = np.sum(np.abs(np.fft.rfft(found.residual * np.hanning(len(self.time)), axis=1) / found.noise[:, None]) ** 2, axis=0)
        return [2.0 * math.pi * (3 + int(np.argmax(power[3:-1]))) / (len(self.time) * self.step)]


def _result(record: _Record, found: _Fit, smallest_share: float) -> Forced:
    covariance = record.covariance(found) if len(found.poles) + len(found.lines) else np.zeros((0, 0))
    count, modes, others = len(found.poles), [], []
    for k, pole in enumerate(found.poles):
        p = complex(pole)
        rows = found.coefficients[4 * k : 4 * k + 2] * record.scale / record.size
        spread = np.hypot(*found.deviations[4 * k : 4 * k + 2]) * found.noise * record.scale / record.size
        block = covariance[np.ix_([k, count + k], [k, count + k])]
        w, zeta = abs(p), -p.real / abs(p)
        of_w, of_zeta = np.array([p.real**2, p.imag**2]) / w, np.array([zeta, -zeta]) * p.imag**2 / w**2
        modes.append(
            Mode(
                w,
                math.sqrt(max(0.0, of_w @ block @ of_w)),
                zeta,
                math.sqrt(max(0.0, of_zeta @ block @ of_zeta)),
                ((rows[0] + 1j * rows[1]) / p)[None, :],
                (spread / w)[None, :],
                0.0,
                p,
            )
        )
    total = sum((np.abs(mode.residues[0]) for mode in modes if mode.damping_ratio < SHAPEABLE), np.zeros(len(record.scale)))
    kept = []
    for mode in sorted(modes, key=lambda one: one.natural_frequency):
        share = float(np.max(np.abs(mode.residues[0]) / np.where(total > 0.0, total, 1.0)))
        kind = "overdamped" if mode.damping_ratio >= SHAPEABLE else "minor" if share < smallest_share else None
        if kind is None:
            kept.append(Mode(**{**vars(mode), "share": share}))
        else:
            others.append(OtherPole(kind, mode.pole, mode.natural_frequency_std, mode.residues, share))
    others += [OtherPole("line", 1j * float(line), 0.0, np.zeros((1, len(record.scale)), complex), 0.0) for line in found.lines]
    findings = _findings(record, found, kept)
    residual = (found.residual.T * record.scale)[:, None, :]
    response = record.response
    identification = Identification(
        tuple(kept), tuple(others), (found.noise * record.scale)[None, :], 2 * count + 2 * len(found.lines), tuple(findings),
        response.names, response.step, len(record.time), record.scale[None, :], residual,
    )  # fmt: skip
    return Forced(identification, record.band, _weakest(record, kept), response)


def _findings(record: _Record, found: _Fit, modes: list[Mode]) -> list[Finding]:
    low, high = record.band
    findings = [Finding("band", f"the command excites from {low:.3g} to {high:.3g} Hz: modes outside of that are not seen")]
    lines = " and ".join(f"{line / (2.0 * math.pi):.5g}" for line in found.lines)
    if lines:
        findings.append(Finding("hum", f"lines at {lines} Hz, which the command does not excite, were excluded"))
    findings += [
        Finding("poor", f"the mode at {mode.natural_frequency:.4g} rad/s is poorly known, +-{mode.natural_frequency_std:.2g} rad/s")
        for mode in modes
        if mode.natural_frequency_std > 0.1 * mode.natural_frequency
    ]
    seen = [
        one for one, noise, floor in zip(found.residual, found.noise, record.floor, strict=True) if noise > max(3.0 * floor, 1e-3)
    ]
    if any(is_bent(one) for one in seen):
        text = "what the fit leaves is not white noise: the modes do not explain all of the response to the command"
        findings.append(Finding("coloured", text))
    if not modes and not any(one.code == "coloured" for one in findings):
        findings.append(Finding("no_vibration", "the command excites no mode of vibration"))
    return findings


def _weakest(record: _Record, modes: list[Mode]) -> float:
    """Least energy in the record of a mode of amplitude 1 after a unit step, over the band."""
    zeta = float(np.median([mode.damping_ratio for mode in modes])) if modes else 0.02
    energies = []
    for hertz in np.geomspace(*record.band, 16):
        pole = 2.0 * math.pi * hertz * complex(-zeta, math.sqrt(max(1e-12, 1.0 - zeta * zeta)))
        energies.append(0.5 * float(np.sum(np.abs(pole * driven(pole, record.u * record.size, record.step)) ** 2)))
    return max(1e-300, min(energies))
