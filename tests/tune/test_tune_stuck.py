"""Plants that stick where they are excited little: in friction, behind a converter's steps, or in a dead zone."""

from __future__ import annotations

import math
from dataclasses import replace

import numpy as np
import pytest
from rough_fmus import rough_fmu

from shaper_fmu import tune_plant
from shaper_fmu.analysis.identification import Finding, free_response, identify, unexplained
from shaper_fmu.tune import experiment, requirements_for
from shaper_fmu.tune.identify.range import PlantModes
from shaper_fmu.tune.tuning_plant import hopeless_verdict

W, ZETA = 10.0, 0.02


@pytest.mark.parametrize("stuck", [{"count": 0.3}, {"dead": 0.2}])
def test_an_excitation_at_which_nothing_moves_is_not_taken_for_a_linear_one(stuck):
    """A tenth of the first amplitude, 0.1, is rounded to 0, or lost in the dead zone; behind them the plant is linear."""
    found = experiment(rough_fmu(), "u", ["y"], start_values={"w": W, "z": ZETA, **stuck})
    assert found.excitation.amplitude == 1.0
    assert [mode.natural_frequency for mode in found.modes] == pytest.approx([W], rel=1e-3)
    assert [mode.damping_ratio for mode in found.modes] == pytest.approx([ZETA], rel=0.05)
    assert "nonlinear" in [finding.code for finding in found.findings]


def test_a_plant_that_only_creeps_when_excited_little_may_vibrate():
    """Friction of a twentieth of the command's force: it acts as a damper of 50 N s/m up to its slip, but the step goes far beyond.

    Each half swing loses twice friction over stiffness, 1e-3, of a swing of 1e-2: about five of them are seen.
    """
    values = {"w": W, "z": 1e-3, "friction": 0.05, "slip": 1e-3}
    creeping = 0.05 / 1e-3 / (2.0 * W)
    assert creeping > 1.0  # overdamped
    found = tune_plant(rough_fmu(), "u", ["y"], start_values=values, requirements=requirements_for({}))
    assert found.verdict == "not_proven"
    assert "after a step as large as the commands, 1, it swings at" in found.summary
    assert found.plant is not None


def test_growing_poles_of_what_is_not_linear_are_no_instability():
    linear = experiment(rough_fmu(), "u", ["y"], start_values={"w": W, "z": ZETA})
    modes = PlantModes((linear,), (), (Finding("unstable", "it grows"),))
    verdict = hopeless_verdict(modes)
    assert verdict is not None
    assert verdict[0] == "unstable"
    fits_badly = replace(modes, findings=(*modes.findings, Finding("nonlinear", "too nonlinear")))
    assert hopeless_verdict(fits_badly) == ("not_proven", "it grows, but poles prove nothing here: too nonlinear")


def test_a_plant_that_does_not_vibrate_at_any_size_needs_no_shaper():
    found = tune_plant(rough_fmu(), "u", ["y"], start_values={"w": W, "z": 1.5}, amplitude=10.0, requirements=requirements_for({}))
    assert found.verdict == "no_vibration"


def test_noise_is_no_part_that_poles_leave():
    """White noise of 2 % of the swing's RMS, in a record of poles that are known: nothing else is left by them."""
    time = 0.01 * np.arange(1000)
    swing = np.exp(-0.2 * time) * np.cos(10.0 * time)
    known = identify(free_response(swing, 0.01))
    noise = 0.02 * float(np.std(swing))
    noisy = free_response(swing + noise * np.random.default_rng(3).standard_normal(1000), 0.01)
    assert unexplained(noisy, known) == pytest.approx(0.02, rel=0.1)
    assert unexplained(noisy, known, np.array([noise])) == 0.0
    assert unexplained(noisy, known, np.array([0.5 * noise])) == pytest.approx(0.02 * math.sqrt(1.0 - (0.5 * 1.15) ** 2), rel=0.1)
