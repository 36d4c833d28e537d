"""Runs of FMUs and SSP archives by other people's masters: libcosim and ecos, and FMUs step by step by fmpy's calls.

Each run takes place in a process of its own, `python other_masters.py MASTER REQUEST ANSWER`, since these masters are C++
libraries with loaders, threads and log streams of their own. The two files are JSON, which keeps every bit of a number;
standard output belongs to the masters.
"""

from __future__ import annotations

import csv
import functools
import itertools
import json
import math
import os
import subprocess
import sys
from collections.abc import Mapping, Sequence
from dataclasses import asdict, dataclass, field
from importlib.metadata import distribution
from pathlib import Path
from typing import Any

Value = float | int | bool

INSTANCE = "instance"
"""The name of the one instance where an FMU is run alone; ecos's command line calls it so."""


@dataclass(frozen=True)
class Job:
    """A run of an FMU alone, or of an SSP archive, over `steps` steps of `step` [s]."""

    path: str
    step: float
    steps: int
    record: list[tuple[str, str, str]]  # instance, variable, kind: real, integer or boolean
    # of an FMU run alone: inputs, constant from t = 0 on or a list with a value for each step, and start values of parameters;
    # a value is of the Python type of its variable
    drive: Mapping[str, Value | Sequence[Value]] = field(default_factory=dict)
    start: Mapping[str, Value] = field(default_factory=dict)
    # of fmpy alone: the ends of all steps [s] in place of equal ones, and FMI 3.0's event mode with early return
    ends: list[float] = field(default_factory=list)
    events: bool = False

    def inputs(self, step: int) -> dict[str, Value]:
        """The inputs that this step, counted from 0, has to set: all at first, then those that differ from the step before."""
        now, before = ({n: v[i] if isinstance(v, Sequence) else v for n, v in self.drive.items()} for i in (step, max(step - 1, 0)))
        return {name: value for name, value in now.items() if step == 0 or value != before[name]}


@dataclass(frozen=True)
class Run:
    """What a master gave: its times [s] before the first step and after each, the values after each step, and its log.

    Of fmpy with event mode also the times [s] at which a step ended for an event.
    """

    times: list[float]
    rows: list[list[float]]
    log: str
    events: list[float] = field(default_factory=list)


def run_jobs(master: str, jobs: dict[str, Job], folder: Path) -> dict[str, Run]:
    """Run all jobs by one master in one process. A job that fails, or a crash, is an AssertionError with the master's log."""
    request, answer = folder / f"{master}_request.json", folder / f"{master}_answer.json"
    request.write_text(json.dumps({name: asdict(job) for name, job in jobs.items()}))
    command = [sys.executable, __file__, master, str(request), str(answer)]
    environment = dict(os.environ)
    if master == "ecos":
        environment["LD_LIBRARY_PATH"] = ":".join(filter(None, [str(tbb_folder()), environment.get("LD_LIBRARY_PATH", "")]))
    run = functools.partial(subprocess.run, command, capture_output=True, text=True, timeout=900, env=environment, cwd=folder)
    done = run()
    if done.returncode < 0:  # ecos has ended by a signal once in some hundred runs, which did not come back
        print(f"{master} was ended by signal {-done.returncode}: {done.stdout}{done.stderr}")
        done = run()
    log = f"{done.stdout}{done.stderr}"
    assert done.returncode == 0, f"status {done.returncode}: {log}"
    return {name: Run(**found, log=log) for name, found in json.loads(answer.read_text()).items()}


def tbb_folder() -> Path:
    """The folder of the library libtbb, which the package tbb brings and ecos needs."""
    found = [file for file in distribution("tbb").files or [] if file.name == "libtbb.so.12"]
    assert found, "the package tbb has no libtbb.so.12"
    return Path(str(distribution("tbb").locate_file(found[0]))).resolve().parent


def kind_of(value: Value) -> str:
    return "boolean" if isinstance(value, bool) else "integer" if isinstance(value, int) else "real"


