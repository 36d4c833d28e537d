"""FMI 1.0: slaves run by the formula, aliases, initialization by what is known before, faults in words, resets that are refused."""

from __future__ import annotations

import contextlib
import math
import zipfile
from pathlib import Path

import fmpy
import numpy as np
import pytest
from faulty_fmus import faulty_fmu
from fmpy.model_description import CoSimulation
from reading_fmus import lag_fmu
from spring_fmus import CAPABILITIES, FAULTS, PERIOD, model, moved, slave, spring_fmu

from shaper_fmu import System
from shaper_fmu.errors import ArchiveError, ModelError, SimulationError
from shaper_fmu.master.batch import Batch, Plan
from shaper_fmu.master.fmu import fmu_problems, load_fmu
from shaper_fmu.master.instance import Instance
from shaper_fmu.master.simulation import Simulation
from shaper_fmu.metrics import Final

STEPS, STEP = 10, 0.1


def driven(force: object = 3.0, **start: object) -> System:
    system = System()
    system.add("x", spring_fmu(), start)
    system.drive("x.force", force)
    return system


@pytest.mark.parametrize("algorithm", ["jacobi", "gauss_seidel", "parallel"])
def test_a_slave_moves_by_the_formula(algorithm):
    """Also: never read between set and step, which it answers by an error; aliases with their signs."""
    record = ["position", "drop", "same", "steps", "minus_steps", "moving", "resting", "force", "pull", "sum", "count_out"]
    results = driven(count_in=4).simulate(STEPS * STEP, STEP, algorithm=algorithm, record=[f"x.{name}" for name in record])
    expected, steps = moved(np.full(STEPS, 3.0), STEP), np.arange(STEPS + 1.0)
    assert results["x.position"] == pytest.approx(expected, abs=1e-14)
    assert np.array_equal(results["x.drop"], -results["x.position"])
    assert np.array_equal(results["x.same"], results["x.position"])
    assert np.array_equal(results["x.steps"], steps)
    assert np.array_equal(results["x.minus_steps"], -steps)
    assert np.array_equal(results["x.count_out"], steps + 4.0)
    assert np.array_equal(results["x.moving"], steps > 0)
    assert np.array_equal(results["x.resting"], steps == 0)
    assert np.array_equal(results["x.force"], np.full(STEPS + 1, 3.0))
    assert np.array_equal(results["x.pull"], np.full(STEPS + 1, -3.0))
    assert results["x.sum"] == pytest.approx(expected + 3.0, abs=1e-14)
    assert fmu_problems(spring_fmu()) == []


def test_a_slave_gives_the_bits_of_another_master():
    names = ["position", "speed", "sum", "seen", "count_out", "steps", "moving"]
    times = np.arange(9) * 0.125
    signal = np.array(list(zip(times, np.full(9, 3.0), strict=True)), [("time", "f8"), ("force", "f8")])
    other = fmpy.simulate_fmu(
        str(spring_fmu()), stop_time=1.0, output_interval=0.125, input=signal, output=names, start_values={"mass": 3.0}
    )
    ours = driven(mass=3.0).simulate(1.0, 0.125)
    for name in names:
        assert np.array_equal(ours[f"x.{name}"], other[name].astype(float)), name


def test_start_values_of_negated_aliases():
    results = driven(excitation=-4.0).simulate(STEPS * STEP, STEP)
    assert results["x.position"] == pytest.approx(moved(np.full(STEPS, 3.0), STEP, damping=4.0), abs=1e-14)
    for excitation, words in ((-4.0, ""), (-3.0, "x: damping and excitation are aliases, and cannot be set to values that differ")):
        system = driven(damping=4.0, excitation=excitation)
        with pytest.raises(ModelError, match=words) if words else contextlib.nullcontext():
            system.simulate(0.1, 0.1)
    system = System()
    system.add("x", spring_fmu(), pull=2.0)
    assert system.simulate(0.1, 0.1, record=["x.force"])["x.force"][0] == -2.0


