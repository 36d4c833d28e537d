"""An FMU by pythonfmu itself, as somebody else would write it: a mass on a spring, exact for a held force, that counts its steps.

Each step adds a byte to the file $COUNTED_STEPS, and takes $COUNTED_PAUSE seconds, where these are set. A mass above $COUNTED_DEADLY
ends the process by SIGSEGV, one above $COUNTED_LIMIT fails.
"""

from __future__ import annotations

from collections.abc import Callable
from pathlib import Path

from pythonfmu.builder import FmuBuilder

SCRIPT = '''\
import cmath
import os
import signal
import time

from pythonfmu import DefaultExperiment, Fmi2Causality, Fmi2Slave, Fmi2Variability, Real


class Counted(Fmi2Slave):
    """m x'' + c x' + k x = F, F held: x - F/k is a sum of two exponentials."""

    def __init__(self, **arguments):
        super().__init__(**arguments)
        self.default_experiment = DefaultExperiment(start_time=0.0, stop_time=10.0)
        self.force, self.position, self.mass, self.stiffness, self.damping = 0.0, 0.0, 1.0, 25.0, 0.5
        self.speed = 0.0
        self.register_variable(Real("force", causality=Fmi2Causality.input, start=0.0))
        self.register_variable(Real("position", causality=Fmi2Causality.output))
        for name in ("mass", "stiffness", "damping"):
            self.register_variable(Real(name, causality=Fmi2Causality.parameter, variability=Fmi2Variability.tunable))

    def do_step(self, t, dt):
        count, pause = os.environ.get("COUNTED_STEPS"), os.environ.get("COUNTED_PAUSE")
        if count:
            with open(count, "ab") as stream:
                stream.write(b".")
        if pause:
            time.sleep(float(pause))
        if self.mass > float(os.environ.get("COUNTED_DEADLY", "inf")):
            os.kill(os.getpid(), signal.SIGSEGV)
        if self.mass > float(os.environ.get("COUNTED_LIMIT", "inf")):
            return False
        rate = self.damping / (2.0 * self.mass)
        p = complex(-rate, (self.stiffness / self.mass - rate * rate) ** 0.5)
        rest = self.force / self.stiffness
        q = self.position - rest
        a = 0.5 * complex(q, (p.real * q - self.speed) / p.imag)  # q = 2 Re(a), q' = 2 Re(p a)
        b = a * cmath.exp(p * dt)
        self.position, self.speed = rest + 2.0 * b.real, 2.0 * (p * b).real
        return True
'''


def counted_spring(folder: Path) -> Path:
    """Write the FMU; returns its path."""
    (folder / "counted.py").write_text(SCRIPT)
    return Path(FmuBuilder.build_FMU(folder / "counted.py", dest=folder))


def steps_counted(folder: Path, monkeypatch: object) -> Callable[[], int]:
    """Have the FMU count from now on; a function that tells its steps."""
    path = folder / "steps"
    path.write_bytes(b"")
    monkeypatch.setenv("COUNTED_STEPS", str(path))  # pyright: ignore[reportAttributeAccessIssue]
    return lambda: path.stat().st_size
