"""Runs a sweep: the runs that the store lacks, by an engine; the refinement; and the system of a store."""

from __future__ import annotations

import hashlib
from collections.abc import Callable, Iterator, Mapping
from itertools import islice
from pathlib import Path
from typing import Any

import msgspec

from shaper_fmu.archives import read_file
from shaper_fmu.errors import ModelError, StudyError
from shaper_fmu.master.events import treat_events
from shaper_fmu.master.notes import coupling_notes, system_notes
from shaper_fmu.master.results import Results
from shaper_fmu.master.simulation import Simulation
from shaper_fmu.master.system import System
from shaper_fmu.master.variables import own_start
from shaper_fmu.ssp.archive import SspSystem, load_ssp
from shaper_fmu.sweep.engines import Engine, Processes, Serial, available_workers
from shaper_fmu.sweep.job import Job
from shaper_fmu.sweep.plan import Value
from shaper_fmu.sweep.refine import points_to_add
from shaper_fmu.sweep.runs import Run, Task
from shaper_fmu.sweep.step_lengths import sweep_step_notes
from shaper_fmu.sweep.store import Store
from shaper_fmu.sweep.study import Study, check_study
from shaper_fmu.version import __version__

Progress = Callable[[int, int, int], None]
"""Called now and then with the number of runs that are done, that have failed, and of all runs."""

_ROUNDS = 60
_MOST_ADDED, _TIMES_ADDED = 10_000, 10
"""A refinement adds so many runs at most, or so many times as many as were planned, if that is more."""

Point = tuple[str, tuple[Value, ...]]
"""A case, and the varied values."""


def run_study(
    study: Study, store: Path | str, progress: Progress | None = None, *, engine: Engine | None = None, retry_failed: bool = False
) -> dict[str, int]:
    """Do the runs that the store lacks; a failed run is kept with its reason. Returns the number of runs by status.

    `engine`: serial in this process if None. With `retry_failed`, runs that have failed are run again. Raises ModelError before
    the first run if the study names what the system does not have, StudyError if the store is another study's or in use.
    """
    if not isinstance(study, Study):
        raise StudyError(f"run_study({study!r:.60}): a Study is needed, such as read_study('study.toml')")
    loaded = load_ssp(study.system_path)
    study = with_nominals(study, loaded.system)
    job = job_of(study, loaded)
    engine = engine or Serial()
    with Store(store, study, provenance_of(loaded)) as opened:
        for i, note in enumerate(_notes_of(study, loaded, job)):
            opened.remark(f"run {i:03d}", note)
        if retry_failed:
            opened.retry_failed()
        _run_planned(opened, job, engine, progress)
        for _ in range(_ROUNDS if study.refine is not None else 0):
            if not opened.add(_within_limit(points_to_add(study, opened), opened)):
                break
            _run_planned(opened, job, engine, progress)
        if not engine.reuses:
            opened.remark("instances", "a reset of these FMUs fails, or leaves something behind: every run had fresh instances")
        return opened.counts()


def _within_limit(points: list[Point], opened: Store) -> list[Point]:
    """As many of a refinement's points as are allowed; if that is not all, the store records it."""
    most = max(_MOST_ADDED, _TIMES_ADDED * opened.study().count)
    left = most - opened.added()
    if len(points) > left:
        message = (
            f"the refinement ended after {most} added runs, the largest number allowed: some intervals in which the metric "
            "crosses the level are longer than refine.width. A metric that crosses it in many places needs a finer grid instead"
        )
        opened.remark("refine", message)
    return points[: max(0, left)]


def _notes_of(study: Study, loaded: SspSystem, job: Job) -> tuple[str, ...]:
    """Notes on all runs, as `Simulation.run` gives them in its results."""
    treatment = treat_events(job.system, job.plan.exact)
    coupling = coupling_notes(job.system, treatment, job.plan.algorithm, (), job.plan.coupling)
    return (*loaded.notes, *system_notes(job.system), *coupling, *sweep_step_notes(study, job.system))


def _run_planned(opened: Store, job: Job, engine: Engine, progress: Progress | None) -> None:
    counts = opened.counts()
    done, failed, total = counts.get("done", 0), counts.get("failed", 0), sum(counts.values())
    planned: Iterator[Task] = opened.planned()

    def feed(size: int) -> list[Task]:
        return list(islice(planned, size))

    if progress is not None:
        progress(done, failed, total)
    if done + failed == total:
        return
    running = engine.outcomes(job, feed)
    try:
        for outcomes in running:
            opened.enter(outcomes)
            failed += sum(outcome.metrics is None for outcome in outcomes)
            done += sum(outcome.metrics is not None for outcome in outcomes)
            if progress is not None:
                progress(done, failed, total)
    finally:
        running.close()  # pyright: ignore[reportAttributeAccessIssue]


