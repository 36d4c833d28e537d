"""FMUs that fail in each call in turn, coupled with healthy ones: what the error says, what it keeps, and what goes on."""

from __future__ import annotations

import os
import re
from pathlib import Path

import fmpy
import numpy as np
import pytest
from faulty_fmus import ERROR, alone, chain, faulty_fmu, library, packed

from shaper_fmu.errors import ModelError, SimulationError
from shaper_fmu.master.results import Results
from shaper_fmu.master.simulation import Simulation
from shaper_fmu.master.system import System

STEP, STOP = 0.1, 1.0
WARNING, DISCARD, FATAL = 1, 2, 4


def assert_equal(one: Results, other: Results, rows: int) -> None:
    assert one.time.tolist() == other.time[:rows].tolist()
    for name in one.values:
        assert one[name].tolist() == other[name][:rows].tolist(), name


# fault, status, the moment, the message after the instance and the moment (FMI 2.0; "3" in place of "2" for FMI 3.0), rows recorded
COMMON = [
    ("enter_initialization", ERROR, None, "fmi2EnterInitializationMode failed: initialization goes wrong as told", 0),
    ("exit_initialization", ERROR, None, "fmi2ExitInitializationMode failed: initialization goes wrong as told", 0),
    ("enter_initialization", FATAL, None, "fmi2EnterInitializationMode failed: initialization goes wrong as told (Fatal: it", 0),
    ("set_real", ERROR, None, "fmi2SetReal failed: writing goes wrong as told", 0),
    ("set_integer", ERROR, None, "fmi2SetInteger failed: writing goes wrong as told", 0),
    ("set_boolean", ERROR, None, "fmi2SetBoolean failed: writing goes wrong as told", 0),
    ("get_real", ERROR, None, "fmi2GetReal failed: reading goes wrong as told", 0),
    ("get_integer", ERROR, None, "fmi2GetInteger failed: reading goes wrong as told", 0),
    ("get_boolean", ERROR, None, "fmi2GetBoolean failed: reading goes wrong as told", 0),
    ("set_real", ERROR, 0.5, "fmi2SetReal failed: writing goes wrong as told", 5),
    ("set_integer", DISCARD, 0.5, "fmi2SetInteger was refused (Discard): writing goes wrong as told", 5),
    ("set_boolean", ERROR, 0.5, "fmi2SetBoolean failed: writing goes wrong as told", 5),
    ("get_real", ERROR, 0.5, "fmi2GetReal failed: reading goes wrong as told", 5),
    ("get_integer", ERROR, 0.5, "fmi2GetInteger failed: reading goes wrong as told", 5),
    ("get_boolean", FATAL, 0.5, "fmi2GetBoolean failed: reading goes wrong as told (Fatal: it", 5),
    ("step", DISCARD, 0.5, "fmi2DoStep was refused (Discard): a step goes wrong as told", 6),
    ("step", ERROR, 0.5, "fmi2DoStep failed: a step goes wrong as told", 6),
    ("step", ERROR, 0.0, "fmi2DoStep failed: a step goes wrong as told", 1),
    ("step", FATAL, 0.5, "fmi2DoStep failed: a step goes wrong as told (Fatal: it", 6),
    ("step", 5, 0.5, "fmi2DoStep goes on in the background (Pending), which this master does not support: a step goes", 6),
    ("step", 17, 0.5, "fmi2DoStep returned 17, which is not a status: a step goes wrong as told", 6),
    ("percent", ERROR, 0.5, "fmi2DoStep failed: a load of 100%s%n is too much", 6),
    ("silent", ERROR, 0.5, "fmi2DoStep failed and gave no message", 6),
]
ONLY3 = [
    ("enter_event", ERROR, 0.5, "fmi3EnterEventMode failed: event mode goes wrong as told", 5),
    ("enter_step", ERROR, 0.5, "fmi3EnterStepMode failed: step mode goes wrong as told", 5),
    ("update", ERROR, 0.5, "fmi3UpdateDiscreteStates failed: the update goes wrong as told", 5),
    ("update", FATAL, 0.5, "fmi3UpdateDiscreteStates failed: the update goes wrong as told (Fatal: it", 5),
    ("endless", 0, 0.5, "fmi3UpdateDiscreteStates asked for another update again and again", 5),
    ("terminate_in_update", 0, 0.5, "fmi3UpdateDiscreteStates asked to end the simulation", 6),
    ("update", ERROR, None, "fmi3UpdateDiscreteStates failed: the update goes wrong as told", 0),
]
CASES = [(version, *case) for version in (2, 3) for case in COMMON] + [(3, *case) for case in ONLY3]


