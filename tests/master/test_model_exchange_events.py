"""Events of several FMUs of model exchange that follow from one another, against solutions in closed form."""

from __future__ import annotations

from itertools import pairwise

import pytest
from equation_fmus import MODELS, equations, equations_fmu

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


@VERSIONS
@ALGORITHMS
@pytest.mark.parametrize("step", [0.05, 0.3])
@pytest.mark.parametrize("limit", [0.0, 0.25, 0.5])
def test_a_limit_that_is_met_exactly_is_passed(version, algorithm, step, limit):
    """u = t comes to be above p after the time at which the event indicator u - p is 0, at the start for one; x1 = t - p then."""
    system = System()
    system.add("a", equations_fmu(version), {"model": float(MODELS["two_sided"]), "p": 9.0})
    system.add("b", equations_fmu(version), {"model": float(MODELS["switched"]), "p": limit})
    system.drive("a.u", [(0.0, 1.0)])
    system.connect("a.y", "b.u")
    results = system.simulate(1.0, step, algorithm=algorithm, solver_tolerance=1e-9, record=["b.events", "b.x1", "a.x1"])
    assert results["b.events"][-1] == 1.0
    assert results["b.x1"][-1] == pytest.approx(1.0 - limit, abs=1e-7)
    assert results["a.x1"][-1] == pytest.approx(1.0, abs=1e-10)


@VERSIONS
@pytest.mark.parametrize("gap", [0.0, 1e-15, 3e-11])
@pytest.mark.parametrize("within", [False, True])
def test_time_events_that_follow_at_once_are_handled(version, gap, within):
    """Three at 0.3, as near to each other as times can be told apart, or at the same time; x1' = 3 then."""
    system = equations(version, "soon", p=0.3, q=gap)
    if within:
        system.drive("x.u", lambda t: 1.0)
    results = system.simulate(1.0, 0.1, solver_tolerance=1e-9)
    assert results["x.count"][-1] == 3.0
    assert results["x.y"][-1] == pytest.approx(3.0 * 0.7, abs=1e-7)


@VERSIONS
def test_an_input_that_jumps_over_a_limit_does_so_again_where_a_step_is_tried_again(version):
    """u jumps over p at 0.5, at a communication point; x1 = t - 0.5 then. Steps are taken whole, back, and by halves."""
    system = equations(version, "switched", p=0.5)
    system.drive("x.u", [(0.0, 0.0), (0.5, 1.0)])
    results = system.simulate(1.0, 0.1, exact=False, tolerance=1e-3, record=["x.x1", "x.events"])
    assert results["x.events"][-1] == 1.0
    assert results["x.x1"][-1] == pytest.approx(0.5, abs=1e-6)


@pytest.mark.parametrize("options", [{}, {"coupling": "steps"}, {"exact": False}], ids=["as one", "at steps", "on the grid"])
@pytest.mark.parametrize("count", [15, 120])
@VERSIONS
def test_an_event_goes_through_a_chain_of_any_length(version, count, options):
    """The first switches at 0.3 s and each switches the next one in the same instant: x1' = 1 from then on, for all."""
    system = System()
    system.add("first", equations_fmu(version), {"model": float(MODELS["switching"]), "p": 0.3})
    names = [f"a{i}" for i in range(count)]
    for before, name in pairwise(["first", *names]):
        system.add(name, equations_fmu(version), {"model": float(MODELS["switched"]), "p": 0.5})
        system.connect_raw(f"{before}.y", f"{name}.u")
    results = system.simulate(1.0, 0.05, solver_tolerance=1e-9, record=[f"{name}.x1" for name in names], **options)
    assert [float(values[-1]) for values in results.values.values()] == pytest.approx([0.7] * count, abs=1e-11)