def test_inputs_by_negated_aliases_and_booleans():
    system = System()
    system.add("x", spring_fmu())
    system.drive("x.pull", -3.0)
    system.drive("x.held", [(0.0, 0.0), (0.5, 1.0)])
    found = system.simulate(1.0, STEP)
    expected = moved(np.full(5, 3.0), STEP)
    assert found["x.position"] == pytest.approx([*expected, *[expected[-1]] * 5], abs=1e-14)
    assert found["x.resting"].tolist() == [1.0] + [0.0] * 4 + [0.0] + [1.0] * 5
    with pytest.raises(ModelError, match=r"input x\.force is an alias of pull, which is driven already"):
        system.drive("x.force", 1.0)


def test_what_is_known_is_set_before_initialization():
    """FMI 1.0 has no initialization mode: a signal, and an output of an FMU that has one (x + u = 2), are there all the same."""
    assert driven(3.0).simulate(0.1, 0.1)["x.seen"][0] == 3.0
    system = System()
    system.add("lag", lag_fmu(2), u=2.0, count_in=0)
    system.add("x", spring_fmu())
    system.connect("lag.through", "x.force", gain=3.0)
    assert system.simulate(0.1, 0.1)["x.seen"][0] == 6.0
    with Batch(system, Plan(0.2, 0.1), {"seen": Final("x.seen")}, ["lag.u"]) as batch:
        assert [batch.run({"lag.u": u})["seen"] for u in (1.0, 5.0)] == [3.0, 15.0]


def test_slaves_in_a_loop():
    """A loop through slaves is cut by them: FMI 1.0 lets nobody read what follows an input at the start."""
    system = System()
    system.add("a", spring_fmu())
    system.add("b", spring_fmu())
    system.connect_raw("a.sum", "b.force", gain=0.5, offset=1.0)
    system.connect_raw("b.sum", "a.force", gain=-0.5)
    system.connect("a.count_out", "b.count_in")  # of real numbers alone loops could be solved, and need not here
    system.connect("b.count_out", "a.count_in")
    assert system.check() == []
    results = system.simulate(STEPS * STEP, STEP)
    assert "solved at the start" not in " ".join(results.notes)
    assert "sum to b.force" in " ".join(results.notes)
    a, b = results["a.sum"], results["b.sum"]
    assert a[1:] - results["a.position"][1:] == pytest.approx(-0.5 * b[:-1], abs=1e-15)  # over each step what was at its beginning
    assert b[1:] - results["b.position"][1:] == pytest.approx(0.5 * a[:-1] + 1.0, abs=1e-15)


def test_inputs_are_linear_over_a_step_with_the_right_sign():
    """The source's slope over the step before, by which the slave takes the mean of the force over a step."""
    for target, sign in (("force", 1.0), ("pull", -1.0)):
        system = System()
        system.add("lag", lag_fmu(2), u=2.0, count_in=0)
        system.add("x", spring_fmu())
        system.connect("lag.x", f"x.{target}")
        results = system.simulate(STEPS * STEP, STEP, interpolation="linear")
        x = results["lag.x"]
        means = [x[0], *(1.5 * x[1:-1] - 0.5 * x[:-2])]
        assert results["x.position"] == pytest.approx(sign * moved(np.array(means), STEP), abs=1e-14)


FAILURES = {
    "step": r"^x at t = 0\.5 s: fmiDoStep failed: 100% of the load: broken at 0\.5 s$",
    "discard": r"^x at t = 0\.5 s: fmiDoStep was refused \(Discard\): 100% of the load: too far at 0\.5 s$",
    "pending": r"^x at t = 0\.5 s: fmiDoStep goes on in the background \(Pending\), which this master does not support",
    "initialization": r"^x at initialization: fmiInitializeSlave failed: 100% of the load: no equilibrium at 0 s$",
}


@pytest.mark.parametrize("fault", FAILURES)
def test_failures_are_told_in_words(fault):
    system = driven(fault=FAULTS[fault], fault_time=0.55)
    with Simulation(system) as simulation:
        for _ in range(2):  # after a failure it can be run again
            with pytest.raises(SimulationError, match=FAILURES[fault]):
                simulation.run(1.0, STEP)
    with Batch(system, Plan(1.0, STEP), {"end": Final("x.position")}, []) as batch, pytest.raises(SimulationError) as error:
        batch.run({})
    assert "fmiDoStep" in str(error.value) or "fmiInitializeSlave failed" in str(error.value)