@pytest.mark.parametrize(("version", "fault", "status", "at", "words", "rows"), CASES)
def test_a_failing_call_is_told_with_the_instance_the_time_and_the_messages(version, fault, status, at, words, rows):
    if version == 3:
        for name, name3 in {"fmi2": "fmi3", "Real": "Float64", "Integer": "Int32"}.items():
            words = words.replace(name, name3)
    moment = "at initialization" if at is None else f"at t = {at:g} s"
    with Simulation(chain(faulty_fmu(version), fault, status, at or 0.0)) as simulation:
        with pytest.raises(SimulationError, match="^" + re.escape(f"x {moment}: {words}")) as caught:
            simulation.run(STOP, STEP)
        if rows:
            assert_equal(caught.value.results, chain(faulty_fmu(version)).simulate(STOP, STEP), rows)
            assert len(caught.value.results.time) == rows
        else:
            assert caught.value.results is None
        _check_what_goes_on(simulation, faulty_fmu(version), status == FATAL)


def _check_what_goes_on(simulation: Simulation, path: Path, fatal: bool) -> None:
    """The same simulation runs again, unless the status was fatal."""
    healthy = {"x.fault": 0}
    if fatal:
        with pytest.raises(SimulationError, match=r"x: faulty\d.fmu failed beyond repair in an earlier run; make another"):
            simulation.run(STOP, STEP, start_values=healthy)
        return
    expected = chain(path).simulate(STOP, STEP)
    assert_equal(simulation.run(STOP, STEP, start_values=healthy), expected, len(expected.time))


@pytest.mark.parametrize(("version", "reached"), [(2, "0.5"), (3, "0.6")])
def test_an_fmu_that_asks_to_end_the_simulation_ends_it_with_what_was_recorded(version, reached):
    """FMI 2.0 says so by Discard and a status asked for (the step is not taken), FMI 3.0 by an answer of the step."""
    with Simulation(chain(faulty_fmu(version), "terminate_in_step", 0, 0.5)) as simulation:
        with pytest.raises(
            SimulationError, match=f"^x at t = {reached} s: fmi{version}DoStep asked to end the simulation$"
        ) as caught:
            simulation.run(STOP, STEP)
        assert_equal(caught.value.results, chain(faulty_fmu(version)).simulate(STOP, STEP), 6)
        _check_what_goes_on(simulation, faulty_fmu(version), fatal=False)


@pytest.mark.parametrize("version", [2, 3])
def test_warnings_are_counted_and_the_run_goes_on(version):
    """Steps that begin at 0.5, 0.6, ..., 0.9 s warn; with FMI 3.0's event at 0.75 s, one more."""
    results = chain(faulty_fmu(version), "step", WARNING, 0.5).simulate(STOP, STEP)
    expected = chain(faulty_fmu(version)).simulate(STOP, STEP)
    assert_equal(results, expected, len(expected.time))
    assert expected.notes == ()
    count = 5 if version == 2 else 6
    assert results.notes == (f"{count} calls returned a warning, the last by x: a step goes wrong as told",)


