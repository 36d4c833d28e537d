"""Plants as users have them: Euler's method as a solver, lags, drifts, noise, motion at the start (see support/fmus/rough2.c)."""

from __future__ import annotations

import math

import pytest
from rough_fmus import EULER, rough_fmu

from shaper_fmu.errors import SimulationError
from shaper_fmu.tune import experiment
from shaper_fmu.tune.identify.response import Experiment
from shaper_fmu.tune.plant import Plant

W, ZETA = 100.0, 0.05
"""Euler's method x + h A x is stable for h < 2 zeta / w = 1 ms: |1 + h p|^2 = 1 - 2 zeta w h + (w h)^2."""


def test_a_stable_step_is_found_before_settling():
    """A two-hundredth of the default experiment, 5 ms, diverges: a motion at the start grows until the FMU fails."""
    plant = Plant(rough_fmu(1.0), "u", ["y"], {"w": W, "z": ZETA, "euler": EULER, "q0": 1e-5})
    trial = Experiment(plant, {})
    assert trial.settle(1.0) is None
    assert plant.longest_step < 2.0 * ZETA / W
    assert 1.0 <= trial.settle_time <= 3.0  # exp(-zeta w t) = 1e-3 after 1.4 s
    found = experiment(plant)
    assert [mode.natural_frequency for mode in found.modes] == pytest.approx([W], rel=1e-4)
    assert [mode.damping_ratio for mode in found.modes] == pytest.approx([ZETA], rel=1e-3)


def test_a_plant_that_is_unstable_keeps_its_step():
    plant = Plant(rough_fmu(1.0), "u", ["y"], {"w": W, "z": -0.005, "q0": 1e-5})
    assert Experiment(plant, {}).settle(1.0) is not None
    assert math.isinf(plant.longest_step)
    assert experiment(plant).has("unstable")


def test_a_plant_that_fails_at_any_step_says_why():
    plant = Plant(rough_fmu(1.0), "u", ["y"], {"w": W, "z": -0.5, "q0": 1.0})
    with pytest.raises(SimulationError, match="overflow"):
        experiment(plant)
    assert math.isinf(plant.longest_step)
