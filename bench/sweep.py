"""Sweeps: against a plain loop over fmpy's slaves, two workers against one, and what the store takes.

A sweep is 10 000 runs of 1000 steps: a ZV shaper is given 100 N at t = 0 and drives a lightly damped plant, whose stiffness varies
over +-50 %; metrics are the residual vibration and the largest displacement. The convention is that of a plain loop: an input is
what its source gave at the end of the step before (`algorithm="parallel"`), and no step ends at an event (`exact=False`).
"""

from __future__ import annotations

import os
import time
from collections.abc import Callable, Iterable
from dataclasses import replace
from itertools import islice
from pathlib import Path
from typing import TypeVar

from harness import Measured, Row, alone, compared
from rich.console import Console

from shaper_fmu.export.build import fmu_path
from shaper_fmu.metrics.peak import Peak
from shaper_fmu.metrics.residual import Residual
from shaper_fmu.progress import runs_progress
from shaper_fmu.ssp.archive import load_ssp, pack_ssp
from shaper_fmu.sweep.engine import job_of, provenance_of, with_nominals
from shaper_fmu.sweep.engines import Engine, Processes, Serial, available_workers
from shaper_fmu.sweep.job import Job
from shaper_fmu.sweep.runs import Outcome, Task
from shaper_fmu.sweep.store import Store
from shaper_fmu.sweep.study import Study
from shaper_fmu.sweep.variation import Vary

RUNS, STEPS, STEP = 10_000, 1000, 0.01
PARALLEL_RUNS = 30_000
TURNS = 5
PEER_RUNS = 40
"""Of the peer in a turn, spread over the plan; the rest is extrapolated."""

FORCE = 100.0
FILES = {"shaper": "InputShaper", "plant": "MassSpringDamper"}
VARIED = "plant.stiffness"
T = TypeVar("T")


class Sweep:
    """The study, and its system, packed into `folder` unless it is there."""

    def __init__(self, folder: Path, runs: int = RUNS):
        self._stores, self._count = folder / f"stores_{len(list(folder.iterdir()))}", 0
        self._stores.mkdir()
        archive = folder / "sweep.ssp"
        if not archive.is_file():
            fmus = folder / "sweep_fmus"
            fmus.mkdir()
            for file in FILES.values():
                (fmus / f"{file}.fmu").write_bytes(fmu_path(file, fmi=2, platforms=["this"]).read_bytes())
            pack_ssp(Path(__file__).with_name("sweep_ssp"), fmus, archive)
        self._loaded = load_ssp(archive)
        study = Study(
            "bench", str(archive), STEPS * STEP, STEP, {VARIED: Vary(low=50.0, high=150.0, points=runs, nominal=50.0)},
            {"residual": Residual("plant.position", "shaper.shaped"), "peak": Peak("plant.position")},
            {"ZV": {"shaper.command": FORCE}}, algorithm="parallel",
        )  # fmt: skip
        self.study = with_nominals(study, self._loaded.system)
        job = job_of(self.study, self._loaded)
        self.job: Job = replace(job, plan=replace(job.plan, exact=False))

    def stored(self, engine: Engine) -> tuple[list[Outcome], float]:
        """A sweep into a fresh store: its outcomes in the plan's order, and the seconds on the clock since the first ones came."""
        self._count += 1
        found: list[Outcome] = []
        with (
            open(os.devnull, "w") as nowhere,
            runs_progress("sweeping", Console(file=nowhere)) as tell,
            Store(self._stores / f"{self._count}.sqlite", self.study, provenance_of(self._loaded)) as store,
        ):
            planned, first = store.planned(), 0.0
            for outcomes in engine.outcomes(self.job, lambda size: list(islice(planned, size))):
                first = first or time.perf_counter()
                store.enter(outcomes)
                found += outcomes
                tell(len(found), 0, self.study.count)
            return sorted(found, key=lambda one: one.id), time.perf_counter() - first

    def unstored(self) -> list[Outcome]:
        """The same runs without a store."""
        planned = (Task(i, "ZV", values) for i, values in enumerate(self.study.points))
        serial = Serial().outcomes(self.job, lambda size: list(islice(planned, size)))
        return [one for outcomes in serial for one in outcomes]


