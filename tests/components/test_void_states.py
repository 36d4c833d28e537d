"""Model exchange: states at which a plant's equations are void are refused in words, as in co-simulation."""

from __future__ import annotations

from ctypes import c_double

import pytest
from fmpy.fmi1 import FMICallException
from native_drivers import Driver
from native_host import native_fmu


@pytest.mark.parametrize("fmi", [2, 3])
@pytest.mark.parametrize(
    ("name", "state", "words"),
    [
        ("OverheadCrane", [0.0, 0.0, 5.0, 2.0, 0.1], "OverheadCrane: the rope would have to push"),
        ("OverheadCrane", [0.0, 0.0, -0.1, 0.0, 0.1], "OverheadCrane: hoisting at 0 m/s leaves no rope (rope length -0.1 m)"),
        ("DoublePendulumCrane", [0.0, 0.0, -0.1, 0.0, 0.0, 0.1, 0.0], "leaves no rope (rope length -0.1 m)"),
        ("DoublePendulumCrane", [0.0, 0.0, 5.0, 2.0, 2.0, 0.0, 0.0], "DoublePendulumCrane: the rope would have to push"),
        ("DoublePendulumCrane", [0.0, 0.0, 5.0, 0.0, 2.0, 0.0, 0.0], "DoublePendulumCrane: the sling would have to push"),
        (
            "HydraulicPendulum",
            [-0.31, 0.0, 0.0, 0.0, 0.5, 0.5, 0.0, 0.0],
            "the piston ran into the end of its cylinder: slide_position = -0.31 m",
        ),
        ("HydraulicPendulum", [0.0, 0.0, 0.0, 0.0, 0.5, -0.01, 0.0, 0.0], "the pressure in a chamber fell to -100000 Pa"),
    ],
)
def test_a_state_at_which_the_equations_are_void_is_refused(name, state, words, fmi):
    driver = Driver(native_fmu(name, fmi), exchange=True).initialize()
    driver.update()
    driver.slave.enterContinuousTimeMode()
    driver.slave.setContinuousStates((c_double * len(state))(*state), len(state))
    ask = driver.slave.getContinuousStateDerivatives if fmi == 3 else driver.slave.getDerivatives
    with pytest.raises(FMICallException):
        ask((c_double * len(state))(), len(state))
    assert words in driver.messages[-1]
    driver.close()