def test_a_warning_at_initialization_lets_the_run_go_on():
    """fmpy takes the status of this call for a text; a warning would be an address."""
    assert np.array_equal(driven(fault=4).simulate(1.0, STEP)["x.position"], driven().simulate(1.0, STEP)["x.position"])


def test_an_instance_that_is_not_made():
    with pytest.raises(
        SimulationError, match=r"cannot be instantiated: fmiInstantiateSlave failed; 100% of the load: another guid"
    ):
        Instance("x", load_fmu(spring_fmu(changes=(('guid="spring"', 'guid="other"'),))))


@pytest.mark.parametrize("fault", ["none", "reset"])
def test_runs_one_after_the_other_are_alike_whether_or_not_it_can_be_reset(fault):
    system = driven(fault=FAULTS[fault])
    with Simulation(system) as simulation:
        first, second = (simulation.run(1.0, STEP) for _ in range(2))
    assert np.array_equal(first["x.position"], second["x.position"])
    metrics = {"end": Final("x.position"), "drop": Final("x.drop")}
    with Batch(system, Plan(1.0, STEP), metrics, ["x.mass"]) as batch:
        assert batch.resets == (fault == "none")
        ends = [batch.run({"x.mass": 2.0}) for _ in range(3 if batch.resets else 1)]
    assert ends == [{"end": first["x.position"][-1], "drop": -first["x.position"][-1]}] * len(ends)


def test_isolated_runs_and_archives(tmp_path):
    system, right = driven(), driven().simulate(1.0, STEP)
    assert np.array_equal(system.simulate(1.0, STEP, isolate=True)["x.drop"], right["x.drop"])


def test_a_model_is_initialized_and_has_its_functions():
    with_tolerance = (("<ModelVariables>", '<DefaultExperiment tolerance="1e-5"/><ModelVariables>'),)
    fmu = load_fmu(spring_fmu("", changes=with_tolerance))
    assert (fmu.version, fmu.interface, fmu.exchanges_model) == (1, "model_exchange", True)
    assert fmu.description.numberOfContinuousStates == 2
    instance = Instance("x", fmu)
    instance.enter_initialization(0.5, 1.0, {"force": 3.0, "excitation": -2.0})
    assert instance.get_values(["seen", "damping", "drop"]) == [3.0, 2.0, 0.0]
    for name in ("SetTime", "GetDerivatives", "SetContinuousStates", "EventUpdate", "CompletedIntegratorStep", "Terminate"):
        assert instance.address(f"fmi{name}") != 0
    assert instance.address("fmiDoNothing") == 0
    with pytest.raises(SimulationError, match=r"x: models of FMI 1\.0 cannot be reset"):
        instance.reset()
    instance.close()


def test_functions_that_are_never_called_may_be_missing(tmp_path):
    def without(*names: str) -> Path:
        with zipfile.ZipFile(spring_fmu()) as archive:
            files = {name: archive.read(name) for name in archive.namelist()}
        for file, content in files.items():
            for name in names if not file.endswith("xml") else ():
                content = content.replace(f"\0spring_{name}\0".encode(), f"\0sprung_{name}\0".encode())
            files[file] = content
        path = tmp_path / f"{'_'.join(names)}.fmu"
        with zipfile.ZipFile(path, "w") as archive:
            for file, content in files.items():
                archive.writestr(file, content)
        return path

    def of(path: Path) -> System:
        system = System()
        system.add("x", path)
        system.drive("x.force", 3.0)
        return system

    right = driven().simulate(1.0, STEP)["x.position"]
    with Simulation(of(without("fmiCancelStep", "fmiResetSlave", "fmiGetString", "fmiTerminateSlave"))) as simulation:
        for _ in range(2):
            assert np.array_equal(simulation.run(1.0, STEP)["x.position"], right)
    with pytest.raises(SimulationError, match=r"its library lacks functions: spring_fmiInitializeSlave, spring_fmiDoStep$"):
        of(without("fmiDoStep", "fmiInitializeSlave")).simulate(1.0, STEP)
    with pytest.raises(ModelError, match=r"x: the library of fmiSetReal\.fmu lacks the function fmiSetReal"):
        of(without("fmiSetReal")).simulate(1.0, STEP)


