"""Loops of direct feedthrough: named, and solved at initialization."""

from __future__ import annotations

from pathlib import Path

import pytest

from shaper_fmu import System
from shaper_fmu.errors import SimulationError
from shaper_fmu.export.build import build_fmu
from shaper_fmu.master.wiring import signal_order
from shaper_fmu.registry import load_components

FUNCTION = """
from shaper_fmu.component import Component, Input, Output, Parameter


class Function(Component):
    value = Input("", "what goes in")
    gain = Parameter(0.5, "", "factor")
    square = Parameter(0.0, "", "factor of the square")
    result = Output("", "gain value + square value^2")

    def step(self, t, h):
        self.result = self.gain * self.value + self.square * self.value * self.value
"""


@pytest.fixture(scope="module")
def function(tmp_path_factory) -> Path:
    folder = tmp_path_factory.mktemp("function")
    (folder / "function.py").write_text(FUNCTION)
    return build_fmu(load_components(folder / "function.py")[0], folder, backend="native", platforms=["this"])


def ring(function: Path, offset: float, **values: float) -> System:
    """one -> two -> one, with an offset on the way to the second."""
    system = System()
    system.add("one", function, **values)
    system.add("two", function)
    system.connect("one.result", "two.value", offset=offset)
    system.connect("two.result", "one.value")
    return system


def test_a_linear_loop_is_solved_at_the_start(function):
    """y1 = a y2 and y2 = (y1 + b) / 2, so y1 = a b / (2 - a)."""
    for gain, offset in ((0.5, 3.0), (-0.9, 2.0), (1.9, 1.0), (-7.0, 4.0)):
        results = ring(function, offset, gain=gain).simulate(0.0, 0.1)
        assert results["one.result"][0] == pytest.approx(gain * offset / (2 - gain), rel=1e-12)
        assert results["two.result"][0] == pytest.approx(offset / (2 - gain), rel=1e-12)
        assert results.notes == (
            "loop without delay two.value -> one.value -> two.value: solved at the start, later two.value is an exchange behind",
        )


def test_a_nonlinear_loop_is_solved_at_the_start(function):
    """x = y2, y1 = x / 5 + x^2 / 10, x = (y1 + 1) / 2: x^2 - 18 x + 10 = 0."""
    results = ring(function, 1.0, gain=0.2, square=0.1).simulate(0.0, 0.1)
    assert results["two.result"][0] == pytest.approx(9.0 - 71.0**0.5, rel=1e-12)


def test_a_loop_without_a_solution_is_an_error(function):
    """y1 = 2 y2 and y2 = (y1 + 1) / 2: no values do."""
    with pytest.raises(SimulationError, match=r"two\.value -> one\.value -> two\.value: no values were found that close the loop"):
        ring(function, 1.0, gain=2.0).simulate(1.0, 0.1)


def test_two_loops_are_solved_together(function):
    """a and b feed each other, b and c feed each other: found by elimination."""
    system = System()
    for name in ("a", "b", "c", "d"):
        system.add(name, function)
    system.connect("a.result", "b.value", offset=1.0)
    system.connect("b.result", "a.value")
    system.connect("d.result", "c.value", offset=2.0)
    system.connect("c.result", "d.value")
    results = system.simulate(0.0, 0.1)
    assert [results[f"{name}.result"][0] for name in "abcd"] == pytest.approx([1 / 3, 2 / 3, 4 / 3, 2 / 3], rel=1e-12)
    assert len(results.notes) == 2


def test_acceleration_fed_back_as_a_force_acts_as_mass_at_the_start(function, fmus):
    """force = F - ma a: at rest a = F / (m + ma), which no order of the exchange gives."""
    system = System()
    system.add("inertia", function, gain=-3.0)
    system.add("plant", fmus / "MassSpringDamper.fmu", mass=2.0)
    system.connect("plant.acceleration", "inertia.value")
    system.connect("inertia.result", "plant.force", offset=10.0)
    assert system.check() == []
    assert system.simulate(0.0, 0.1)["plant.acceleration"][0] == pytest.approx(10.0 / 5.0, rel=1e-12)


def test_every_loop_is_cut_once():
    connections = {
        ("a", "u"): ("b", "y"),
        ("b", "u"): ("a", "y"),
        ("c", "u"): ("a", "y"),
        ("d", "u"): ("c", "y"),
        ("c", "v"): ("d", "y"),
    }
    inputs = {"a": ["u"], "b": ["u"], "c": ["u", "v"], "d": ["u"]}
    order, loops = signal_order(connections, lambda port: [(port[0], name) for name in inputs[port[0]]])
    assert loops == [(("a", "u"), ("b", "u"), ("a", "u")), (("d", "u"), ("c", "v"), ("d", "u"))]
    assert order.index(("a", "u")) < order.index(("b", "u"))
    assert order.index(("d", "u")) < order.index(("c", "v"))
