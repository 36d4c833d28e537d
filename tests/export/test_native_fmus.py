"""Native FMUs of every component, FMI 2.0 and 3.0: the same bits as plain Python, exact states, builds alike."""

from __future__ import annotations

import random

import numpy as np
import pytest
from compiled_kernels import record_dtype
from native_drivers import Driver
from native_host import native_fmu
from test_fmu_identity import plain_run
from trial_runs import PARAMETERS, STEP, STEPS, stimuli

from shaper_fmu.export.build import build_fmu, fmu_path
from shaper_fmu.export.native.toolchain import USUAL_PLATFORMS
from shaper_fmu.registry import components, find_component

every_component = pytest.mark.parametrize("name", components())
both_versions = pytest.mark.parametrize("fmi", [2, 3])


def native_run(name: str, fmi: int, **options: bool) -> list[list[str]]:
    """Outputs after each step, as exact hexadecimal texts."""
    driver = Driver(native_fmu(name, fmi), **options).initialize(PARAMETERS[name])
    rows = []
    for i in range(STEPS):
        driver.set(stimuli(name, i))
        driver.step(i * STEP, STEP)
        rows.append([value.hex() for value in driver.elements("output")])
    driver.close()
    return rows


@every_component
@both_versions
def test_native_equals_plain_python_bit_for_bit(name, fmi):
    """On Linux both call the same mathematics library, so there is no tolerance."""
    assert native_run(name, fmi) == plain_run(components()[name])


@every_component
@both_versions
def test_all_values_after_initialization_equal_those_of_plain_python(name, fmi):
    plain = components()[name]()
    for variable, value in PARAMETERS[name].items():
        plain.set(variable, value)
    plain.initialize(0.7)
    driver = Driver(native_fmu(name, fmi)).initialize(PARAMETERS[name], start_time=0.7)
    for variable in plain.variables.values():
        if variable.causality == "state":
            continue
        expected = getattr(plain, variable.name)
        if variable.size is None or fmi == 3:
            assert driver.get(variable.name) == expected
        else:
            assert [driver.get(label) for label in variable.scalar_names] == expected
    driver.close()


@every_component
@both_versions
def test_a_restored_state_replays_to_the_bit(name, fmi):
    """Also after serialization, in another instance, after other steps, and with inputs set before the state was taken."""
    driver, other = (Driver(native_fmu(name, fmi)).initialize(PARAMETERS[name]) for _ in range(2))
    rng = random.Random(name)

    def run(who: Driver, first: int, count: int) -> list[float]:
        seen = []
        for i in range(first, first + count):
            who.set(stimuli(name, i))
            who.step(i * STEP, STEP)
            seen += who.elements("output")
        return seen

    run(driver, 0, 40)
    reals = [variable for variable, start in stimuli(name, 0).items() if isinstance(start, float)]
    driver.set({variable: rng.uniform(-0.1, 0.1) for variable in reals})
    get, put, free, pack, unpack = [
        getattr(driver.slave, f)
        for f in (
            ("getFMUState", "setFMUState", "freeFMUState", "serializeFMUState", "deserializeFMUState")
            if fmi == 3
            else ("getFMUstate", "setFMUstate", "freeFMUstate", "serializeFMUstate", "deSerializeFMUstate")
        )
    ]
    state = get()
    serialized = pack(state)
    expected = run(driver, 40, 40)
    put(state)
    assert run(driver, 40, 40) == expected
    run(other, 0, 7)
    elsewhere = unpack(serialized)
    getattr(other.slave, put.__name__)(elsewhere)
    assert run(other, 40, 40) == expected
    free(state)
    free(elsewhere)
    driver.slave.reset()
    driver.initialize(PARAMETERS[name])
    run(driver, 0, 40)
    driver.close()
    other.close()


def _with_value(serialized: bytes, record: np.dtype, name: str, value: float) -> bytes:
    """A serialized state (see states.c: checksum, life, two records) with another value and the checksum that belongs to it."""
    content = bytearray(serialized[8:])
    first = len(content) - 2 * record.itemsize
    for begin in (first, first + record.itemsize):
        np.frombuffer(content, record, 1, begin)[name][...] = value
    total = 14695981039346656037  # FNV-1a
    for byte in content:
        total = (total ^ byte) * 1099511628211 % 2**64
    return total.to_bytes(8, "little") + bytes(content)