def run_libcosim(job: Job) -> dict[str, Any]:
    """A run by libcosim's fixed-step algorithm, whose times are whole nanoseconds."""
    from libcosimpy.CosimExecution import CosimExecution
    from libcosimpy.CosimLogging import CosimLogLevel, log_output_level
    from libcosimpy.CosimManipulator import CosimManipulator
    from libcosimpy.CosimObserver import CosimObserver
    from libcosimpy.CosimSlave import CosimLocalSlave

    log_output_level(CosimLogLevel.WARNING)
    step = round(job.step * 1e9)
    if job.path.endswith(".ssp"):
        execution = CosimExecution.from_ssp_file(job.path, step)
    else:
        execution = CosimExecution.from_step_size(step)
        assert execution.add_local_slave(CosimLocalSlave(job.path, INSTANCE)) == 0
    observer, override = CosimObserver.create_last_value(), CosimManipulator.create_override()
    assert execution.add_observer(observer)
    assert execution.add_manipulator(override)
    slaves = {info.name.decode(): info.index for info in execution.slave_infos()}
    references = {
        (name, variable.name.decode()): variable.reference
        for name, index in slaves.items()
        for variable in execution.slave_variables(index)
    }
    first = {
        "real": execution.real_initial_value,
        "integer": execution.integer_initial_value,
        "boolean": execution.boolean_initial_value,
    }
    for name, value in job.start.items():
        assert first[kind_of(value)](slaves[INSTANCE], references[INSTANCE, name], value)
    write = {"real": override.slave_real_values, "integer": override.slave_integer_values, "boolean": override.slave_boolean_values}
    read = {"real": observer.last_real_values, "integer": observer.last_integer_values, "boolean": observer.last_boolean_values}
    times, rows = [0], []
    for step_number in range(job.steps):
        for name, value in job.inputs(step_number).items():
            assert write[kind_of(value)](slaves[INSTANCE], [references[INSTANCE, name]], [value])
        assert execution.step()
        times.append(execution.status().current_time)
        rows.append([read[kind](slaves[name], [references[name, variable]])[0] for name, variable, kind in job.record])
    return {"times": [time / 1e9 for time in times], "rows": rows}


def run_ecos(job: Job) -> dict[str, Any]:
    """A run by ecos through its Python interface, with its default algorithm."""
    from ecospy import EcosSimulation, EcosSimulationStructure
    from ecospy.lib import EcosLib

    EcosLib.set_log_level("warn")
    if job.path.endswith(".ssp"):
        simulation = EcosSimulation(job.step, ssp_path=job.path)
    else:
        structure = EcosSimulationStructure()
        structure.add_model(INSTANCE, job.path)
        structure.add_parameter_set("nominal", {f"{INSTANCE}::{name}": value for name, value in job.start.items()})
        simulation = EcosSimulation(job.step, structure=structure)
    assert simulation.init(parameter_set="nominal"), EcosLib.get_last_error()
    write = {"real": simulation.set_real, "integer": simulation.set_integer, "boolean": simulation.set_bool}
    read = {"real": simulation.get_real, "integer": simulation.get_integer, "boolean": simulation.get_bool}
    times, rows = [simulation.get_time()], []
    for step_number in range(job.steps):
        for name, value in job.inputs(step_number).items():
            write[kind_of(value)](f"{INSTANCE}::{name}", value)
        times.append(simulation.step())
        rows.append([read[kind](f"{name}::{variable}") for name, variable, kind in job.record])
    simulation.terminate()
    simulation.free()
    return {"times": times, "rows": rows}


def run_fmpy(job: Job) -> dict[str, Any]:
    """A run of an FMU by fmpy's calls, over steps that end where the job says; inputs change in event mode where there is one."""
    from native_drivers import Driver

    driver = Driver(Path(job.path), **({"eventModeUsed": True, "earlyReturnAllowed": True} if job.events else {}))
    driver.initialize(dict(job.start))
    times = [0.0, *(job.ends or [(i + 1) * job.step for i in range(job.steps)])]
    rows, events = [], []
    for step_number, (t, end) in enumerate(itertools.pairwise(times)):
        changed = job.inputs(step_number)
        if job.events and changed and step_number > 0:
            driver.slave.enterEventMode()
        driver.set(changed)
        if job.events and (changed or step_number == 0):
            driver.leave_event_mode()
        while t < end:
            event, reached = driver.step(t, end - t)
            t = reached if event else end
            assert event or math.isclose(reached, end, rel_tol=1e-14), f"returned at {reached} s of {end} s without an event"
            if event:
                events.append(t)
                driver.handle_event()
        rows.append([driver.get(variable) for _, variable, _ in job.record])
    driver.slave.terminate()
    driver.close()
    return {"times": times, "rows": rows, "events": events}


ECOS = "http://github.com/Ecos-platform/libecos/resources/schema"


