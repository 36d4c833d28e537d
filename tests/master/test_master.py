"""Coupling FMUs: names, types and units; the algorithms; inputs from outside; what is recorded."""

from __future__ import annotations

import math
from itertools import pairwise

import numpy as np
import pytest
from conftest import gain_component
from scipy.linalg import expm

from shaper_fmu.errors import ModelError
from shaper_fmu.export.pythonfmu_backend import build_fmu
from shaper_fmu.export.start_values import with_start_values
from shaper_fmu.master.simulation import Simulation
from shaper_fmu.master.system import System
from shaper_fmu.master.wiring import instance_order, signal_order
from shaper_fmu.plants.mass_spring_damper import MassSpringDamper


@pytest.fixture
def chain(fmus) -> System:
    """profile -> shaper -> plant, complete."""
    system = System("chain")
    system.add("profile", fmus / "MotionProfile.fmu", profile="step", distance=2.0, start_time=0.1)
    system.add("shaper", fmus / "InputShaper.fmu", shaper="none")
    system.add("plant", fmus / "MassSpringDamper.fmu")
    system.connect("profile.position", "shaper.command")
    system.connect("shaper.shaped", "plant.force")
    return system


@pytest.mark.parametrize(
    ("wrong", "words"),
    [
        (lambda s, f: s.add("profile", f / "MotionProfile.fmu"), "already an instance 'profile'"),
        (lambda s, f: s.add("my plant", f / "MotionProfile.fmu"), "'my plant' is not a name for an instance"),
        (lambda s, f: s.add("other", f / "MotionProfile.fmu", durration=1.0), "other: .*'durration'. Did you mean 'duration'?"),
        (lambda s, f: s.add("other", f / "MotionProfile.fmu", duration="long"), "duration = 'long' is not of type Real"),
        (lambda s, f: s.add("other", f / "InputShaper.fmu", modes=1.5), "modes = 1.5 is not of type Integer"),
        (lambda s, f: s.add("other", f / "InputShaper.fmu", shape_mode=[2]), r"shape_mode\[1\] = 2 is not of type Boolean"),
        (lambda s, f: s.add("other", f / "InputShaper.fmu", natural_frequency=3.0), "natural_frequency is an array"),
        (
            lambda s, f: s.add("other", f / "InputShaper.fmu", natural_frequency=[1.0] * 5),
            r"no input or parameter 'natural_frequency\[5\]'",
        ),
        (lambda s, f: s.add("other", f / "InputShaper.fmu", shaped=1.0), r"'shaped' \(it is of causality output\)"),
        (lambda s, f: s.connect("profil.position", "plant.force"), "no instance 'profil'. Did you mean 'profile'?"),
        (lambda s, f: s.connect("profile.positon", "plant.force"), "no output 'positon'. Did you mean 'position'?"),
        (lambda s, f: s.connect("profile.position", "plant.mass"), r"no input 'mass' \(it is of causality parameter\)"),
        (lambda s, f: s.connect("profile.velocity", "plant.force"), "plant.force is already driven by shaper.shaped"),
        (lambda s, f: s.drive("plant.force", 1.0), "plant.force is already driven by shaper.shaped"),
        (lambda s, f: s.set("plant.stifness", 1.0), "Did you mean 'stiffness'?"),
        (lambda s, f: s.simulate(1.0, 0.1, record=["plant.positon"]), "plant.positon: .*Did you mean 'position'?"),
        (lambda s, f: s.simulate(1.0, 0.1, start_values={"plant.mas": 1.0}), "Did you mean 'mass'?"),
        (lambda s, f: s.simulate(1.0, -0.1), "cannot run from 0.0 s to 1.0 s in steps of -0.1 s"),
        (lambda s, f: s.simulate(1.0, 0.1, algorithm="seidel"), "no algorithm 'seidel'. Did you mean 'gauss_seidel'?"),
        (lambda s, f: s.simulate(1.0, 0.1)["plant.speed"], "'plant.speed' was not recorded. Did you mean"),
    ],
)
def test_wrong_wiring_is_refused_in_words(chain, fmus, wrong, words):
    with pytest.raises(ModelError, match=words.replace("?", r"\?")):
        wrong(chain, fmus)


def test_types_and_units_must_fit(fmus):
    system = System()
    system.add("profile", fmus / "MotionProfile.fmu")
    system.add("plant", fmus / "MassSpringDamper.fmu")
    with pytest.raises(ModelError, match=r"profile.moving is of type Boolean but plant.force of type Real"):
        system.connect("profile.moving", "plant.force")
    with pytest.raises(ModelError, match=r"profile.position is in m but plant.force in N"):
        system.connect("profile.position", "plant.force")


