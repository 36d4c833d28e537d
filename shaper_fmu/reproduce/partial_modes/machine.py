"""Masses, springs and gains for Jung (2011), which prints none of them: two sets that have the modes of its eq. (11)."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np


@dataclass(frozen=True)
class Machine:
    """Three masses [kg] in a row, two springs [N/m] with dampers [N s/m], and F = proportional (r - x1) - derivative v1."""

    name: str
    mass: tuple[float, float, float]
    stiffness: tuple[float, float]
    damping: tuple[float, float]
    proportional_gain: float
    derivative_gain: float

    def chain_values(self) -> dict[str, float]:
        """Start values of the ThreeMassChain, without its name."""
        lists = {"mass": self.mass, "stiffness": self.stiffness, "damping": self.damping}
        return {f"{name}[{i}]": value for name, values in lists.items() for i, value in enumerate(values, 1)}

    def start_values(self) -> dict[str, float]:
        """Start values of the whole system."""
        gains = {"proportional_gain": self.proportional_gain, "derivative_gain": self.derivative_gain}
        return {
            **{f"chain.{name}": value for name, value in self.chain_values().items()},
            **{f"controller.{name}": value for name, value in gains.items()},
        }

    def described(self) -> str:
        """Its numbers, as a text."""
        masses, springs = (", ".join(f"{value:.10g}" for value in values) for values in (self.mass, self.stiffness))
        force = f"{self.proportional_gain:.10g} (r - x1) - {self.derivative_gain:.10g} v1"
        return f"masses {masses} kg, springs {springs} N/m, F = {force}"

    def closed_loop(self) -> tuple[np.ndarray, np.ndarray]:
        """a (6 by 6) and b (6,) of x' = a x + b r, x the positions and speeds, by eqs. (9) and (10)."""
        springs = np.array([[-1.0, 1.0, 0.0], [0.0, -1.0, 1.0]])
        inverse = np.diag(1.0 / np.array(self.mass))
        k, c = (springs.T @ np.diag(values) @ springs for values in (self.stiffness, self.damping))
        k[0, 0] += self.proportional_gain
        c[0, 0] += self.derivative_gain
        a = np.block([[np.zeros((3, 3)), np.eye(3)], [-inverse @ k, -inverse @ c]])
        return a, np.array([0.0, 0.0, 0.0, self.proportional_gain / self.mass[0], 0.0, 0.0])


SET_A = Machine("A", (15.0, 8.0, 10.0), (400.0, 120.0), (20.0, 6.0), 300.0, 50.0)
"""The defaults of the chain's FMU."""
SET_B = Machine(
    "B", (1.0, 0.032541457, 0.025839616), (2.245434982, 0.465375764), (2.245434982 / 20.0, 0.465375764 / 20.0), 7.51237, 2.40028
)
"""Found by a search for the set that meets most of the paper's statements."""
SETS = (SET_A, SET_B)
