"""Modes from the response to a swept excitation that was not recorded, such as the raw data of Klipper's TEST_RESONANCES.

The response, divided by the spectrum of a sweep of the estimated law, is the machine's impulse response (Farina 2000): what the
excitation's harmonics excite comes before it, and is cut off with most of the noise. Its spectrum is fitted by maximum likelihood,

    H(s) = exp(i (a + b f + c f^2)) [d + e s^2 + sum_k (r_k + v_k s) / (s^2 + 2 zeta_k w_k s + w_k^2)],     s = 2 pi i f

with a phase, a delay and a dispersion (the errors of the law); r, v, d and e are real, linear and drop out (variable projection).
Modes are added where the residual has its peak, as long as the Bayesian information criterion improves. The noise counts as white
in the response.
"""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from shaper_fmu.analysis.identification.projection import mixed, orthonormal, products
from shaper_fmu.analysis.identification.record import FreeResponse
from shaper_fmu.analysis.identification.sweep_law import SweepLaw

_BEFORE, _AFTER = 1.0, 16.0
"""Part of the impulse response that is kept [s]: it decays until then, but for modes of hardly any damping."""
MOST_MODES = 12
_STEPS = 30
_STANDING = 1e-7
"""Share of the cost: less gain than that ends the search."""
_TAPERED = 1.0
"""Length of the ends of the band over which its spectrum rises and falls [Hz]."""
_DAMPINGS = (0.005, 0.02, 0.06, 0.15)
_BETTER = 8.0
_FLOOR = 5e-3
"""Of the response's size: nothing smaller is looked for, since the law is not exact."""
TOO_DAMPED = 0.5
_BEYOND = 1.3
"""Of the ends of the band: modes that are not farther away are looked for."""


@dataclass(frozen=True)
class Fit:
    """Poles [rad/s], the law's errors (a, b, c), and what belongs to them: real coefficients in rows, and a criterion."""

    poles: NDArray[np.complex128]
    phase: NDArray[np.float64]
    coefficients: np.ndarray
    deviations: np.ndarray
    residual: np.ndarray
    noise: np.ndarray
    criterion: float
    span: np.ndarray


