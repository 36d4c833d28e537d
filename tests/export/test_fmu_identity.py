"""One kernel, three ways; FMUs that do not mix in one process; states that replay to the bit."""

from __future__ import annotations

import json
import subprocess
import sys

import pytest
from conftest import gain_component

from shaper_fmu.component import Component
from shaper_fmu.export.pythonfmu_backend import build_fmu
from shaper_fmu.master.fmu import load_fmu
from shaper_fmu.master.instance import Instance
from shaper_fmu.master.system import System
from shaper_fmu.registry import components

STEPS = 120
STEP = 0.0371
PARAMETERS = {
    "InputShaper": {"shaper": 3, "modes": 2, "natural_frequency[1]": 5.0, "natural_frequency[2]": 13.0, "damping_ratio[1]": 0.1},
    "MotionProfile": {"profile": 6, "duration": 3.1, "start_time": 0.2, "damping_ratio": 0.08, "natural_frequency": 5.5045},
    "FlexibleBeam": {"modes": 2, "tip_mass": 0.012, "modal_damping[1]": 0.01, "modal_damping[2]": 0.02},
    "MassSpringDamper": {"mass": 0.7, "damping": 0.9},
    "OverheadCrane": {"initial_rope_length": 3.3, "damping_ratio": 0.02},
    "HydraulicPendulum": {"rod_length": 0.6, "leakage": 2e-12},
    "PulseTrain": {
        "design": 2,
        "amplitude": 0.7,
        "duration": 0.9,
        "start_time": 0.2,
        "natural_frequency": 4.0,
        "damping_ratio": 0.08,
    },
    "PulseWidthModulator": {"carrier_frequency": 3.0, "carrier_phase": 0.3, "minimum_pulse_width": 0.001},
    "PositionController": {"proportional_gain": 30.0, "integral_gain": 7.0, "derivative_gain": 4.0, "force_limit": 2.5},
    "ThreeMassChain": {"mass[2]": 5.0, "damping[1]": 9.0, "stiffness[2]": 80.0},
}


def stimulus(step: int, place: int) -> float:
    """Inputs that change now and then, moderate enough for every component."""
    return 0.02 * ((7 * (step // 5) + 3 * place) % 11) - 0.1


def plain_run(component: type[Component]) -> list[list[str]]:
    """Outputs after each step, as exact hexadecimal texts, of the plain Python object."""
    instance = component()
    for name, value in PARAMETERS[component.__name__].items():
        instance.set(name, value)
    instance.initialize(0.0)
    inputs = [label for v in component.variables.values() if v.causality == "input" for label in v.scalar_names]
    rows = []
    for i in range(STEPS):
        for place, name in enumerate(inputs):
            instance.set(name, stimulus(i, place))
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
    names = {c: [v.name for v in fmu.variables.values() if v.causality == c] for c in ("input", "output")}
    instance.set_values(PARAMETERS[path.stem])
    for call in ("setupExperiment", "enterInitializationMode", "exitInitializationMode"):
        instance.call(call)
    rows = []
    for i in range(STEPS):
        instance.set_values({name: stimulus(i, place) for place, name in enumerate(names["input"])})
        instance.call("doStep", i * STEP, STEP)
        rows.append([float(value).hex() for value in instance.get_values(names["output"])])
    instance.close()
    return rows


ALONE = """
import json, sys
for name in ("shaper_fmu", "numba", "numpy.random"):
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
inputs = [v.valueReference for v in variables.values() if v.causality == "input"]
outputs = [v for v in variables.values() if v.causality == "output"]
rows = []
for i, values in enumerate(stimuli):
    slave.setReal(inputs, values)
    slave.doStep(i * step, step)
    rows.append([float((slave.getReal if v.type == "Real" else slave.getBoolean)([v.valueReference])[0]).hex() for v in outputs])
slave.terminate()
slave.freeInstance()
print(json.dumps(rows))
"""


def alone_run(path) -> list[list[str]]:
    """The same of the FMU in a process in which `shaper_fmu` cannot be imported."""
    inputs = sum(v.causality == "input" for v in load_fmu(path).variables.values())
    stimuli = [[stimulus(i, place) for place in range(inputs)] for i in range(STEPS)]
    argument = json.dumps([str(path), PARAMETERS[path.stem], stimuli, STEP])
    done = subprocess.run([sys.executable, "-c", ALONE, argument], capture_output=True, text=True, timeout=900, cwd=path.parent)
    assert done.returncode == 0, done.stderr
    return json.loads(done.stdout)


@pytest.mark.parametrize("name", PARAMETERS)
def test_one_kernel_three_ways_gives_equal_bits(name, python_fmus):
    plain = plain_run(components()[name])
    assert len({tuple(row) for row in plain}) > 10  # something happens
    assert fmu_run(python_fmus / f"{name}.fmu") == plain
    assert alone_run(python_fmus / f"{name}.fmu") == plain


def test_every_component_is_run_three_ways():
    assert set(PARAMETERS) == set(components())


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
