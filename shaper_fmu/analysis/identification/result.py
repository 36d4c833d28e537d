"""The result of an identification: modes, other poles and findings."""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import Literal

import numpy as np
from numpy.typing import NDArray

Kind = Literal[
    "offset", "drift", "acceleration", "decay", "growth", "unstable", "overdamped", "harmonic", "minor", "too_slow", "too_fast",
    "line",
]  # fmt: skip
"""What a pole is that is no mode of vibration.

offset, drift, acceleration: one, two, three poles at 0 (a new rest, a rigid body that moves on, one that is driven on); decay,
growth: a real pole; unstable: a pair that grows; overdamped: a pair with a damping ratio above 0.95; harmonic: a sum of other
poles, which a nonlinearity makes; minor: of less than the smallest share asked for; too_slow, too_fast: the data do not support it;
line: a motion that something keeps up, such as a hum.
"""


@dataclass(frozen=True)
class Finding:
    """Something that the user should know: a word for programs, and a sentence."""

    code: str
    text: str


@dataclass(frozen=True)
class Mode:
    """A mode of vibration, Re(residue exp(pole t)) in each output from the first sample on.

    Attributes:
        natural_frequency: undamped, |pole| [rad/s], and its standard deviation.
        damping_ratio: -Re(pole) / |pole|, not below 0, and its standard deviation.
        residues: complex, in the outputs' units, shape (experiments, outputs); 0 where an output does not move.
        residue_std: root of the sum of the variances of real and imaginary part, shape (experiments, outputs).
        share: its amplitude over the sum of all modes' amplitudes, in the output that shows it best, 0 to 1.
        pole: [rad/s].
    """

    natural_frequency: float
    natural_frequency_std: float
    damping_ratio: float
    damping_ratio_std: float
    residues: NDArray[np.complex128]
    residue_std: NDArray[np.float64]
    share: float
    pole: complex

    @property
    def period(self) -> float:
        """Damped period 2 pi / Im(pole) [s]."""
        return 2.0 * math.pi / self.pole.imag

    @property
    def frequency(self) -> float:
        """Damped frequency [Hz]."""
        return self.pole.imag / (2.0 * math.pi)


@dataclass(frozen=True)
class OtherPole:
    """A pole that is no mode of vibration; residues as for modes, in a polynomial its coefficient of t^power."""

    kind: Kind
    pole: complex
    pole_std: float
    residues: NDArray[np.complex128]
    share: float


@dataclass(frozen=True)
class Identification:
    """Modes of a free response, by rising natural frequency, its other poles and findings.

    Attributes:
        modes: of vibration.
        others: other poles, see `Kind`.
        noise: standard deviation of the residual of each output, in its unit, shape (experiments, outputs); at least its floor.
        order: number of poles, those at 0 and those that are not listed included.
        findings: what the user should know.
        names: of the outputs.
        step: distance of the samples [s].
        samples: number of samples.
        signal: RMS of each output about a straight line, in its unit, shape (experiments, outputs).
        residual: of the fit, in the outputs' units, shape (samples, experiments, outputs).
    """

    modes: tuple[Mode, ...]
    others: tuple[OtherPole, ...]
    noise: NDArray[np.float64]
    order: int
    findings: tuple[Finding, ...]
    names: tuple[str, ...]
    step: float
    samples: int
    signal: NDArray[np.float64]
    residual: NDArray[np.float64]

    def has(self, code: str) -> bool:
        """Whether there is a finding of this code."""
        return any(finding.code == code for finding in self.findings)

    @property
    def vibrates(self) -> bool:
        """Whether a mode of vibration was found."""
        return bool(self.modes)

    @property
    def time(self) -> np.ndarray:
        """Sample times [s] from the first sample on, shape (samples,)."""
        return self.step * np.arange(self.samples)

    def response(self, time: np.ndarray, experiment: int = 0) -> np.ndarray:
        """The sum of modes and other poles at these times after the first sample, shape (len(time), outputs)."""
        total = np.zeros((len(time), len(self.names)))
        for part in (*self.modes, *self.others):
            power = {"drift": 1, "acceleration": 2}.get(getattr(part, "kind", ""), 0)
            shape = np.exp(np.multiply.outer(np.asarray(time), part.pole)) * np.asarray(time) ** power
            total += (shape[:, None] * part.residues[experiment]).real
        return total
