"""FMI 3.0 in the master: mixed with FMI 2.0, arrays, enumerations, event mode; and shaped commands at any step, by both mechanisms."""

from __future__ import annotations

import itertools
import math
from pathlib import Path

import numpy as np
import pytest
from native_host import native_fmu

from shaper_fmu.design.pulses import carrier_pulses
from shaper_fmu.design.shapers import shaper
from shaper_fmu.errors import ModelError
from shaper_fmu.export.build import build_fmu
from shaper_fmu.kinds.shapers import Shaper
from shaper_fmu.master.results import Results
from shaper_fmu.master.simulation import Simulation
from shaper_fmu.master.system import System
from shaper_fmu.registry import load_components

W, ZETA = 10.3, 0.05  # no edge of these shapers falls on a grid of 1, 7 or 50 ms
MECHANISMS = {"fmi2": (2, False), "fmi3 next_event_time": (3, False), "fmi3 event mode": (3, True)}


def shaped_plant(versions: tuple[int, int, int]) -> System:
    """profile -> shaper -> plant."""
    system = System()
    system.add("profile", native_fmu("MotionProfile", versions[0]), profile="polynomial_345", duration=0.31, start_time=0.033)
    system.add("shaper", native_fmu("InputShaper", versions[1]), shaper="zvd", natural_frequency=[W], damping_ratio=[ZETA])
    system.add("plant", native_fmu("MassSpringDamper", versions[2]), stiffness=W * W, damping=2 * ZETA * W)
    system.connect("profile.position", "shaper.command")
    system.connect("shaper.shaped", "plant.force")
    return system


def crane(versions: tuple[int, int, int]) -> System:
    """A modulated force on an oscillator, and a crane that its switches do not touch."""
    system = System()
    system.add("train", native_fmu("PulseTrain", versions[0]), natural_frequency=W, damping_ratio=ZETA, start_time=0.05)
    system.add("plant", native_fmu("MassSpringDamper", versions[1]), stiffness=W * W, damping=2 * ZETA * W)
    system.add("crane", native_fmu("OverheadCrane", versions[2]), hoist_speed=0.1)
    system.connect("train.pulse", "plant.force")
    system.connect("train.reference", "crane.trolley_acceleration")
    return system


def loop(versions: tuple[int, int, int]) -> System:
    """A controlled plant that follows a profile with jumps of the acceleration."""
    system = System()
    system.add("profile", native_fmu("MotionProfile", versions[0]), profile="s_curve", duration=0.5, start_time=0.1)
    system.add("controller", native_fmu("PositionController", versions[1]))
    system.add("plant", native_fmu("MassSpringDamper", versions[2]))
    system.connect("profile.position", "controller.reference")
    system.connect("controller.force", "plant.force")
    system.connect("plant.position", "controller.position")
    system.connect("plant.velocity", "controller.velocity")
    return system


@pytest.mark.parametrize("algorithm", ["jacobi", "parallel", "gauss_seidel"])
@pytest.mark.parametrize("make", [shaped_plant, crane, loop])
def test_mixed_versions_give_the_same_results(make, algorithm):
    """On the grid to the bit. With events, FMI 3.0's are told by the FMU and FMI 2.0's by an output, to the same instants."""
    everywhere = [make(versions) for versions in itertools.product((2, 3), repeat=3)]
    runs = [system.simulate(1.0, 0.01, algorithm=algorithm, exact=False) for system in everywhere]
    for run in runs[1:]:
        assert run.time.tolist() == runs[0].time.tolist()
        for name, column in runs[0].values.items():
            assert run[name].tolist() == column.tolist(), name
    if algorithm == "jacobi":
        runs = [system.simulate(1.0, 0.01) for system in everywhere]
        for run in runs[1:]:
            for name, column in runs[0].values.items():
                assert run[name] == pytest.approx(column, rel=1e-12, abs=1e-12), name


MIXER = '''\
"""Arrays as inputs, parameters and outputs."""

from shaper_fmu.component import Component, Input, Output, Parameter


class Mixer(Component):
    """Weighs its inputs one by one."""

    value = Input("", "what comes in", size=3)
    weight = Parameter(1.0, "", "gain of each", size=3)
    weighed = Output("", "weight value", size=3)

    def step(self, t, h):
        for i in range(3):
            self.weighed[i] = self.weight[i] * self.value[i]
'''


@pytest.fixture(scope="module")
def mixers(tmp_path_factory) -> dict[int, Path]:
    folder = tmp_path_factory.mktemp("mixer")
    (folder / "mixer.py").write_text(MIXER)
    component = load_components(folder / "mixer.py")[0]
    for fmi in (2, 3):
        (folder / str(fmi)).mkdir()
    return {fmi: build_fmu(component, folder / str(fmi), fmi=fmi, platforms=["this"]) for fmi in (2, 3)}