def test_a_model_moves_by_the_formula_through_its_time_events():
    """It takes no event within a step that is not completed, and counts every update: none at the start, one at each event."""
    system = System()
    system.add("x", model())
    system.drive("x.force", [(0.0, 3.0), (0.5, -1.0)])
    record = ["position", "drop", "steps", "updates", "seen", "moving"]
    with Simulation(system, record=[f"x.{name}" for name in record]) as simulation:
        results, again = (simulation.run(1.0, STEP, solver_tolerance=1e-9) for _ in range(2))
    assert results["x.position"] == pytest.approx(moved(np.array([3.0] * 5 + [-1.0] * 5), STEP), abs=1e-7)
    assert np.array_equal(results["x.drop"], -results["x.position"])
    assert results["x.steps"].tolist() == [math.floor(t / PERIOD + 1e-9) for t in results.time]
    assert results["x.updates"][-1] == 3  # two time events, and the jump of the force
    assert results["x.seen"][0] == 3.0
    for name in record:
        assert np.array_equal(results[f"x.{name}"], again[f"x.{name}"])
    with Batch(system, Plan(1.0, STEP), {"end": Final("x.position"), "updates": Final("x.updates")}, []) as batch:
        found = batch.run({})
        assert (found["end"], found["updates"]) == (pytest.approx(results["x.position"][-1], abs=1e-5), 3.0)
        with pytest.raises(ModelError, match="an FMU cannot be reset, so that a batch is good for one run"):
            batch.run({})


def test_a_model_may_ask_to_end_the_simulation_at_once():
    system = System()
    system.add("x", model(), fault=FAULTS["end"])
    with pytest.raises(SimulationError, match=r"^x at initialization: fmiInitialize asked to end the simulation$"):
        system.simulate(1.0, STEP)
    with Batch(system, Plan(1.0, STEP), {"end": Final("x.position")}, []) as batch, pytest.raises(SimulationError) as error:
        batch.run({})
    assert "fmiInitialize asked to end the simulation" in str(error.value)


def test_slaves_and_models_drive_each_other():
    """A slave's position is the force of a model, held over each step; the model is known to be right by the test above."""
    system = System()
    system.add("slave", spring_fmu())
    system.add("x", model())
    system.drive("slave.force", 3.0)
    system.connect_raw("slave.position", "x.force", gain=100.0)
    results = system.simulate(1.0, STEP, solver_tolerance=1e-9)
    forces = 100.0 * results["slave.position"][:-1]
    assert results["x.position"] == pytest.approx(moved(forces, STEP), abs=1e-6)


@pytest.mark.parametrize("algorithm", ["jacobi", "gauss_seidel", "parallel"])
def test_an_input_that_jumps_over_an_event_indicator_is_an_event(algorithm):
    """It is held over each step, so that no solver sees the indicator cross 0: the mass stands still until the force is beyond."""
    system = System()
    system.add("lag", lag_fmu(2), u=2.0, count_in=0)
    system.add("x", model(), stiction=1.0)
    system.connect("lag.x", "x.force")
    exact = None if algorithm != "gauss_seidel" else False  # which holds what is at t over steps that end at events
    results = system.simulate(1.0, STEP, algorithm=algorithm, exact=exact, solver_tolerance=1e-9)
    forces = results["lag.x"][1:] if algorithm == "gauss_seidel" else results["lag.x"][:-1]
    assert 0 < np.count_nonzero(forces > 1.0) < STEPS
    assert results["x.position"] == pytest.approx(moved(np.where(forces > 1.0, forces, 0.0), STEP), abs=1e-7)


