"""What clocked inputs get: of every kind of source the value at the tick, in all algorithms; and in loops what was before it.

The FMU (fmus/clocked3.c) adds up its input at its ticks: y_k = y_(k-1) + u_k. Expected values are sums and recursions.
"""

from __future__ import annotations

import itertools
from typing import Any

import numpy as np
import pytest
from clocked_fmus import KINDS, clocked_fmu, constant
from native_host import native_fmu
from typer.testing import CliRunner

from shaper_fmu import System
from shaper_fmu.cli.main import app
from shaper_fmu.errors import ModelError

ALGORITHMS = ("jacobi", "parallel", "gauss_seidel")
ROWS = ([0.0, 0.5, 0.7], [1.0, 3.0, -2.0])


def held(t: float) -> float:
    return 1.0 if t < 0.5 - 1e-12 else 3.0 if t < 0.7 - 1e-12 else -2.0


SOURCES: dict[str, tuple[Any, Any, Any]] = {  # what drives, its interpolation, its value at t
    "function": (lambda t: t, "hold", lambda t: t),
    "function that jumps": (held, "hold", held),
    "number": (2.5, "hold", lambda t: 2.5),
    "held table": (ROWS, "hold", held),
    "linear table": (([0.0, 10.0], [0.0, 10.0]), "linear", lambda t: t),
}
CLOCKS = {"on the grid": (0.1, 0.0, 0.1), "on and off the grid": (0.1, 0.0, 0.25), "off the grid": (0.0371, 0.0123, 0.05)}


def tick_times(interval: float, shift: float) -> np.ndarray:
    """Up to 1 s."""
    times = shift + np.arange(200) * interval
    return times[times <= 1.0 + 1e-9]


@pytest.mark.parametrize("algorithm", ALGORITHMS)
@pytest.mark.parametrize("clock", CLOCKS)
@pytest.mark.parametrize("source", SOURCES)
def test_each_source_is_sampled_at_the_tick(source, clock, algorithm):
    """Directly, and through an FMU without delay: force = 2 reference."""
    given, interpolation, value = SOURCES[source]
    interval, shift, step = CLOCKS[clock]
    expected = sum(value(t) for t in tick_times(interval, shift))
    system = System()
    for name in ("a", "b"):
        system.add(name, clocked_fmu(constant(interval, shift)), interval=interval, shift=shift)
    system.add("p", native_fmu("PositionController", 2), proportional_gain=2.0, derivative_gain=0.0)
    for target in ("a.u", "p.reference"):
        system.drive(target, given, interpolation)
    system.connect("p.force", "b.u")
    results = system.simulate(1.0, step, algorithm=algorithm)
    assert results["a.y"][-1] == pytest.approx(expected, abs=1e-9)
    assert results["b.y"][-1] == pytest.approx(2.0 * expected, abs=1e-9)


@pytest.mark.parametrize("algorithm", ALGORITHMS)
def test_functions_with_triggered_clocks_step_control_and_isolation(algorithm):
    """z = w + 1000 at each third tick, 0.1 (3 n - 1): the last in 1 s is at 0.8 s."""
    system = System()
    system.add("a", clocked_fmu(constant(0.1)), every=3)
    system.add("b", clocked_fmu(), kind=KINDS["countdown"])
    system.connect("a.out", "b.trig")
    system.drive("a.u", np.sin)
    system.drive("b.w", np.exp)
    ways: list[dict[str, Any]] = [{}, {"tolerance": 1e-3}, {"isolate": True}]
    for options in ways:
        results = system.simulate(1.0, 0.25, algorithm=algorithm, **options)
        assert results["a.y"][-1] == pytest.approx(np.sin(tick_times(0.1, 0.0)).sum(), rel=1e-12)
        assert results["b.z"][-1] == pytest.approx(np.exp(0.8) + 1000.0, rel=1e-12)


@pytest.mark.parametrize("algorithm", ALGORITHMS)
def test_functions_are_asked_once_for_a_time(algorithm):
    asked: list[float] = []
    system = System()
    system.add("a", clocked_fmu(constant(0.1)))
    system.drive("a.u", lambda t: asked.append(t) or t)
    for _ in range(2):
        asked.clear()
        system.simulate(0.5, 0.25, algorithm=algorithm)
        assert asked[0] == 0.0
        assert sorted(set(asked[1:] if algorithm == "jacobi" else asked)) == (asked[1:] if algorithm == "jacobi" else asked)


@pytest.mark.parametrize("algorithm", ALGORITHMS)
@pytest.mark.parametrize("version", [2, 3])
@pytest.mark.parametrize("every", [1, 3, 1000])
@pytest.mark.parametrize("first", [0, 1])
def test_a_loop_through_unclocked_variables_samples_what_was_before(first, every, version, algorithm):
    """u_k = 1 - y_(k-1) / 2, so y_k = y_(k-1) / 2 + 1, whatever is connected first, and whether an output clock ticks, too."""
    system = System()
    system.add("a", clocked_fmu(constant(0.1)), every=every)
    system.add("p", native_fmu("PositionController", version), proportional_gain=0.5, derivative_gain=0.0)
    wires = [lambda: system.connect("a.y", "p.reference"), lambda: system.connect("p.force", "a.u", gain=-1.0, offset=1.0)]
    wires[first]()
    wires[1 - first]()
    assert system.check() == []
    results = system.simulate(0.8, 0.1, algorithm=algorithm)
    assert results["a.y"] == pytest.approx([2.0 - 0.5**k for k in range(9)], rel=1e-12)


