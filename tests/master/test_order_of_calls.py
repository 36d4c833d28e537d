"""No output is read between the setting of inputs and the step, by FMUs whose solvers are disturbed by it (fmus/reading.h).

FMI 2.0.4, section 4.2.4 forbids it, and so does FMI 3.0 in Step Mode. Expected values come from the formula of the lag.
"""

from __future__ import annotations

import dataclasses

import numpy as np
import pytest
from reading_fmus import HIGHEST, LOWEST, lag_fmu, lagged

from shaper_fmu import System
from shaper_fmu.errors import ModelError, SimulationError
from shaper_fmu.master.algorithms import ALGORITHMS
from shaper_fmu.master.batch import Batch, Plan
from shaper_fmu.master.simulation import Simulation
from shaper_fmu.metrics.final import Final
from shaper_fmu.sweep.engine import run_study
from shaper_fmu.sweep.store import Store
from shaper_fmu.sweep.study import read_study

STEP = 0.125
FIXED_STEP, STEP_MODE, BOUNDS, STOP_TIME = 2, 3, 4, 5  # as `strict`, see fmus/reading.h
TIMES = np.arange(9) * STEP
KINDS = [(2, False), (3, False), (3, True)]
"""FMI version, and whether with event mode."""


def ramp(t: float) -> float:
    return 1.0 + t


def one(kind: tuple[int, bool], strict: int, source, **options) -> System:
    system = System()
    system.add("lag", lag_fmu(kind[0], event_mode=kind[1], rigid=strict == FIXED_STEP), strict=strict, count_in=3)
    system.drive("lag.u", source, **options)
    return system


SOURCES = {
    "number": 2.0,
    "function": ramp,
    "held table": np.column_stack([TIMES, 1.0 + TIMES]),
    "linear table": np.array([[0.0, 1.0], [1.0, 2.0]]),
}


@pytest.mark.parametrize("strict", [0, 1])
@pytest.mark.parametrize("source", SOURCES)
@pytest.mark.parametrize("algorithm", ALGORITHMS)
@pytest.mark.parametrize("kind", KINDS)
def test_a_driven_solver_is_not_disturbed(kind, algorithm, source, strict):
    """Whatever drives it and whatever is recorded, its own inputs and local variables, too."""
    system = one(kind, strict, SOURCES[source], **({"interpolation": "linear"} if source == "linear table" else {}))
    record = ["lag.x", "lag.u", "lag.load", "lag.through", "lag.count_out"]
    results = system.simulate(1.0, STEP, algorithm=algorithm, record=record)
    u = np.full(9, 2.0) if source == "number" else 1.0 + TIMES
    x = lagged(u[:-1], STEP)
    assert results["lag.x"] == pytest.approx(x, rel=1e-14)
    assert results["lag.count_out"].tolist() == list(range(3, 12))
    if algorithm == "jacobi":
        assert results["lag.u"].tolist() == u.tolist()  # as it is set for the next step
    events = kind[1] and source == "held table"  # every row is an event, in which values are read anew
    held = u if events else np.concatenate([u[:1], u[:-1]])
    if algorithm == "jacobi" or not events:
        assert results["lag.through"] == pytest.approx(x + held, rel=1e-14)


@pytest.mark.parametrize("kind", KINDS)
@pytest.mark.parametrize("record", [[], ["lag.x"], ["lag.u", "lag.load", "lag.through", "lag.x"]])
def test_what_is_recorded_does_not_change_what_is_computed(kind, record):
    """With jumps off the grid, at which the run steps; the metric tells the end."""
    system = one(kind, 0, np.array([[0.0, 1.0], [0.3, 5.0], [0.71, -1.0]]))
    with Simulation(system, record=record, metrics={"end": Final("lag.x")}) as simulation:
        end = simulation.run(1.0, STEP, everywhere=bool(record)).metrics["end"]
    x = 0.0
    for u, h in ((1.0, 0.3), (5.0, 0.41), (-1.0, 0.29)):
        x = lagged(np.array([u]), h, x)[-1]
    assert end == pytest.approx(x, rel=1e-13)


