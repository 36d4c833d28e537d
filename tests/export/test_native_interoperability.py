"""Native FMUs in other people's masters: libcosim (FMI 2.0), ecos (FMI 2.0 and 3.0) and ecos's command line, without Python.

Each master runs every component of the registry; what it reads is compared with the plain Python component, driven over
the master's own communication points. Both masters call the same mathematics library as Python, so there is no tolerance.
"""

from __future__ import annotations

import enum
import importlib.util
import itertools
import os
import platform
import re
import shutil
import sys
from dataclasses import replace
from functools import lru_cache
from importlib.metadata import distribution
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from other_masters import INSTANCE, Job, Run, run_ecos_program, run_jobs, write_system
from trial_runs import PARAMETERS

from shaper_fmu.component import Component
from shaper_fmu.export.build import fmu_path
from shaper_fmu.registry import components
from shaper_fmu.ssp.archive import load_ssp, pack_ssp

COMPONENTS = components()
STEPS = 100
PACKAGES = {"libcosim": ("libcosimpy",), "ecos": ("ecospy", "tbb")}
every_component = pytest.mark.parametrize("name", COMPONENTS)
held_or_driven = pytest.mark.parametrize("driven", [False, True], ids=["at_start_values", "driven"])

pytestmark = pytest.mark.skipif(
    sys.platform != "linux" or platform.machine() != "x86_64",
    reason="the masters are run from their packages' binaries for Linux on x86-64",
)


def require(master: str) -> None:
    """Skip where the master is not installed; in continuous integration that is a failure."""
    missing = [name for name in PACKAGES[master] if not _installed(name)]
    if missing and os.environ.get("CI"):
        pytest.fail(f"{' and '.join(missing)} must be installed here: pip install shaper-fmu[interop]")
    if missing:
        pytest.skip(f"{' and '.join(missing)} not installed: pip install shaper-fmu[interop]")


def _installed(name: str) -> bool:
    if name == "tbb":  # libraries without a module
        return any(found.stem.startswith("tbb-") for path in sys.path for found in Path(path).glob("tbb-*.dist-info"))
    return importlib.util.find_spec(name) is not None


def inputs(component: type[Component], driven: bool, fmi: int) -> dict[str, float | bool]:
    """A constant for each input, all different and small, so that a controller works within its limits, or True; or none.

    Elements of arrays in FMI 2.0 alone: these masters do not set arrays of FMI 3.0.
    """
    found = [v for v in component.variables.values() if v.causality == "input" and (v.size is None or fmi == 2)]
    kinds = [(label, v.kind) for v in found for label in v.scalar_names]
    return {name: 0.1 / (1 + place) if kind is float else True for place, (name, kind) in enumerate(kinds)} if driven else {}


def start_values(component: type[Component], fmi: int) -> dict[str, float | int]:
    """Values of parameters that these masters can set: of no enumeration, and in FMI 3.0 of no array."""
    found = {name: component.variables[name.split("[")[0]] for name in PARAMETERS.get(component.__name__, {})}
    known = {name: v for name, v in found.items() if not issubclass(v.kind, enum.IntEnum) and (v.size is None or fmi == 2)}
    return {name: v.kind(PARAMETERS[component.__name__][name]) for name, v in known.items()}


def outputs(component: type[Component], fmi: int) -> list[tuple[str, str, str]]:
    kinds = {float: "real", bool: "boolean"}
    found = [v for v in component.variables.values() if v.causality == "output" and (v.size is None or fmi == 2)]
    return [(INSTANCE, label, kinds.get(v.kind, "integer")) for v in found for label in v.scalar_names]


def plain_rows(component: type[Component], job: Job, times: list[float], step: float | None) -> list[list[Any]]:
    """Outputs of the plain Python object after each step between these times [s]; of `step` [s], or of the times' differences."""
    instance = component()
    for name, value in job.start.items():
        instance.set(name, value)
    instance.initialize(times[0])
    for name, value in job.drive.items():
        instance.set(name, value)
    rows = []
    for t, following in itertools.pairwise(times):
        instance.do_step(t, following - t if step is None else step)
        rows.append([element_of(instance, label) for _, label, _ in job.record])
    return rows