@pytest.mark.parametrize("versions", list(itertools.product((2, 3), repeat=2)))
def test_elements_of_arrays_are_connected_driven_and_set_one_by_one(mixers, versions):
    """The FMI 3.0 array is transferred as a whole: what nothing feeds keeps its start value."""
    system = System()
    system.add("one", mixers[versions[0]], {"weight[2]": 3.0, "value[3]": 7.0})
    system.add("two", mixers[versions[1]], {"weight": [10.0, 100.0], "value[2]": -1.0})
    system.drive("one.value[1]", lambda t: 1.0 + t)
    system.drive("one.value[2]", 2.0)
    system.connect("one.weighed[2]", "two.value[1]")
    system.connect("one.weighed[1]", "two.value[3]")
    results = system.simulate(0.2, 0.1, start_values={"two.weight[3]": 0.5})
    one = {1: [1.0, 1.1, 1.2], 2: [6.0] * 3, 3: [7.0] * 3}
    two = {1: [60.0] * 3, 2: [-100.0] * 3, 3: [0.5 * x for x in one[1]]}
    for name, columns in (("one", one), ("two", two)):
        for i, column in columns.items():
            assert results[f"{name}.weighed[{i}]"].tolist() == pytest.approx(column, rel=1e-15), (name, i)


def test_arrays_are_known_by_their_elements_and_wrong_ones_are_refused(mixers):
    system = System()
    system.add("mixer", mixers[3])
    with pytest.raises(ModelError, match=r"mixer.value\[4\]"):
        system.drive("mixer.value[4]", 1.0)
    with pytest.raises(ModelError, match=r"no input or parameter 'weight\[4\]'"):
        system.set("mixer.weight", [1.0] * 4)
    with pytest.raises(ModelError, match="weight is an array; give its elements as a sequence"):
        system.set("mixer.weight", 1.0)


def test_start_values_of_single_elements_and_names_of_items():
    """Two modes in an array: the second one's frequency alone; the reference is the convolution of both shapers."""
    times = {}
    for fmi, kind in itertools.product((2, 3), ("zv", int(Shaper.zv))):
        system = System()
        start = {"modes": 2, "natural_frequency[1]": W, "natural_frequency[2]": 2.7 * W}
        system.add("shaper", native_fmu("InputShaper", fmi), start, shaper=kind)
        system.set("shaper.damping_ratio[2]", ZETA)
        system.set("shaper.damping_ratio[1]", 0.0)
        system.drive("shaper.command", [(0.0, 0.0), (0.1, 1.0)])
        results = system.simulate(1.0, 0.2, everywhere=True)
        times[fmi, kind] = [results.time[i] - 0.1 for i in np.flatnonzero(np.diff(results["shaper.shaped"])) + 1]
    expected = shaper("zv", [W, 2.7 * W], [0.0, ZETA])
    for found in times.values():
        assert found == pytest.approx(expected.delays, abs=1e-12)
    with pytest.raises(ModelError, match=r"'zvv' is not a value of shaper\. Did you mean 'zv"):
        System().add("shaper", native_fmu("InputShaper", 3), shaper="zvv")


def oscillator_residual(results: Results, end: float, w: float, zeta: float) -> float:
    """V: envelope of the plant's free vibration at `end`, over that of a unit step at its time, from the last recorded state."""
    t, deviation, speed = results.time[-1], results["plant.position"][-1] - 1.0 / (w * w), results["plant.velocity"][-1]
    wd = w * math.sqrt(1.0 - zeta * zeta)
    envelope = math.hypot(deviation, (speed + zeta * w * deviation) / wd) * math.exp(zeta * w * (t - end))
    return envelope * w * w * math.sqrt(1.0 - zeta * zeta)


def commanded(mechanism: str, name: str, parameters: dict, output: str, ratio: float) -> System:
    """A source of commands on an oscillator of the frequency ratio * W, both with events by one mechanism."""
    fmi, event_mode = MECHANISMS[mechanism]
    w = ratio * W
    system = System()
    system.add("source", native_fmu(name, fmi), parameters)
    system.add("plant", native_fmu("MassSpringDamper", fmi), stiffness=w * w, damping=2 * ZETA * w)
    system.connect(f"source.{output}", "plant.force")
    system.use_event_mode("source", event_mode)
    return system


def residuals(system: System, begin: float, duration: float, step: float, ratio: float) -> tuple[float, float]:
    """Found with steps that end at events, and with steps of the grid alone."""
    stop = step * math.ceil((begin + duration + 0.2) / step)
    runs = [system.simulate(stop, step, exact=exact) for exact in (None, False)]
    found = [oscillator_residual(run, begin + duration, ratio * W, ZETA) for run in runs]
    assert runs[0].notes == ()
    return found[0], found[1]


