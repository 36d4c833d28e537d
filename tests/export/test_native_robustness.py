"""Native FMUs cannot be broken: what is illegal is refused in words, memory stays flat, and instances share nothing."""

from __future__ import annotations

import ctypes
import math
import os
import subprocess
import sys
from ctypes import byref, c_bool, c_double, c_uint32, c_void_p
from functools import lru_cache
from pathlib import Path

import pytest
from native_calls import ERROR, OK, Host, array, null_call
from native_fuzz import Fuzzer
from native_host import (
    HOSTS,
    SANITIZED,
    THREAD,
    binary_of,
    gcc,
    host_program,
    load,
    native_fmu,
    sanitized_library,
    signatures,
    token_of,
)

from shaper_fmu.registry import components, find_component

every_component = pytest.mark.parametrize("name", components())
both_versions = pytest.mark.parametrize("fmi", [2, 3])
both_kinds = pytest.mark.parametrize("exchange", [False, True], ids=["co_simulation", "model_exchange"])
CALLS = {"InputShaper": 2000, "PulseTrain": 5000}  # their design takes some milliseconds
STRANGE = [math.nan, math.inf, -math.inf]


@lru_cache
def other_states(name: str, fmi: int, exchange: bool) -> tuple[list[int], int]:
    """States of other components, and one of this component's instance for the other kind of simulation."""
    others = [Host(other, fmi) for other in ("PositionController", "MassSpringDamper", "InputShaper") if other != name]
    found = []
    for host in [*others, Host(name, fmi, not exchange)]:
        place = c_void_p()
        assert host.call("GetFMUState" if fmi == 3 else "GetFMUstate", byref(place)) == OK
        assert place.value
        found.append(place.value)
    return found[:-1], found[-1]


@every_component
@both_versions
@both_kinds
def test_random_calls_are_done_or_refused_as_the_standard_says(name, fmi, exchange):
    """20,000 calls of each component by each version, fewer where a start is slow; the same calls in every run."""
    for events in [False] if exchange or fmi == 2 else [False, True]:
        host = Host(name, fmi, exchange, events)
        calls = CALLS.get(name, 10_000) // (1 if exchange or fmi == 2 else 2)
        Fuzzer(host, f"{name}/{fmi}/{exchange}/{events}", *other_states(name, fmi, exchange)).run(calls)
        host.free()


def real_variables(host: Host, causality: str) -> list:
    return [v for v in host.variables if v.type in ("Real", "Float64") and v.causality == causality]


@every_component
@both_versions
def test_an_input_that_is_not_finite_stops_the_step_and_no_more(name, fmi):
    host = Host(name, fmi)
    expected = host.standard_run()
    for variable in real_variables(host, "input"):
        for value in STRANGE:
            assert host.call("Reset") == host.setup() == host.call("ExitInitializationMode") == host.put(variable, value) == OK
            assert host.step(0.0, 0.01) == ERROR
            assert f"{variable.name}{'[1]' if host.size(variable) > 1 else ''} is " in host.log[0][1]
            assert host.put(variable, host.starts(variable)[0]) == host.step(0.0, 0.01) == OK
    assert host.call("Reset") == OK
    assert host.standard_run() == expected
    host.free()


@every_component
@both_versions
def test_a_parameter_outside_its_domain_stops_the_initialization_and_no_more(name, fmi):
    """The domain is what the component declares (published bounds may be narrower); test_fmu_faults.py has bounds that are excluded."""
    host = Host(name, fmi)
    expected = host.standard_run()
    domains = find_component(name).variables
    for variable in real_variables(host, "parameter"):
        domain = domains[variable.name.split("[")[0]]
        outside = [
            bound + way * (1.0 + 0.01 * abs(bound)) for bound, way in ((domain.min, -1.0), (domain.max, 1.0)) if bound is not None
        ]
        for value in STRANGE + outside:
            assert host.call("Reset") == host.put(variable, value) == host.setup() == OK
            assert host.call("ExitInitializationMode") == ERROR
            assert variable.name in host.log[0][1]
            assert host.put(variable, host.starts(variable)[0]) == OK
    assert host.call("Reset") == OK
    assert host.standard_run() == expected
    host.free()


@every_component
@both_versions
def test_a_null_instance_is_an_error_for_every_function(name, fmi):
    library = load(native_fmu(name, fmi), fmi)
    for function, (result, arguments) in signatures(fmi).items():
        if result is ctypes.c_int:
            assert null_call(library, fmi, function) == ERROR, function
        elif arguments:  # Instantiate* gives no instance, and FreeInstance has nothing to free
            assert null_call(library, fmi, function) is None, function


@both_versions
def test_an_instance_without_a_logger_is_refused_in_silence(fmi):
    host = Host("MassSpringDamper", fmi)
    token = host.token
    if fmi == 2:
        instance = host.library.fmi2Instantiate(b"silent", 1, token, None, None, 0, 1)
    else:
        options = (False, True, False, False, None, 0, None, None, None)
        instance = host.library.fmi3InstantiateCoSimulation(b"silent", token, None, *options)
    host.free()
    host.instance = instance
    assert host.call("Terminate") == ERROR
    assert host.log == []
    assert host.standard_run()
    host.free()


