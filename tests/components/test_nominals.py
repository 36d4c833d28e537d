"""Nominal values of continuous states, and what comes of them: plants that are right at importers' default tolerances."""

from __future__ import annotations

import math
from ctypes import c_double
from typing import Any

import fmpy
import numpy as np
import pytest
from description_cases import TOKEN, read_back
from native_drivers import Driver
from native_host import native_fmu

from shaper_fmu.component import Component, Input, Output, State
from shaper_fmu.errors import BuildError
from shaper_fmu.export.model_description import fmi2_native_description, fmi3_native_description

both_versions = pytest.mark.parametrize("fmi", [2, 3])
MOVES = {
    "MassSpringDamper": ("force", [(0.0, 1.0)]),
    "FlexibleBeam": ("base_acceleration", [(0.0, 1.0), (0.5, -1.0), (1.0, 0.0)]),
    "OverheadCrane": ("trolley_acceleration", [(0.0, 0.5), (2.0, -0.5), (4.0, 0.0)]),
    "DoublePendulumCrane": ("trolley_acceleration", [(0.0, 0.5), (2.0, -0.5), (4.0, 0.0)]),
    "RotatingBeam": ("hub_acceleration", [(0.0, 1.0), (0.5, -1.0), (1.0, 0.0)]),
    "ThreeMassChain": ("force", [(0.0, 1.0), (0.5, -1.0), (1.0, 0.0)]),
    "HydraulicPendulum": ("reference_position", [(0.0, 0.0), (0.5, 0.01)]),
}
"""An input of each plant, and its values from these times on."""
JUMPING = ("acceleration", "tip_acceleration", "hub_torque", "rope_tension", "sling_tension")


def simulated(name: str, fmi: int, kind: str, tolerance: float | None, interval: float) -> dict[str, np.ndarray]:
    """Outputs over time by fmpy, over the default experiment; those that jump with the input are left out."""
    path = str(native_fmu(name, fmi))
    variables: Any = fmpy.read_model_description(path).modelVariables
    options: dict[str, Any] = {} if tolerance is None else {"relative_tolerance": tolerance}
    variable, jumps = MOVES[name]
    ends = [*[time for time, _ in jumps[1:]], 100.0]
    rows = [row for (time, value), end in zip(jumps, ends, strict=True) for row in ((time, value), (end, value))]
    found = fmpy.simulate_fmu(
        path,
        fmi_type=kind,
        input=np.array(rows, dtype=[("time", float), (variable, float)]),
        output_interval=interval,
        **options,
        output=[v.name for v in variables if v.causality == "output" and v.name not in JUMPING],
    )
    return {name: found[name].reshape(len(found), -1) for name in found.dtype.names or ()}


@both_versions
@pytest.mark.parametrize("tolerance", [None, 1e-5, 1e-4], ids=["described", "of FMPy", "of OMSimulator"])
@pytest.mark.parametrize("name", MOVES)
def test_a_plant_is_right_within_one_percent_at_default_tolerances(name, tolerance, fmi):
    """CVODE in fmpy against co-simulation (exact, or 1e-10), as a share of how far each output goes."""
    stepped = simulated(name, fmi, "CoSimulation", None, 0.001)
    solved = simulated(name, fmi, "ModelExchange", tolerance, 0.01)
    for output in stepped:
        for known, found in zip(stepped[output].T, solved[output].T, strict=True):
            if output != "time" and np.ptp(known) > 0.0:
                expected = np.interp(solved["time"][:, 0], stepped["time"][:, 0], known)
                assert np.max(np.abs(found - expected)) < 0.01 * np.ptp(known), output


@both_versions
def test_nominals_follow_the_parameters(fmi):
    """Of a mass on a spring: F/k and F w/k for a force of 1 N; in the description those of the start values."""
    driver = Driver(native_fmu("MassSpringDamper", fmi), exchange=True).initialize({"stiffness": 400.0, "mass": 4.0})
    experiment: Any = driver.description.defaultExperiment
    x = (c_double * 2)()
    driver.slave.getNominalsOfContinuousStates(x, 2)
    assert list(x) == pytest.approx([1.0 / 400.0, 10.0 / 400.0], rel=1e-15)
    assert float(str(driver.variables["position"].nominal)) == 0.01
    assert float(str(driver.variables["velocity"].nominal)) == 0.1
    assert float(str(experiment.tolerance)) == 1e-6
    driver.close()


def declared(nominal, kind: type = float) -> type[Component]:
    class Mine(Component):
        push = Input("N", "force")
        place = Output("m", "place", kind=kind, start=kind(0), nominal=nominal)
        three = State(1.0, size=3)
        scale = State(-2.0)

        def step(self, t, h):
            pass

    return Mine


@pytest.mark.parametrize("nominal", [0.0, -1.0, math.nan, math.inf, "scale", "three", "nothing", "scal"])
@pytest.mark.parametrize("make", [fmi2_native_description, fmi3_native_description])
def test_a_nominal_that_is_none_is_told_at_the_build(nominal, make):
    with pytest.raises(BuildError, match="Mine: the nominal of 'place'"):
        make(declared(nominal), TOKEN, "the test")


def test_a_nominal_is_for_real_variables():
    with pytest.raises(BuildError, match="the variable of type float"):
        fmi2_native_description(declared(2.0, int), TOKEN, "the test")
    place = next(v for v in read_back(fmi3_native_description(declared(2.0), TOKEN, "x")).modelVariables if v.name == "place")
    assert float(str(place.nominal)) == 2.0