def element_of(instance: Component, label: str) -> Any:
    """The value of a scalar, or of an element "x[2]"."""
    name, _, index = label.rstrip("]").partition("[")
    return getattr(instance, name)[int(index) - 1] if index else getattr(instance, name)


def bits(rows: list[list[Any]]) -> list[list[str]]:
    return [[float(value).hex() for value in row] for row in rows]


@lru_cache
def job(name: str, fmi: int, driven: bool) -> Job:
    """As everything starts, or with inputs driven and parameters set."""
    component = COMPONENTS[name]
    path = str(fmu_path(name, fmi=fmi, platforms=["this"]))
    start = start_values(component, fmi) if driven else {}
    return Job(path, component.default_step_size, STEPS, outputs(component, fmi), inputs(component, driven, fmi), start)


@pytest.fixture(scope="module")
def libcosim_runs(tmp_path_factory) -> dict[str, Run]:
    require("libcosim")
    jobs = {f"{name} {driven}": job(name, 2, driven) for name in COMPONENTS for driven in (False, True)}
    return run_jobs("libcosim", jobs, tmp_path_factory.mktemp("libcosim"))


@pytest.fixture(scope="module")
def ecos_runs(tmp_path_factory) -> dict[str, Run]:
    require("ecos")
    cases = [(name, fmi, driven) for name in COMPONENTS for fmi in (2, 3) for driven in (False, True)]
    jobs = {f"{name} {fmi} {driven}": job(name, fmi, driven) for name, fmi, driven in cases}
    return run_jobs("ecos", jobs, tmp_path_factory.mktemp("ecos"))


@every_component
@held_or_driven
def test_libcosim_gives_the_bits_of_plain_python(libcosim_runs, name, driven):
    """libcosim steps by the difference of two communication points, not by a constant."""
    run = libcosim_runs[f"{name} {driven}"]
    expected = plain_rows(COMPONENTS[name], job(name, 2, driven), run.times, None)
    assert bits(run.rows) == bits(expected)
    assert run.times == [round(i * COMPONENTS[name].default_step_size * 1e9) / 1e9 for i in range(STEPS + 1)]
    assert not driven or len({tuple(row) for row in run.rows}) > 2  # something happens


def test_libcosims_parser_finds_no_fault_in_a_model_description(libcosim_runs):
    """Nothing is logged at the level of warnings or above, except that libcosim leaves out variables of enumerations."""
    log = next(iter(libcosim_runs.values())).log
    lines = [line for line in log.splitlines() if "Enumeration variable type not supported" not in line]
    assert lines == []


@every_component
@pytest.mark.parametrize("fmi", [2, 3])
@held_or_driven
def test_ecos_gives_the_bits_of_plain_python(ecos_runs, name, fmi, driven):
    """ecos adds up its time and steps by a constant."""
    run, step = ecos_runs[f"{name} {fmi} {driven}"], COMPONENTS[name].default_step_size
    assert bits(run.rows) == bits(plain_rows(COMPONENTS[name], job(name, fmi, driven), run.times, step))
    assert run.times == pytest.approx([i * step for i in range(STEPS + 1)], rel=1e-12)
    assert not driven or not outputs(COMPONENTS[name], fmi) or len({tuple(row) for row in run.rows}) > 2


def test_ecos_finds_no_fault_in_a_model_description(ecos_runs):
    """Known words: its reader of FMI 3.0 asks for fmi3GetVersion before it loads the library, and leaves out enumerations."""
    log = next(iter(ecos_runs.values())).log
    known = (
        r'Function "fmi3GetVersion" is not provided by this FMU\.|Loading FMI version 3\.\.\.|.*is of unsupported type, skipping\.'
    )
    assert [line for line in log.splitlines() if not re.fullmatch(known, line)] == []


