"""Habits of other tools' FMUs, by an FMU of our own that has them: identified as well as those without."""

from __future__ import annotations

import numpy as np
import pytest
from hidden_plants import swinging
from linear_fmus import faulty, linear_fmu, matrices

from shaper_fmu import System, experiment
from shaper_fmu.master.batch import Batch, Plan
from shaper_fmu.metrics.final import Final

MODES = {"w1": 3.0, "z1": 0.05, "w2": 8.0, "z2": 0.1, "b2": 5.0}


def poles_of(found) -> list[complex]:
    return [mode.pole for mode in found.modes]


def test_a_solver_that_takes_the_communication_step_for_its_own():
    """Euler's method makes a damped mode unstable at long steps (OpenModelica's co-simulation); extrapolated to none."""
    found = experiment(linear_fmu(2), "u", ["y"], start_values=faulty("euler", **MODES), linear=False)
    assert poles_of(found) == pytest.approx(list(swinging(matrices(**MODES)[0])), rel=1e-4)


def test_a_solver_that_moves_on_in_steps_of_its_own():
    """It goes past the communication point to the next of its own (20-sim): values at these alone are those of the system."""
    plant = linear_fmu(2, own_step=0.01)
    found = experiment(plant, "u", ["y"], start_values=faulty("own_steps", **MODES), linear=False)
    assert poles_of(found) == pytest.approx(list(swinging(matrices(**MODES)[0])), rel=1e-5)


@pytest.mark.parametrize(
    ("modes", "step"),
    [({"w1": 40.0, "z1": 0.5, "w2": 90.0, "z2": 0.4, "b2": 5.0}, 5.0), (MODES, 1000.0), (MODES, 20.0), (MODES, 0.3)],
)
def test_a_default_step_that_is_none_of_the_solvers_own(modes, step):
    """However long it is, above the run of 10 s, too: a plant that is at rest when it is over does not move on in such steps."""
    found = experiment(linear_fmu(2, own_step=step), "u", ["y"], start_values=modes, linear=False)
    assert poles_of(found) == pytest.approx(list(swinging(matrices(**modes)[0])), rel=1e-5)


def test_a_solvers_tolerance_is_told_where_it_is_asked_for():
    system = System()
    system.add("plant", linear_fmu(2), faulty("tolerant"), u=0.0)
    assert system.simulate(0.2, 0.1)["plant.y"].tolist() == [0.0] * 3
    assert system.simulate(0.2, 0.1, solver_tolerance=1e-7)["plant.y"].tolist() == [1e-7] * 3


@pytest.mark.parametrize("version", [2, 3])
def test_the_tolerance_of_the_default_experiment_is_passed_on(version):
    system = System()
    system.add("plant", linear_fmu(version, default_tolerance="1e-5"), faulty("tolerant"), u=0.0)
    assert system.simulate(0.2, 0.1)["plant.y"].tolist() == [1e-5] * 3
    assert system.simulate(0.2, 0.1, solver_tolerance=1e-7)["plant.y"].tolist() == [1e-7] * 3
    with Batch(system, Plan(0.2, 0.1), {"end": Final("plant.y")}, []) as batch:
        assert [batch.run({}), batch.run({})] == [{"end": 1e-5}] * 2


@pytest.mark.parametrize("told", ["0", "-1e-5"])
def test_a_default_tolerance_that_makes_no_sense_is_none(told):
    system = System()
    system.add("plant", linear_fmu(2, default_tolerance=told), faulty("tolerant"), u=0.0)
    assert system.simulate(0.2, 0.1)["plant.y"].tolist() == [0.0] * 3


def test_an_output_that_does_not_follow_is_not_read_again_when_an_input_jumps():
    """Reading between setting and stepping disturbs some solvers (Dymola's): one read a step, with a jump as without."""
    counts = []
    for jump in (0.0, 1.0):
        system = System()
        system.add("plant", linear_fmu(2, follows=False), faulty("counting"))
        system.drive("plant.u", np.array([[0.0, 0.0], [0.5, jump], [0.6, jump]]))
        counts.append(np.diff(system.simulate(1.0, 0.1, record=["plant.y"])["plant.y"]).tolist())
    assert counts == [[1.0] * 10] * 2


@pytest.mark.parametrize(("version", "directional"), [(2, ""), (3, ""), (2, "CoSimulation"), (3, "CoSimulation")])
def test_a_plant_that_must_not_be_read_between_set_and_step(version, directional):
    """FMI forbids it; by experiments, and linearized by the directional derivatives of co-simulation."""
    plant = linear_fmu(version, directional, exchange=not directional)
    found = experiment(plant, "u", ["y"], start_values=faulty("unreadable", **MODES), linear=bool(directional))
    assert poles_of(found) == pytest.approx(list(swinging(matrices(**MODES)[0])), rel=1e-6)
