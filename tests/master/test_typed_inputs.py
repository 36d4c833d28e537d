"""Inputs that are no Reals: driven by tables, constants and functions, with values in their types."""

from __future__ import annotations

import numpy as np
import pytest

from shaper_fmu.errors import ModelError, SimulationError
from shaper_fmu.export.pythonfmu_backend import build_fmu
from shaper_fmu.master.system import System

SWITCH = '''\
"""A switch and a counter, for inputs that are no Reals."""

from shaper_fmu.component import Component, Input, Output


class Switch(Component):
    """Passes on a boolean and an integer."""

    on = Input("", "switch", start=False)
    count = Input("", "number", start=0)
    both = Output("", "count if on, else -1")

    def step(self, t, h):
        self.both = float(self.count) if self.on else -1.0
'''


@pytest.fixture
def switch(tmp_path):
    from shaper_fmu.registry import load_components

    (tmp_path / "switch.py").write_text(SWITCH)
    return build_fmu(load_components(tmp_path / "switch.py")[0], tmp_path)


def test_booleans_and_integers_are_driven_by_tables_constants_and_numpy(switch):
    system = System()
    system.add("switch", switch)
    system.drive("switch.on", [(0.0, 0), (0.2, 1)])
    system.drive("switch.count", lambda t: np.int64(7))
    assert system.simulate(0.3, 0.1)["switch.both"].tolist() == [-1.0, -1.0, 7.0, 7.0]


@pytest.mark.parametrize(
    ("target", "source", "words"),
    [
        ("count", lambda t: 2.5, r"switch.count at t = 0 s: count = 2.5 is not of type Integer"),
        ("on", lambda t: None, r"on = None is not of type Boolean"),
        ("count", lambda t: 1 / 0, r"switch.count at t = 0 s: its function failed: ZeroDivisionError"),
    ],
)
def test_values_of_another_type_are_told_with_input_and_time(switch, target, source, words):
    system = System()
    system.add("switch", switch, on=False, count=0)
    system.drive(f"switch.{target}", source)
    with pytest.raises(SimulationError, match=words):
        system.simulate(0.3, 0.1)


@pytest.mark.parametrize(
    ("target", "source", "words"),
    [
        ("count", 2.5, r"switch.count: count = 2.5 is not of type Integer"),
        ("count", [(0.0, 1), (1.0, 2**40)], r"count = 1099511627776.0 is not of type Integer"),
        ("on", 2, r"on = 2.0 is not of type Boolean"),
    ],
)
def test_numbers_and_tables_of_another_type_are_told_before_a_run(switch, target, source, words):
    system = System()
    system.add("switch", switch, on=False, count=0)
    with pytest.raises(ModelError, match=words):
        system.drive(f"switch.{target}", source)


@pytest.mark.parametrize("value", [[], {}, {1.0: 2}])
def test_start_values_that_say_nothing_are_refused(fmus, value):
    with pytest.raises(ModelError, match="gives no values"):
        System().add("shaper", fmus / "InputShaper.fmu", natural_frequency=value)