@pytest.mark.parametrize("strict", [0, 1])
@pytest.mark.parametrize("kind", KINDS)
@pytest.mark.parametrize("algorithm", ALGORITHMS)
def test_behind_a_shaper(fmus, kind, algorithm, strict):
    """The shaper's own outputs are read anew, since it says that they may be; its impulses end the steps of both."""
    system = System()
    system.add("shaper", fmus / "InputShaper.fmu", shaper="zv", natural_frequency=[7.0], modes=1)
    system.add("lag", lag_fmu(kind[0], event_mode=kind[1]), strict=strict, count_in=0)
    system.drive("shaper.command", 1.0)
    system.connect("shaper.shaped", "lag.u")
    results = system.simulate(1.0, STEP, algorithm=algorithm, record=["lag.x", "lag.load"])
    half = np.pi / 7.0  # an undamped ZV shaper: halves at 0 and half a period
    x = lagged(np.array([1.0]), 1.0 - half, lagged(np.array([0.5]), half)[-1])[-1]
    assert results["lag.x"][-1] == pytest.approx(x, rel=1e-12)
    assert results.notes == ()


def chain(kind: tuple[int, bool], **options) -> System:
    """first -> second -> third, through outputs that follow their inputs at once."""
    system = System()
    for name in ("first", "second", "third"):
        system.add(name, lag_fmu(kind[0], event_mode=kind[1], **options), strict=1)
    system.set("first.count_in", 0)
    system.drive("first.u", ramp)
    for source, target in (("first", "second"), ("second", "third")):
        system.connect(f"{source}.through", f"{target}.u")
        if kind[1]:  # each count would be an event, at which values are read anew
            system.set(f"{target}.count_in", 0)
        else:
            system.connect(f"{source}.count_out", f"{target}.count_in")
    return system


@pytest.mark.parametrize("declared", [True, False])
@pytest.mark.parametrize("kind", KINDS)
def test_what_follows_at_once_comes_a_step_late_and_that_is_said(kind, declared):
    results = chain(kind, declared=declared).simulate(1.0, STEP)
    u = 1.0 + TIMES
    through = u + lagged(u[:-1], STEP)  # at initialization, and in event mode, values are read anew: no delay at t = 0
    late = np.concatenate([through[:1], (lagged(u[:-1], STEP)[1:] + u[:-1])])
    assert results["first.through"] == pytest.approx(late, rel=1e-14)
    assert results["second.x"] == pytest.approx(lagged(late[:-1], STEP), rel=1e-14)
    first, second, *third = results.notes
    assert ["follow the inputs held over the step before" in note for note in third] == [True] * declared
    assert first.startswith("first: through to second.u" if declared else "first: where it follows an input at once")
    assert "a step late" in first
    assert "system.read_after_set('first')" in first
    counted = "" if kind[1] else "; count_out to third.count_in"
    assert second.startswith(f"second: through to third.u{counted}" if declared else "second: where")
    assert ("between events" in first) == kind[1]


@pytest.mark.parametrize("version", [2, 3])
def test_an_instance_that_may_be_read_is_not_late(version):
    """By its annotation, or because the user says so; an annotation of somebody else says nothing of it."""
    u = 1.0 + TIMES
    x = lagged(u[:-1], STEP)
    named, told = chain((version, False), annotation="io.shaper-fmu"), chain((version, False))
    for name in ("first", "second", "third"):
        told.read_after_set(name)
    for system in (named, told):
        assert all(system.readable_after_set(name) for name in system.fmus)
        with pytest.raises(SimulationError, match=r"Get.* failed"):  # which this FMU does not bear, so it is read indeed
            system.simulate(1.0, STEP)
    other = chain((version, False), annotation="com.example")
    assert not any(other.readable_after_set(name) for name in other.fmus)
    assert other.simulate(1.0, STEP)["first.x"] == pytest.approx(x, rel=1e-14)
    named.read_after_set("first", False)
    assert not named.readable_after_set("first")


@pytest.mark.parametrize("algorithm", ALGORITHMS)
@pytest.mark.parametrize("source", ["held table", "off the grid"])
def test_a_solver_that_gets_its_inputs_in_step_mode_alone(source, algorithm):
    """Dymola 2023x makes nothing of an input's jump that it is told in event mode alone: 7 % behind a ZV shaper."""
    jumps = {"held table": SOURCES["held table"], "off the grid": np.array([[0.0, 1.0], [0.3, 5.0], [0.71, -1.0]])}
    x = one((3, True), 0, jumps[source]).simulate(1.0, STEP, algorithm=algorithm)["lag.x"]
    found = one((3, True), STEP_MODE, jumps[source]).simulate(1.0, STEP, algorithm=algorithm)
    assert found["lag.x"].tolist() == x.tolist()
    end = 0.0
    for u, h in ((1.0, 0.3), (5.0, 0.41), (-1.0, 0.29)):
        end = lagged(np.array([u]), h, end)[-1]
    assert x[-1] == pytest.approx(end if source == "off the grid" else lagged(1.0 + TIMES[:-1], STEP)[-1], rel=1e-13)


