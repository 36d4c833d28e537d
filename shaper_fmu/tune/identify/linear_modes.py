"""A linear system of a plant at an operating point, and its modes."""

from __future__ import annotations

from dataclasses import dataclass, replace
from functools import cached_property
from typing import Any, Literal

import numpy as np
from numpy.typing import NDArray
from scipy.linalg import eig, matrix_balance

from shaper_fmu.analysis.decaying_sum import SHAPEABLE
from shaper_fmu.design.modal_responses import ModalResponse, step_response
from shaper_fmu.tune.identify.linear_interface import LinearizationError

Origin = Literal["directional derivatives", "differences"]
"""Where the matrices come from: the FMU's directional derivatives, or central differences of its state derivatives."""

AT_REST = 1e-3
"""Unrest up to which a point is called one of rest; as the outputs of a plant that has settled."""
_KNOWN = 0.1
_REAL = 1e-9
"""Imaginary part over magnitude below which a pole is taken for real."""


@dataclass(frozen=True)
class LinearMode:
    """An oscillating pole pair of a linear system: damping ratio below 0.95, also negative.

    Attributes:
        pole: that with Im > 0 [rad/s].
        residues: of the response to a unit step of the input, Re(residue exp(pole t)) in each output, complex, shape (m,).
        error: bound, of first order, of what the matrices' errors make of the pole, over its magnitude.
    """

    pole: complex
    residues: NDArray[np.complex128]
    error: float

    @property
    def natural_frequency(self) -> float:
        """|pole| [rad/s]."""
        return abs(self.pole)

    @property
    def damping_ratio(self) -> float:
        """-Re(pole) / |pole|."""
        return -self.pole.real / abs(self.pole)


@dataclass(frozen=True)
class Linearization:
    """d/dt x = A x + B u, y = C x + D u for small deviations x, u, y from an operating point.

    Attributes:
        A, B, C, D: shapes (n, n), (n, 1), (m, n), (m, 1), in the variables' units.
        states, input, outputs: names of x, u and y.
        state, derivative: x and dx/dt at the operating point, shape (n,).
        time: at which it was made: that of the FMU's settling [s].
        origin: see `Origin`.
        error: bound of the errors of A's elements, shape (n, n): rounding, and for differences how far two step sizes differ.
        unrest: how far from rest it is: the largest step of a state to the equilibrium (by least squares), over the state's
            magnitude or nominal value, or what of the derivative no state can balance, in the same measure; 0 at rest.
    """

    A: np.ndarray
    B: np.ndarray
    C: np.ndarray
    D: np.ndarray
    states: tuple[str, ...]
    input: str
    outputs: tuple[str, ...]
    state: np.ndarray
    derivative: np.ndarray
    time: float
    origin: Origin
    error: np.ndarray
    unrest: float

    @property
    def at_rest(self) -> bool:
        """Whether nothing moves at the operating point."""
        return self.unrest <= AT_REST

    @cached_property
    def poles(self) -> NDArray[np.complex128]:
        """Eigenvalues of A, shape (n,), by rising magnitude, of a pair the one with Im > 0 last [rad/s]."""
        values = _decomposed(self.A)[0]
        return values[np.lexsort((values.imag, np.abs(values)))]

    @cached_property
    def modes(self) -> tuple[LinearMode, ...]:
        """Modes of vibration by rising natural frequency, those that the input or the outputs do not show included.

        Poles that are not known within a tenth are none: two poles at 0, those of a rigid body, come apart by rounding.
        Residues are 2 c v w* b / (w* v p) with the right and left eigenvectors v and w of a pole p, so that they are right even
        where other poles coincide, as those of a rigid body do.
        """
        values, left, right, scale = _decomposed(self.A)
        b, c = self.B[:, 0] / scale, self.C * scale
        error = self.error / scale[:, None] * scale + _rounding(self.A / scale[:, None] * scale)
        found = []
        for k, pole in enumerate(values):
            if not (pole.imag > _REAL * abs(pole) and -pole.real < SHAPEABLE * abs(pole)):
                continue
            v, w = right[:, k], left[:, k].conj()
            product = w @ v
            size = max(abs(product), 1e-300)
            spread = float(np.abs(w) @ error @ np.abs(v) / size / abs(pole))
            if spread > _KNOWN:  # one of several that are 0, as far as can be told
                continue
            found.append(LinearMode(complex(pole), 2.0 * (c @ v) * (w @ b) / (product * pole), spread))
        return tuple(sorted(found, key=lambda mode: mode.natural_frequency))

    def step_response(self) -> ModalResponse:
        """The response to a unit step of the input. Raises ArgumentError for systems that do not settle (see `step_response`)."""
        found = step_response(self.A, self.B, self.C, self.outputs)
        return replace(found, final=found.final + self.D[:, 0]) if self.D.any() else found


def _rounding(balanced: np.ndarray) -> float:
    """Bound of the backward error of the eigenvalues' computation, for each element of the matrix."""
    return len(balanced) * np.finfo(float).eps * float(np.linalg.norm(balanced, 2))


def _decomposed(a: np.ndarray) -> tuple[NDArray[np.complex128], np.ndarray, np.ndarray, np.ndarray]:
    """Eigenvalues, left and right eigenvectors of the balanced matrix, and its states' scales."""
    found: Any = matrix_balance(a, permute=False, separate=True)
    balanced, (scale, _) = found
    try:
        found = eig(balanced, left=True, right=True)
    except np.linalg.LinAlgError as error:
        raise LinearizationError(f"the eigenvalues of a matrix of {len(a)} states cannot be computed: {error}") from None
    return found[0].astype(np.complex128), found[1], found[2], scale


def unrest(a: np.ndarray, derivative: np.ndarray, scale: np.ndarray) -> float:
    """See `Linearization.unrest`; `scale` are the states' magnitudes, shape (n,)."""
    if not np.any(derivative):
        return 0.0
    scaled, rate = a / scale[:, None] * scale, derivative / scale
    try:
        step = np.linalg.lstsq(scaled, -rate, rcond=1e-9)[0]
    except np.linalg.LinAlgError as error:
        raise LinearizationError(f"the equilibrium of {len(a)} states cannot be computed: {error}") from None
    left = np.abs(rate + scaled @ step).max()
    return float(max(np.abs(step).max(), left / max(float(np.linalg.norm(scaled, 2)), 1e-300)))