@both_versions
@pytest.mark.parametrize(("field", "value"), [("modes", 10**6), ("modes", -5), ("shaper", 999), ("natural_frequency", -1.0)])
def test_a_state_with_impossible_values_is_refused(fmi, field, value):
    """Kernels rely on the domains of parameters and inputs: where bounds are declared, an index is not tested."""
    driver = Driver(native_fmu("InputShaper", fmi)).initialize(PARAMETERS["InputShaper"])
    pack, unpack, put = (
        ("serializeFMUState", "deserializeFMUState", "setFMUState")
        if fmi == 3
        else ("serializeFMUstate", "deSerializeFMUstate", "setFMUstate")
    )
    state = getattr(driver.slave, "getFMUState" if fmi == 3 else "getFMUstate")()
    record = record_dtype(components()["InputShaper"])
    same = getattr(driver.slave, pack)(state)
    assert _with_value(same, record, "modes", np.frombuffer(same, record, 1, len(same) - record.itemsize)["modes"][0]) == same
    changed = getattr(driver.slave, unpack)(_with_value(same, record, field, value))
    with pytest.raises(Exception, match=r"Error|status 3"):
        getattr(driver.slave, put)(changed)
    assert any(field in message for message in driver.messages)
    with pytest.raises(Exception, match=r"Error|status 3"):
        driver.step(0.0, 0.1)
    driver.slave.reset()
    driver.initialize(PARAMETERS["InputShaper"])
    driver.step(0.0, 0.1)
    driver.close()


@every_component
@both_versions
def test_reset_equals_a_fresh_instance(name, fmi):
    driver = Driver(native_fmu(name, fmi)).initialize({})
    for i in range(5):
        driver.step(0.1 * i, 0.1)
    driver.slave.reset()
    driver.initialize(PARAMETERS[name])
    rows = []
    for i in range(STEPS):
        driver.set(stimuli(name, i))
        driver.step(i * STEP, STEP)
        rows.append([value.hex() for value in driver.elements("output")])
    assert rows == plain_run(components()[name])
    driver.close()


@every_component
@both_versions
def test_outputs_read_between_set_and_step_follow_the_inputs_and_change_nothing(name, fmi):
    """What the annotation promises: read there, outputs are those of a step of length zero, and later ones are not touched."""
    reader, other = (Driver(native_fmu(name, fmi)).initialize(PARAMETERS[name]) for _ in range(2))
    plain = components()[name]()
    for variable, value in PARAMETERS[name].items():
        plain.set(variable, value)
    plain.initialize()
    outputs = [v for v in plain.variables.values() if v.causality == "output"]
    for i in range(STEPS):
        inputs = stimuli(name, i)
        for variable, value in inputs.items():
            plain.set(variable, value)
        plain.do_step(i * STEP, 0.0)
        reader.set(inputs)
        other.set(inputs)
        values = [getattr(plain, v.name) for v in outputs]
        expected = [float(x) for value in values for x in (value if isinstance(value, list) else [value])]
        assert reader.elements("output") == pytest.approx(expected, rel=1e-13, abs=1e-14)
        for driver in (reader, other):
            driver.step(i * STEP, STEP)
        assert reader.elements("output") == pytest.approx(other.elements("output"), rel=1e-13, abs=1e-14)
        plain.do_step(i * STEP, STEP)
    reader.close()
    other.close()


@pytest.mark.representatives(fmi=[3], platforms=[("this",)])
@pytest.mark.parametrize("platforms", [("this",), USUAL_PLATFORMS], ids=["this", "usual"])
@both_versions
def test_builds_are_the_same_to_the_byte(fmi, platforms, tmp_path, monkeypatch):
    """In another cache: kernels and libraries are compiled anew."""
    path = fmu_path("MassSpringDamper", fmi, platforms=platforms)
    monkeypatch.setenv("SHAPER_FMU_CACHE", str(tmp_path / "cache"))
    again = build_fmu(find_component("MassSpringDamper"), tmp_path, fmi=fmi, platforms=platforms)
    assert again.read_bytes() == path.read_bytes()
    assert path.stat().st_size < 1_000_000
