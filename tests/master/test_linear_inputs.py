"""Inputs that are linear over a step: FMI 2.0's input derivatives in our FMUs, and the master that gives them."""

from __future__ import annotations

import itertools
import math
from ctypes import c_double, c_int, c_uint

import numpy as np
import pytest
from fmpy.fmi1 import FMICallException
from native_drivers import Driver
from scipy.integrate import solve_ivp
from scipy.linalg import expm

from shaper_fmu import System
from shaper_fmu.errors import ModelError
from shaper_fmu.export.build import fmu_path
from shaper_fmu.registry import components

KP, KI, KD = 300.0, 700.0, 12.0
STIFFNESS, DAMPING = 100.0, 0.4


def set_slope(driver: Driver, name: str, slope: float, order: int = 1) -> None:
    reference = (c_uint * 1)(driver.variables[name].valueReference)
    driver.slave.fmi2SetRealInputDerivatives(driver.slave.component, reference, 1, (c_int * 1)(order), (c_double * 1)(slope))


@pytest.mark.parametrize("step", [0.001, 0.05, 0.8])
def test_a_ramp_of_force_is_exact_at_any_step(fmus, step):
    """m x'' + k x = r t from rest: x = r / k (t - sin(w t) / w)."""
    driver = Driver(fmus / "MassSpringDamper.fmu").initialize({"mass": 2.0, "stiffness": 50.0, "damping": 0.0})
    set_slope(driver, "force", 3.0)  # it stays until another one is set, and the force goes on from where it has come to
    steps = round(4.0 / step)
    for i in range(steps):
        driver.slave.doStep(i * step, step)
    t = steps * step
    assert driver.get("force") == pytest.approx(3.0 * t, rel=1e-12)
    assert driver.get("position") == pytest.approx(3.0 / 50.0 * (t - math.sin(5.0 * t) / 5.0), abs=1e-12)


def test_slopes_are_part_of_the_state_and_forgotten_by_reset(fmus):
    driver = Driver(fmus / "MassSpringDamper.fmu").initialize()
    set_slope(driver, "force", 3.0)
    state = driver.slave.getFMUstate()
    driver.slave.doStep(0.0, 0.1)
    ramped = driver.get("position")
    driver.slave.setFMUstate(state)
    set_slope(driver, "force", 0.0)
    driver.slave.doStep(0.0, 0.1)
    assert driver.get("position") == 0.0
    driver.slave.setFMUstate(state)
    driver.slave.freeFMUstate(state)
    driver.slave.doStep(0.0, 0.1)
    assert driver.get("position") == ramped > 0.0
    driver.slave.reset()
    driver.initialize()
    driver.slave.doStep(0.0, 0.1)
    assert (driver.get("position"), driver.get("force")) == (0.0, 0.0)


def test_wrong_derivatives_are_refused_in_words(fmus):
    plant = Driver(fmus / "MassSpringDamper.fmu").initialize()
    shaper = Driver(fmus / "InputShaper.fmu").initialize()
    cases = [
        (plant, "force", 1.0, 2, "MassSpringDamper: the derivative of force of order 2 is not taken, only the first"),
        (plant, "force", math.nan, 1, "MassSpringDamper: the derivative of force must be a finite number"),
        (plant, "mass", 1.0, 1, "MassSpringDamper: the derivative of mass of order 1 is not taken: it is held over a step"),
        (shaper, "command", 1.0, 1, "InputShaper: the derivative of command of order 1 is not taken: it is held over a step"),
    ]
    for driver, name, slope, order, words in cases:
        with pytest.raises(FMICallException):
            set_slope(driver, name, slope, order)
        assert driver.messages == [words]
    plant.slave.doStep(0.0, 0.1)  # the instance lives on, and nothing was set
    assert plant.get("position") == 0.0


