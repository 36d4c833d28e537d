"""The step response of a linear system from its poles and residues, exactly, with and without a shaper."""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray

from shaper_fmu.analysis.decaying_sum import SHAPEABLE, DecayingSum
from shaper_fmu.design.impulse_sequence import ImpulseSequence
from shaper_fmu.errors import ArgumentError

ComplexArray = NDArray[np.complex128]
Piece = tuple[float, float, float, ComplexArray]


@dataclass(frozen=True)
class ModalResponse:
    """Response of m outputs to a unit step: x_j(t) = final_j + Re sum_k residues_jk exp(poles_k t).

    Attributes:
        poles: complex, shape (n,) [rad/s]; of each complex pair only the one with Im > 0; all with Re < 0.
        residues: complex, shape (m, n), in the outputs' units; of a pair twice the partial fraction's, of a real pole real.
        final: the values that the outputs settle at, shape (m,), not 0.
        names: of the outputs.
    """

    poles: ComplexArray
    residues: ComplexArray
    final: np.ndarray
    names: tuple[str, ...]

    def __post_init__(self) -> None:
        for name, values, kind in (
            ("poles", self.poles, complex),
            ("residues", self.residues, complex),
            ("final", self.final, float),
        ):
            object.__setattr__(self, name, np.array(values, kind))
        object.__setattr__(self, "names", tuple(self.names))
        _check(self)

    @property
    def natural_frequency(self) -> np.ndarray:
        """|p_k| [rad/s], shape (n,)."""
        return np.abs(self.poles)

    @property
    def damping_ratio(self) -> np.ndarray:
        """-Re p_k / |p_k|, shape (n,); 1 for a real pole."""
        return -self.poles.real / np.abs(self.poles)

    @property
    def modes(self) -> tuple[int, ...]:
        """Indices of the poles that can be shaped, by rising natural frequency."""
        found = [k for k, p in enumerate(self.poles) if p.imag > 0.0 and self.damping_ratio[k] < SHAPEABLE]
        return tuple(sorted(found, key=lambda k: self.natural_frequency[k]))

    def remaining(self, shaper: ImpulseSequence) -> np.ndarray:
        """G_k = sum_i A_i exp(p_k (t_n - t_i)), shape (n,): the remaining factor of each mode at the last impulse t_n."""
        gone = shaper.duration - np.array(shaper.delays)
        return np.exp(np.multiply.outer(self.poles, gone)) @ np.array(shaper.amplitudes)

    def residual(self, shaper: ImpulseSequence, limit: float | None = None) -> tuple[float, float]:
        """Bounds (low, high) of rho = max_j sup |x_j - final_j| / |final_j| from the last impulse on.

        They are at most 1e-13 apart; with a `limit` only so near that high <= limit, or low > limit, is known.
        """
        return self.residual_of(self.remaining(shaper), limit)

    def residual_of(self, left: np.ndarray, limit: float | None = None) -> tuple[float, float]:
        """The same for given remaining factors of the modes, complex, shape (n,); those of convolved shapers are multiplied."""
        low = high = 0.0
        for final, residues in zip(self.final, self.residues, strict=True):
            found = DecayingSum(residues * left / abs(final), self.poles).maximum(limit=limit)
            low, high = max(low, found[0]), max(high, found[1])
        return low, high

    def values(self, shaper: ImpulseSequence, time: np.ndarray) -> np.ndarray:
        """The outputs' response to a unit step through the shaper, shape (m, len(time))."""
        total = np.zeros((len(self.final), len(time)))
        for a, t in zip(shaper.amplitudes, shaper.delays, strict=True):
            after = np.maximum(0.0, time - t)
            one = self.final[:, None] + (self.residues @ np.exp(np.multiply.outer(self.poles, after))).real
            total += np.where(time >= t, a * one, 0.0)
        return total

    def overshoot(self, shaper: ImpulseSequence) -> np.ndarray:
        """How far each output goes beyond its final value, as a share of it, shape (m,); at least 0."""
        found = np.zeros(len(self.final))
        for begin, end, level, left in _pieces(self, shaper):
            for j, final in enumerate(self.final):
                e = DecayingSum(self.residues[j] * left / final, self.poles)
                found[j] = max(found[j], e.maximum(1.0, level - 1.0, end - begin)[0])
        return found

    def settling_time(self, shaper: ImpulseSequence, band: float) -> np.ndarray:
        """The time [s] after which each output stays within `band` > 0 times its final value of it, shape (m,)."""
        if not band > 0.0:
            raise ArgumentError(f"band = {band}: the settling band must be a positive share of the final value")
        pieces = _pieces(self, shaper)[::-1]
        return np.array([_last_outside(self, pieces, j, band) for j in range(len(self.final))])