def test_descriptions_in_the_terms_of_fmi_2():
    """Roles as in FMI 2.0's section 2.2.7; what has no start value cannot be set in FMI 1.0."""
    changes = (
        ('variability="parameter"><Real start="2" fixed="true"', 'variability="parameter" causality="none"><Real'),
        ('causality="input" variability="discrete"><Integer', 'causality="input" variability="constant"><Integer'),
        ('variability="discrete" alias="negatedAlias"><Integer', 'alias="negatedAlias"><Integer'),
    )
    fmu = load_fmu(spring_fmu(slave('canHandleVariableCommunicationStepSize="TRUE "'), changes))
    roles = {name: (v.causality, v.variability, v.initial) for name, v in fmu.variables.items()}
    assert roles["force"] == ("input", "continuous", "exact")
    assert roles["position"] == ("output", "continuous", "calculated")
    assert roles["stiffness"] == ("parameter", "fixed", "exact")
    assert roles["mass"] == ("calculatedParameter", "fixed", "calculated")
    assert roles["count_in"] == ("local", "constant", "exact")
    assert roles["minus_steps"] == ("output", "discrete", "calculated")
    assert fmu.takes_any_step
    assert isinstance(fmu.capabilities, CoSimulation)
    assert not fmu.capabilities.canInterpolateInputs
    assert fmu.inputs_of("sum") == ["force"]
    assert fmu.inputs_of("position") == []
    assert not fmu.declares_inputs_of("count_out")
    assert "count_in" not in fmu.inputs_of("count_out")
    assert set(fmu.inputs_of("count_out")) == {"force", "pull", "held"}
    assert not load_fmu(spring_fmu(slave(""))).takes_any_step


def test_what_is_refused():
    tool = (
        "<Implementation><CoSimulation_Tool><Capabilities/><Model entryPoint='a' manualStart='false' type='b'/></CoSimulation_Tool>"
    )
    with pytest.raises(ModelError, match=r"an FMI 1\.0 FMU that couples a tool \(CoSimulation_Tool\); only those that stand alone"):
        load_fmu(spring_fmu(tool + "</Implementation>"))
    with pytest.raises(ArchiveError, match=r"variable 'same' \(line 2\): alias is 'negated', none of noAlias, alias, negatedAlias"):
        load_fmu(spring_fmu(changes=(('alias="alias"', 'alias="negated"'),)))
    with pytest.raises(ArchiveError, match=r"'drop' \(line 2\) is a negated alias of type String, which has no negative value"):
        load_fmu(spring_fmu(changes=(('alias="negatedAlias"><Real unit="m"', 'alias="negatedAlias"><String'),)))
    (problem,) = fmu_problems(spring_fmu(changes=(("<Name>force", "<Name>weight"),)))
    assert "it depends on 'weight', which is no variable; its dependencies count as not declared" in problem
    once = load_fmu(spring_fmu(slave(f'{CAPABILITIES} canBeInstantiatedOnlyOncePerProcess="true"')))
    system = System()
    system.add("a", once)
    system.add("b", once)
    with pytest.raises(ModelError, match="are instances of the same FMU"):
        system.simulate(1.0, 0.1)
    missing = load_fmu(spring_fmu(changes=(('modelIdentifier="spring"', 'modelIdentifier="other"'),)))
    with pytest.raises(SimulationError, match=r"it has no library other\..* only for|nor for any other platform"):
        Instance("x", missing)


def test_units_are_converted_where_their_names_are_those_of_si():
    """FMI 1.0 tells no more than names: those of SI mean what they say, others connect to the same names alone."""
    system = System()
    system.add("a", spring_fmu(changes=(('Real unit="m"', 'Real unit="mm"'),)))
    system.add("b", spring_fmu(changes=(('Real unit="N" start="0" fixed', 'Real unit="m" start="0" fixed'),)))
    system.add("c", spring_fmu(changes=(('Real unit="N" start="0" fixed', 'Real unit="furlong" start="0" fixed'),)))
    system.connect("a.position", "b.force")
    assert system.scalings["b", "force"] == (1e-3, 0.0)
    with pytest.raises(
        ModelError, match=r"a\.position is in mm but c\.force in furlong; they cannot be connected: FMI 1\.0 does not"
    ):
        system.connect("a.position", "c.force")
    with pytest.raises(ModelError, match=r"a\.speed is in m/s but c\.pull in N; they cannot be connected$"):
        system.connect("a.speed", "c.pull")


def test_a_mapping_for_a_negated_alias_is_refused():
    system = System()
    system.add("f", faulty_fmu(2))
    output = 'causality="output" variability="discrete" alias="negatedAlias"><Integer'
    system.add("x", spring_fmu(changes=((output, f'{output.replace("output", "input")} start="0"'),)))
    with pytest.raises(ModelError, match="is a negated alias, which takes no mapping of values"):
        system.connect_raw("f.count_out", "x.minus_steps", mapping={1: 2})