def test_the_description_tells_which_fmus_take_derivatives(fmus):
    for name, component in components().items():
        co_simulation = Driver(fmus / f"{name}.fmu").description.coSimulation
        assert co_simulation is not None
        taken = any(variable.slope for variable in component.variables.values())
        assert bool(co_simulation.canInterpolateInputs) == taken, name


def commanded() -> System:
    """A smooth command on an oscillator, by a controller that gets no measurements: force = k position of the profile."""
    system = System()
    system.add("profile", fmu_path("MotionProfile", platforms=["this"]), profile="polynomial_345", duration=0.75)
    system.add("gain", fmu_path("PositionController", platforms=["this"]), proportional_gain=STIFFNESS, position=0.0, velocity=0.0)
    system.add("plant", fmu_path("MassSpringDamper", platforms=["this"]), stiffness=STIFFNESS, damping=DAMPING)
    system.connect("profile.position", "gain.reference")
    system.connect("gain.force", "plant.force")
    return system


def commanded_position(t: float) -> float:
    """The same by scipy: the 3-4-5 polynomial is 10 u^3 - 15 u^4 + 6 u^5."""

    def slopes(s, y):
        u = min(1.0, s / 0.75)
        return [y[1], STIFFNESS * ((10 - 15 * u + 6 * u * u) * u**3 - y[0]) - DAMPING * y[1]]

    move = solve_ivp(slopes, (0.0, 0.75), [0.0, 0.0], method="DOP853", rtol=1e-13, atol=1e-15)
    return float(solve_ivp(slopes, (0.75, t), move.y[:, -1], method="DOP853", rtol=1e-13, atol=1e-15).y[0, -1])


def orders(errors: list[float]) -> list[float]:
    return [math.log2(coarse / fine) for coarse, fine in itertools.pairwise(errors)]


@pytest.mark.parametrize("algorithm", ["jacobi", "gauss_seidel"])
def test_a_smooth_command_converges_with_order_two(algorithm):
    """Extrapolated from the step before, or interpolated between known ends; a held one is late by half a step."""
    exact = commanded_position(1.2)
    errors = {}
    for interpolation in ("hold", "linear"):
        runs = [commanded().simulate(1.2, step, algorithm=algorithm, interpolation=interpolation) for step in (0.004, 0.002, 0.001)]
        errors[interpolation] = [abs(run["plant.position"][-1] - exact) for run in runs]
    assert orders(errors["linear"])[-1] == pytest.approx(2.0, abs=0.1)
    assert orders(errors["hold"])[-1] == pytest.approx(1.0, abs=0.1)
    assert errors["linear"][-1] < 1e-5 < 1e-4 < errors["hold"][-1]


@pytest.mark.parametrize("algorithm", ["jacobi", "gauss_seidel", "parallel"])
@pytest.mark.parametrize("count", [2, 3, 7])
def test_a_source_of_several_linear_inputs_gives_each_what_it_gives_one(algorithm, count):
    """Each keeps the value at the beginning of the step for itself; places beyond the bus were written before, which ended the host."""
    alone = commanded()
    alone.add("listener", fmu_path("PositionController", platforms=["this"]), derivative_gain=2.0)
    alone.connect("plant.velocity", "listener.velocity")
    one = alone.simulate(0.9, 0.003, algorithm=algorithm, interpolation="linear")
    system = commanded()
    for i in range(count):
        system.add(f"load{i}", fmu_path("MassSpringDamper", platforms=["this"]), stiffness=STIFFNESS, damping=DAMPING)
        system.connect("gain.force", f"load{i}.force")
    system.add("listener", fmu_path("PositionController", platforms=["this"]), derivative_gain=2.0)
    system.connect("plant.velocity", "listener.velocity")
    results = system.simulate(0.9, 0.003, algorithm=algorithm, interpolation="linear")
    note = next(one for one in results.notes if one.startswith("linear over each step: "))
    for i in range(count):
        assert f"load{i}.force" in note
        np.testing.assert_array_equal(results[f"load{i}.position"], results["plant.position"])
    for name in ("plant.position", "listener.force"):
        np.testing.assert_array_equal(results[name], one[name])


