"""Clocks of FMI 3.0 in the master: each kind ticks when FMI 3.0.2, section 2.2.8, says so, and clocked values move while it does.

The FMU (fmus/clocked3.c) refuses every call that the standard does not allow, and steps over ticks. Expected times are formulas.
"""

from __future__ import annotations

from typing import Any

import numpy as np
import pytest
from clocked_fmus import FAULTS, KINDS, clocked_fmu, constant, of_kind
from native_host import native_fmu

from shaper_fmu import System
from shaper_fmu.errors import ModelError, SimulationError
from shaper_fmu.master.batch import Batch, Plan
from shaper_fmu.master.fmu import fmu_problems
from shaper_fmu.master.results import Results
from shaper_fmu.master.simulation import Simulation
from shaper_fmu.metrics.final import Final


def sampled(clock: str, *, kind: str = "constant", interval: float = 0.0371, shift: float = 0.0123, **more: Any) -> System:
    """A sampler that adds up the time at its ticks."""
    system = System()
    options = {name: more.pop(name) for name in ("trig", "free", "event_mode", "declared") if name in more}
    system.add("a", clocked_fmu(clock, **options), interval=interval, shift=shift, kind=KINDS[kind], **more)
    system.drive("a.u", ([0.0, 10.0], [0.0, 10.0]), "linear")
    return system


def ticks(results: Results, name: str = "a.count") -> np.ndarray:
    """When a count goes up."""
    return results.time[1:][np.diff(results[name]) > 0]


def periodic(interval: float, shift: float, stop: float) -> np.ndarray:
    times = shift + np.arange(int((stop - shift) / interval + 2)) * interval
    return times[times <= stop]


@pytest.mark.parametrize("algorithm", ["jacobi", "parallel", "gauss_seidel"])
@pytest.mark.parametrize("declared", [True, False])
def test_constant_clock_samples_at_its_ticks(declared, algorithm):
    """t_k = shift + k * interval to the bit, between the points of the grid, and y_k is the sum of u(t_j) = t_j up to k."""
    results = sampled(constant(0.0371, 0.0123), declared=declared).simulate(1.0, 0.05, everywhere=True, algorithm=algorithm)
    expected = periodic(0.0371, 0.0123, 1.0)
    assert ticks(results).tolist() == expected.tolist()
    last = np.searchsorted(results.time, expected, side="right") - 1
    assert results["a.y"][last] == pytest.approx(np.cumsum(expected), rel=1e-14)
    assert results["a.y"].tolist() == results["a.held"].tolist()  # what its last tick gave, in between
    assert results["a.last"][-1] == pytest.approx(expected[-1], rel=1e-14)


