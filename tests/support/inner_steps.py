"""An FMU by pythonfmu itself that steps inside by Euler's method with its own step, as exports of 20-sim do.

No communication step changes its mode, which is not the one of its equations: x_{n+1} = (1 + h A) x_n has the poles log(1 + h p) / h.
"""

from __future__ import annotations

import cmath
from pathlib import Path

from pythonfmu.builder import FmuBuilder

SCRIPT = '''\
from pythonfmu import DefaultExperiment, Fmi2Causality, Fmi2Slave, Fmi2Variability, Real


class Inner(Fmi2Slave):
    """m x'' + c x' + k x = F by Euler's method: with `on_grid` at multiples of its own step, else in equal parts up to that."""

    def __init__(self, **arguments):
        super().__init__(**arguments)
        self.default_experiment = DefaultExperiment(start_time=0.0, stop_time=10.0, step_size=0.002)
        self.force, self.position, self.speed, self.done = 0.0, 0.0, 0.0, 0
        self.mass, self.stiffness, self.damping, self.own_step, self.on_grid = 1.0, 60.0, 0.5, 0.002, 0.0
        self.register_variable(Real("force", causality=Fmi2Causality.input, start=0.0))
        self.register_variable(Real("position", causality=Fmi2Causality.output))
        for name in ("mass", "stiffness", "damping", "own_step", "on_grid"):
            self.register_variable(Real(name, causality=Fmi2Causality.parameter, variability=Fmi2Variability.tunable))

    def euler(self, h):
        rate = (self.force - self.damping * self.speed - self.stiffness * self.position) / self.mass
        self.position, self.speed = self.position + h * self.speed, self.speed + h * rate

    def do_step(self, t, dt):
        if self.on_grid:
            while (self.done + 1) * self.own_step <= t + dt + 1e-9 * self.own_step:
                self.done += 1
                self.euler(self.own_step)
            return True
        parts = max(1, int(dt / self.own_step + 0.999999))
        for _ in range(parts):
            self.euler(dt / parts)
        return True
'''
STEP = 0.002


def inner_steps(folder: Path) -> Path:
    """Write the FMU; returns its path."""
    (folder / "inner.py").write_text(SCRIPT)
    return Path(FmuBuilder.build_FMU(folder / "inner.py", dest=folder))


def pole_seen(mass: float = 1.0, stiffness: float = 60.0, damping: float = 0.5, step: float = STEP) -> complex:
    """Of what the FMU computes [rad/s]."""
    rate = damping / (2.0 * mass)
    p = complex(-rate, (stiffness / mass - rate * rate) ** 0.5)
    return cmath.log(1.0 + step * p) / step
