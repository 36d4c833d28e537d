"""FMUs of model exchange in the loop: against solutions in closed form, scipy, and co-simulation of the same FMU."""

from __future__ import annotations

import gc
import math
from pathlib import Path

import numpy as np
import pytest
from equation_fmus import equations, equations_fmu
from hypothesis import given
from hypothesis import strategies as st
from linear_fmus import linear_fmu, matrices
from scipy.linalg import expm

from shaper_fmu.errors import ModelError, SimulationError
from shaper_fmu.export.build import build_fmu
from shaper_fmu.master.batch import Batch, Plan
from shaper_fmu.master.cvode import Cvode
from shaper_fmu.master.fmu import load_fmu
from shaper_fmu.master.simulation import Simulation
from shaper_fmu.master.system import System
from shaper_fmu.metrics.peak import Peak
from shaper_fmu.registry import components

VERSIONS = pytest.mark.parametrize("version", [2, 3])
G = 9.81


@pytest.fixture(scope="session")
def fmus3(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """Native FMUs of FMI 3.0 of the plants that the tests couple."""
    folder = tmp_path_factory.mktemp("fmus3")
    for name in ("MassSpringDamper", "InputShaper"):
        build_fmu(components()[name], folder, platforms=["this"], fmi=3)
    return folder


def stimulated(path: Path, interface: str) -> System:
    """A component's FMU with jumps in its real inputs."""
    system = System()
    system.add("x", path, interface=interface)
    for name, variable in system.fmus["x"].variables.items():
        if variable.causality == "input" and variable.type in ("Real", "Float64"):
            rest = float(variable.start or 0.0)
            system.drive(f"x.{name}", [(0.0, rest), (0.1037, rest + 1.0), (0.4, 0.5 * rest)])
    return system


@pytest.mark.parametrize("name", sorted(components()))
def test_the_components_give_the_same_by_both_interfaces(name, fmus):
    """Co-simulation is exact here, or integrated to 1e-10; a mean over the last step is one between events in model exchange."""
    tolerance = 1e-9
    exchanged = stimulated(fmus / f"{name}.fmu", "model_exchange").simulate(1.0, 0.01, solver_tolerance=tolerance)
    stepped = stimulated(fmus / f"{name}.fmu", "co_simulation").simulate(1.0, 0.01)
    for variable, values in stepped.values.items():
        if not variable.endswith("_mean"):
            scale = 1.0 + np.abs(values).max()
            assert np.abs(exchanged[variable] - values).max() <= 10.0 * tolerance * scale, variable


@VERSIONS
@pytest.mark.parametrize("directional", ["", "ModelExchange"])
@pytest.mark.parametrize("solver", ["auto", "bdf", "adams"])
def test_two_modes_under_jumps_follow_the_matrix_exponential(version, directional, solver):
    """With the Jacobian by directional derivatives, and by differences."""
    system = System()
    system.add("x", linear_fmu(version, directional), {"d": 0.5}, interface="model_exchange")
    system.drive("x.u", [(0.0, 0.0), (0.1, 1.0), (0.37, 0.0)])
    results = system.simulate(1.0, 0.05, solver=solver, solver_tolerance=1e-10, record=["x.y"])
    a, b, c, d = matrices(d=0.5)
    both = np.zeros((5, 5))
    both[:4, :4], both[:4, 4:] = a, b
    after = expm(both * 0.27) @ np.array([0.0, 0.0, 0.0, 0.0, 1.0])
    for t, y in zip(results.time, results["x.y"], strict=True):
        u = float(0.1 <= t < 0.37)
        state = expm(both * (t - 0.1)) @ np.array([0, 0, 0, 0, 1.0]) if u else expm(both * max(0.0, t - 0.37)) @ [*after[:4], 0.0]
        expected = float((c @ state[:4])[0] + d[0, 0] * u) if t >= 0.1 else 0.0
        assert y == pytest.approx(expected, abs=2e-9), t


def bounces(restitution: float, count: int) -> list[float]:
    """When a ball that falls from 1 m meets the ground: t0 = sqrt(2 / g), then each flight takes 2 v / g."""
    times, speed = [math.sqrt(2.0 / G)], math.sqrt(2.0 * G)
    while len(times) < count:
        speed *= restitution
        times.append(times[-1] + 2.0 * speed / G)
    return times


@VERSIONS
@pytest.mark.parametrize("step", [0.01, 0.5])
def test_a_ball_bounces_when_it_meets_the_ground(version, step):
    """State events end steps at their time, whatever the step."""
    results = equations(version, "ball", p=0.7, q=0.5).simulate(3.0, step, everywhere=True, solver_tolerance=1e-10)
    jumps = results.time[np.flatnonzero(np.diff(results["x.events"]) > 0) + 1]
    expected = bounces(0.7, len(jumps))
    assert len(jumps) == 7  # sqrt(2 g) 0.7^7 < 0.5
    assert jumps == pytest.approx(expected, abs=1e-9)
    assert results["x.y"][-1] == 0.0


@VERSIONS
def test_a_ball_that_never_rests_is_told_in_words(version):
    """Its bounces end at t0 (1 + 2 r / (1 - r)): after it there is no solution."""
    system = equations(version, "ball", p=0.5, q=0.0)
    with pytest.raises(SimulationError, match=r"x at t = 1\.35\d* s: state events follow each other ever faster") as caught:
        system.simulate(3.0, 0.01)
    assert caught.value.results is not None
    assert caught.value.results.time[-1] == pytest.approx(math.sqrt(2.0 / G) * 3.0, abs=0.02)


@VERSIONS
def test_a_relay_that_slides_is_told_in_words(version):
    with pytest.raises(SimulationError, match=r"x at t = 0\.5\d* s: state events follow each other"):
        equations(version, "relay", p=0.5).simulate(2.0, 0.01)


@VERSIONS
@pytest.mark.parametrize("step", [0.01, 0.25])
def test_time_events_are_counted_when_they_are_due(version, step):
    results = equations(version, "clocked", p=0.3).simulate(1.0, step, everywhere=True, solver_tolerance=1e-10)
    jumps = results.time[np.flatnonzero(np.diff(results["x.count"]) > 0) + 1]
    assert jumps == pytest.approx([0.3, 0.6, 0.9], abs=1e-12)
    assert results["x.y"][-1] == pytest.approx(0.3 * 1.0 + 0.3 * 2.0 + 0.1 * 3.0, abs=1e-9)


@VERSIONS
def test_an_event_after_a_completed_step_is_handled(version):
    """x1 = t, and becomes 0 in the event after the first completed step beyond p; the event's time is what q says."""
    results = equations(version, "completing", p=0.55).simulate(1.0, 0.1, record=["x.y", "x.q", "x.count", "x.completed"])
    assert results["x.count"][-1] == 1.0
    assert 0.55 < results["x.q"][-1] <= 0.65
    assert results["x.y"][-1] == pytest.approx(1.0 - results["x.q"][-1], abs=1e-6)
    assert results["x.completed"][-1] >= 10.0


@VERSIONS
def test_that_event_is_at_a_communication_point_that_the_solver_has_stepped_over(version):
    """The solver's steps are longer than these; for the FMU a step is completed at each communication point."""
    results = equations(version, "completing", p=0.555).simulate(1.0, 0.01, record=["x.y", "x.q", "x.count"])
    assert results["x.count"][-1] == 1.0
    assert 0.555 < results["x.q"][-1] <= 0.56 + 1e-9
    assert results["x.y"][-1] == pytest.approx(1.0 - results["x.q"][-1], abs=1e-6)


@VERSIONS
def test_an_fmu_that_does_not_tell_its_inputs_is_run(version):
    """x1' = -2 (x1 - u), and u jumps from 1 to 0: exponentials. As FMUs by the FMI support functions of the IBK do."""
    system = equations(version, "secret", p=2.0)
    system.drive("x.u", [(0.0, 1.0), (0.455, 0.0)])
    results = system.simulate(1.0, 0.01, solver_tolerance=1e-9, record=["x.y"])
    t = results.time
    exact = np.where(t < 0.455, 1.0 - np.exp(-2.0 * t), (1.0 - np.exp(-0.91)) * np.exp(-2.0 * (t - 0.455)))
    assert results["x.y"] == pytest.approx(exact, abs=1e-7)


@VERSIONS
def test_values_that_are_computed_with_derivatives_or_completed_steps_are_up_to_date(version):
    """x1' = -2 (x1 - 1): 1 - exp(-2 t); between the solver's points, too. Thus compute FMUs of OpenModelica before 1.12.0."""
    system = equations(version, "late", p=2.0)
    system.drive("x.u", [(0.0, 1.0)])
    results = system.simulate(1.0, 0.01, solver_tolerance=1e-9, record=["x.y", "x.der1"])
    assert results["x.y"] == pytest.approx(1.0 - np.exp(-2.0 * results.time), abs=1e-7)
    assert results["x.der1"][1:] == pytest.approx(2.0 * np.exp(-2.0 * results.time[1:]), abs=1e-6)


@VERSIONS
def test_without_states_event_indicators_of_time_are_met(version):
    results = equations(version, "timer", p=0.4321).simulate(1.0, 0.1, everywhere=True)
    assert results["x.events"][-1] == 1.0
    assert results["x.count"][-1] == pytest.approx(0.4321, abs=1e-9)


@VERSIONS
@pytest.mark.parametrize("rate", [1.0, 1e3, 1e6])
def test_a_stiff_plant_takes_no_longer(version, rate):
    """x1' = -p (x1 - u): 1 - exp(-p t)."""
    system = equations(version, "decay", p=rate)
    system.drive("x.u", [(0.0, 1.0)])
    results = system.simulate(1.0, 0.1, solver_tolerance=1e-8, record=["x.y", "x.completed"])
    assert results["x.y"] == pytest.approx(1.0 - np.exp(-rate * results.time), abs=1e-7)
    assert results["x.completed"][-1] < 1000.0


@VERSIONS
@pytest.mark.parametrize(
    ("model", "values", "words"),
    [
        (
            "singular",
            {"p": 0.5},
            r"x at t = 0\.\d+ s: value 1 of fmi(2GetDerivatives|3GetContinuousStateDerivatives) is not a finite",
        ),
        (
            "exploding",
            {"p": 2.0},
            r"x at t = 0\.[45]\d* s: the solver \(CVODE\) cannot go on|x at t = 0\.[45]\d* s: value 1 of fmi",
        ),
        ("refusing", {"q": 0.5}, r"x at t = 0\.\d+ s: fmi(2GetDerivatives|3GetContinuousStateDerivatives) was refused"),
        ("failing", {"p": 0.4}, r"x at t = 0\.4\d* s: fmi(2GetDerivatives|3GetContinuousStateDerivatives) failed: 100% wrong"),
        ("ending", {"p": 0.4}, r"x at t = 0\.4 s: fmi(2NewDiscreteStates|3UpdateDiscreteStates) asked to end the simulation"),
        ("endless", {"p": 0.4}, r"x at t = 0\.4 s: fmi(2NewDiscreteStates|3UpdateDiscreteStates) asked for another update again"),
    ],
)
def test_what_cannot_be_solved_is_told_in_words(version, model, values, words):
    system = equations(version, model, **values)
    system.drive("x.u", [(0.0, 1.0)])
    with pytest.raises(SimulationError, match=words) as caught:
        system.simulate(2.0, 0.01)
    assert caught.value.results is not None
    assert len(caught.value.results.time) > 10


@VERSIONS
@pytest.mark.parametrize("algorithm", ["jacobi", "parallel", "gauss_seidel"])
def test_events_within_steps_that_cannot_be_shortened_are_handled_within(version, algorithm):
    """A Python function gives the input, so steps keep to the grid. x1 = t passes p = 0.4321, and the event notes when."""
    system = equations(version, "two_sided", p=0.4321)
    system.drive("x.u", lambda t: 1.0)
    results = system.simulate(1.0, 0.1, algorithm=algorithm, solver_tolerance=1e-10)
    assert len(results.time) == 11
    assert results["x.events"][-1] == 1.0
    assert results["x.count"][-1] == pytest.approx(0.4321, abs=1e-9)


def test_runs_on_the_grid_keep_the_instance():
    """It has event mode whatever the run: nothing is made anew."""
    with Simulation(equations(2, "clocked", p=0.3)) as simulation:
        first = simulation.run(1.0, 0.05, exact=False)
        instance = simulation.instances["x"]
        second = simulation.run(1.0, 0.05, exact=False)
        assert simulation.instances["x"] is instance
    assert np.array_equal(first["x.y"], second["x.y"])
    assert second["x.count"][-1] == 3.0


def pair(path: Path, source: str, gain: float) -> System:
    """Two masses on springs, the force on each in proportion to the other's motion; on the first one a constant force, too."""
    system = System()
    for name, stiffness in (("a", 100.0), ("b", 150.0)):
        system.add(name, path, interface="model_exchange", stiffness=stiffness, damping=0.3)
    system.connect_raw(f"a.{source}", "b.force", gain=gain)
    system.connect_raw(f"b.{source}", "a.force", gain=gain, offset=1.0)
    return system


def exact_pair(source: str, gain: float, t: float) -> np.ndarray:
    """Positions: M x'' + C x' + K x = (1, 0), by the matrix exponential; the other's acceleration acts through M."""
    mass, damping, stiffness = np.eye(2), 0.3 * np.eye(2), np.diag([100.0, 150.0])
    swapped = gain * np.array([[0.0, 1.0], [1.0, 0.0]])
    mass, stiffness = (mass - swapped, stiffness) if source == "acceleration" else (mass, stiffness - swapped)
    a = np.zeros((5, 5))
    a[:2, 2:4] = np.eye(2)
    a[2:4, :2], a[2:4, 2:4] = -np.linalg.solve(mass, stiffness), -np.linalg.solve(mass, damping)
    a[2:4, 4] = np.linalg.solve(mass, [1.0, 0.0])
    return (expm(a * t) @ np.array([0.0, 0.0, 0.0, 0.0, 1.0]))[:2]


@pytest.mark.parametrize("step", [0.001, 0.02, 0.2])
@pytest.mark.parametrize(("source", "gain"), [("position", 40.0), ("acceleration", 0.4)])
@VERSIONS
def test_coupled_as_one_there_is_no_coupling_error(version, source, gain, step, fmus, fmus3):
    """The acceleration follows the force at once, so that the two are a loop without delay."""
    system = pair((fmus3 if version == 3 else fmus) / "MassSpringDamper.fmu", source, gain)
    results = system.simulate(2.0, step, solver_tolerance=1e-10)
    found = np.array([results["a.position"][-1], results["b.position"][-1]])
    assert np.abs(found - exact_pair(source, gain, 2.0)).max() < 1e-8
    assert results.notes == ()


def test_coupled_at_steps_the_error_is_of_first_order(fmus):
    """Half the step, half the error: the inputs are held."""
    system = pair(fmus / "MassSpringDamper.fmu", "position", 40.0)
    errors = []
    for step in (0.004, 0.002, 0.001):
        results = system.simulate(1.0, step, solver_tolerance=1e-10, coupling="steps")
        exact = [exact_pair("position", 40.0, t)[0] for t in results.time]
        errors.append(np.abs(results["a.position"] - exact).max())
    assert errors[0] / errors[1] == pytest.approx(2.0, abs=0.1)
    assert errors[1] / errors[2] == pytest.approx(2.0, abs=0.1)


def test_a_controller_in_co_simulation_acts_as_on_the_exact_plant(fmus):
    """The mass by co-simulation is propagated exactly for the force that is held."""
    found = []
    for interface in ("model_exchange", "co_simulation"):
        system = System()
        system.add("controller", fmus / "PositionController.fmu")
        system.add("plant", fmus / "MassSpringDamper.fmu", interface=interface)
        system.connect("controller.force", "plant.force")
        system.connect("plant.position", "controller.position")
        system.connect("plant.velocity", "controller.velocity")
        system.drive("controller.reference", [(0.0, 0.0), (0.1, 0.01)])
        found.append(system.simulate(1.0, 0.002, solver_tolerance=1e-10)["plant.position"])
    assert np.abs(found[0]).max() > 1e-3
    assert np.abs(found[0] - found[1]).max() < 1e-10


@VERSIONS
def test_a_shaped_command_reaches_the_plant_at_its_edges(version, fmus, fmus3):
    """ZV on 10 rad/s leaves nothing, though its edges lie between communication points (Singer and Seering 1990)."""
    folder = fmus3 if version == 3 else fmus
    system = System()
    system.add("shaper", folder / "InputShaper.fmu", shaper="zv", natural_frequency=[10.0], damping_ratio=[0.05])
    system.add("plant", folder / "MassSpringDamper.fmu", interface="model_exchange", damping=1.0)
    system.drive("shaper.command", [(0.0, 0.0), (0.0713, 1.0)])
    system.connect_raw("shaper.shaped", "plant.force")
    results = system.simulate(2.0, 0.05, solver_tolerance=1e-10)
    after = results.time > 0.0713 + math.pi / 10.0 + 0.01
    assert np.abs(results["plant.position"][after] - 0.01).max() < 1e-10


@pytest.mark.parametrize("interpolation", ["hold", "linear"])
@pytest.mark.parametrize("algorithm", ["jacobi", "parallel", "gauss_seidel"])
@VERSIONS
def test_a_smooth_command_acts_as_on_the_exact_plant(version, algorithm, interpolation, fmus, fmus3):
    """The mass by co-simulation is exact for inputs that are held, and for linear ones (FMI 2.0)."""
    found = []
    for interface in ("model_exchange", "co_simulation"):
        system = System()
        system.add("profile", fmus / "MotionProfile.fmu", duration=0.5, distance=1.0)
        folder = fmus3 if version == 3 and interface == "model_exchange" else fmus
        system.add("plant", folder / "MassSpringDamper.fmu", interface=interface)
        system.connect_raw("profile.position", "plant.force")
        options = {"algorithm": algorithm, "interpolation": interpolation, "solver_tolerance": 1e-10}
        found.append(system.simulate(1.0, 0.02, **options))
    assert np.abs(found[0]["plant.position"] - found[1]["plant.position"]).max() < 1e-10
    assert found[0].notes == found[1].notes


def test_batches_isolated_and_controlled_runs_give_the_same(fmus):
    system = pair(fmus / "MassSpringDamper.fmu", "position", 40.0)
    whole = system.simulate(1.0, 0.01, solver_tolerance=1e-8, start_values={"a.mass": 1.5})
    again = system.simulate(1.0, 0.01, solver_tolerance=1e-8, start_values={"a.mass": 1.5}, isolate=True)
    assert all(np.array_equal(whole[name], again[name]) for name in whole.values)
    metrics = {"peak": Peak("a.position")}
    with Batch(system, Plan(1.0, 0.01, solver_tolerance=1e-8), metrics, ["a.mass"]) as batch:
        found = [batch.run({"a.mass": mass})["peak"] for mass in (1.0, 1.5, 1.0)]
    assert found[1] == np.abs(whole["a.position"]).max()
    assert found[0] == found[2]
    controlled = system.simulate(1.0, 0.05, solver_tolerance=1e-8, start_values={"a.mass": 1.5}, tolerance=1e-6, coupling="steps")
    assert np.abs(controlled["a.position"] - whole["a.position"][::5]).max() < 1e-4


def test_runs_with_many_tolerances_keep_few_solvers():
    """CVODE's memory is freed with the programs of earlier runs."""
    gc.collect()
    before = sum(isinstance(one, Cvode) for one in gc.get_objects())
    with Simulation(equations(2, "decay")) as simulation:
        for i in range(40):
            simulation.run(0.1, 0.1, solver="bdf", solver_tolerance=1e-6 * (1.0 + 0.01 * i))
        gc.collect()
        assert sum(isinstance(one, Cvode) for one in gc.get_objects()) - before <= 20


@pytest.mark.parametrize(
    ("version", "words"),
    [
        (2, r"x at (initialization|t = 0 s): fmi2GetEventIndicators writes more values than the 2 that it is asked for"),
        (3, r"x.*: fmi3Get(NumberOfEventIndicators tells of 6 .*, the description of 2|EventIndicators writes more values)"),
    ],
)
def test_more_event_indicators_than_described_are_told_in_words(version, words):
    """They were written over other memory."""
    system = equations(version, "wide")
    with pytest.raises(SimulationError, match=words):
        system.simulate(1.0, 0.1)
    with pytest.raises(SimulationError, match=words), Batch(system, Plan(1.0, 0.1), {"peak": Peak("x.y")}, ["x.p"]) as batch:
        batch.run({"x.p": 1.0})


def test_an_interface_that_is_not_offered_is_refused_in_words(fmus):
    with pytest.raises(ModelError, match="offers model exchange only, not co-simulation"):
        System().add("x", equations_fmu(2), interface="co_simulation")
    with pytest.raises(ModelError, match=r"there is no interface 'exchange'\."):
        System().add("x", equations_fmu(2), interface="exchange")
    assert load_fmu(equations_fmu(3)).interface == "model_exchange"
    assert load_fmu(fmus / "MassSpringDamper.fmu").interface == "co_simulation"


@pytest.mark.parametrize(
    ("options", "words"),
    [
        ({"solver": "rk4"}, "there is no solver 'rk4'"),
        ({"coupling": "step"}, "there is no coupling 'step'"),
        ({"solver_tolerance": 0.0}, r"solver_tolerance = 0\.0 must lie between 0 and 1"),
        ({"solver_tolerance": math.nan}, "solver_tolerance = nan must lie between 0 and 1"),
    ],
)
def test_options_of_the_solver_that_make_no_sense_are_refused(options, words):
    with pytest.raises(ModelError, match=words):
        equations(2, "decay").simulate(1.0, 0.1, **options)


@given(st.floats(0.3, 3.0), st.floats(0.01, 0.5), st.floats(0.2, 0.9))
def test_the_solver_comes_to_the_same_by_any_steps(rate, step, jump):
    """x1' = -p (x1 - u) with a jump of u: in closed form at every communication point."""
    system = equations(2, "decay", p=rate)
    system.drive("x.u", [(0.0, 0.0), (jump, 1.0)])
    results = system.simulate(1.0, step, solver_tolerance=1e-9)
    expected = np.where(results.time >= jump, 1.0 - np.exp(-rate * np.maximum(0.0, results.time - jump)), 0.0)
    assert np.abs(results["x.y"] - expected).max() < 1e-8