@pytest.mark.parametrize(("algorithm", "interpolation", "order"), [
    ("jacobi", "hold", 1), ("gauss_seidel", "hold", 1), ("parallel", "hold", 1),
    ("jacobi", "linear", 2), ("gauss_seidel", "linear", 2), ("parallel", "linear", 2),
])  # fmt: skip
def test_a_feedback_loop_converges_at_the_order_of_its_inputs(algorithm, interpolation, order):
    """PID control of an oscillator after a step of the reference, against the matrix exponential of the whole."""
    system = System("loop")
    system.add(
        "controller", fmu_path("PositionController", platforms=["this"]), reference=1.0,
        proportional_gain=KP, integral_gain=KI, derivative_gain=KD,
    )  # fmt: skip
    system.add("plant", fmu_path("MassSpringDamper", platforms=["this"]), stiffness=STIFFNESS, damping=DAMPING)
    system.connect("controller.force", "plant.force")
    system.connect("plant.position", "controller.position")
    system.connect("plant.velocity", "controller.velocity")
    a = np.array([[0, 1, 0, 0], [-(STIFFNESS + KP), -(DAMPING + KD), KI, KP], [-1, 0, 0, 1], [0, 0, 0, 0.0]])
    exact = (expm(a * 0.8) @ [0.0, 0.0, 0.0, 1.0])[0]
    errors = []
    for step in (0.002, 0.001, 0.0005, 0.00025):
        results = system.simulate(0.8, step, algorithm=algorithm, interpolation=interpolation, record=["plant.position"])
        errors.append(abs(results["plant.position"][-1] - exact))
        if interpolation == "linear":
            (note,) = results.notes
            assert note.startswith("linear over each step: ")
            assert all(port in note for port in ("plant.force", "controller.position", "controller.velocity"))
    assert orders(errors)[-1] == pytest.approx(order, abs=0.15)
    assert errors[-1] < (2e-3 if order == 1 else 2e-5)


@pytest.mark.parametrize("algorithm", ["jacobi", "gauss_seidel", "parallel"])
@pytest.mark.parametrize("step", [0.001, 0.007, 0.05])
def test_jumps_stay_jumps(algorithm, step):
    """A ZV-shaped step on an undamped oscillator: no line is drawn across a jump, and none goes on beyond it."""
    system = System()
    w = math.sqrt(STIFFNESS)
    system.add("profile", fmu_path("MotionProfile", platforms=["this"]), profile="step", start_time=0.02)
    system.add("shaper", fmu_path("InputShaper", platforms=["this"]), {"shaper": "zv", "natural_frequency[1]": w})
    system.add("plant", fmu_path("MassSpringDamper", platforms=["this"]), stiffness=STIFFNESS, damping=0.0)
    system.connect("profile.position", "shaper.command")
    system.connect("shaper.shaped", "plant.force", gain=STIFFNESS)
    results = system.simulate(1.0, step, algorithm=algorithm, interpolation="linear")
    late = results.time > 0.02 + math.pi / w + step
    assert np.max(np.abs(results["plant.position"][late] - 1.0)) < 1e-12


def test_an_unknown_interpolation_and_fmus_that_take_none(fmus):
    system = System()
    system.add("shaper", fmus / "InputShaper.fmu")
    system.add("profile", fmus / "MotionProfile.fmu")
    system.connect("profile.acceleration", "shaper.command")
    with pytest.raises(ModelError, match=r"there is no interpolation 'liner'.*linear"):
        system.simulate(1.0, 0.1, interpolation="liner")
    assert system.simulate(1.0, 0.1, interpolation="linear").notes == (
        "all inputs are held over each step: no FMU takes derivatives of its connected inputs",
    )
