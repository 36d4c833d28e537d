"""A communication step that is long for what is in a system is noted: durations and periods by formulas."""

from __future__ import annotations

import math

import pytest

from shaper_fmu import System
from shaper_fmu.errors import ModelError
from shaper_fmu.master.batch import Batch, Plan
from shaper_fmu.master.simulation import Simulation
from shaper_fmu.metrics.final import Final

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
        (0.4, True, []),
        (0.5, True, ["profile.duration = 4 s"]),  # 8 steps of a smooth move
        (1.25, True, ["profile.duration = 4 s", "plant.natural_frequency = 3.14159 rad/s"]),  # and 1.6 steps a period
        (0.19, False, []),
        (0.25, False, ["plant.natural_frequency = 3.14159 rad/s"]),  # on the grid 10 a period are needed: 8
    ],
)
def test_long_steps_are_noted(fmus, step, exact, noted):
    notes = [n for n in moved(fmus).simulate(10.0, step, exact=exact).notes if n.startswith("a step of")]
    assert len(notes) == len(noted)
    for note, words in zip(notes, noted, strict=True):
        assert words in note


def move_into_plant(fmus, output: str, **values) -> System:
    """A move of 4 s into a plant so slow (a period of 1000 s) that it asks for no short steps."""
    system = System()
    system.add("profile", fmus / "MotionProfile.fmu", distance=1.0, duration=4.0, **values)
    system.add("plant", fmus / "MassSpringDamper.fmu", mass=1.0, stiffness=(math.pi / 500.0) ** 2, damping=0.0)
    system.connect_raw(f"profile.{output}", "plant.force")
    return system


@pytest.mark.parametrize(
    ("output", "kind", "exact", "noted"),
    [
        ("position", "cycloid", True, True),
        ("velocity", "two_part", True, True),
        ("acceleration", "s_curve", True, True),
        ("velocity", "trapezoid", True, True),
        ("acceleration", "trapezoid", True, False),  # constant between the events that steps end at
        ("acceleration", "trapezoid", False, True),  # on the grid its edges are moved
        ("position", "step", True, False),
        ("position", "step", False, False),  # a step has no duration
    ],
)
@pytest.mark.parametrize("late", [False, True])
def test_a_smooth_move_needs_ten_steps(fmus, output, kind, exact, noted, late):
    """4 s / 10 = 0.4 s: a step of 0.4 s is short enough, 0.5 s is not; whether the kind is given to the system or to the run."""
    system = move_into_plant(fmus, output, **({} if late else {"profile": kind}))
    given = {"profile.profile": kind} if late else {}

    def told(step: float) -> list[str]:
        return [n for n in system.simulate(8.0, step, exact=exact, start_values=given).notes if n.startswith("a step of")]

    assert told(0.4) == []
    words = "a step of 0.5 s is long for profile.duration = 4 s: it has 8 steps, and needs 10 (0.4 s)"
    assert told(0.5) == ([words] if noted else [])


def test_pulses_are_no_smooth_move(fmus):
    """Steps end at their edges: a travel of 0.4 s in steps of 0.1 s loses nothing, in steps of 1 s its frequency is not seen."""
    system = System()
    system.add("pulses", fmus / "PulseTrain.fmu", duration=0.4)
    system.add("plant", fmus / "MassSpringDamper.fmu", mass=1.0, stiffness=1e-4, damping=0.0)
    system.connect_raw("pulses.pulse", "plant.force")
    assert not [n for n in system.simulate(2.0, 0.1).notes if n.startswith("a step of")]


def test_a_frequency_given_to_the_run_counts(fmus):
    """60 rad/s is a period of 0.1047 s: 0.209 steps of 0.5 s."""
    system = move_into_plant(fmus, "position", profile="two_part")
    notes = system.simulate(8.0, 0.5, start_values={"profile.natural_frequency": 60.0}).notes
    assert any("profile.natural_frequency = 60 rad/s: it has 0.209 steps a period" in note for note in notes)


def test_a_step_above_the_run_is_refused_at_every_door_of_the_master(fmus):
    system, words = moved(fmus), "a step of 100 s does not fit into a run of 10 s; give a step of 10 s at most"
    with pytest.raises(ModelError, match=words):
        system.simulate(10.0, 100.0)
    with Simulation(system) as simulation, pytest.raises(ModelError, match=words):
        simulation.run(10.0, 100.0)
    with pytest.raises(ModelError, match=words):
        Batch(system, Plan(10.0, 100.0), {"end": Final("plant.position")}, [])