def run_ecos_program(program: Path, job: Job, folder: Path) -> tuple[list[dict[str, str]], str]:
    """A run of an FMU by ecos's command line, in an environment that has nothing of Python's.

    Returns the lines of the CSV file that it writes, and what its dynamic loader tells of all files that it opened.
    """
    columns = "".join(f'<ecos:variable name="{variable}"/>' for _, variable, _ in job.record)
    (folder / "columns.xml").write_text(
        f'<ecos:CsvConfig xmlns:ecos="{ECOS}/CsvConfig.xsd"><ecos:components><ecos:component name="{INSTANCE}">{columns}'
        "</ecos:component></ecos:components></ecos:CsvConfig>"
    )
    options = [f"--path={job.path}", f"--stepSize={job.step!r}", f"--stopTime={(job.steps + 0.5) * job.step!r}"]
    options.append("--csvConfig=columns.xml")
    if job.drive:
        values = "".join(
            f'<ecos:variable id="{INSTANCE}::{name}"><ecos:{kind_of(value)} value="{str(value).lower()}"/></ecos:variable>'
            for name, value in job.inputs(0).items()
        )
        (folder / "inputs.xml").write_text(
            f'<ecos:Scenario xmlns:ecos="{ECOS}/ScenarioConfig"><ecos:action t="0">{values}</ecos:action></ecos:Scenario>'
        )
        options.append("--scenarioConfig=inputs.xml")
    alone = {"LD_LIBRARY_PATH": str(tbb_folder()), "LD_DEBUG": "files", "LD_DEBUG_OUTPUT": str(folder / "opened")}
    command = [str(program), "simulate", *options]
    done = subprocess.run(command, capture_output=True, text=True, timeout=900, env=alone, cwd=folder)
    assert done.returncode == 0, done.stdout + done.stderr
    (written,) = folder.glob("*.csv")
    with written.open(newline="") as file:
        lines = list(csv.DictReader(file, skipinitialspace=True))
    return lines, "".join(path.read_text() for path in folder.glob("opened.*"))


SSP = "http://ssp-standard.org/SSP1/SystemStructure"


def write_system(
    folder: Path, sources: dict[str, str], connections: list[tuple[str, str]], parameters: dict[str, dict[str, float]]
) -> None:
    """The folder of an SSP archive as both masters read it: one flat system, these very prefixes, a parameter set for each
    component. `sources` names the FMUs; connections are between "instance.variable"s of type Real."""
    (folder / "resources").mkdir(parents=True)
    ends = [(*start.split("."), *end.split(".")) for start, end in connections]
    elements = ""
    for name, source in sources.items():
        connectors = [(end[1], "output") for end in ends if end[0] == name] + [(end[3], "input") for end in ends if end[2] == name]
        declared = "".join(f'<ssd:Connector name="{c}" kind="{kind}"><ssc:Real/></ssd:Connector>' for c, kind in connectors)
        elements += (
            f'<ssd:Component name="{name}" type="application/x-fmu-sharedlibrary" source="resources/{source}.fmu">'
            f"<ssd:Connectors>{declared}</ssd:Connectors><ssd:ParameterBindings>"
            f'<ssd:ParameterBinding source="resources/{name}.ssv"/></ssd:ParameterBindings></ssd:Component>'
        )
        values = "".join(
            f'<ssv:Parameter name="{key}"><ssv:Real value="{value!r}"/></ssv:Parameter>' for key, value in parameters[name].items()
        )
        (folder / "resources" / f"{name}.ssv").write_text(
            f'<ssv:ParameterSet xmlns:ssv="{SSP}ParameterValues" version="1.0" name="nominal">'
            f"<ssv:Parameters>{values}</ssv:Parameters></ssv:ParameterSet>"
        )
    names = ("startElement", "startConnector", "endElement", "endConnector")
    wires = "".join(
        "<ssd:Connection " + " ".join(f'{key}="{value}"' for key, value in zip(names, end, strict=True)) + "/>" for end in ends
    )
    (folder / "SystemStructure.ssd").write_text(
        f'<ssd:SystemStructureDescription xmlns:ssd="{SSP}Description" xmlns:ssc="{SSP}Common" version="1.0" '
        f'name="{folder.name}"><ssd:System name="root"><ssd:Elements>{elements}</ssd:Elements>'
        f"<ssd:Connections>{wires}</ssd:Connections></ssd:System>"
        '<ssd:DefaultExperiment startTime="0" stopTime="2"/></ssd:SystemStructureDescription>'
    )


def main() -> None:
    """Answer the request named on the command line."""
    master, request, answer = sys.argv[1:]
    run = {"libcosim": run_libcosim, "ecos": run_ecos, "fmpy": run_fmpy}[master]
    jobs = {name: Job(**job) for name, job in json.loads(Path(request).read_text()).items()}
    Path(answer).write_text(json.dumps({name: run(job) for name, job in jobs.items()}))


if __name__ == "__main__":
    main()