@pytest.mark.parametrize("algorithm", ALGORITHMS)
@pytest.mark.parametrize("kind", KINDS)
@pytest.mark.parametrize("interpolation", ["hold", "linear"])
@pytest.mark.parametrize("times", [(0.25, 0.5, 0.875), (0.3, 0.71, 0.72), (0.3, 0.5, 0.71)], ids=["on the grid", "off it", "both"])
def test_an_input_jumps_from_bound_to_bound(times, interpolation, kind, algorithm):
    """The FMU refuses every value outside of its bounds, and takes a jump from what is set in Step Mode alone: so no master may
    come to a jump by values beyond it."""
    values = [LOWEST, HIGHEST, LOWEST, HIGHEST]
    rows = [[0.0, LOWEST]]
    for t, before, after in zip(times, values[:-1], values[1:], strict=True):
        rows += [[t, before], [t, after]] if interpolation == "linear" else [[t, after]]
    system = System()
    system.add("lag", lag_fmu(kind[0], event_mode=kind[1], bounded=True), strict=BOUNDS)
    system.drive("lag.u", np.array(rows), interpolation=interpolation)
    found = system.simulate(1.0, STEP, algorithm=algorithm)["lag.x"][-1]
    x = 0.0
    for u, h in zip(values, np.diff([0.0, *times, 1.0]), strict=True):
        x = lagged(np.array([u]), h, x)[-1]
    assert found == pytest.approx(x, rel=1e-13)


@pytest.mark.parametrize("kind", KINDS)
def test_that_solver_does_refuse_values_beyond_its_bounds(kind):
    system = System()
    system.add("lag", lag_fmu(kind[0], event_mode=kind[1], bounded=True), strict=BOUNDS)
    system.drive("lag.u", np.array([[0.0, HIGHEST], [0.3, np.nextafter(HIGHEST, 6.0)]]))
    with pytest.raises(SimulationError, match=r"lag at t = 0\.3 s: fmi.Set(Real|Float64) failed: .*bounds"):
        system.simulate(1.0, STEP)


def count(t: float) -> int:
    return int(4.0 * t + 1e-9)


@pytest.mark.parametrize("algorithm", ALGORITHMS)
@pytest.mark.parametrize("kind", KINDS)
def test_discrete_inputs_are_set_in_event_mode_where_there_is_one(kind, algorithm):
    """FMI 3.0 allows it in event mode alone; the FMU refuses it elsewhere. Functions, and outputs of others."""
    system = System()
    for name in ("first", "second"):
        system.add(name, lag_fmu(kind[0], event_mode=kind[1]), strict=1, u=1.0)
    system.drive("first.count_in", count)
    system.connect("first.count_out", "second.count_in")
    results = system.simulate(1.0, STEP, algorithm=algorithm, record=["first.count_out", "second.count_in", "second.x"])
    assert results["second.x"] == pytest.approx(lagged(np.ones(8), STEP), rel=1e-14)
    counted = np.array([count(t) for t in TIMES])
    if algorithm == "jacobi":
        held = counted if kind[1] else np.concatenate([counted[:1], counted[:-1]])  # what the last step left
        assert results["first.count_out"].tolist() == (held + np.arange(9)).tolist()
        assert results["second.count_in"].tolist() == results["first.count_out"].tolist()


@pytest.mark.parametrize("kind", KINDS)
@pytest.mark.parametrize("algorithm", ALGORITHMS)
def test_in_a_loop(kind, algorithm):
    """first <-> second without delay: solved at the start, later by what the steps left."""
    system = System()
    for name in ("first", "second"):
        system.add(name, lag_fmu(kind[0], event_mode=kind[1]), strict=1, count_in=0)
    system.connect("first.through", "second.u", gain=0.5)
    system.connect("second.through", "first.u", gain=-0.5, offset=-2.0)
    results = system.simulate(1.0, STEP, algorithm=algorithm)
    assert "loop without delay" in results.notes[0]
    assert "a step late" in results.notes[0]
    # x = 0 at the start, so that through = u
    start = results["first.through"][0]
    assert start == pytest.approx(-0.5 * (0.5 * start) - 2.0, rel=1e-9)


@pytest.mark.parametrize("kind", KINDS)
def test_halved_steps(kind):
    """Control of the step size saves and restores states between set and step, but reads nothing."""
    system = one(kind, 1, SOURCES["linear table"], interpolation="linear")
    results = system.simulate(1.0, STEP, tolerance=1e-3)
    exact = TIMES + 1.0 - 0.5 + (0.0 - 0.5) * np.exp(-TIMES / 0.5)  # x' = (1 + t - x) / T: x = t + 1 - T + c exp(-t / T)
    assert results["lag.x"] == pytest.approx(exact, abs=9e-3)  # eight steps, each within 1e-3 (1 + |x|)


