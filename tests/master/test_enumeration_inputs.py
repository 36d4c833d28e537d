"""Enumerations that integers of other FMUs feed, in FMI 2.0 and 3.0: items arrive, another number ends the run."""

from __future__ import annotations

from pathlib import Path

import pytest

from shaper_fmu.errors import SimulationError
from shaper_fmu.export.build import build_fmu
from shaper_fmu.master.algorithms import ALGORITHMS
from shaper_fmu.master.system import System
from shaper_fmu.registry import load_components

SOURCE = '''\
"""A count, and a gear that it chooses."""

from enum import IntEnum

from shaper_fmu.component import Component, Input, Output, State


class Gear(IntEnum):
    """Gears."""

    low = 1
    high = 2
    park = 5


class Count(Component):
    """Counts its steps."""

    count = Output("", "number of steps, and one", start=1, depends=())
    steps = State(1)

    def step(self, t, h):
        if h > 0.0:
            self.steps += 1
        self.count = self.steps


class Gearbox(Component):
    """Tells its gear."""

    gear = Input("", "gear", start=Gear.low)
    seen = Output("", "the gear", start=0)

    def step(self, t, h):
        self.seen = int(self.gear)
'''


@pytest.fixture(scope="module")
def parts(tmp_path_factory) -> dict[tuple[str, int], Path]:
    folder = tmp_path_factory.mktemp("gears")
    (folder / "gears.py").write_text(SOURCE)
    return {
        (component.__name__, fmi): build_fmu(component, folder / str(fmi), fmi=fmi, platforms=["this"])
        for component in load_components(folder / "gears.py")
        for fmi in (2, 3)
    }


@pytest.mark.representatives(versions=[(2, 3), (3, 2)])
@pytest.mark.parametrize("algorithm", ALGORITHMS)
@pytest.mark.parametrize("versions", [(2, 2), (2, 3), (3, 2), (3, 3)])
def test_a_number_that_is_no_item_ends_the_run(parts, versions, algorithm):
    """1, 2, then 3, which becomes 5 (park) by a mapping, and 4, which is not an item."""
    system = System()
    system.add("counter", parts["Count", versions[0]])
    system.add("box", parts["Gearbox", versions[1]])
    system.connect_raw("counter.count", "box.gear", mapping={3: 5})
    results = system.simulate(0.2, 0.1, algorithm=algorithm)
    assert set(results["box.seen"]) <= {1.0, 2.0, 5.0}
    words = (
        r"box at t = 0\.[234]\d* s: the value for input gear is 4, from counter\.count, which is not an item of the enumeration: "
        r"low \(1\), high \(2\), park \(5\)"
    )
    with pytest.raises(SimulationError, match=words):
        system.simulate(1.0, 0.1, algorithm=algorithm)
