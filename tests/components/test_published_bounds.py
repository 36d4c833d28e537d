"""Bounds that an FMU tells are inclusive in FMI: each is accepted, and the FMU runs at it, with all else as it is by default."""

from __future__ import annotations

import sys
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from fmpy import read_model_description

from shaper_fmu import System
from shaper_fmu.component import Component
from shaper_fmu.errors import SimulationError
from shaper_fmu.export.build import build_fmu
from shaper_fmu.registry import components, load_components

NOT_TOLD = {
    ("MotionProfile", "max_velocity"), ("MotionProfile", "max_acceleration"), ("LimitedShaper", "max_jerk"),
    ("FeedbackInverse", "natural_frequency"), ("FeedbackInverse", "sample_period"),
}  # fmt: skip
"""Bounded, but a minimum that goes with all other values does not exist: their descriptions tell the domain."""


@pytest.fixture(scope="module", params=[2, 3])
def built(request, fmus, tmp_path_factory) -> Path:
    """A folder with all FMUs of one version of FMI."""
    if request.param == 2:
        return fmus
    folder = tmp_path_factory.mktemp("fmi3")
    for component in components().values():
        build_fmu(component, folder, fmi=3, platforms=["this"])
    return folder


def results_at(component: type[Component], fmu: Path, values: dict[str, Any]) -> None:
    """Run ten steps with these values, and look at everything that the FMU computes."""
    system = System()
    system.add("a", fmu, **values)
    computed = [v for v in component.variables.values() if v.causality in ("output", "local", "calculatedParameter")]
    results = system.simulate(0.1, 0.01, record=[f"a.{name}" for v in computed for name in v.scalar_names])
    for name, column in results.values.items():
        assert np.isfinite(column).all(), (name, values)


@pytest.mark.parametrize("name", sorted(components()))
def test_every_published_bound_runs(name, built):
    """The bounds are read from the FMU, not from the declaration; arrays at the bound as a whole, and one element of them."""
    component = components()[name]
    path, tried = built / f"{name}.fmu", 0
    for variable in read_model_description(str(path)).modelVariables:
        if variable.causality not in ("parameter", "input") or variable.type in ("Enumeration", "Boolean"):
            continue
        for bound in (variable.min, variable.max):
            if bound is not None:
                size = component.variables[variable.name.split("[")[0]].size if variable.dimensions else None
                results_at(component, path, {variable.name: [float(bound)] * size if size else float(bound)})
                tried += 1
    assert tried


def test_what_is_bounded_tells_a_bound():
    """So that tools can refuse a mass of -1 before anything runs; what tells none, tells its domain in words."""
    for component in components().values():
        for v in component.variables.values():
            for side in ("min", "max"):
                if getattr(v, side) is not None and v.kind in (int, float):
                    assert (side in v.published_bounds) != ((component.__name__, v.name) in NOT_TOLD), (component.__name__, v.name)


OWN = '''\
"""A component of a user's own."""

from shaper_fmu.component import Component, Output, Parameter


class Compliance(Component):
    """1 / stiffness^2."""

    stiffness = Parameter(1.0, "", "stiffness", min=0.0, exclusive=True{})
    result = Output("", "result", depends=())

    def step(self, t, h):
        self.result = 1.0 / (self.stiffness * self.stiffness)
'''


def test_what_published_is_for(tmp_path):
    """Without it the excluded 0 is told as a number at which the kernel overflows; with it, smaller values are accepted as before."""
    for told in ("", ", published=(1e-9, None)"):
        folder = tmp_path / f"own{len(told)}"
        folder.mkdir()
        (folder / "own.py").write_text(OWN.format(told))
        (component,) = load_components(folder / "own.py")
        fmu = build_fmu(component, folder, platforms=["this"])
        (variable,) = [v for v in read_model_description(str(fmu)).modelVariables if v.name == "stiffness"]
        least = float(str(variable.min))
        if told:
            assert least == 1e-9
            results_at(component, fmu, {"stiffness": least})
            results_at(component, fmu, {"stiffness": 1e-10})
        else:
            assert least == sys.float_info.min
            with pytest.raises(SimulationError, match="division by zero"):
                results_at(component, fmu, {"stiffness": least})