class Spectrum:
    """The spectrum of the impulse response over the band of a sweep, and fits of modes to it.

    Attributes:
        law: of the sweep.
        frequency: [Hz], shape (n,), at distances of one over the length of the impulse response that was kept.
        values: of the response, but for the size of the sweep's spectrum at 1 Hz, shape (m, n).
        weight: size of the sweep's spectrum over that at 1 Hz, shape (n,): `values` over it is the frequency response.
        scale: of the values, shape (m,).
    """

    def __init__(self, response: FreeResponse, law: SweepLaw):
        self.law: SweepLaw = law
        self.frequency: np.ndarray
        self.values: np.ndarray
        self.weight: np.ndarray
        self.frequency, self.values, self.weight, self._phase = _divided(response, law)
        self.scale: np.ndarray = np.maximum(np.sqrt(np.mean(np.abs(self.values) ** 2, axis=1)), 1e-300)
        self._s = 2j * math.pi * self.frequency

    def found(self, begun: Fit | None = None, most: int = MOST_MODES) -> Fit:
        """The fit of the model with the least criterion that the search meets, from no mode or those of a fit on."""
        best = begun or self.fit(np.zeros(0, complex), self._phase)
        while len(best.poles) < most:
            trials = sorted((self.fit(np.append(best.poles, p), best.phase) for p in self._peaks(best)), key=lambda f: f.criterion)
            better = min((self.polished(one) for one in trials[:2]), key=lambda f: f.criterion, default=best)
            if not better.criterion < best.criterion - _BETTER:
                break
            best = better
        return best

    def fit(self, poles: NDArray[np.complex128], phase: NDArray[np.float64]) -> Fit:
        """The best real coefficients for given poles and phase."""
        functions = self._rows(poles) * self._turned(phase)
        span, change = orthonormal(_real(functions))
        y = _real(self.values) / self.scale[:, None]
        inside = products(span, y)
        residual = y - mixed(inside.T, span)
        columns, n = y.shape
        unknowns = 3 + 4 * len(poles) + len(functions) * columns  # poles twice: they are sought among many (Djuric 1996)
        deviation = np.sqrt(np.einsum("ij,ij->i", residual, residual) / n + _FLOOR**2)
        criterion = 2.0 * n * float(np.log(deviation).sum()) + unknowns * math.log(n * columns)
        spread = np.sqrt(np.einsum("ij,ij->j", change, change))
        return Fit(poles, phase, change.T @ inside, spread, residual, deviation, criterion, span)

    def _rows(self, poles: NDArray[np.complex128]) -> NDArray[np.complex128]:
        """The functions that the frequency response is made of, shape (2 + 2 k, n)."""
        rows = [np.ones_like(self._s), (self._s / abs(self._s[-1])) ** 2]
        for p in poles:
            rows += self._of_mode(complex(p))
        return np.array(rows)

    def _of_mode(self, p: complex) -> list[NDArray[np.complex128]]:
        below = self._s * self._s - 2.0 * p.real * self._s + abs(p) ** 2
        return [abs(p) ** 2 / below, abs(p) * self._s / below]

    def turn(self, phase: np.ndarray) -> np.ndarray:
        """The phase of the law's errors [rad], shape (n,)."""
        f = self.frequency / self.frequency[-1]
        return phase[0] + phase[1] * f + phase[2] * f * f

    def model(self, found: Fit) -> NDArray[np.complex128]:
        """What a fit makes of the values, shape (m, n)."""
        return (found.coefficients.T * self.scale[:, None]) @ (self._rows(found.poles) * self._turned(found.phase))

    def _turned(self, phase: np.ndarray) -> NDArray[np.complex128]:
        return np.asarray(np.exp(1j * self.turn(phase)) * self.weight)

    def polished(self, begun: Fit) -> Fit:
        """Poles and phase of greatest likelihood near those of a fit, by the Levenberg-Marquardt method."""
        found, damping, weight = begun, 1e-3, begun.noise**-2
        for _ in range(_STEPS):
            information, gradient = self._normal_equations(found, begun.noise)
            size = np.sqrt(np.maximum(np.diag(information), 1e-300))
            lower = None
            while damping < 1e9 and lower is None:
                scaled = information / np.outer(size, size) + damping * np.eye(len(size))
                move = np.linalg.solve(scaled, gradient / size)
                trial = self.at(parameters(found) + move / size)
                if _cost(trial, weight) <= _cost(found, weight):
                    lower = trial
                else:
                    damping *= 8.0
            if lower is None:
                break
            gain, found, damping = _cost(found, weight) - _cost(lower, weight), lower, max(1e-12, damping / 10.0)
            if gain < _STANDING * _cost(found, weight):
                break
        return found

    def _normal_equations(self, found: Fit, noise: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
        """Fisher's information of the parameters, and the direction in which the cost falls."""
        moved = self._jacobian(found, noise)
        flat = (found.residual / noise[:, None]).reshape(1, -1)
        return products(moved, moved), products(moved, flat)[:, 0]

    def _jacobian(self, found: Fit, noise: np.ndarray) -> np.ndarray:
        """Of the weighted residual, of the coefficients' change the part outside of the basis (Kaufman 1975), shape (k, 2 n m)."""
        f = self.frequency / self.frequency[-1]
        rows = self._rows(found.poles)
        turned = self._turned(found.phase)
        moved = []  # derivatives of the model, shape (m, n) each
        for of_damping in (False, True):
            for k, pole in enumerate(found.poles):
                near = _with(pole, 1e-6, of_damping)
                change = (np.array(self._of_mode(near)) - rows[2 + 2 * k : 4 + 2 * k]) / 1e-6
                moved.append(found.coefficients[2 + 2 * k : 4 + 2 * k].T @ (change * turned))
        whole = found.coefficients.T @ (rows * turned)
        moved += [1j * f**power * whole for power in range(3)]
        rows = [_real(one) for one in moved]
        outside = [one - mixed(products(one, found.span), found.span) for one in rows]
        return np.array([(one / noise[:, None]).ravel() for one in outside])

    def at(self, x: np.ndarray) -> Fit:
        """The fit of parameters, see `parameters`."""
        count = (len(x) - 3) // 2
        low, high = 2.0 * math.pi * self.frequency[[0, -1]]
        w = np.exp(np.clip(x[:count], math.log(low / _BEYOND), math.log(high * _BEYOND)))
        zeta = np.exp(np.clip(x[count : 2 * count], math.log(1e-5), math.log(TOO_DAMPED)))
        return self.fit(w * (-zeta + 1j * np.sqrt(1.0 - zeta * zeta)), x[2 * count :])

    def covariance(self, found: Fit) -> np.ndarray:
        """Of the parameters, from the Jacobian."""
        information, _ = self._normal_equations(found, found.noise)
        size = np.sqrt(np.maximum(np.diag(information), 1e-300))
        return np.linalg.pinv(information / np.outer(size, size), rcond=1e-14, hermitian=True) / np.outer(size, size)

    def _peaks(self, found: Fit) -> list[complex]:
        """Poles at the highest peaks of the residual."""
        n = len(self.frequency)
        residual = (found.residual[:, :n] + 1j * found.residual[:, n:]) / found.noise[:, None]
        places = []
        for width in (3, 15, 45):
            power = np.convolve(np.sum(np.abs(residual) ** 2, axis=0), np.hanning(width + 2)[1:-1], "same")
            places.append(int(np.argmax(power)))
        w = 2.0 * math.pi * self.frequency[sorted(set(places))]
        return [complex(-zeta * x, x * math.sqrt(1.0 - zeta * zeta)) for x in w for zeta in _DAMPINGS]


def parameters(found: Fit) -> np.ndarray:
    """Logarithms of natural frequencies and damping ratios, then the phase."""
    w = np.abs(found.poles)
    return np.concatenate([np.log(w), np.log(np.maximum(1e-5, -found.poles.real / np.maximum(w, 1e-300))), found.phase])


def _with(pole: complex, share: float, of_damping: bool) -> complex:
    """A pole of a natural frequency, or a damping ratio, that is larger by this share."""
    w, zeta = abs(pole), -pole.real / abs(pole)
    w, zeta = (w, zeta * (1.0 + share)) if of_damping else (w * (1.0 + share), zeta)
    return complex(-zeta * w, w * math.sqrt(1.0 - zeta * zeta))


def _real(values: NDArray[np.complex128]) -> np.ndarray:
    """Real parts and imaginary parts, shape (m, 2 n)."""
    return np.concatenate([values.real, values.imag], axis=1)


def _cost(found: Fit, weight: np.ndarray) -> float:
    return float(np.einsum("ij,ij->i", found.residual, found.residual) @ weight)


def _divided(response: FreeResponse, law: SweepLaw) -> tuple[np.ndarray, NDArray[np.complex128], np.ndarray, np.ndarray]:
    """Frequencies, the response's spectrum over them, the sweep's size, and first errors of the law."""
    n = 2 ** math.ceil(math.log2(len(response.values) + 2.0 * _AFTER / response.step))
    frequency = np.fft.rfftfreq(n, response.step)
    low, high = law.band
    inside = (frequency > low) & (frequency < high)
    values = np.fft.rfft(response.values - response.values.mean(axis=0), n, axis=0).T
    sweep = np.fft.rfft(law.command(response.step * np.arange(len(response.values))), n)
    size = np.where(inside & law.growing, frequency, 1.0)  # of the sweep's spectrum, but for its ripples
    turn = np.where(inside, np.conj(sweep) / np.where(inside, np.abs(sweep), 1.0) / size, 0.0)
    impulse = np.fft.irfft(values * turn * _taper(frequency, low, high), n, axis=1)
    peak = int(np.argmax(np.sum(impulse**2, axis=0)))
    coarse, spectrum = _short(np.roll(impulse, -peak, axis=1), response.step)
    used = (coarse >= law.seen[0]) & (coarse <= law.seen[1])
    phase = _excess_phase(coarse[used], spectrum[:, used].sum(axis=0))
    weight = coarse[used] if law.growing else np.ones(np.count_nonzero(used))
    return coarse[used], spectrum[:, used] * weight, weight, phase


def _short(impulse: np.ndarray, step: float) -> tuple[np.ndarray, NDArray[np.complex128]]:
    """Frequencies and spectrum of the part of an impulse response that is kept, without harmonics and most of the noise."""
    length = impulse.shape[1]
    after, before = min(length // 3, round(_AFTER / step)), min(length // 16, round(_BEFORE / step))
    window = np.cos(0.5 * math.pi * np.clip(np.linspace(-3.0, 1.0, after), 0.0, 1.0)) ** 2
    ahead = np.sin(0.5 * math.pi * np.clip(np.linspace(0.0, 2.0, before), 0.0, 1.0)) ** 2
    kept = np.concatenate([impulse[:, :after] * window, impulse[:, -before:] * ahead], axis=1)
    return np.fft.rfftfreq(after + before, step), np.fft.rfft(kept, axis=1)


def _excess_phase(frequency: np.ndarray, values: NDArray[np.complex128]) -> np.ndarray:
    """A quadratic of the frequency over the highest one in the phase beyond that of the minimum-phase system of the same size
    (which Hilbert's transform of the logarithm gives): constant, linear, and quadratic coefficient."""
    step, count = float(frequency[1] - frequency[0]), len(frequency)
    before, behind = round(frequency[0] / step), 7 * count
    size = np.log(np.maximum(np.abs(values), 1e-6 * np.abs(values).max()))
    edge = max(1, round(_TAPERED / step))
    log = np.concatenate([np.full(before, size[:edge].mean()), size, np.full(behind, size[-edge:].mean())])
    cepstrum = np.fft.irfft(log)
    fold = np.zeros(len(cepstrum))
    fold[0], fold[1 : len(fold) // 2] = 1.0, 2.0
    minimum = np.fft.rfft(cepstrum * fold).imag[before : before + count]
    excess = np.unwrap(np.angle(values) - minimum)
    return np.polyfit(frequency / frequency[-1], excess, 2)[::-1].copy()


def _taper(frequency: np.ndarray, low: float, high: float) -> np.ndarray:
    """1 in the band, falling to 0 at its ends."""
    rise = np.clip((frequency - low) / _TAPERED, 0.0, 1.0)
    fall = np.clip((high - frequency) / _TAPERED, 0.0, 1.0)
    return np.sin(0.5 * math.pi * rise) ** 2 * np.sin(0.5 * math.pi * fall) ** 2