@pytest.mark.parametrize("order", list(itertools.permutations(range(4)))[::5])
@pytest.mark.parametrize("every", [1, 1000])
def test_all_samplers_of_a_loop_sample_what_was_before(every, order):
    """a -> p -> b -> q -> a: a.u_k = 1 - b.y_(k-1) / 2 and b.u_k = a.y_(k-1) / 2."""
    system = System()
    for name in ("a", "b"):
        system.add(name, clocked_fmu(constant(0.1)), every=every)
    for name in ("p", "q"):
        system.add(name, native_fmu("PositionController", 2), proportional_gain=0.5, derivative_gain=0.0)
    wires = [("a.y", "p.reference", {}), ("p.force", "b.u", {}), ("b.y", "q.reference", {}), ("q.force", "a.u", {"gain": -1.0})]
    for i in order:
        source, target, more = wires[i]
        system.connect(source, target, **({**more, "offset": 1.0} if more else more))
    results = system.simulate(0.5, 0.1)
    a, b, expected = 0.0, 0.0, []
    for _ in range(6):
        a, b = a + 1.0 - 0.5 * b, b + 0.5 * a
        expected.append((a, b))
    assert np.column_stack([results["a.y"], results["b.y"]]) == pytest.approx(np.array(expected), rel=1e-12)


def ring(one: str, other: str, **options: Any) -> System:
    system = System()
    system.add("a", clocked_fmu(one, **options))
    system.add("b", clocked_fmu(other, **options))
    system.connect("a.y", "b.u")
    system.connect("b.y", "a.u", gain=-0.5, offset=1.0)
    return system


TOGETHER = {
    "same": (constant(0.1), constant(0.1)),
    "at times": (constant(0.1), constant(0.15)),
    "shifted": (constant(0.1, 0.05), constant(0.15, 0.1)),  # both at 0.25 s
    "not known": (constant(0.1), 'intervalVariability="tunable" intervalDecimal="0.1" shiftDecimal="0.05"'),
    "fraction": (constant(0.2, 0.1), 'intervalVariability="constant" intervalCounter="3" resolution="10"'),  # at 0.3 s
}


@pytest.mark.parametrize("declared", [True, False])
@pytest.mark.parametrize("clocks", TOGETHER)
def test_a_loop_of_clocked_variables_that_tick_together_is_refused(clocks, declared):
    system = ring(*TOGETHER[clocks], declared=declared)
    (problem,) = system.check()
    assert "a loop of clocked variables acts on itself without delay" in problem
    assert "b.u -> a.u -> b.u" in problem or "a.u -> b.u -> a.u" in problem
    with pytest.raises(ModelError, match=r"a loop of clocked variables acts on itself without delay"):
        system.simulate(1.0, 0.1)


def test_a_loop_of_one_instance_and_one_through_a_triggered_clock_are_refused():
    system = System()
    system.add("a", clocked_fmu(constant(0.1)))
    system.connect("a.y", "a.u", gain=0.5)
    assert "a.u -> a.u" in "".join(system.check())
    system = System()
    system.add("a", clocked_fmu(constant(0.1)))
    system.add("b", clocked_fmu(), kind=KINDS["countdown"])
    system.connect("a.out", "b.trig")
    system.connect("a.y", "b.w")
    system.connect("b.z", "a.u")
    assert "a loop of clocked variables" in "".join(system.check())


@pytest.mark.parametrize("every", [1, 1000])
def test_a_loop_of_clocks_that_never_tick_together_runs(every):
    """In turn, at k / 10 and k / 10 + 0.05: a.y += 1 - b.y / 2, then b.y += a.y."""
    system = ring(constant(0.1), constant(0.1, 0.05))
    system.set("a.every", every)
    system.set("b.every", every)
    system.set("b.shift", 0.05)
    assert system.check() == []
    results = system.simulate(0.5, 0.1)
    a, b, expected = 1.0, 0.0, [(1.0, 0.0)]
    for _ in range(5):
        b += a
        a += 1.0 - 0.5 * b
        expected.append((a, b))
    assert np.column_stack([results["a.y"], results["b.y"]]) == pytest.approx(np.array(expected), rel=1e-12)


def test_an_archive_with_a_loop_of_clocked_variables_is_refused_by_check_and_run(tmp_path):
    archive = tmp_path / "ring.ssp"
    ring(*TOGETHER["same"]).to_ssp(archive)
    for arguments in (["check", str(archive)], ["run", str(archive), "--stop-time", "1", "--step", "0.1"]):
        result = CliRunner().invoke(app, arguments)
        assert result.exit_code != 0
        assert "a loop of clocked variables acts on itself" in " ".join([*result.output.split(), str(result.exception)])