def engine_for(workers: int | None = None, dask: str | None = None) -> Engine:
    """The engine for these options: Dask at an address ("local" for a new cluster), 0 workers for serial, or processes.

    Raises StudyError for a negative number, and where Dask is not installed.
    """
    if dask is not None:
        from shaper_fmu.sweep.dask_engine import Dask

        return Dask(dask, workers)
    if workers is not None and workers < 0:
        raise StudyError(f"workers = {workers} must not be negative; 0 runs everything in one process")
    return Serial() if workers == 0 else Processes(workers or available_workers())


def with_nominals(study: Study, system: System) -> Study:
    """The study with the system's own values where it gives no nominal ones. Raises ModelError and StudyError."""
    vary = {}
    for name, one in study.vary.items():
        system.check_settable(name)
        instance, variable = system.split(name)
        system.fmus[instance].variable(variable, "input", "parameter")
        nominal = one.nominal
        if nominal is None:
            nominal = _number(system.start_values[instance].get(variable, system.fmus[instance].variables[variable].start))
        vary[name] = msgspec.structs.replace(one, nominal=nominal)
    completed = msgspec.structs.replace(study, vary=vary)
    check_study(completed)
    return completed


def _number(value: Any) -> float | None:
    try:
        return None if isinstance(value, bool) else float(value)
    except (TypeError, ValueError):
        return None


def job_of(study: Study, loaded: SspSystem) -> Job:
    """The study as workers get it. Raises ModelError for names that the system does not have."""
    system = loaded.system
    system.ports(study.recorded())
    for values in study.compare.values():
        for name, value in values.items():
            system.check_settable(name)
            instance, variable = system.split(name)
            system.fmus[instance].start_values({variable: value})
    for name in (*study.vary, *[name for values in study.compare.values() for name in values]):
        _give_start_value(system, name)
    plan = study.batch_plan(loaded.structure.start_time or 0.0)
    return Job(system, plan, study.metrics, study.compare, tuple(study.vary), study.time_limit)


def _give_start_value(system: System, name: str) -> None:
    """An input that runs set is no open one: in the runs that do not set it, it has the FMU's own value."""
    instance, variable = system.split(name)
    found = system.fmus[instance].variables.get(variable)
    if found is not None and found.causality == "input" and found.start is not None:
        system.start_values[instance].setdefault(variable, own_start(found, instance))


def provenance_of(loaded: SspSystem) -> dict[str, Any]:
    """The provenance of a sweep: the version, and the digests of the system and its FMUs."""
    fmus = {name: fmu.digest for name, fmu in loaded.system.fmus.items()}
    return {"shaper-fmu": __version__, "system": loaded.digest, "fmus": fmus}


def load_stored_system(store: Store) -> SspSystem:
    """The system whose runs a store holds: at its original place, or with the store, if both were moved.

    Raises StudyError if it is not there, or has changed since, so that its results would differ.
    """
    study, provenance = store.study(), store.provenance()
    folder, name = store.path.resolve().parent, Path(study.system)
    places = list(dict.fromkeys([study.system_path, folder / name, folder / name.name, folder.parent / name]))
    there = [place for place in places if place.is_file()]
    if not there:
        raise StudyError(f"{store.path}: there is no system {study.system} in {study.folder}, nor beside the store; put it there")
    for place in there:
        if hashlib.sha256(read_file(place)).hexdigest() == provenance.get("system"):
            loaded = load_ssp(place)
            if provenance_of(loaded) == provenance:
                return loaded
    raise StudyError(f"{store.path}: its runs are of another {study.system_path.name} or another version; sweep again")


def simulate_run(simulation: Simulation, study: Study, run: Run, start_time: float = 0.0) -> Results:
    """The trajectories of one run of the study."""
    values: Mapping[str, Any] = {**study.compare[run.compared], **run.varied}
    try:
        return simulation.run(
            study.stop_time,
            study.step,
            algorithm=study.algorithm,
            interpolation=study.interpolation,
            start_values=values,
            start_time=start_time,
            solver=study.solver,
            coupling=study.coupling,
            solver_tolerance=study.solver_tolerance,
        )
    except ModelError as error:
        raise StudyError(f"run {run.id}: {error}") from None