def _last_outside(response: ModalResponse, pieces: list[Piece], j: int, band: float) -> float:
    """The last time at which output j is outside the band, 0 if it never is; the pieces from the last to the first."""
    for begin, end, level, left in pieces:
        e = DecayingSum(response.residues[j] * left / response.final[j], response.poles)
        last = e.last_time_outside(band, level - 1.0, end - begin)
        if last is not None:
            return begin + last
    return 0.0


def _pieces(response: ModalResponse, shaper: ImpulseSequence) -> list[Piece]:
    """(begin, end, level of the command, G_k at the begin) between a shaper's impulses and after the last."""
    pieces, left, level = [], np.zeros(len(response.poles), complex), 0.0
    for i, (a, t) in enumerate(zip(shaper.amplitudes, shaper.delays, strict=True)):
        last = i + 1 == len(shaper.delays)
        end = math.inf if last else shaper.delays[i + 1]
        if i:
            left = left * np.exp(response.poles * (t - shaper.delays[i - 1]))
        left, level = left + a, 1.0 if last else level + a
        if end > t:
            pieces.append((t, end, level, left))
    return pieces


def _check(response: ModalResponse) -> None:
    """Raise ComponentError for numbers that make no stable response."""
    m, n = len(response.names), len(response.poles)
    if response.residues.shape != (m, n) or response.final.shape != (m,):
        raise ArgumentError(
            f"residues of shape {response.residues.shape} and {len(response.final)} final values do not fit {n} poles, {m} outputs"
        )
    if not m or not all(np.isfinite(v).all() for v in (response.poles, response.residues, response.final)):
        raise ArgumentError("a response needs at least one output, and finite poles, residues and final values")
    for p in response.poles:
        if not p.real < 0.0:
            raise ArgumentError(f"the pole {p:.6g} rad/s does not decay, so the response never settles; give damping to every mode")
        if p.imag < 0.0:
            raise ArgumentError(f"of a pair of poles give the one with a positive imaginary part, not {p:.6g} rad/s")
    for name, final in zip(response.names, response.final, strict=True):
        if final == 0.0:
            raise ArgumentError(f"{name} returns to 0, so its residual has no measure; leave this output out")


def modal_response(poles: Any, residues: Any, final: Any, names: Sequence[str] | None = None) -> ModalResponse:
    """A `ModalResponse` from given modes; see there for the arguments. Raises ArgumentError for what makes none."""
    values = np.array(final, float).reshape(-1)
    found = tuple(names) if names is not None else tuple(f"x{j + 1}" for j in range(len(values)))
    return ModalResponse(np.array(poles, complex), np.atleast_2d(np.array(residues, complex)), values, found)


def step_response(a: Any, b: Any, c: Any, names: Sequence[str] | None = None) -> ModalResponse:
    """Poles and residues of y = c x for x' = a x + b u, a unit step u, from rest.

    Args:
        a: shape (n, n), stable and with distinct eigenvalues.
        b: shape (n,) or (n, 1).
        c: shape (m, n): a row for each output.

    Poles that no output shows (residues below 1e-12 of the final value) are left out. Raises ArgumentError for an unstable
    system, and for eigenvalues that coincide so closely that residues mean nothing.
    """
    a, c = np.array(a, float), np.atleast_2d(np.array(c, float))
    b = np.array(b, float).reshape(-1)
    if a.ndim != 2 or a.shape != (len(b), len(b)) or c.shape[1] != len(b):
        raise ArgumentError(f"a of shape {a.shape}, b of {b.shape} and c of {c.shape} do not belong together")
    eigenvalues, vectors = (np.asarray(found, np.complex128) for found in np.linalg.eig(a))
    if not (eigenvalues.real < 0.0).all():
        unstable = eigenvalues[np.argmax(eigenvalues.real)]
        raise ArgumentError(f"the system is not stable: it has the pole {unstable:.6g} rad/s, so its response does not settle")
    if np.linalg.cond(vectors) > 1e10:
        raise ArgumentError("eigenvalues coincide, so the response is not a sum of modes; change a parameter a little")
    shares = np.linalg.solve(vectors, b.astype(complex)) / eigenvalues  # e^(A t) A^-1 b, by modes
    kept = eigenvalues.imag >= 0.0
    residues = (c @ vectors) * shares * np.where(eigenvalues.imag > 0.0, 2.0, 1.0)
    final = -(c @ np.linalg.solve(a, b))
    shown = kept & (np.abs(residues) > 1e-12 * np.maximum(1e-300, np.abs(final))[:, None]).any(axis=0)
    order = np.argsort(np.abs(eigenvalues[shown]), kind="stable")
    return modal_response(eigenvalues[shown][order], residues[:, shown][:, order], final, names)