@pytest.mark.parametrize("version", [2, 3])
@pytest.mark.parametrize(("fault", "shown"), [("not_a_number", "nan"), ("infinite", "inf")])
@pytest.mark.parametrize("algorithm", ["jacobi", "parallel", "gauss_seidel"])
def test_values_that_are_not_finite_end_the_run_where_they_are_connected(version, fault, shown, algorithm):
    """In parallel, inputs are set at the beginning of the next step; Gauss and Seidel set them for the step that begins at 0.4 s."""
    moment = "0.4" if algorithm == "gauss_seidel" else "0.5"
    words = f"^last at t = {moment} s: the value for input input is {shown}, from x.output$"
    with Simulation(chain(faulty_fmu(version), fault, 0, 0.5)) as simulation:
        with pytest.raises(SimulationError, match=words) as caught:
            simulation.run(STOP, STEP, algorithm=algorithm, exact=False)
        rows = len(caught.value.results.time)
        assert rows == {"jacobi": 5, "parallel": 6, "gauss_seidel": 5}[algorithm]
        assert np.isfinite(caught.value.results["x.output"][:5]).all()
        _check_what_goes_on(simulation, faulty_fmu(version), fatal=False)


@pytest.mark.parametrize("version", [2, 3])
def test_values_that_are_only_recorded_may_be_anything_but_nan_is_noted(version):
    """An output may be infinite or undefined by design; who does not use it does not stop for it."""
    for fault, notes in (("not_a_number", ("x.output is not a number from t = 0.5 s on",)), ("infinite", ())):
        results = alone(version, fault, 0, 0.5).simulate(STOP, STEP)
        assert results.notes == notes
        assert len(results.time) == 11
        assert np.flatnonzero(~np.isfinite(results["x.output"])).tolist() == list(range(5, 11))


@pytest.mark.parametrize(
    ("source", "target", "fault", "words"),
    [
        ("count_out", "small", "none", "last at t = 0.3 s: the value for input small is 300.0, from x.count_out, .* type UInt8"),
        (
            "output",
            "single",
            "huge_value",
            r"last at t = 0.5 s: the value for input single is 1e\+300, from x.output, .* type Float32",
        ),
    ],
)
def test_values_that_do_not_fit_into_the_type_of_their_input_are_told(source, target, fault, words):
    system = alone(3, fault, 0, 0.5)
    inputs = ("input", "count_in", "flag_in", "small", "single")
    system.add("last", faulty_fmu(3), dict.fromkeys([name for name in inputs if name != target], 0))
    system.connect(f"x.{source}", f"last.{target}")
    with pytest.raises(SimulationError, match=f"^{words}$"):
        system.simulate(STOP, STEP, exact=False)


def test_an_event_that_nobody_announced_cannot_end_the_step_of_instances_that_have_taken_it():
    words = (
        "^x: fmi3DoStep returned early, at t = 0.525 s, from an event that it had not announced, and the step cannot be "
        r"shortened for all. Use it without event mode: system.use_event_mode\('x', False\)$"
    )
    system = chain(faulty_fmu(3), "early", 0, 0.5)
    with Simulation(system) as simulation:
        with pytest.raises(SimulationError, match=words) as caught:
            simulation.run(STOP, STEP)
        assert_equal(caught.value.results, chain(faulty_fmu(3)).simulate(STOP, STEP), 6)
        _check_what_goes_on(simulation, faulty_fmu(3), fatal=False)
    for name in ("first", "last"):  # then x steps first, and the others follow it
        system.use_event_mode(name, False)
    everywhere = system.simulate(STOP, STEP, everywhere=True)
    assert 0.525 in everywhere.time.round(12)
    # one step more than the 10 of the grid and the two to the events at 0.25 s and 0.75 s, which x announces
    assert everywhere["first.output"][-1] == everywhere["x.count_out"][-1] / 100 == 13.0
    with pytest.raises(SimulationError, match="returned early"):  # on the grid alone, steps are not shortened
        system.simulate(STOP, STEP, exact=False)


def test_an_fmu_that_refuses_the_event_mode_which_it_declares_is_told_with_what_to_do():
    """As Roberts of the Reference FMUs does."""
    system = alone(3, name="plain")
    with pytest.raises(
        SimulationError, match=r"Event Mode is not supported\.; to do without: system\.use_event_mode\('plain', False\)$"
    ):
        system.simulate(STOP, STEP)
    system.use_event_mode("plain", False)
    assert system.simulate(STOP, STEP).time[-1] == STOP


