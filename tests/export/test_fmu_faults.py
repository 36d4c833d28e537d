"""What goes wrong in an FMU is told in words, and the host lives on."""

from __future__ import annotations

import math
import subprocess
import sys
from typing import Any

import pytest
from conftest import gain_component
from fmpy.fmi1 import FMICallException

from shaper_fmu.errors import ArchiveError, ModelError, SimulationError
from shaper_fmu.export.pythonfmu_backend import build_fmu
from shaper_fmu.master.fmu import load_fmu
from shaper_fmu.master.instance import Instance
from shaper_fmu.master.system import System


def shaper_system(python_fmus, start=None, command: Any = 1.0) -> System:
    system = System()
    system.add("shaper", python_fmus / "InputShaper.fmu", start or {})
    system.drive("shaper.command", command)
    return system


@pytest.mark.parametrize(
    ("start", "words"),
    [
        ({"natural_frequency[1]": -5.0}, r"natural_frequency\[1\] = -5 rad/s must be greater than 0 rad/s"),
        ({"natural_frequency[1]": 0.0}, r"natural_frequency\[1\] = 0 rad/s must be greater than 0 rad/s"),
        ({"damping_ratio[1]": 1.0}, r"damping_ratio\[1\] = 1 must be less than 1"),
        ({"damping_ratio[2]": -0.1}, r"damping_ratio\[2\] = -0.1 must be at least 0"),
        ({"modes": 5}, "modes = 5 must be at most 4"),
        ({"shaper": "custom", "custom_amplitude": [0.5, 0.4]}, "must add up to 1"),
        ({"shaper": "custom", "custom_delay": [0.1, 0.3]}, "must begin with 0 s"),
        ({"natural_frequency[1]": math.nan}, r"natural_frequency\[1\] is nan"),
    ],
)
def test_a_parameter_outside_its_domain_stops_the_initialization(python_fmus, start, words):
    with pytest.raises(SimulationError, match=f"^shaper at initialization: .*InputShaper: .*{words}"):
        shaper_system(python_fmus, start).simulate(1.0, 0.1)


def test_a_number_that_is_no_item_is_refused_by_the_master(python_fmus):
    with pytest.raises(ModelError, match=r"shaper = 99 is not an item of the enumeration: none \(1\), zv \(2\)"):
        shaper_system(python_fmus, {"shaper": 99})


def test_an_unknown_shaper_name_suggests_the_nearest(python_fmus):
    with pytest.raises(ModelError, match=r"'zvdx' is not a value of shaper. Did you mean 'zvd"):
        shaper_system(python_fmus, {"shaper": "zvdx"})


def test_a_command_that_is_nan_names_the_instance_the_time_and_the_input(python_fmus):
    system = shaper_system(python_fmus, command=lambda t: math.nan if t > 0.45 else 1.0)
    with pytest.raises(SimulationError, match=r"shaper at t = 0.5 s: the value for input command is nan"):
        system.simulate(1.0, 0.1)


def test_the_fmu_itself_refuses_nan(python_fmus):
    instance = Instance("shaper", load_fmu(python_fmus / "InputShaper.fmu"))
    for call in ("setupExperiment", "enterInitializationMode", "exitInitializationMode"):
        instance.call(call)
    instance.set_values({"command": math.nan})
    with pytest.raises(
        SimulationError, match=r"fmi2DoStep failed: InputShaper: input command is nan; it must be a finite number at t = 0 s"
    ):
        instance.call("doStep", 0.0, 0.1)


def test_a_full_history_is_an_error_not_a_wrong_number(python_fmus):
    system = shaper_system(python_fmus, {"natural_frequency[1]": 0.1}, command=lambda t: t)
    with pytest.raises(SimulationError, match=r"changed more than 4095 times within the shaper duration 31.4159265 s"):
        system.simulate(30.0, 0.005)


@pytest.mark.parametrize("name", ["nothing.fmu", "text.fmu", "empty.fmu"])
def test_a_file_that_is_no_fmu_is_refused(name, tmp_path):
    (tmp_path / "text.fmu").write_text("not a zip")
    (tmp_path / "empty.fmu").write_bytes(b"PK\x05\x06" + bytes(18))
    with pytest.raises(ArchiveError, match=name):
        System().add("x", tmp_path / name)


