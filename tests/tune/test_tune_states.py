"""Runs that begin in saved states, beside runs that begin at the start: the same bits, or a finding that says why not."""

from __future__ import annotations

import numpy as np
import pytest
from linear_fmus import faulty, linear_fmu

from shaper_fmu import System
from shaper_fmu.errors import SimulationError
from shaper_fmu.tune.identify.experiment import PlantIdentification, experiment
from shaper_fmu.tune.identify.response import Experiment
from shaper_fmu.tune.plant import Plant


def loop(fmus) -> System:
    system = System("loop")
    system.add("plant", fmus / "MassSpringDamper.fmu")
    system.add("controller", fmus / "PositionController.fmu", proportional_gain=50.0, derivative_gain=0.0, integral_gain=20.0)
    system.connect("controller.force", "plant.force")
    system.connect("plant.position", "controller.position")
    system.connect("plant.velocity", "controller.velocity")
    return system


def about_a_point(source, input_: str, output: str, value: float, **options) -> list[PlantIdentification]:
    """An experiment at a point that is reached first: from restored states, and with all runs from the start."""
    point = {input_: value}
    return [experiment(source, input_, [output], point=point, restored=one, linear=False, **options) for one in (True, False)]


@pytest.mark.parametrize("version", [2, 3])
def test_restored_states_change_no_bit(version):
    """A Duffing spring under a constant force, which the FMU integrates with internal steps."""
    restored, whole = about_a_point(linear_fmu(version), "u", "y", 4.0, start_values={"cubic": 5.0})
    assert restored.settle_time > 0.0
    assert restored.response.tobytes() == whole.response.tobytes()
    assert restored.modes[0].pole == whole.modes[0].pole
    assert not restored.has("state_lost")


@pytest.mark.parametrize("substeps", [1, 4])
def test_restored_states_of_coupled_fmus_change_no_bit(fmus, substeps):
    """Also where inputs are linear over a step, whose slopes the loop keeps; also after another excitation."""
    plant = Plant(loop(fmus), "controller.reference", ["plant.position"])
    restored, whole = (Experiment(plant, {"controller.reference": 0.1}, 30.0, one) for one in (True, False))
    for amplitude in (0.01, -0.02):
        made = restored.excitation("pulse", amplitude, 0.2, 0.1)
        values = [one.difference(made, 0.1, 100, substeps) for one in (restored, whole)]
        assert values[0].tobytes() == values[1].tobytes()
        assert np.ptp(values[0]) > 0.001
    assert restored.settling.at_hand
    assert not whole.settling.at_hand
    restored.close()
    assert not restored.settling.at_hand


@pytest.mark.parametrize("kind", ["doublet", "step", "chirp"])
def test_restored_states_serve_every_excitation(fmus, kind):
    restored, whole = about_a_point(fmus / "MassSpringDamper.fmu", "force", "position", 3.0, excitation=kind)
    assert restored.response.tobytes() == whole.response.tobytes()


def test_states_that_are_not_restored_exactly_are_found_out():
    """An FMU whose output depends on what it does not restore; one that refuses to save; one that does not claim to do it."""
    given = faulty("forgetful", w1=3.0)
    restored, whole = about_a_point(linear_fmu(2), "u", "y", 4.0, start_values=given)
    assert restored.response.tobytes() == whole.response.tobytes()
    (finding,) = restored.findings
    assert finding.code == "state_lost"
    assert "do not restore all of their saved states" in finding.text
    refused, whole = about_a_point(linear_fmu(3), "u", "y", 4.0, start_values=faulty("save_fails"))
    assert refused.response.tobytes() == whole.response.tobytes()
    assert "nothing is saved" in refused.findings[0].text
    rigid, whole = about_a_point(linear_fmu(2, states=False), "u", "y", 4.0, start_values={"fault": 0.0})
    assert rigid.response.tobytes() == whole.response.tobytes()
    assert not rigid.findings


def test_states_are_saved_only_where_the_plant_has_to_settle():
    """Without settling, the refusal of an FMU to save its state is not even noticed."""
    found = experiment(linear_fmu(2), "u", ["y"], start_values=faulty("save_fails"), linear=False)
    assert found.settle_time == 0.0
    assert not found.findings


def test_after_a_run_that_fails_the_next_one_is_right(fmus):
    """An excitation that hoists the load into the trolley is an error; the weaker one after it has the bits of a run from the start."""
    plant = Plant(fmus / "OverheadCrane.fmu", "hoist_speed", ["rope_length", "swing_angle"])
    restored, whole = (Experiment(plant, {}, 5.0, one) for one in (True, False))
    for _ in range(2):
        with pytest.raises(SimulationError, match="leaves no rope"):
            restored.difference(restored.excitation("pulse", 100.0, 0.2, 0.1), 0.1, 50)
        made = restored.excitation("pulse", 0.1, 0.2, 0.1)
        values = [one.difference(made, 0.1, 50) for one in (restored, whole)]
        assert values[0].tobytes() == values[1].tobytes()
        assert values[0][-1, 0] == pytest.approx(-0.02)
    restored.close()
