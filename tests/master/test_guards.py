"""Smooth commands through shapers: what an event of a shaper must not set off."""

from __future__ import annotations

import math

import numpy as np
import pytest

from shaper_fmu import System
from shaper_fmu.design.shapers import shaper
from shaper_fmu.export.build import fmu_path
from shaper_fmu.master.algorithms import ALGORITHMS

W, ZETA = 9.7, 0.01  # no impulse falls on a grid of 5 ms
MOVE, STEP = 0.8, 0.005


def shaped_move(fmi: int, kinds: list[str]) -> System:
    """A smooth move of 1 m through one shaper after the other; no plant."""
    system = System()
    system.add("profile", fmu_path("MotionProfile", fmi, platforms=["this"]), profile="polynomial_345", duration=MOVE)
    source = "profile.position"
    for i, kind in enumerate(kinds):
        parameters = {"shaper": kind, "natural_frequency[1]": W * (1.0 + 0.37 * i), "damping_ratio[1]": ZETA}
        system.add(f"shaper{i}", fmu_path("InputShaper", fmi, platforms=["this"]), parameters)
        system.connect(source, f"shaper{i}.command")
        source = f"shaper{i}.shaped"
    return system


def position(t: np.ndarray) -> np.ndarray:
    u = np.clip(t / MOVE, 0.0, 1.0)
    return u**3 * (10 - 15 * u + 6 * u**2)


@pytest.mark.parametrize("algorithm", ALGORITHMS)
@pytest.mark.parametrize("fmi", [2, 3])
def test_a_smooth_command_is_taken_at_the_grid_and_each_sample_comes_once_an_impulse(fmi, algorithm):
    """sum of A_i y(t_k) for the latest t_k <= t - T_i, to the bit of rounding; and no more rows than samples and impulses make.

    The other algorithms take the samples a step late or early.
    """
    results = shaped_move(fmi, ["zvd"]).simulate(2.0, STEP, algorithm=algorithm, everywhere=True, record=["shaper0.shaped"])
    impulses = shaper("zvd", W, ZETA)
    moving = math.ceil(MOVE / STEP)
    assert len(results.time) <= 2 * (401 + 2 * moving + 10)  # both sides of the grid and of each event of the two late impulses
    after = np.append(np.diff(results.time) > 0.0, True)  # from the right, where there are values on both sides
    on_grid = np.flatnonzero(after & np.isclose(results.time / STEP, np.round(results.time / STEP), atol=1e-9))
    expected = np.zeros(len(on_grid))
    for amplitude, lag in zip(impulses.amplitudes, impulses.delays, strict=True):
        sampled = np.floor((results.time[on_grid] - lag) / STEP + 1e-9) * STEP
        expected += amplitude * position(sampled)
    found = results["shaper0.shaped"][on_grid]
    if algorithm == "jacobi":
        assert found == pytest.approx(expected, abs=1e-12)
    else:
        assert np.max(np.abs(found - expected)) < 1.875 * STEP / MOVE  # the profile's peak speed is 1.875 m / MOVE


def test_two_shapers_in_series_stay_bounded():
    """The second takes the first one's jumps, wherever they are: nine impulses in all, as if convolved."""
    results = shaped_move(2, ["zvd", "zvd"]).simulate(2.5, STEP, everywhere=True, record=["shaper1.shaped"])
    moving = math.ceil(MOVE / STEP)
    assert len(results.time) < 501 + 2 * 8 * (moving + 3)
    assert results["shaper1.shaped"][-1] == pytest.approx(1.0, abs=1e-12)


def test_a_shaper_removes_its_mode_from_the_samples_of_a_smooth_move():
    """ZV at steps of 20, 10 and 5 ms: whatever staircase comes in, nothing is left of it."""
    left = []
    for step in (0.02, 0.01, 0.005):
        system = shaped_move(2, ["zv"])
        system.add("plant", fmu_path("MassSpringDamper", platforms=["this"]), stiffness=W * W, damping=2 * ZETA * W)
        system.connect("shaper0.shaped", "plant.force", gain=W * W)
        results = system.simulate(2.0, step, record=["plant.position", "plant.velocity"])
        deviation, speed = results["plant.position"][-1] - 1.0, results["plant.velocity"][-1] / W
        left.append(math.hypot(deviation, speed))
    assert max(left) < 1e-12