@pytest.mark.parametrize(("version", "function"), [(2, "fmi2Instantiate"), (3, "fmi3InstantiateCoSimulation")])
def test_an_fmu_that_gives_no_instance_is_told_with_its_words(tmp_path, version, function):
    system = alone(version, name="null")
    words = f"^null: faulty{version}.fmu cannot be instantiated: {function} failed; there is no instance today$"
    with pytest.raises(SimulationError, match=words):
        system.simulate(STOP, STEP)
    stranger = packed(tmp_path / "stranger.fmu", version, library(f"faulty{version}"), token="{other}")
    with pytest.raises(SimulationError, match=rf"{function} failed; the (GUID|token) is of another FMU$"):
        chain(stranger).simulate(STOP, STEP)


@pytest.mark.parametrize("version", [2, 3])
def test_an_fmu_without_a_usable_library_is_told_and_the_folder_stays(tmp_path, version):
    here = os.getcwd()
    platform = fmpy.platform_tuple if version == 3 else fmpy.platform
    text = tmp_path / "text"
    text.write_text("this is not a library")
    cases = [
        (packed(tmp_path / "none.fmu", version, None), rf"no library faulty\.\w+ for {platform}, nor for any other platform$"),
        (
            packed(tmp_path / "other.fmu", version, text, platform="riscv64-plan9"),
            rf"no library faulty\.\w+ for {platform}, only for riscv64-plan9$",
        ),
        (packed(tmp_path / "text.fmu", version, text), "Failed to load shared library"),
    ]
    for path, words in cases:
        with pytest.raises(SimulationError, match=f"^first: {path.name} cannot be instantiated: .*{words}"):
            chain(path).simulate(STOP, STEP)
        assert os.getcwd() == here


def test_the_set_up_can_fail():
    system = alone(2, name="setup")
    with pytest.raises(SimulationError, match=r"^setup at initialization: fmi2SetupExperiment failed: set-up goes wrong as told$"):
        system.simulate(STOP, STEP)


@pytest.mark.parametrize("version", [2, 3])
def test_a_reset_that_fails_is_told_at_the_next_run(version):
    with Simulation(chain(faulty_fmu(version), "reset")) as simulation:
        simulation.run(STOP, STEP)
        for _ in range(2):
            with pytest.raises(SimulationError, match=f"^x at reset: fmi{version}Reset failed: reset goes wrong as told"):
                simulation.run(STOP, STEP)


def test_a_closed_simulation_says_so():
    simulation = Simulation(chain(faulty_fmu(2)))
    simulation.run(STOP, STEP)
    simulation.close()
    simulation.close()
    with pytest.raises(SimulationError, match=r"^first: the simulation is closed; make another one$"):
        simulation.run(STOP, STEP)


def test_a_failing_function_of_the_user_keeps_what_was_recorded():
    system = System()
    system.add("x", faulty_fmu(2), count_in=0, flag_in=False)
    system.drive("x.input", lambda t: 1.0 if t < 0.45 else 1.0 / 0.0)
    with pytest.raises(SimulationError, match=r"x.input at t = 0.5 s: its function failed: ZeroDivisionError") as caught:
        system.simulate(STOP, STEP)
    assert caught.value.results.time.tolist() == [0.0, 0.1, 0.2, 0.30000000000000004, 0.4]
    assert caught.value.results["x.output"].tolist() == [0.0, 2.0, 4.0, 6.0, 8.0]


@pytest.mark.parametrize("version", [2, 3])
def test_texts_are_left_alone(version):
    """An FMU with texts runs: they are no numbers, so they keep their start values and are not among the results."""
    system = alone(version)
    assert list(system.simulate(STOP, STEP).values) == ["x.output", "x.count_out", "x.flag_out"]
    with pytest.raises(ModelError, match=r"x.text_out is of type String; only numbers and booleans can be transferred"):
        system.simulate(STOP, STEP, record=["x.text_out"])