# ecos's command line: a C++ program, in an environment without anything of Python's


@pytest.fixture(scope="module")
def ecos_program(tmp_path_factory) -> Path:
    """The program that the package ecospy carries, copied, since it comes without permission to run."""
    require("ecos")
    found = distribution("ecospy").locate_file("ecospy/binaries/ecos")
    program = tmp_path_factory.mktemp("program") / "ecos"
    shutil.copy(str(found), program)
    program.chmod(0o755)
    return program


@every_component
@pytest.mark.parametrize("fmi", [2, 3])
def test_ecos_simulates_without_any_python_in_the_process(ecos_program, tmp_path, name, fmi):
    component = COMPONENTS[name]
    task = replace(job(name, fmi, driven=True), start={})
    lines, opened = run_ecos_program(ecos_program, task, tmp_path)
    assert f"{name}.so" in opened  # the list holds what is opened while the program runs
    assert "libpython" not in opened
    times = list(itertools.accumulate([0.0] + [task.step] * STEPS))  # as ecos adds up its time
    expected = plain_rows(component, task, times, task.step)
    codes = {"real": "REAL", "integer": "INT", "boolean": "BOOL"}
    for line, row in zip(lines[1 : STEPS + 1], expected, strict=True):  # the first line holds the start
        for (_, label, kind), value in zip(task.record, row, strict=True):
            # C++ writes a real with six decimals, correctly rounded, as Python does: the texts are equal
            text = f"{value:.6f}" if kind == "real" else str(int(value))
            assert line[f"{INSTANCE}::{label}[{codes[kind]}]"] == text


# A system as an SSP archive: numbers as parameters only, since neither master reads ssv:Enumeration

SOURCES = {"profile": "MotionProfile", "shaper": "InputShaper", "plant": "MassSpringDamper"}
CONNECTIONS = [("profile.position", "shaper.command"), ("shaper.shaped", "plant.force")]
VALUES = {
    "profile": {"distance": 0.3, "duration": 0.8, "start_time": 0.05},
    "shaper": {"natural_frequency[1]": 9.0, "damping_ratio[1]": 0.05},
    "plant": {"mass": 1.3, "stiffness": 105.3, "damping": 1.17},
}
RECORDED = ["profile.position", "shaper.shaped", "plant.position", "plant.velocity"]
LATE_READING = ("ecos", "shaper.shaped")


@pytest.mark.parametrize("master", PACKAGES)
def test_a_system_of_native_fmus_runs_from_its_ssp_archive(master, fmus, tmp_path):
    """The other masters' algorithm is our "parallel" one on fixed steps: an input is what its source gave at the end of the
    step before, and no step ends at an event.

    libcosim shows the outputs as they were then. ecos reads what it shows when the inputs are already set to their new
    values, and there `shaped`, which follows its command without delay, is what our "jacobi" algorithm gives.
    """
    require(master)
    write_system(tmp_path / "shaped_move", SOURCES, CONNECTIONS, VALUES)
    archive = pack_ssp(tmp_path / "shaped_move", fmus)
    step, steps = 0.01, 200
    record = [(instance, variable, "real") for instance, variable in (name.split(".") for name in RECORDED)]
    run = run_jobs(master, {"system": Job(str(archive), step, steps, record)}, tmp_path)["system"]
    system = load_ssp(archive).system
    ours = system.simulate(steps * step, step, algorithm="parallel", exact=False, record=RECORDED)
    undelayed = system.simulate(steps * step, step, exact=False, record=RECORDED)
    for place, name in enumerate(RECORDED):
        found, shown = np.array([row[place] for row in run.rows]), undelayed if (master, name) == LATE_READING else ours
        assert np.max(np.abs(found - shown[name][1:])) <= 1e-12 * np.max(np.abs(found))
        if name.startswith("plant"):  # the delay through the shaper is there, and far above rounding
            assert np.max(np.abs(found - undelayed[name][1:])) > 1e-2 * np.max(np.abs(found))
