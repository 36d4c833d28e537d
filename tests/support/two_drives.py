"""An FMU with two inputs by pythonfmu itself, as somebody else would write it, and its residual vibration by its own eigenvalues.

Two masses on springs and dampers, coupled by a spring, each with a drive:

    m x1'' + c x1' + k1 x1 + kc (x1 - x2) = f1,   m x2'' + c x2' + k2 x2 + kc (x2 - x1) = f2
"""

from __future__ import annotations

import itertools
from collections.abc import Sequence
from pathlib import Path

import numpy as np
from pythonfmu.builder import FmuBuilder

VALUES = {"mass": 1.0, "damping": 0.4, "k1": 60.0, "k2": 180.0, "coupling": 25.0}
SCRIPT = f'''\
import numpy as np
from scipy.linalg import expm

from pythonfmu import DefaultExperiment, Fmi2Causality, Fmi2Slave, Fmi2Variability, Real


class TwoDrives(Fmi2Slave):
    """By the matrix exponential, exact for held forces."""

    def __init__(self, **arguments):
        super().__init__(**arguments)
        self.default_experiment = DefaultExperiment(start_time=0.0, stop_time=10.0)
        self.f1 = self.f2 = self.x1 = self.x2 = 0.0
        self.state, self.known, self.step_matrix = np.zeros(4), None, None
        for name, value in {VALUES!r}.items():
            setattr(self, name, value)
            self.register_variable(Real(name, causality=Fmi2Causality.parameter, variability=Fmi2Variability.tunable))
        for name in ("f1", "f2"):
            self.register_variable(Real(name, causality=Fmi2Causality.input, start=0.0))
        for name in ("x1", "x2"):
            self.register_variable(Real(name, causality=Fmi2Causality.output))

    def do_step(self, t, h):
        key = (h, self.mass, self.damping, self.k1, self.k2, self.coupling)
        if key != self.known:
            a = np.zeros((6, 6))
            a[:2, 2:4] = np.eye(2)
            a[2:4, :2] = np.array([[-self.k1 - self.coupling, self.coupling], [self.coupling, -self.k2 - self.coupling]]) / self.mass
            a[2:4, 2:4] = -np.eye(2) * self.damping / self.mass
            a[2:4, 4:] = np.eye(2) / self.mass
            self.known, self.step_matrix = key, expm(a * h)
        self.state = (self.step_matrix @ np.concatenate([self.state, [self.f1, self.f2]]))[:4]
        self.x1, self.x2 = float(self.state[0]), float(self.state[1])
        return True
'''


def two_drives(folder: Path) -> Path:
    """Write the FMU; returns its path."""
    (folder / "drives.py").write_text(SCRIPT)
    return Path(FmuBuilder.build_FMU(folder / "drives.py", dest=folder))


def frequencies(**given: float) -> np.ndarray:
    """Natural frequencies [rad/s], by rising frequency: damping is proportional to the mass."""
    p = {**VALUES, **given}
    return np.sqrt(np.linalg.eigvalsh(_stiffness(p)) / p["mass"])


def left_together(jumps: Sequence[tuple[Sequence[float], Sequence[float]]], **given: float) -> float:
    """The largest share of the vibration in x1, x2 that impulses (amplitudes, times) before each drive leave, over the signs.

    Of steps of 1 N at once. In modes, x = sum phi_i q_i with q_i = Re(z_i), so that each jump A at t adds A phi_ij / w_i^2 times
    a decaying swing; half the peak to peak value over one and a half slow periods from the last jump of the case on.
    """
    p = {**VALUES, **given}
    squares, shapes = np.linalg.eigh(_stiffness(p) / p["mass"])
    rate = p["damping"] / (2.0 * p["mass"])
    poles = -rate + 1j * np.sqrt(squares - rate * rate)
    single = [([1.0], [0.0])] * len(jumps)
    sizes = [np.max([_half(case, signs, squares, shapes, poles, p["mass"]) for signs in ((1, 1), (1, -1))], axis=0)
             for case in (jumps, single)]  # fmt: skip
    return float(np.max(sizes[0] / sizes[1]))


def _half(jumps, signs, squares, shapes, poles, mass) -> np.ndarray:
    end = max(times[-1] for _, times in jumps)
    t = end + np.linspace(0.0, 1.5 * 2.0 * np.pi / np.sqrt(squares[0]), 4001)
    x = np.zeros((len(t), 2))
    for (i, square), (j, (amplitudes, times)) in itertools.product(enumerate(squares), enumerate(jumps)):
        p = poles[i]
        weight = signs[j] * shapes[j, i] / (mass * square)
        for amplitude, begin in zip(amplitudes, times, strict=True):
            swing = np.exp(p * (t - begin))  # q = 1 - (p* e^(p t) - p e^(p* t)) / (p* - p), of a step
            x += (
                -weight
                * amplitude
                * np.real((p.conjugate() * swing - p * swing.conjugate()) / (p.conjugate() - p))[:, None]
                * shapes[:, i]
            )
    return 0.5 * np.ptp(x, axis=0)


def _stiffness(p: dict[str, float]) -> np.ndarray:
    return np.array([[p["k1"] + p["coupling"], -p["coupling"]], [-p["coupling"], p["k2"] + p["coupling"]]])
