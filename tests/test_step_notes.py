"""A communication step that is long for what is in a system is noted: durations and periods by formulas."""

from __future__ import annotations

import math

import pytest

from shaper_fmu import System

W = math.pi  # a period of 2 s


def moved(fmus) -> System:
    system = System()
    system.add("profile", fmus / "MotionProfile.fmu", profile="cycloid", distance=1.0, duration=4.0)
    system.add("plant", fmus / "MassSpringDamper.fmu", mass=1.0, stiffness=W * W, damping=0.0)
    system.connect_raw("profile.position", "plant.force")
    return system


@pytest.mark.parametrize(
    ("step", "exact", "noted"),
    [
        (0.1, True, []),
        (0.5, True, []),
        (1.25, True, ["plant.natural_frequency = 3.14159 rad/s"]),  # 1.6 steps a period
        (0.19, False, []),
        (0.25, False, ["plant.natural_frequency = 3.14159 rad/s"]),  # on the grid 10 a period are needed: 8
    ],
)
def test_long_steps_are_noted(fmus, step, exact, noted):
    notes = [n for n in moved(fmus).simulate(10.0, step, exact=exact).notes if n.startswith("a step of")]
    assert len(notes) == len(noted)
    for note, words in zip(notes, noted, strict=True):
        assert words in note
