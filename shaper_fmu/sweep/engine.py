"""Running a sweep: what is not done, one run after the other, on instances that are reset between runs."""

from __future__ import annotations

import time
from collections.abc import Callable
from pathlib import Path
from typing import Any

import numpy as np

from shaper_fmu import __version__
from shaper_fmu.analysis.response import command_end, residual_amplitude
from shaper_fmu.errors import SimulationError, StudyError
from shaper_fmu.master.results import Results
from shaper_fmu.master.simulation import Simulation
from shaper_fmu.master.system import System
from shaper_fmu.ssp.archive import SspSystem, load_ssp
from shaper_fmu.sweep.store import Run, Store
from shaper_fmu.sweep.study import Residual, Study

Progress = Callable[[int, int], None]
"""Called before the first run and after each with the number of runs done or failed, and of all runs."""


def run_study(study: Study, store: Path | str, progress: Progress | None = None) -> list[Run]:
    """Run what the store does not hold yet; a run that fails is kept with its reason. Returns all runs.

    Raises ModelError before the first run if the study names what the system does not have.
    """
    loaded = load_ssp(study.system_path)
    system, start_time = loaded.system, loaded.structure.start_time or 0.0
    provenance = provenance_of(loaded)
    check_names(study, system)
    with Store(store, study, provenance) as opened:
        simulation = Simulation(system, record=study.recorded())
        try:
            planned, total = opened.runs("planned"), sum(opened.counts().values())
            for number, run in enumerate(planned):
                if progress is not None:
                    progress(total - len(planned) + number, total)
                begin = time.perf_counter()
                try:
                    results = simulate_run(simulation, study, run, start_time)
                    opened.finish(run.id, metrics_of(study, results), time.perf_counter() - begin)
                except SimulationError as error:
                    opened.fail(run.id, str(error), time.perf_counter() - begin)
                    simulation.close()
                    simulation = Simulation(system, record=study.recorded())
            if progress is not None:
                progress(total, total)
        finally:
            simulation.close()
        return opened.runs()


def check_names(study: Study, system: System) -> None:
    """Raise ModelError for a recorded variable or a start value that the system does not have."""
    system.ports(study.recorded())
    for values in [dict.fromkeys(study.vary, 1.0), *study.compare.values()]:
        for name, value in values.items():
            system.check_settable(name)
            instance, variable = system.split(name)
            system.fmus[instance].start_values({variable: value})


def provenance_of(loaded: SspSystem) -> dict[str, Any]:
    """What the numbers of a sweep come from: the version, and the digests of the system and its FMUs."""
    fmus = {name: fmu.digest for name, fmu in loaded.system.fmus.items()}
    return {"shaper-fmu": __version__, "system": loaded.digest, "fmus": fmus}


def load_stored_system(store: Store) -> SspSystem:
    """The system whose runs a store holds. Raises StudyError if it has changed since, so that it would tell another story."""
    loaded = load_ssp(store.study().system_path)
    if provenance_of(loaded) != store.provenance():
        raise StudyError(f"{store.path}: its runs are of another {store.study().system_path.name} or another version; sweep again")
    return loaded


def simulate_run(simulation: Simulation, study: Study, run: Run, start_time: float = 0.0) -> Results:
    """The trajectories of one run of the study."""
    values: dict[str, Any] = {**study.compare[run.compared], **run.varied}
    return simulation.run(study.stop_time, study.step, algorithm=study.algorithm, start_values=values, start_time=start_time)


def metrics_of(study: Study, results: Results) -> dict[str, float]:
    """The study's metrics of one run, in SI units."""
    found = {}
    for name, metric in study.metrics.items():
        if isinstance(metric, Residual):
            end = command_end(results.time, results[metric.command])
            if end >= results.time[-1]:
                words = f"has not come to its end by stop_time = {study.stop_time:g} s; use a later one"
                raise SimulationError(f"{metric.command} {words}")
            found[name] = residual_amplitude(results.time, results[metric.output], end)
        else:
            found[name] = float(np.max(np.abs(results[metric.output])))
    return found
