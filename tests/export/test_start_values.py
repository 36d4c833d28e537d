"""FMUs with other start values: what a tool that sets nothing finds in them, by both backends and in both versions of FMI."""

from __future__ import annotations

import re

import pytest
from conftest import gain_component

from shaper_fmu import Simulation, System
from shaper_fmu.commands.input_shaper import InputShaper
from shaper_fmu.commands.motion_profile import MotionProfile
from shaper_fmu.errors import BuildError, ComponentError
from shaper_fmu.export.build import build_fmu
from shaper_fmu.export.start_values import with_start_values
from shaper_fmu.master.fmu import load_fmu
from shaper_fmu.plants.mass_spring_damper import MassSpringDamper
from shaper_fmu.ssp.own_fmus import own_fmus

WANTED = {"profile": "s_curve", "duration": "0.5", "distance": 2.0}


@pytest.mark.parametrize(("backend", "fmi"), [("native", 2), ("native", 3), ("python", 2)])
def test_the_fmu_begins_with_these_values_and_works_by_them(tmp_path, fmus, backend, fmi):
    """Its results are those of the component's own FMU, to which the values are given; the bits of all steps."""
    variant = with_start_values(MotionProfile, WANTED, "Quick")
    path = build_fmu(variant, tmp_path, backend=backend, fmi=fmi, platforms=["this"])
    assert path.name == "Quick.fmu"
    described = {name: variable.start for name, variable in load_fmu(path).variables.items()}
    assert [float(str(described[name])) for name in ("profile", "duration", "distance", "damping_ratio")] == [7.0, 0.5, 2.0, 0.0]
    results = []
    for fmu, values in ((path, {}), (fmus / "MotionProfile.fmu", {"profile": "s_curve", "duration": 0.5, "distance": 2.0})):
        system = System()
        system.add("profile", fmu, values)
        with Simulation(system) as simulation:
            results.append(simulation.run(1.0, 0.01))
    assert results[0]["profile.position"].max() == 2.0
    for name in results[0].values:
        assert results[0][name].tobytes() == results[1][name].tobytes(), name


def test_names_and_identities_follow_from_the_values(tmp_path):
    zvd, ei = (with_start_values(InputShaper, {"shaper": kind, "natural_frequency[2]": 3}) for kind in ("zvd", "ei"))
    assert (zvd.__name__, ei.__name__) == ("InputShaper_zvd_3", "InputShaper_ei_3")
    assert zvd.variables["natural_frequency"].starts == [10.0, 3.0, 10.0, 10.0]
    same_name = [with_start_values(MassSpringDamper, {"mass": mass}, "Mine") for mass in (2.0, 3.0)]
    one, other = (load_fmu(build_fmu(c, tmp_path / str(i), platforms=["this"])) for i, c in enumerate(same_name))
    assert one.description.guid != other.description.guid


def test_a_users_component_can_be_changed_too(tmp_path):
    """By the python backend, which packs the user's file beside the one with the start value."""
    variant = with_start_values(gain_component(tmp_path, 2.0), {"factor": 5.0}, "Fivefold")
    for backend in ("native", "python"):
        system = System()
        system.add("gain", build_fmu(variant, tmp_path / backend, backend=backend, platforms=["this"]))
        system.drive("gain.value", 3.0)
        assert system.simulate(0.1, 0.1)["gain.result"][-1] == 30.0


@pytest.mark.parametrize(
    ("values", "name", "words"),
    [
        ({"profil": "step"}, "", "MotionProfile has no input or parameter 'profil'. Did you mean 'profile'"),
        ({"profile": "scurve"}, "", "'scurve' is not a value of profile. Did you mean 's_curve'"),
        ({"duration": "soon"}, "", "duration = 'soon' is not of type float"),
        ({"duration": -1.0}, "", "parameter duration = -1 s must be greater than 0 s"),
        ({"position": 1.0}, "", "MotionProfile has no input or parameter 'position'"),
        ({"duration": 2.0}, "2 s", "'2 s' is not a name for MotionProfile with other start values"),
        ({"duration": 2.0}, "MotionProfile", "'MotionProfile' is not a name for MotionProfile with other start values"),
    ],
)
def test_wrong_values_are_told(values, name, words):
    with pytest.raises(ComponentError, match=words):
        with_start_values(MotionProfile, values, name)


@pytest.mark.parametrize(
    ("text", "words"),
    [
        ("[A]\ncomponent = 5\nstart = {}", "Expected `str`, got `int`"),
        ('[A]\ncomponent = "MotionProfil"\nstart = {}', "there is no component 'MotionProfil'. Did you mean 'MotionProfile'"),
        ('[A]\ncomponent = "MotionProfile"\nstart = {profile = "scurve"}', "'scurve' is not a value of profile"),
        ('[A]\ncomponent = "MotionProfile"\nstarts = {}', "unknown field `starts`|missing required field `start`"),
        ("[A", "Expected"),
    ],
)
def test_a_wrong_fmus_toml_is_told_by_its_name(tmp_path, text, words):
    (tmp_path / "fmus.toml").write_text(text)
    with pytest.raises(BuildError, match=rf"fmus\.toml: .*({words})"):
        own_fmus(tmp_path)


@pytest.mark.parametrize(("backend", "fmi"), [("native", 2), ("native", 3), ("python", 2)])
def test_outputs_can_be_left_out_for_clients_that_read_numbers_alone(tmp_path, backend, fmi):
    """What is left is as before, to the bit."""
    variant = with_start_values(MotionProfile, {"profile": "trapezoid"}, without=["moving", "shortest_duration"])
    assert variant.__name__ == "MotionProfile_trapezoid_without_moving_shortest_duration"
    path = build_fmu(variant, tmp_path, backend=backend, fmi=fmi, platforms=["this"])
    loaded = load_fmu(path)
    shown = [label for v in MotionProfile.variables.values() if v.causality != "state" for label in v.scalar_names]
    assert [n for n in loaded.variables if n != "time"] == [n for n in shown if n not in ("moving", "shortest_duration")]
    plain = MotionProfile(profile="trapezoid")
    plain.initialize()
    system = System()
    system.add("profile", path)
    results = system.simulate(1.0, 0.1)
    for i in range(10):
        plain.do_step(0.1 * i, 0.1)
    assert results["profile.position"][-1] == plain.position


@pytest.mark.parametrize(
    ("name", "words"),
    [
        ("mowing", "MotionProfile has no output 'mowing' to leave out. Did you mean 'moving'"),
        ("profile", "MotionProfile has no output 'profile' to leave out"),
        ("ramp", "MotionProfile has no output 'ramp' to leave out"),
    ],
)
def test_what_cannot_be_left_out_is_told(name, words):
    with pytest.raises(ComponentError, match=re.escape(words)):
        with_start_values(MotionProfile, {}, without=[name])


def test_a_derivative_that_is_left_out_is_told(tmp_path):
    with pytest.raises(BuildError, match="the derivative of 'position', 'velocity', must be an output or a local"):
        build_fmu(with_start_values(MotionProfile, {}, without=["velocity"]), tmp_path, platforms=["this"])