def test_ticks_do_not_drift():
    """The 9999 ticks of 0.1 s in 1000 s: k * 0.1, not a sum of 0.1 (which is off by 1e-9 s at the end)."""
    results = sampled(constant(0.1), interval=0.1, shift=0.0).simulate(1000.0, 1.0, everywhere=True, record=["a.count"])
    k = np.arange(1, 10001)
    assert results["a.count"][-1] == 10001.0
    assert ticks(results).tolist() == np.where(k % 10 == 0, k // 10, k * 0.1).tolist()


DESCRIBED = {
    "decimal": (constant(0.0371, 0.0123), periodic(0.0371, 0.0123, 1.0)),
    "no shift": ('intervalVariability="constant" intervalDecimal="0.3"', np.array([0.0, 0.3, 0.6, 3 * 0.3])),
    "fraction": (
        'intervalVariability="constant" intervalDecimal="0.1428571" intervalCounter="10" shiftCounter="3" resolution="70"',
        np.array([(3 + 10 * k) / 70 for k in range(7)]),
    ),
    "fixed": ('intervalVariability="fixed" intervalDecimal="0.17" shiftDecimal="0.03"', periodic(0.17, 0.03, 1.0)),
    "tunable": ('intervalVariability="tunable" intervalDecimal="0.17" shiftDecimal="0.03"', periodic(0.17, 0.03, 1.0)),
}


@pytest.mark.parametrize("name", DESCRIBED)
def test_described_intervals(name):
    clock, expected = DESCRIBED[name]
    step = 0.07
    interval = expected[1] - expected[0]
    results = sampled(clock, interval=interval, shift=expected[0]).simulate(1.0, step, everywhere=True)
    assert results["a.count"][-1] == len(expected)
    grid = np.round(expected / step) * step
    at = np.where(np.abs(grid - expected) < 1e-9, grid, expected)
    assert ticks(results).tolist() == pytest.approx(at[at > 0.0].tolist(), abs=1e-15)


@pytest.mark.parametrize("fraction", [False, True])
@pytest.mark.parametrize("kind", ["fixed", "calculated"])
def test_asked_intervals(kind, fraction):
    """Interval and shift by parameters of the FMU: 0.111 s and 0.013 s, as fractions 333 / 3000 and 39 / 3000."""
    results = sampled(of_kind(kind, fraction), kind=kind, interval=0.111, shift=0.013).simulate(1.0, 0.05, everywhere=True)
    k = np.arange(9)
    assert ticks(results).tolist() == ((39 + k * 333) / 3000 if fraction else 0.013 + k * 0.111).tolist()


def test_tunable_clock():
    """From an event at t on, ticks are at t + k * (new interval): 0.1 s, 0.05 s from 0.25 s on, 0.025 s from 0.5 s on.

    The tick that is due at 0.5 s itself is kept.
    """
    results = sampled(of_kind("tunable"), kind="tunable", interval=0.1, shift=0.02, period=0.25).simulate(0.6, 0.3, everywhere=True)
    expected = [0.02, 0.12, 0.22, 0.3, 0.35, 0.4, 0.45, 0.5, 0.525, 0.55, 0.575, 0.6]
    assert ticks(results).tolist() == pytest.approx(expected, abs=1e-15)


def test_changing_clock():
    """Intervals T, 2 T, 3 T, ...: ticks at T k (k + 1) / 2."""
    results = sampled(of_kind("changing"), kind="changing", interval=0.03).simulate(1.0, 0.07, everywhere=True)
    assert ticks(results).tolist() == pytest.approx([0.03 * k * (k + 1) / 2 for k in range(1, 8)], abs=1e-14)


@pytest.mark.parametrize("fraction", [False, True])
@pytest.mark.parametrize("interval", [0.07, 0.0])
def test_countdown_clock(interval, fraction):
    """Started at the events n * 0.3 s: ticks at n * 0.3 + interval, at the events themselves for an interval of 0."""
    system = sampled(of_kind("countdown", fraction), kind="countdown", interval=interval, period=0.3)
    results = system.simulate(1.0, 0.2, everywhere=True)
    assert ticks(results).tolist() == pytest.approx([n * 0.3 + interval for n in (1, 2, 3)], abs=1e-15)


def pair(every: int = 3, **options: Any) -> System:
    """A sampler whose output clock triggers another FMU's clock, which takes the sampler's output."""
    system = sampled(constant(0.0371, 0.0123), every=every, **options)
    system.add("b", clocked_fmu(declared=options.get("declared", True)), kind=KINDS["countdown"])
    system.connect("a.out", "b.trig")
    system.connect("a.y", "b.w")
    return system


@pytest.mark.parametrize("declared", [True, False])
def test_output_clock_triggers_an_input_clock(declared):
    """At every third tick of a, b ticks at the same time and gives z = y + 1000 of that very tick."""
    results = pair(declared=declared).simulate(1.0, 0.05, everywhere=True)
    expected = periodic(0.0371, 0.0123, 1.0)
    heard = ticks(results, "b.heard")
    assert heard.tolist() == expected[2::3].tolist()
    last = np.searchsorted(results.time, heard, side="right") - 1
    assert results["b.z"][last].tolist() == (results["a.y"][last] + 1000.0).tolist()
    assert results["a.v"][last].tolist() == [100.0 * n for n in range(3, 3 * len(heard) + 1, 3)]  # clocked by the output clock


def test_connected_clocks_are_not_lost_in_an_archive(tmp_path):
    with pytest.raises(ModelError, match="connects clocks, which SSP"):
        pair(declared=True).to_ssp(tmp_path / "x.ssp")
    assert not (tmp_path / "x.ssp").exists()


def test_chain_through_clocks_of_one_time():
    """a and b tick together and b takes what a has just given: sums of sums, in whatever order they were added."""
    for order in ("ab", "ba"):
        system = System()
        for name in order:
            system.add(name, clocked_fmu(constant(0.1)), interval=0.1)
        system.drive("a.u", 1.0)
        system.connect("a.y", "b.u")
        results = system.simulate(1.0, 0.25)
        assert (results["a.y"][-1], results["b.y"][-1]) == (11.0, 66.0)


def test_controlled_plant():
    """A sampler adds up the position of an oscillator (w = 2, held force y): the discrete recursion of it, in numpy.

    x(t + T) = y + (x - y) cos(wT) + v / w sin(wT) for unit stiffness force w^2 y; y_k = y_(k-1) + x_k.
    """
    w, interval = 2.0, 0.13
    system = System()
    system.add("a", clocked_fmu(constant(interval)), interval=interval)
    system.add("plant", native_fmu("MassSpringDamper", 2), stiffness=w * w, damping=0.0)
    system.connect("plant.position", "a.u", offset=-1.0)
    system.connect("a.y", "plant.force", gain=-0.1 * w * w)
    results = system.simulate(1.3, 0.1, everywhere=True)
    x, v, total, expected = 0.0, 0.0, 0.0, []
    for _ in range(11):
        total += x - 1.0
        expected.append(total)
        y = -0.1 * total
        cos, sin = np.cos(w * interval), np.sin(w * interval)
        x, v = y + (x - y) * cos + v / w * sin, -(x - y) * w * sin + v * cos
    at = np.searchsorted(results.time, interval * np.arange(11) + 1e-9, side="right") - 1
    assert results["a.y"][at] == pytest.approx(expected, rel=1e-12)
    assert not results.notes


@pytest.mark.parametrize("version", [2, 3])
def test_jump_at_a_tick_is_sampled_from_the_right(version):
    """A step of 1 at t = 0.5, at the sixth tick of 0.1 s: the sum of samples from there on to 1 s is 6."""
    system = System()
    system.add("profile", native_fmu("MotionProfile", version), profile="step", distance=1.0, start_time=0.5)
    system.add("a", clocked_fmu(constant(0.1)), interval=0.1)
    system.connect("profile.position", "a.u")
    assert system.simulate(1.0, 0.3)["a.y"][-1] == 6.0


def test_start_time_and_values():
    """Shifts count from the start time; a clocked input that nothing feeds keeps its start value."""
    system = System()
    system.add("a", clocked_fmu(constant(0.1, 0.05)), interval=0.1, shift=0.05, u=2.0)
    results = system.simulate(3.0, 0.5, start_time=2.5, everywhere=True)
    assert ticks(results).tolist() == [2.5 + (0.05 + k * 0.1) for k in range(5)]
    assert results["a.y"][-1] == 10.0


def test_again_isolated_in_a_batch_and_with_step_control():
    """The same numbers by every way of running, and again after a reset."""
    system = pair()
    first = system.simulate(1.0, 0.05)
    names = ["a.y", "b.z", "a.count"]
    with Simulation(system) as simulation:
        for _ in range(2):
            again = simulation.run(1.0, 0.05)
            assert all(again[name].tolist() == first[name].tolist() for name in names)
    isolated = system.simulate(1.0, 0.05, isolate=True)
    controlled = system.simulate(1.0, 0.05, tolerance=1e-3)
    for name in names:
        assert isolated[name].tolist() == first[name].tolist()
        assert controlled[name].tolist() == first[name].tolist()
    metrics = {name: Final(name) for name in names}
    with Batch(system, Plan(1.0, 0.05), metrics, ["a.every"]) as batch:
        for every in (3.0, 2.0, 3.0):
            found = batch.run({"a.every": every})
            system.set("a.every", int(every))
            single = system.simulate(1.0, 0.05)
            assert found == {name: single[name][-1] for name in names}


@pytest.mark.parametrize("options", [{"exact": False}, {"free": False}])
def test_ticks_on_the_grid(options):
    """Steps of one length alone (set by the user, or all that the FMU takes): ticks at points of the grid are as exact."""
    run = {name: value for name, value in options.items() if name == "exact"}
    system = sampled(constant(0.1, 0.2), interval=0.1, shift=0.2, **{k: v for k, v in options.items() if k not in run})
    results = system.simulate(1.0, 0.05, **run)
    assert ticks(results).tolist() == pytest.approx([0.2 + 0.1 * k for k in range(9)], abs=1e-15)
    for kind, period in (("countdown", 0.3), ("changing", 1e300), ("tunable", 0.35)):
        given = {"kind": kind, "interval": 0.4, "shift": 0.1, "period": period}
        on_grid = sampled(of_kind(kind), free=options.get("free", True), **given).simulate(1.0, 0.05, **run)
        exact = sampled(of_kind(kind), **given).simulate(1.0, 0.05)
        assert ticks(on_grid).tolist() == pytest.approx(ticks(exact).tolist(), abs=1e-12)


@pytest.mark.parametrize("free", [True, False])
def test_ticks_off_the_grid_are_refused_there(free):
    """Before the first step for a periodic clock, and where a later tick becomes known for another."""
    system = sampled(constant(0.03), interval=0.03, shift=0.0, free=free)
    with pytest.raises(
        SimulationError, match=r"clock a\.c at initialization: it ticks next at t = 0\.03 s, between two communication"
    ):
        system.simulate(1.0, 0.05, exact=False)
    system = sampled(of_kind("countdown"), kind="countdown", interval=0.12, period=0.3, free=free)
    with pytest.raises(SimulationError, match=r"clock a\.c at t = 0\.3 s: it ticks next at t = 0\.42 s, .* multiples of 0\.05 s"):
        system.simulate(1.0, 0.05, exact=False)


WRONG = {
    "not_known": (of_kind("changing"), "initialization: asked for its interval, the FMU told fmi3IntervalNotYetKnown"),
    "odd_qualifier": (of_kind("fixed"), "the FMU told the qualifier 7"),
    "not_a_number": (of_kind("fixed"), "its interval nan s must be"),
    "zero": (of_kind("calculated"), "its interval 0 s must be"),
    "negative": (of_kind("countdown"), "its interval -1 s must be"),
    "interval_fails": (of_kind("tunable"), r"a at initialization: fmi3GetIntervalDecimal failed: clock 1 has no interval now"),
    "shift_fails": (of_kind("fixed", True), r"a at initialization: fmi3GetShiftFraction failed: clock 1 has no shift now"),
    "set_fails": (constant(0.1, 0.2), r"a at t = 0\.2 s: fmi3SetClock failed: clock 1 cannot be set"),
    "get_fails": (constant(0.1, 0.2), r"a at t = 0\.2 s: fmi3GetClock failed: clock 3 cannot be read"),
}


@pytest.mark.parametrize("fault", WRONG)
def test_what_fmus_tell_wrongly(fault):
    clock, words = WRONG[fault]
    kind = clock.split('"')[1]
    period = 0.3 if kind == "countdown" else 1e300
    system = sampled(clock, kind=kind, interval=0.1, shift=0.2, period=period, fault=FAULTS[fault])
    with pytest.raises(SimulationError, match=words):
        system.simulate(1.0, 0.05)


def test_endless_ticks():
    """A changing clock whose intervals stay 0."""
    system = sampled(of_kind("changing"), kind="changing", interval=0.0)
    with pytest.raises(SimulationError, match=r"clock a\.c at initialization: it ticks again and again at this time"):
        system.simulate(1.0, 0.05)


def test_what_cannot_be_run_is_refused_by_name():
    system = sampled(constant(0.1), event_mode=False)
    system.add("b", clocked_fmu(constant(0.1), trig=True), u=0.0, w=0.0)
    system.use_event_mode("b", False)
    problems = "\n".join(system.check())
    assert "a: clocks c, out tick only in event mode, but co-simulation has none (hasEventMode is not true)" in problems
    assert "b: clocks c, trig, out tick only in event mode: leave out use_event_mode('b', False)" in problems
    assert "clock b.trig ticks when another clock does, but nothing is connected to it: connect an output clock" in problems
    with pytest.raises(ModelError, match=r"b\.trig"):
        system.simulate(1.0, 0.05)


def test_wrong_connections_of_clocks():
    system = pair()
    system.add("c", clocked_fmu())
    for source, target, words in (
        ("a.out", "b.trig", "is already driven by a.out"),
        ("a.out", "a.c", "ticks at its own times"),
        ("a.out", "c.w", "cannot be connected"),
        ("a.y", "c.trig", "cannot be connected"),
        ("b.trig", "c.trig", "no output"),
    ):
        with pytest.raises(ModelError, match=words):
            system.connect(source, target)


BROKEN = {
    'intervalVariability="constant"': "clock c: it is constant, but neither intervalDecimal nor",
    'intervalVariability="constant" intervalDecimal="0"': "clock c: its interval 0 must be above 0",
    'intervalVariability="constant" intervalDecimal="-0.1"': "clock c: its interval -0.1 must be above 0",
    'intervalVariability="constant" intervalDecimal="fast"': "clock c: intervalDecimal = 'fast' is not a number",
    'intervalVariability="constant" intervalDecimal="1" shiftDecimal="-1"': "clock c: its shift -1 must not be below 0",
    'intervalVariability="constant" intervalCounter="1.5" resolution="10"': "intervalCounter = '1.5' is not a whole number",
    'intervalVariability="constant" intervalCounter="1" resolution="0"': "clock c: its resolution 0 must be above 0",
    'intervalVariability="sometimes"': "clock c: intervalVariability = 'sometimes' is none of constant, fixed",
    "": None,
}


@pytest.mark.parametrize("clock", [clock for clock in BROKEN if clock])
def test_broken_descriptions(clock):
    system = System()
    system.add("a", clocked_fmu(clock), u=0.0)
    assert any(str(BROKEN[clock]) in problem for problem in system.check())
    assert any(str(BROKEN[clock]) in problem for problem in fmu_problems(clocked_fmu(clock)))


def test_check_tells_what_cannot_be_run():
    """An FMU whose clocks have no event mode, and one for Scheduled Execution alone; nothing of one that can be run."""
    assert fmu_problems(clocked_fmu(constant(0.1))) == []
    (problem,) = fmu_problems(clocked_fmu(constant(0.1), event_mode=False))
    assert "clocks c, out tick only in event mode" in problem
    scheduled = clocked_fmu(constant(0.1), interface='<ScheduledExecution modelIdentifier="clocked"/>')
    assert "it has only Scheduled Execution" in "".join(fmu_problems(scheduled))
    with pytest.raises(ModelError, match="FMU for Scheduled Execution only; co-simulation"):
        System().add("a", scheduled)