@pytest.mark.parametrize("wanted", [None, math.nan, -math.inf, math.inf, 1e308, 0.0])
def test_inside_an_intermediate_update_nothing_can_be_changed(wanted):
    """The importer may only look; whatever else it calls is refused, even to free the instance, and the step goes on."""
    told: list[str] = []

    def update(environment, time, setting, getting, finished, early, requested, wanted_time):
        values = array(c_double, [0.0])
        reference = array(c_uint32, [next(v for v in host.variables if v.name == "pulse").valueReference])
        assert host.call("GetFloat64", reference, 1, values, 1) == OK
        for function, arguments in {
            "DoStep": (time, 0.1, True, *[byref(c_bool()) for _ in range(3)], byref(c_double())),
            "SetFloat64": (reference, 1, values, 1), "Reset": (), "Terminate": (), "GetFMUState": (byref(c_void_p()),),
            "EnterEventMode": (), "SetDebugLogging": (True, 0, None), "FreeInstance": (),
        }.items():  # fmt: skip
            assert host.call(function, *arguments) in (ERROR, None)
            told.extend(text for _, text in host.log)
        if wanted is not None:
            requested[0], wanted_time[0] = True, wanted

    host = Host("PulseTrain", 3, update=update)
    plain = Host("PulseTrain", 3)
    for one in (host, plain):
        assert one.setup() == one.call("ExitInitializationMode") == one.step(0.0, 0.5) == OK
    assert told
    assert all("during an intermediate update" in text for text in told)
    assert len(told) % 8 == 0
    assert host.answers[3].value == 0.5  # early return was not agreed on
    assert host.all_values()[1:] == plain.all_values()[1:]
    host.free()
    plain.free()


@pytest.mark.skipif(not SANITIZED, reason="for the run of test_native_sanitized.py alone")
def test_the_sanitizer_is_there():
    native = binary_of(native_fmu("MassSpringDamper", 2))
    load(native_fmu("MassSpringDamper", 2), 2)
    assert "libasan" in Path("/proc/self/maps").read_text()
    assert b"__asan_report_load8" in native.read_bytes()


ALL_IN_ONE_PROCESS = """
import ctypes, functools
import native_calls
native_calls.load = functools.partial(native_calls.load, mode=ctypes.RTLD_GLOBAL)
hosts = [native_calls.Host(name, fmi) for name in native_calls.components() for fmi in (2, 3)]
for host in hosts:
    print(host.name, host.fmi, host.standard_run())
"""


def test_all_libraries_live_in_one_process_whatever_way_they_are_loaded():
    """A library that is loaded with RTLD_GLOBAL offers its symbols to those loaded later: none may take another's."""
    alone = []
    for name in components():
        for fmi in (2, 3):
            host = Host(name, fmi)
            alone.append(f"{name} {fmi} {host.standard_run()}")
            host.free()
    here = {**os.environ, "PYTHONPATH": os.pathsep.join([str(Path(__file__).parent), *sys.path])}
    command = [sys.executable, "-c", ALL_IN_ONE_PROCESS]
    run = subprocess.run(command, env=here, capture_output=True, text=True, check=False)
    assert run.returncode == 0, run.stderr
    assert run.stdout.splitlines() == alone


# memory and threads


def run_host(command: list[str | Path]) -> str:
    done = subprocess.run(command, capture_output=True, text=True, check=False, timeout=600)
    assert done.returncode == 0, done.stderr
    return done.stdout


@pytest.mark.skipif(SANITIZED, reason="AddressSanitizer holds back what is freed, so that memory grows")
@pytest.mark.parametrize(
    ("name", "instances", "states"), [("MassSpringDamper", 100_000, 1_000_000), ("InputShaper", 20_000, 1_000)]
)
@both_versions
def test_memory_stays_flat(name, instances, states, fmi, capsys):
    """One block lost in each life or state of MassSpringDamper, 24 bytes at least, would be 2.4 MB or 24 MB."""
    fmu = native_fmu(name, fmi)
    arguments = [str(fmi), token_of(fmu), str(instances), str(states)]
    before, after, states_before, states_after = map(int, run_host([host_program("memory.c"), binary_of(fmu), *arguments]).split())
    with capsys.disabled():
        print(
            f"\n{name}, FMI {fmi}: {instances} instances {before} -> {after} kB, {states} states {states_before} -> {states_after} kB"
        )
    assert after - before < 1000
    assert states_after - states_before < 1000


def thread_arguments(name: str, fmi: int) -> list[str]:
    """Version, token, an output and its size, an input without bounds or -1 and its size, and a number of steps."""
    fmu = native_fmu(name, fmi)
    host = Host(name, fmi)
    output = next((v.valueReference, host.size(v)) for v in real_variables(host, "output"))
    free = [v for v in real_variables(host, "input") if v.min is None and v.max is None]
    inputs = [*[(v.valueReference, host.size(v)) for v in free], (-1, 0)]
    host.free()
    return [str(fmi), token_of(fmu), *map(str, (*output, *inputs[0], 300))]


@every_component
@both_versions
def test_instances_in_eight_threads_give_what_they_give_one_by_one(name, fmi):
    command = [host_program("threads.c"), binary_of(native_fmu(name, fmi)), *thread_arguments(name, fmi)]
    alone = run_host([*command, "serial"])
    assert len(set(alone.split())) > 1  # it moves
    assert run_host(command) == alone


@pytest.mark.skipif(SANITIZED, reason="ThreadSanitizer and AddressSanitizer exclude each other")
@every_component
@both_versions
def test_instances_in_threads_share_no_memory(name, fmi, tmp_path):
    """ThreadSanitizer sees every access of the layer and of the kernels."""
    library = sanitized_library(components()[name], token_of(native_fmu(name, fmi)), fmi, THREAD)
    gcc([*THREAD, f"-I{HOSTS}", str(HOSTS / "threads.c"), "-o", str(tmp_path / "threads"), "-ldl", "-lm", "-lpthread"])
    done = subprocess.run(
        [tmp_path / "threads", library, *thread_arguments(name, fmi)], capture_output=True, text=True, check=False
    )
    assert (done.returncode, done.stderr) == (0, "")
