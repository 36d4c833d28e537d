"""One kernel, three ways; FMUs that do not mix in one process; states that replay to the bit."""

from __future__ import annotations

import json
import subprocess
import sys

import pytest
from conftest import gain_component
from trial_runs import PARAMETERS, STEP, STEPS, stimuli

from shaper_fmu.component import Component
from shaper_fmu.export.pythonfmu_backend import build_fmu
from shaper_fmu.master.fmu import load_fmu
from shaper_fmu.master.instance import Instance
from shaper_fmu.master.system import System
from shaper_fmu.registry import components


def plain_run(component: type[Component]) -> list[list[str]]:
    """Outputs after each step, as exact hexadecimal texts, of the plain Python object."""
    instance = component()
    for name, value in PARAMETERS[component.__name__].items():
        instance.set(name, value)
    instance.initialize(0.0)
    rows = []
    for i in range(STEPS):
        for name, value in stimuli(component.__name__, i).items():
            instance.set(name, value)
        instance.do_step(i * STEP, STEP)
        rows.append([value.hex() for value in output_values(instance)])
    return rows


def output_values(instance: Component) -> list[float]:
    """All outputs, arrays element by element."""
    values = (getattr(instance, v.name) for v in instance.variables.values() if v.causality == "output")
    return [float(x) for value in values for x in (value if isinstance(value, list) else [value])]


def fmu_run(path) -> list[list[str]]:
    """The same of the FMU in this process."""
    fmu = load_fmu(path)
    instance = Instance("run", fmu)
    outputs = [v.name for v in fmu.variables.values() if v.causality == "output"]
    instance.set_values(PARAMETERS[path.stem])
    for call in ("setupExperiment", "enterInitializationMode", "exitInitializationMode"):
        instance.call(call)
    rows = []
    for i in range(STEPS):
        instance.set_values(stimuli(path.stem, i))
        instance.call("doStep", i * STEP, STEP)
        rows.append([float(value).hex() for value in instance.get_values(outputs)])
    instance.close()
    return rows


ALONE = """
import json, sys
for name in ("shaper_fmu", "numpy.random"):
    sys.modules[name] = None  # importing it fails from now on
import fmpy
from fmpy.fmi2 import FMU2Slave
path, parameters, stimuli, step = json.loads(sys.argv[1])
try:
    import shaper_fmu
except ImportError:
    pass
else:
    raise SystemExit("shaper_fmu can be imported")
description = fmpy.read_model_description(path)
variables = {v.name: v for v in description.modelVariables}
slave = FMU2Slave(guid=description.guid, modelIdentifier=description.coSimulation.modelIdentifier,
                  unzipDirectory=fmpy.extract(path), instanceName="alone")
slave.instantiate()
for name, value in parameters.items():
    put = slave.setReal if variables[name].type == "Real" else slave.setInteger
    put([variables[name].valueReference], [value])
slave.setupExperiment()
slave.enterInitializationMode()
slave.exitInitializationMode()
inputs = [v for v in variables.values() if v.causality == "input"]
outputs = [v for v in variables.values() if v.causality == "output"]
rows = []
for i, values in enumerate(stimuli):
    for v, value in zip(inputs, values):
        (slave.setReal if v.type == "Real" else slave.setBoolean)([v.valueReference], [value])
    slave.doStep(i * step, step)
    rows.append([float((slave.getReal if v.type == "Real" else slave.getBoolean)([v.valueReference])[0]).hex() for v in outputs])
slave.terminate()
slave.freeInstance()
print(json.dumps(rows))
"""


def alone_run(path) -> list[list[str]]:
    """The same of the FMU in a process in which `shaper_fmu` cannot be imported."""
    inputs = [list(stimuli(path.stem, i).values()) for i in range(STEPS)]
    argument = json.dumps([str(path), PARAMETERS[path.stem], inputs, STEP])
    done = subprocess.run([sys.executable, "-c", ALONE, argument], capture_output=True, text=True, timeout=900, cwd=path.parent)
    assert done.returncode == 0, done.stderr
    return json.loads(done.stdout)


@pytest.mark.parametrize("name", PARAMETERS)
def test_one_kernel_three_ways_gives_equal_bits(name, python_fmus):
    plain = plain_run(components()[name])
    assert len({tuple(row) for row in plain}) > 10  # something happens
    assert fmu_run(python_fmus / f"{name}.fmu") == plain
    assert alone_run(python_fmus / f"{name}.fmu") == plain


def test_two_fmus_and_two_versions_of_one_run_their_own_code(python_fmus, tmp_path):
    first = build_fmu(gain_component(tmp_path / "first", 2.0), tmp_path / "first")
    second = build_fmu(gain_component(tmp_path / "second", 3.0), tmp_path / "second")
    system = System()
    for name, path in {"one": first, "other": second, "again": first, "shaper": python_fmus / "InputShaper.fmu"}.items():
        system.add(name, path, **({"shaper": "none"} if name == "shaper" else {}))
        system.drive(f"{name}.command" if name == "shaper" else f"{name}.value", 5.0)
    results = system.simulate(0.2, 0.1)
    found = {name: results[name][-1] for name in ("one.result", "other.result", "again.result", "shaper.shaped")}
    assert found == {"one.result": 10.0, "other.result": 15.0, "again.result": 10.0, "shaper.shaped": 5.0}


def start_shaper(fmu) -> Instance:
    instance = Instance("shaper", fmu)
    instance.set_values({"shaper": 3, "natural_frequency[1]": 5.0, "damping_ratio[1]": 0.1})
    for call in ("setupExperiment", "enterInitializationMode", "exitInitializationMode"):
        instance.call(call)
    return instance


def replay(instance: Instance, begin: int) -> list[str]:
    """Exact outputs over 40 steps of 50 ms from the step number `begin` on."""
    rows = []
    for i in range(begin, begin + 40):
        instance.set_values({"command": 1.0 if i < 25 else 0.3})
        instance.call("doStep", 0.05 * i, 0.05)
        rows += [float(value).hex() for value in instance.get_values(["shaped", "shaped_mean", "next_event_time", "settled"])]
    return rows


def test_a_saved_state_replays_to_the_bit_with_impulses_pending(python_fmus):
    fmu = load_fmu(python_fmus / "InputShaper.fmu")
    instance = start_shaper(fmu)
    for i in range(9):  # 0.45 s: two of the three impulses (0, 0.63, 1.26 s) are still to come
        instance.set_values({"command": 1.0})
        instance.call("doStep", 0.05 * i, 0.05)
    assert instance.get_values(["settled"]) == [0]
    state = instance.slave.getFMUstate()
    serialized = instance.slave.serializeFMUstate(state)
    expected = replay(instance, 9)
    instance.slave.setFMUstate(state)
    assert replay(instance, 9) == expected
    other = start_shaper(fmu)
    restored = other.slave.deSerializeFMUstate(serialized)
    other.slave.setFMUstate(restored)
    assert replay(other, 9) == expected
    for owner, held in ((instance, state), (other, restored)):
        owner.slave.freeFMUstate(held)
        owner.close()


def test_reset_gives_a_fresh_instance(python_fmus):
    fmu = load_fmu(python_fmus / "InputShaper.fmu")
    instance = start_shaper(fmu)
    expected = replay(instance, 0)
    instance.call("reset")
    instance.set_values({"shaper": 3, "natural_frequency[1]": 5.0, "damping_ratio[1]": 0.1})
    for call in ("setupExperiment", "enterInitializationMode", "exitInitializationMode"):
        instance.call(call)
    assert replay(instance, 0) == expected
    instance.close()