@pytest.mark.parametrize("kind", KINDS)
def test_isolated_and_in_batches(kind):
    system = one(kind, 1, SOURCES["held table"])
    x = lagged(1.0 + TIMES[:-1], STEP)
    isolated = system.simulate(1.0, STEP, isolate=True)
    assert isolated["lag.x"] == pytest.approx(x, rel=1e-14)
    with Batch(system, Plan(1.0, STEP), {"end": Final("lag.x"), "input": Final("lag.u")}, ["lag.count_in"]) as batch:
        for count in (1, 2):
            assert batch.run({"lag.count_in": count}) == {"end": isolated["lag.x"][-1], "input": 2.0}


def test_notes_reach_isolated_callers():
    notes = chain((2, False)).simulate(1.0, STEP).notes
    system = chain((2, False))
    system.signals.clear()
    system.drive("first.u", 1.0)
    assert dataclasses.asdict(system.simulate(1.0, STEP, isolate=True))["notes"] == notes


STUDY = """
name = "chain"
system = "chain.ssp"
stop_time = 1.0
step = 0.125

[vary."first.u"]
values = [1.0, 2.0]

[compare]
chain = {}

[metrics.end]
kind = "final"
output = "second.x"
"""


def test_a_sweep_gives_these_numbers_and_keeps_the_notes(tmp_path):
    system = chain((2, False))
    system.signals.clear()
    system.set("first.u", 1.0)
    system.to_ssp(tmp_path / "chain.ssp", stop_time=1.0, step=STEP)
    (tmp_path / "study.toml").write_text(STUDY)
    run_study(read_study(tmp_path / "study.toml"), tmp_path / "s.sqlite")
    with Store(tmp_path / "s.sqlite") as store:
        ends = [run.metrics["end"] for run in store.runs()]
        remarks = [remark for remark in store.remarks().values() if "a step late" in remark]
    unit = np.concatenate([[1.0], 1.0 + lagged(np.ones(8), STEP)[1:]])  # what first.through is for u = 1
    assert ends == pytest.approx(np.array([1.0, 2.0]) * lagged(unit[:-1], STEP)[-1], rel=1e-14)
    assert [remark.split(":")[0] for remark in remarks] == ["second"]  # nothing is wired to first.u: its value never changes


WHOLE = [
    (0.0, 1.0, 0.1),  # 1.0 - 0.9 is less than 0.1 in doubles
    (0.0, 0.3, 0.1),
    (0.0, 100.0, 0.001),
    (0.7, 1.7, 0.1),
    (1e6, 1e6 + 1.0, 0.01),
    (0.0, 7.0, 7.0 / 3.0),
    (0.0, 2e4, 0.1),  # 200 000 steps
]


@pytest.mark.parametrize("algorithm", ALGORITHMS)
@pytest.mark.parametrize(("start", "stop", "step"), WHOLE)
def test_steps_that_are_meant_whole_are_equal_to_the_bit(start, stop, step, algorithm):
    """The FMU refuses each step that differs from its first one in the last bit."""
    system = one((2, False), FIXED_STEP, 1.0)
    results = system.simulate(stop, step, start_time=start, algorithm=algorithm, record=["lag.count_out"])
    steps = round((stop - start) / step)
    assert results["lag.count_out"][-1] == 3 + steps
    assert results.time[-1] == stop
    with Batch(system, Plan(stop, step, start, algorithm), {"end": Final("lag.count_out")}, []) as batch:
        assert batch.run({}) == {"end": 3 + steps}


def test_whole_steps_where_functions_drive_and_in_fmi3():
    for kind in KINDS:
        assert one(kind, FIXED_STEP, ramp).simulate(1.0, 0.1)["lag.count_out"][-1] == 13


@pytest.mark.parametrize(("start", "stop", "step"), WHOLE)
def test_no_step_goes_beyond_the_stop_time_by_rounding(start, stop, step):
    """20-sim's FMUs refuse it: 0.2 + 0.1 is more than 0.3 in doubles."""
    for kind in KINDS:
        results = one(kind, STOP_TIME, 1.0).simulate(stop, step, start_time=start)
        assert results.time[-1] == stop


def test_a_step_that_is_meant_shorter_is_shorter():
    assert one((2, False), 0, 1.0).simulate(0.25, 0.1)["lag.count_out"].tolist() == [3, 4, 5, 6]
    with pytest.raises(ModelError, match="takes no variable steps, so stop_time must be a multiple"):
        one((2, False), FIXED_STEP, 1.0).simulate(0.25, 0.1)