def sweep_vs_fmpy_loop(folder: Path) -> Row:
    """A whole sweep on one core, with its store, against a plain loop over fmpy's slaves that are reset between runs."""
    sweep, peer = Sweep(folder), _FmpyLoop()
    chosen = range(0, RUNS, RUNS // PEER_RUNS)
    stiffness = [sweep.study.run(i)[1][0] for i in chosen]

    def turns() -> list[Measured]:
        seconds, outcomes = _timed(lambda: sweep.stored(Serial())[0])
        ours = Measured(_per_step(seconds, RUNS), _metrics(outcomes[i] for i in chosen))
        seconds, found = _timed(lambda: [number for one in stiffness for number in peer.run(float(one))])
        return [ours, Measured(_per_step(seconds, PEER_RUNS), tuple(found))]

    sweep.stored(Serial())  # what is compiled is loaded once
    row = compared("sweep_vs_fmpy_loop", turns, tolerance=1e-12, needed=100.0, repetitions=TURNS)
    peer.close()
    return replace(row, note=f"{RUNS} runs of {STEPS} steps, of the peer {TURNS * PEER_RUNS}")


def sweep_two_workers(folder: Path) -> Row:
    """Two worker processes against one, from the first outcomes on."""
    sweep = Sweep(folder, PARALLEL_RUNS)

    def passed(workers: int) -> Measured:
        outcomes, seconds = sweep.stored(Processes(workers))
        return Measured(_per_step(seconds, PARALLEL_RUNS), _metrics(outcomes))

    if available_workers() < 2:
        return alone("sweep_two_workers", lambda: [passed(1)], "not measured: this machine has one processor")
    row = compared("sweep_two_workers", lambda: [passed(2), passed(1)], tolerance=0.0, needed=1.7, repetitions=TURNS)
    others = os.getloadavg()[0] - 2.0 if hasattr(os, "getloadavg") else 0.0  # our own two are part of the load
    busy = others > available_workers() - 1.9
    return replace(row, note=f"fewer than two processors were free: about {others:.1f} other processes ran" if busy else "")


def sweep_store_share(folder: Path) -> Row:
    """A sweep with store and progress against the same runs without: their share is 1 - ratio."""
    sweep = Sweep(folder)

    def turns() -> list[Measured]:
        with_store, outcomes = _timed(lambda: sweep.stored(Serial())[0])
        without, same = _timed(sweep.unstored)
        return [Measured(_per_step(with_store, RUNS), _metrics(outcomes)), Measured(_per_step(without, RUNS), _metrics(same))]

    row = compared("sweep_store_share", turns, tolerance=0.0, needed=0.95, repetitions=TURNS)
    return replace(row, note=f"store and progress take {1.0 - row.peer / row.ours:.1%}" if row.peer else "")


SWEEPS = (sweep_vs_fmpy_loop, sweep_two_workers, sweep_store_share)


class _FmpyLoop:
    """What a user would write with fmpy alone."""

    def __init__(self) -> None:
        import fmpy
        from fmpy.fmi2 import FMU2Slave

        self._slaves, self._references = {}, {}
        for name, file in FILES.items():
            path = str(fmu_path(file, fmi=2, platforms=["this"]))
            description = fmpy.read_model_description(path, validate=False)
            slave = FMU2Slave(
                guid=description.guid, unzipDirectory=fmpy.extract(path), modelIdentifier=file, instanceName=name
            )  # fmt: skip
            slave.instantiate()
            self._slaves[name] = slave
            self._references[name] = {v.name: [v.valueReference] for v in description.modelVariables}

    def run(self, stiffness: float) -> tuple[float, float]:
        """A run: residual and peak."""
        shaper, plant = self._slaves["shaper"], self._slaves["plant"]
        of_shaper, of_plant = self._references["shaper"], self._references["plant"]
        for slave in (shaper, plant):
            slave.reset()
            slave.setupExperiment(stopTime=STEPS * STEP)
        shaper.setReal(of_shaper["command"], [FORCE])
        plant.setReal(of_plant["stiffness"], [stiffness])
        for slave in (shaper, plant):
            slave.enterInitializationMode()
            slave.exitInitializationMode()
        output, force, position = of_shaper["shaped"], of_plant["force"], of_plant["position"]
        shaped = shaper.getReal(output)
        last = shaped[0]
        largest = smallest = plant.getReal(position)[0]
        peak = abs(largest)
        for i in range(STEPS):
            plant.setReal(force, shaped)
            shaper.doStep(i * STEP, STEP)
            plant.doStep(i * STEP, STEP)
            shaped, x = shaper.getReal(output), plant.getReal(position)[0]
            peak = max(peak, abs(x))
            if shaped[0] != last:
                last, largest, smallest = shaped[0], x, x
            largest, smallest = max(largest, x), min(smallest, x)
        return 0.5 * (largest - smallest), peak

    def close(self) -> None:
        """Free the instances."""
        for slave in self._slaves.values():
            slave.terminate()
            slave.freeInstance()


def _timed(work: Callable[[], T]) -> tuple[float, T]:
    """Seconds of this thread on a processor, and what came of it."""
    begin = time.thread_time()
    found = work()
    return time.thread_time() - begin, found


def _per_step(seconds: float, runs: int) -> float:
    """Microseconds."""
    return seconds / (runs * STEPS) * 1e6


def _metrics(outcomes: Iterable[Outcome]) -> tuple[float, ...]:
    """All metrics. Ends the program if a run has failed."""
    found: list[float] = []
    for outcome in outcomes:
        if outcome.metrics is None:
            raise SystemExit(f"run {outcome.id} of a sweep failed: {outcome.reason}")
        found += outcome.metrics
    return tuple(found)
