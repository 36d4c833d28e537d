"""Events of several FMUs of model exchange that follow from one another, against solutions in closed form."""

from __future__ import annotations

import pytest
from equation_fmus import MODELS, equations_fmu

from shaper_fmu.master.system import System

VERSIONS = pytest.mark.parametrize("version", [2, 3])
ALGORITHMS = pytest.mark.parametrize("algorithm", ["jacobi", "parallel", "gauss_seidel"])


def chain(version: int, following: str, source: str, input_: str, within: bool) -> System:
    """x1 of a passes 0.3721 at this time; b, c, and d get its event, one from the other. `within`: steps keep to the grid."""
    system = System()
    for name in "dcba":
        model = "switching" if name == "a" else following
        values = {"model": float(MODELS[model]), "p": 0.3721 if name == "a" else 0.5}
        system.add(name, equations_fmu(version), values)
    for cause, effect in ("ab", "bc", "cd"):
        system.connect(f"{cause}.{source}", f"{effect}.{input_}")
    if within:
        system.drive("a.u", lambda t: 1.0)
    return system


@VERSIONS
@ALGORITHMS
@pytest.mark.parametrize("within", [False, True])
@pytest.mark.parametrize("step", [0.1, 0.37, 1.0])
@pytest.mark.parametrize(
    ("following", "source", "input_"), [("switched", "y", "u"), ("following", "count", "d")], ids=["continuous", "discrete"]
)
def test_an_event_reaches_all_that_follow_from_it_at_once(version, algorithm, within, step, following, source, input_):
    """Each has one event, and x1 = t - 0.3721 from then on: by inputs that jump over event indicators, and by discrete ones."""
    system = chain(version, following, source, input_, within)
    results = system.simulate(1.0, step, algorithm=algorithm, solver_tolerance=1e-9, record=["b.x1", "c.x1", "d.x1", "d.events"])
    assert results["d.events"][-1] == 1.0
    for name in ("b.x1", "c.x1", "d.x1"):
        assert results[name][-1] == pytest.approx(1.0 - 0.3721, abs=1e-7), name