def test_an_input_that_nothing_feeds_keeps_the_fmus_own_start_value(tmp_path):
    """It is not set at all, and named in the notes; a misspelt connection is an error still."""
    component = with_start_values(MassSpringDamper, {"force": 3.0}, "Pushed")
    system = System()
    system.add("plant", build_fmu(component, tmp_path))
    assert system.check() == []
    results = system.simulate(0.0, 0.1)
    assert results["plant.acceleration"][0] == 3.0
    assert "nothing feeds plant.force: left at the FMU's own start value" in results.notes
    with pytest.raises(ModelError, match=r"plant\.forze.*has no input 'forze'.*Did you mean 'force'"):
        system.drive("plant.forze", 1.0)
    for feed, expected in ((lambda: system.set("plant.force", 5.0), 5.0), (lambda: system.drive("plant.force", 7.0), 7.0)):
        feed()
        results = system.simulate(0.0, 0.1)
        assert (results["plant.acceleration"][0], results.notes) == (expected, ())


def test_a_loop_through_a_plant_with_memory_is_no_problem(fmus, tmp_path):
    """position -> gain -> force: the position does not depend on the force without delay."""
    gain = build_fmu(gain_component(tmp_path, -30.0), tmp_path)
    system = System()
    system.add("gain", gain)
    system.add("plant", fmus / "MassSpringDamper.fmu")
    system.connect("plant.position", "gain.value")
    system.connect("gain.result", "plant.force")
    assert system.check() == []
    assert system.instance_order() == ["plant", "gain"]


def test_outputs_spread_at_initialization(chain):
    chain.set("profile.start_time", 0.0)
    results = chain.simulate(0.0, 0.1)
    assert results.time.tolist() == [0.0]
    assert results["shaper.shaped"].tolist() == [2.0]
    assert results["plant.acceleration"].tolist() == [2.0]


def test_what_each_algorithm_does_with_values_that_act_without_delay(chain):
    """A step at 0.1 s through the shaper, which has direct feedthrough, to the plant, which has memory."""
    recorded = ["profile.position", "shaper.shaped", "plant.position", "plant.acceleration"]
    runs = {
        name: chain.simulate(0.5, 0.1, algorithm=name, record=recorded, exact=False)
        for name in ("jacobi", "parallel", "gauss_seidel")
    }
    for run in runs.values():
        assert run["profile.position"].tolist() == [0.0, 2.0, 2.0, 2.0, 2.0, 2.0]
    assert runs["jacobi"]["shaper.shaped"].tolist() == [0.0, 2.0, 2.0, 2.0, 2.0, 2.0]
    assert runs["parallel"]["shaper.shaped"].tolist() == [0.0, 0.0, 2.0, 2.0, 2.0, 2.0]
    assert runs["gauss_seidel"]["shaper.shaped"].tolist() == [0.0, 2.0, 2.0, 2.0, 2.0, 2.0]
    # the force acts on the plant from 0.1 s, from 0.2 s and from 0 s: seen in the position a step later
    assert {name: int(np.flatnonzero(run["plant.position"])[0]) for name, run in runs.items()} == {
        "jacobi": 2,
        "parallel": 3,
        "gauss_seidel": 1,
    }
    assert runs["jacobi"]["plant.acceleration"][1] == 2.0  # from the right of the jump


def test_jacobi_keeps_a_late_shaped_step_exact(fmus):
    """A ZV-shaped step at 0.1 s through the profile's FMU: no residual, because no edge is delayed against another."""
    wn = 2.0 * math.pi  # half a period is 0.5 s, 50 steps
    residuals = {}
    for algorithm in ("jacobi", "parallel", "gauss_seidel"):
        system = System()
        system.add("profile", fmus / "MotionProfile.fmu", profile="step", start_time=0.1)
        system.add("shaper", fmus / "InputShaper.fmu", shaper="zv", natural_frequency=[wn])
        system.add("plant", fmus / "MassSpringDamper.fmu", stiffness=wn * wn, damping=0.0)
        system.connect("profile.position", "shaper.command")
        system.connect("shaper.shaped", "plant.force")
        results = system.simulate(1.5, 0.01, algorithm=algorithm, exact=False)
        residuals[algorithm] = math.hypot(results["plant.position"][-1] * wn * wn - 1.0, results["plant.velocity"][-1] * wn)
    assert residuals["jacobi"] < 1e-12
    # the two impulses are one step too close or too far apart: |sin(wn h / 2)| is left
    assert residuals["parallel"] == pytest.approx(math.sin(wn * 0.01 / 2), rel=1e-9)
    assert residuals["gauss_seidel"] == pytest.approx(math.sin(wn * 0.01 / 2), rel=1e-9)