every_step = pytest.mark.parametrize("step", [0.001, 0.007, 0.05])
every_mechanism = pytest.mark.parametrize("mechanism", MECHANISMS)
every_ratio = pytest.mark.parametrize("ratio", [0.83, 1.0, 1.21])


@every_step
@every_mechanism
@every_ratio
@pytest.mark.parametrize("kind", ["zv", "zvd", "ei"])
def test_a_shaped_step_leaves_the_residual_of_the_formula(kind, ratio, mechanism, step, record_property):
    """V of Singer and Seering 1990 with the designed impulses, on the tuned plant and on detuned ones."""
    parameters = {"shaper": kind, "natural_frequency[1]": W, "damping_ratio[1]": ZETA}
    system = commanded(mechanism, "InputShaper", parameters, "shaped", ratio)
    begin = 0.0137
    system.drive("source.command", [(0.0, 0.0), (begin, 1.0)])
    impulses = shaper(kind, W, ZETA)
    expected = impulses.residual_vibration(ratio * W, ZETA)
    found, on_grid = residuals(system, begin, impulses.duration, step, ratio)
    record_property("V", (expected, found, on_grid))
    assert found == pytest.approx(expected, abs=1e-10)
    assert (expected < 1e-12) == (ratio == 1.0 and kind != "ei")
    assert abs(on_grid - expected) > 1e4 * max(abs(found - expected), 1e-12)


@every_step
@every_mechanism
@every_ratio
def test_a_pulse_train_leaves_the_residual_of_the_formula(ratio, mechanism, step, record_property):
    """Thirteen carrier periods in a damped period: the residual of its switches, each where it belongs."""
    duration, begin = 0.52, 0.0137
    parameters = {"duration": duration, "natural_frequency": W, "damping_ratio": ZETA, "frequency_ratio": 13.0, "start_time": begin}
    system = commanded(mechanism, "PulseTrain", {"design": "carrier", **parameters}, "pulse", ratio)
    expected = carrier_pulses(duration, W, ZETA, 13.0).residual_vibration(ratio * W, ZETA)
    found, on_grid = residuals(system, begin, duration, step, ratio)
    record_property("V", (expected, found, on_grid))
    assert found == pytest.approx(expected, abs=1e-10)
    assert abs(on_grid - expected) > 1e4 * max(abs(found - expected), 1e-12)


@every_mechanism
def test_event_mode_is_used_or_not_as_asked_for(mechanism):
    """Rows on both sides of each jump. Event mode tells what is left of a jump of an output; a step that ends there does not."""
    parameters = {"shaper": "zv", "natural_frequency[1]": W, "damping_ratio[1]": 0.0}
    system = commanded(mechanism, "InputShaper", parameters, "shaped", 1.0)
    system.drive("source.command", [(0.0, 0.0), (0.1, 2.0)])
    event_mode = MECHANISMS[mechanism][1]
    results = system.simulate(0.6, 0.25, everywhere=True)
    half = math.pi / W  # of the undamped period
    expected = [0.0, 0.1, 0.1, 0.25, 0.1 + half, 0.1 + half, 0.5, 0.6]
    assert results.time == pytest.approx(expected, abs=1e-12)
    assert results["source.shaped"].tolist() == [0.0, 0.0, 1.0, 1.0, 1.0 if event_mode else 2.0, 2.0, 2.0, 2.0]
    with Simulation(system) as simulation:
        assert simulation.instances["source"].event_mode == event_mode
        on_grid = simulation.run(0.6, 0.25, exact=False)
        assert not any(instance.event_mode for instance in simulation.instances.values())
        again = simulation.run(0.6, 0.25, everywhere=True)
        assert simulation.instances["source"].event_mode == event_mode
    assert on_grid.time.tolist() == [0.0, 0.25, 0.5, 0.6]
    for name, column in results.values.items():
        assert again[name].tolist() == column.tolist(), name


def test_event_mode_is_left_out_where_steps_do_not_end_at_events():
    """A mean over the steps is wired, so the grid is kept, and an FMU in event mode must not return in between."""
    system = System()
    system.add("shaper", native_fmu("InputShaper", 3), {"natural_frequency[1]": W}, shaper="zv")
    system.add("plant", native_fmu("MassSpringDamper", 2))
    system.drive("shaper.command", [(0.0, 0.0), (0.1, 1.0)])
    system.connect("shaper.shaped_mean", "plant.force")
    results = system.simulate(1.0, 0.03, everywhere=True)
    assert results.notes == ("events are kept on the grid, since shaper.shaped_mean is a mean over it",)
    assert len(results.time) == 35
    assert results["shaper.shaped"][-1] == 1.0