def test_setting_what_cannot_be_set_is_refused(python_fmus):
    instance = Instance("shaper", load_fmu(python_fmus / "InputShaper.fmu"))
    with pytest.raises(SimulationError, match="shaped is an output and cannot be set"):
        instance.set_values({"shaped": 1.0})


def test_a_fixed_parameter_cannot_be_set_while_running(python_fmus):
    instance = Instance("plant", load_fmu(python_fmus / "MassSpringDamper.fmu"))
    for call in ("setupExperiment", "enterInitializationMode", "exitInitializationMode"):
        instance.call(call)
    with pytest.raises(SimulationError, match="mass is fixed"):
        instance.set_values({"mass": 2.0})


@pytest.mark.parametrize(
    ("call", "words"),
    [
        (lambda slave, vr: slave.setReal([vr["modes"]], [1.5]), "modes is not of type Real"),
        (lambda slave, vr: slave.setInteger([vr["command"]], [1]), "command is not of type Integer"),
        (lambda slave, vr: slave.getBoolean([vr["shaped"]]), "shaped is not of type Boolean"),
        (lambda slave, vr: slave.getReal([4711]), "no variable with the value reference 4711"),
        (lambda slave, vr: slave.doStep(0.0, 0.1), "a step is possible only between initialization and termination"),
    ],
)
def test_wrong_calls_are_refused_in_words(python_fmus, call, words):
    fmu = load_fmu(python_fmus / "InputShaper.fmu")
    instance = Instance("shaper", fmu)
    with pytest.raises(FMICallException):
        call(instance.slave, {v.name: v.valueReference for v in fmu.variables.values()})
    assert words in instance.log[-1]


HOST = """
import sys
import fmpy
from fmpy.fmi2 import FMU2Slave
description = fmpy.read_model_description(sys.argv[1])
for repetition in range(50):
    slave = FMU2Slave(guid=description.guid, modelIdentifier=description.coSimulation.modelIdentifier,
                      unzipDirectory=fmpy.extract(sys.argv[1]), instanceName="x")
    slave.instantiate(loggingOn=True)
    slave.setupExperiment()
    slave.enterInitializationMode()
    slave.exitInitializationMode()
    slave.setReal([0], [2000.0])
    try:
        slave.doStep(0.0, 0.1)
    except Exception as error:
        print(error)
    slave.setReal([0], [2.0])
    slave.doStep(0.0, 0.1)
    slave.reset()
    slave.freeInstance()
print("alive")
"""


def test_percent_signs_and_repeated_failures_do_not_crash_the_host(tmp_path):
    """In a process of its own, with fmpy's printf-like logger: fail, go on, reset and free, fifty times."""
    path = build_fmu(gain_component(tmp_path, 1.0), tmp_path)
    done = subprocess.run([sys.executable, "-c", HOST, str(path)], capture_output=True, text=True, timeout=900)
    assert done.returncode == 0, done.stderr
    assert done.stdout.count("a load of 100% is too much for %s, value = 2000") == 50
    assert done.stdout.endswith("alive\n")


EXIT = """
import atexit, json, sys
registered = []
register = atexit.register
atexit.register = lambda function, *a, **k: (registered.append(function), register(function, *a, **k))[1]
import fmpy
from fmpy.fmi2 import FMU2Slave
description = fmpy.read_model_description(sys.argv[1])
folder = fmpy.extract(sys.argv[1])
for repetition in range(3):
    slave = FMU2Slave(guid=description.guid, modelIdentifier=description.coSimulation.modelIdentifier,
                      unzipDirectory=folder, instanceName="x")
    slave.instantiate()
    slave.freeInstance()
print([f.__name__ for f in registered if "finalize" in getattr(f, "__name__", "")])
"""


@pytest.mark.skipif(sys.platform != "linux", reason="the wrapper's fault is Linux's alone")
def test_the_wrappers_interpreter_is_released_once_before_the_process_ends(python_fmus):
    """pythonfmu releases it again in its exit handlers: a use after free unless it is already gone (seen with valgrind)."""
    path = str(python_fmus / "MotionProfile.fmu")
    done = subprocess.run([sys.executable, "-c", EXIT, path], capture_output=True, text=True, timeout=900)
    assert (done.returncode, done.stdout) == (0, "['finalizePythonInterpreter']\n"), done.stderr