@pytest.mark.parametrize("algorithm", ["jacobi", "parallel", "gauss_seidel"])
def test_shaped_mean_serves_every_algorithm(fmus, algorithm):
    """Delays that no step divides: splitting an edge over a step costs |1 - cos| terms of (wn h)^2 / 16 at most."""
    wn, step = 2.0 * math.pi / 1.0137, 0.01
    system = System()
    system.add("profile", fmus / "MotionProfile.fmu", profile="step", start_time=0.1)
    system.add("shaper", fmus / "InputShaper.fmu", shaper="zv", natural_frequency=[wn])
    system.add("plant", fmus / "MassSpringDamper.fmu", stiffness=wn * wn, damping=0.0)
    system.connect("profile.position", "shaper.command")
    system.connect("shaper.shaped_mean", "plant.force")
    results = system.simulate(1.5, step, algorithm=algorithm)
    residual = math.hypot(results["plant.position"][-1] * wn * wn - 1.0, results["plant.velocity"][-1] * wn)
    assert residual < (wn * step) ** 2 / 16


def test_coupled_steps_converge_to_the_monolithic_solution_at_first_order(fmus, tmp_path):
    """Force on the plant = 3 N - 30 N/m x, by a gain and a sum as FMUs; exact: expm of the coupled system."""
    gain = build_fmu(gain_component(tmp_path, -30.0), tmp_path)
    total = build_fmu(_sum_component(tmp_path), tmp_path)
    a = np.array([[0.0, 1.0, 0.0], [-130.0, -1.0, 1.0], [0.0, 0.0, 0.0]])
    exact = (expm(a) @ [0.0, 0.0, 3.0])[0]  # a constant force of 3 N, and the spring of 30 N/m in the loop

    def error(step: float, algorithm: str) -> float:
        system = System()
        system.add("plant", fmus / "MassSpringDamper.fmu")
        system.add("spring", gain)
        system.add("sum", total)
        system.connect("plant.position", "spring.value")
        system.connect("spring.result", "sum.one")
        system.drive("sum.other", 3.0)
        system.connect("sum.total", "plant.force")
        return abs(system.simulate(1.0, step, algorithm=algorithm, record=["plant.position"])["plant.position"][-1] - exact)

    for algorithm in ("jacobi", "parallel", "gauss_seidel"):
        errors = [error(step, algorithm) for step in (0.01, 0.005, 0.0025)]
        orders = [math.log2(coarse / fine) for coarse, fine in pairwise(errors)]
        assert orders == pytest.approx([1.0, 1.0], abs=0.25), algorithm


def _sum_component(folder):
    from shaper_fmu.registry import load_components

    (folder / "sum.py").write_text('''\
"""A sum."""

from shaper_fmu.component import Component, Input, Output


class Sum(Component):
    """Adds its inputs."""

    one = Input("", "first")
    other = Input("", "second")
    total = Output("N", "one + other")

    def step(self, t, h):
        self.total = self.one + self.other
''')
    return load_components(folder / "sum.py")[0]


@pytest.mark.parametrize(
    ("source", "options", "expected"),
    [
        (lambda t: 2.0 * t, {}, [0.0, 0.2, 0.4, 0.6, 0.8]),
        (3, {}, [3.0] * 5),
        (([0.0, 0.2], [1.0, 5.0]), {}, [1.0, 1.0, 5.0, 5.0, 5.0]),
        ([(0.0, 1.0), (0.2, 5.0)], {"interpolation": "linear"}, [1.0, 3.0, 5.0, 5.0, 5.0]),
        ([(0.0, 0.0), (0.2, 2.0), (0.2, 7.0)], {"interpolation": "linear"}, [0.0, 1.0, 7.0, 7.0, 7.0]),
    ],
)
def test_inputs_are_functions_numbers_or_tables(fmus, source, options, expected):
    """The shaper without impulses passes on what it is given at each communication point."""
    system = System()
    system.add("shaper", fmus / "InputShaper.fmu", shaper="none")
    system.drive("shaper.command", source, **options)
    assert system.simulate(0.4, 0.1)["shaper.shaped"].tolist() == pytest.approx(expected, abs=1e-15)


