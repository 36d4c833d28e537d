"""The other masters at their work, each in a process of its own: python peers.py MASTER ARCHIVE STEPS STEP ANSWER.

Each master runs the system of the SSP archive in one or several ways; a way gives the seconds of a step, and the plant's
position after each step. Loading, instantiation and initialization are not timed. A way is taken several times, in turn
with the others, free as well as held on one core: masters with threads may be the faster there, since theirs then wait for
nothing. The answer is JSON: way -> [median of the seconds in the better of the two, positions].
"""

from __future__ import annotations

import csv
import json
import os
import sys
import time
from collections.abc import Callable
from pathlib import Path
from statistics import median

PASSES = 3

Outcome = tuple[float, list[float]]
Ways = dict[str, Callable[[], Outcome]]


def now() -> tuple[float, float]:
    """Seconds by the clock on the wall, and of this process on processors."""
    return time.perf_counter(), time.process_time()


def since(begin: tuple[float, float]) -> float:
    """Seconds by the clock that tells less: on a busy machine the process's, with threads at work the other."""
    return min(b - a for a, b in zip(begin, now(), strict=True))


def ecos(archive: Path, steps: int, step: float) -> Ways:
    """By ecos: step by step from Python with results read in full, by its own writer of CSV, and without any results."""
    from ecospy import EcosSimulation
    from ecospy.lib import EcosLib

    EcosLib.set_log_level("warn")

    def initialized(table: Path | None = None) -> EcosSimulation:
        simulation = EcosSimulation(step, ssp_path=str(archive))
        if table:
            simulation.add_csv_writer(str(table), identifiers=["plant::position"])
        if not simulation.init():
            raise SystemExit(EcosLib.get_last_error())
        return simulation

    def end(simulation: EcosSimulation) -> None:
        simulation.terminate()
        simulation.free()

    def loop() -> Outcome:
        simulation = initialized()
        advance, read = simulation.step, simulation.get_real
        positions = []
        begin = now()
        for _ in range(steps):
            advance()
            positions.append(read("plant::position"))
        taken = since(begin)
        end(simulation)
        return taken / steps, positions

    def table() -> Outcome:
        path = archive.with_name("ecos.csv")
        path.unlink(missing_ok=True)
        simulation = initialized(path)
        begin = now()
        simulation.step(steps)
        taken = since(begin)
        end(simulation)
        with path.open(newline="") as file:
            lines = list(csv.reader(file))
        return taken / steps, [float(line[-1]) for line in lines[2 : steps + 2]]  # a header, and the start

    def unrecorded() -> Outcome:
        simulation = initialized()
        begin = now()
        simulation.step(steps)
        taken = since(begin)
        last = simulation.get_real("plant::position")
        end(simulation)
        return taken / steps, [last]

    return {"loop": loop, "table": table, "unrecorded": unrecorded}


def libcosim(archive: Path, steps: int, step: float) -> Ways:
    """By libcosim with its observer of time series, which keeps the one variable in memory."""
    from libcosimpy.CosimEnums import CosimVariableType
    from libcosimpy.CosimExecution import CosimExecution
    from libcosimpy.CosimLogging import CosimLogLevel, log_output_level
    from libcosimpy.CosimObserver import CosimObserver

    log_output_level(CosimLogLevel.ERROR)

    def series() -> Outcome:
        execution = CosimExecution.from_ssp_file(str(archive), round(step * 1e9))
        observer = CosimObserver.create_time_series(steps + 1)
        plant = next(info.index for info in execution.slave_infos() if info.name == b"plant")
        position = next(v.reference for v in execution.slave_variables(plant) if v.name == b"position")
        started = execution.add_observer(observer) and observer.start_time_series(plant, position, CosimVariableType.REAL)
        if not (started and execution.step()):  # the first step initializes
            raise SystemExit("libcosim does not start")
        begin = now()
        done = execution.step(steps - 1)
        _, _, positions = observer.time_series_real_samples(plant, position, 1, steps)
        taken = since(begin)
        if not done:
            raise SystemExit("libcosim does not step")
        return taken / (steps - 1), list(positions)

    return {"series": series}


def fmpy_loop(archive: Path, steps: int, step: float) -> Ways:
    """By a plain loop in Python over fmpy's slaves."""
    import fmpy
    from fmpy.fmi2 import FMU2Slave

    files = {"profile": "MotionProfile", "shaper": "InputShaper", "plant": "MassSpringDamper"}
    folder = fmpy.extract(str(archive))
    slaves, references = {}, {}
    for name, file in files.items():
        path = f"{folder}/resources/{file}.fmu"
        description = fmpy.read_model_description(path, validate=False)
        slaves[name] = FMU2Slave(guid=description.guid, unzipDirectory=fmpy.extract(path), modelIdentifier=file, instanceName=name)
        slaves[name].instantiate()
        references[name] = {v.name: v.valueReference for v in description.modelVariables}

    def loop() -> Outcome:
        for slave in slaves.values():
            slave.reset()
            slave.setupExperiment()
            slave.enterInitializationMode()
            slave.exitInitializationMode()
        profile, shaper, plant = slaves.values()
        source, command = [references["profile"]["position"]], [references["shaper"]["command"]]
        output, force = [references["shaper"]["shaped"]], [references["plant"]["force"]]
        result = [references["plant"]["position"]]
        move, shaped, positions = profile.getReal(source), shaper.getReal(output), []
        begin = now()
        for i in range(steps):
            shaper.setReal(command, move)
            plant.setReal(force, shaped)
            for slave in (profile, shaper, plant):
                slave.doStep(i * step, step)
            move, shaped = profile.getReal(source), shaper.getReal(output)
            positions.append(plant.getReal(result)[0])
        return since(begin) / steps, positions

    return {"loop": loop}


def fmpy_ssp(archive: Path, steps: int, step: float) -> Ways:
    """By fmpy's simulate_ssp, which loads, runs and closes: what more steps take more."""
    from fmpy.ssp.simulation import simulate_ssp

    def timed(count: int) -> tuple[float, list[float]]:
        begin = now()
        rows = simulate_ssp(str(archive), stop_time=(count - 0.5) * step, step_size=step)  # it adds up its time
        return since(begin), rows["plant.position"].tolist()

    def difference() -> Outcome:
        few = steps // 10
        short, _ = timed(few)
        long, positions = timed(steps)
        return (long - short) / (steps - few), positions

    return {"difference": difference}


def main() -> None:
    """Answer the request of the command line."""
    master, archive, steps, step, answer = sys.argv[1:]
    ways = {"ecos": ecos, "libcosim": libcosim, "fmpy_loop": fmpy_loop, "fmpy_ssp": fmpy_ssp}[master](
        Path(archive), int(steps), float(step)
    )
    cores = os.sched_getaffinity(0) if hasattr(os, "sched_getaffinity") else {0}
    taken: dict[str, list[float]] = {way: [] for way in ways}
    positions: dict[str, list[float]] = {}
    for held in [cores, {min(cores)}] if len(cores) > 1 else [cores]:
        if len(cores) > 1:
            os.sched_setaffinity(0, held)
        seconds: dict[str, list[float]] = {way: [] for way in ways}
        for _ in range(PASSES):
            for way, run in ways.items():
                one, positions[way] = run()
                seconds[way].append(one)
        for way, found in seconds.items():
            taken[way].append(median(found))
    Path(answer).write_text(json.dumps({way: [min(taken[way]), positions[way]] for way in ways}))


if __name__ == "__main__":
    main()
