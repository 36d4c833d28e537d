"""An FMU that takes multiples of its own step alone, as exports with a fixed solver step do: what a refused step says."""

from __future__ import annotations

from pathlib import Path

import pytest
from pythonfmu.builder import FmuBuilder

from shaper_fmu.errors import SimulationError
from shaper_fmu.master.system import System

SCRIPT = '''\
from pythonfmu import DefaultExperiment, Fmi2Causality, Fmi2Slave, Real


class Rigid(Fmi2Slave):
    """Adds up its input, by steps of 5 ms; fails above 1000."""

    def __init__(self, **arguments):
        super().__init__(**arguments)
        self.default_experiment = DefaultExperiment(start_time=0.0, stop_time=1.0, step_size=0.005)
        self.flow, self.level = 0.0, 0.0
        self.register_variable(Real("flow", causality=Fmi2Causality.input, start=0.0))
        self.register_variable(Real("level", causality=Fmi2Causality.output))

    def do_step(self, t, dt):
        if abs(dt / 0.005 - round(dt / 0.005)) > 1e-6 or self.flow > 1000.0:
            return False
        self.level += self.flow * dt
        return True
'''
JUMP = ([0.0, 0.0123, 0.0123, 1.0], [0.0, 0.0, 2.0, 2.0])


@pytest.fixture(scope="module")
def fmu(tmp_path_factory) -> Path:
    folder = tmp_path_factory.mktemp("rigid")
    (folder / "rigid.py").write_text(SCRIPT)
    return Path(FmuBuilder.build_FMU(folder / "rigid.py", dest=folder))


def driven(fmu: Path, command) -> System:
    system = System("filled")
    system.add("tank", fmu)
    system.drive("tank.flow", command)
    return system


@pytest.mark.parametrize(("command", "step", "told"), [(1.0, 0.0075, "0.0075"), (JUMP, 0.01, "0.0023")])
def test_a_refused_step_that_is_no_multiple_of_the_fmus_own_says_so(fmu, command, step, told):
    """A step of the grid, and one that ends at a jump of the input."""
    with pytest.raises(SimulationError) as caught:
        driven(fmu, command).simulate(0.03, step)
    assert f"This step is of {told} s, no multiple of the 0.005 s that its description names" in str(caught.value)
    assert "exact=False" in str(caught.value)


def test_the_advice_is_right_and_other_failures_have_none(fmu):
    found = driven(fmu, JUMP).simulate(0.03, 0.01, exact=False)
    assert found["tank.level"][-1] == pytest.approx(0.02)  # the jump counts from the next communication point on, 20 ms
    with pytest.raises(SimulationError) as caught:
        driven(fmu, 2000.0).simulate(0.03, 0.01)
    assert "multiple" not in str(caught.value)