@pytest.mark.parametrize(
    ("table", "words"),
    [
        ([1.0, 2.0, 3.0], r"not \(3,\)"),
        (([0.0, 1.0], ["a", "b"]), "not made of numbers"),
        (([0.0, 1.0], [0.0, math.nan]), "not finite"),
        (([0.0, 1.0, 0.5], [0.0, 1.0, 2.0]), "decrease at row 3"),
    ],
)
def test_wrong_tables_are_refused(fmus, table, words):
    system = System()
    system.add("shaper", fmus / "InputShaper.fmu")
    with pytest.raises(ModelError, match=f"shaper.command: .*{words}"):
        system.drive("shaper.command", table)


def test_the_last_step_is_shortened_to_the_stop_time(chain):
    results = chain.simulate(0.25, 0.1)
    assert results.time == pytest.approx([0.0, 0.1, 0.2, 0.25], abs=1e-16)


def test_the_number_of_steps_survives_rounding(chain):
    for steps in (3, 7, 10, 33, 1000):
        assert len(chain.simulate(steps * 0.1, 0.1, record=["profile.moving"]).time) == steps + 1


def test_a_start_time_other_than_zero(chain):
    results = chain.simulate(5.3, 0.1, start_time=5.0)
    assert results.time == pytest.approx([5.0, 5.1, 5.2, 5.3])
    assert results["profile.position"].tolist() == [2.0] * 4


def test_runs_repeat_to_the_bit_on_reset_instances(chain):
    with Simulation(chain) as simulation:
        first = simulation.run(0.5, 0.05)
        other = simulation.run(0.5, 0.05, start_values={"plant.mass": 2.0})
        again = simulation.run(0.5, 0.05)
    fresh = chain.simulate(0.5, 0.05)
    for name in first.values:
        assert first[name].tobytes() == again[name].tobytes() == fresh[name].tobytes()
    assert other["plant.position"][-1] != first["plant.position"][-1]


def test_results_keep_names_units_and_every_digit(chain, tmp_path):
    results = chain.simulate(0.3, 0.1, record=["plant.position", "plant.velocity"])
    assert list(results.values) == ["plant.position", "plant.velocity"]
    assert results.units == {"plant.position": "m", "plant.velocity": "m/s"}
    results.to_csv(tmp_path / "r.csv")
    lines = (tmp_path / "r.csv").read_text().splitlines()
    assert lines[0] == "time,plant.position,plant.velocity"
    read = np.array([[float(x) for x in line.split(",")] for line in lines[1:]])
    assert read[:, 1].tobytes() == results["plant.position"].tobytes()
    dataset = results.to_xarray()
    assert dataset["plant.position"].attrs["units"] == "m"
    assert dataset["plant.velocity"].sel(time=0.1).item() == results["plant.velocity"][1]


def test_angles_are_shown_in_degrees(fmus):
    system = System()
    system.add("crane", fmus / "OverheadCrane.fmu", hoist_speed=0.0, trolley_acceleration=1.0)
    results = system.simulate(1.0, 0.1)
    shown, unit = results.display("crane.swing_angle")
    assert unit == "deg"
    assert shown[-1] == pytest.approx(math.degrees(results["crane.swing_angle"][-1]), rel=1e-15)


def test_order_follows_connections_and_cuts_loops_where_there_is_memory():
    names = ["plant", "controller", "shaper", "profile"]
    connections = {
        ("controller", "reference"): ("shaper", "shaped"),
        ("controller", "position"): ("plant", "position"),
        ("plant", "force"): ("controller", "force"),
        ("shaper", "command"): ("profile", "position"),
    }
    order = instance_order(names, connections, lambda port: port != ("plant", "force"))
    assert order.index("profile") < order.index("shaper") < order.index("controller")
    assert order.index("plant") < order.index("controller")


def test_signal_order_puts_causes_first():
    connections = {("c", "u"): ("b", "y"), ("b", "u"): ("a", "y")}
    order, loops = signal_order(connections, lambda port: [(port[0], "u")])
    assert (order, loops) == ([("b", "u"), ("c", "u")], [])


def test_a_progress_function_hears_the_time(chain):
    heard: list[float] = []
    chain.simulate(1.0, 0.1, progress=heard.append)
    assert heard == sorted(heard)
    assert heard[-1] == 1.0


def test_a_start_value_without_effect_is_refused(chain):
    with pytest.raises(ModelError, match=r"plant.force is fed by shaper.shaped; setting it would have no effect"):
        chain.set("plant.force", 1.0)
    with pytest.raises(ModelError, match=r"shaper.command is fed by profile.position"):
        chain.simulate(1.0, 0.1, start_values={"shaper.command": 1.0})
