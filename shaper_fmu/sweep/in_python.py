"""Sweeps a system that was built in Python, without a study file."""

from __future__ import annotations

import tempfile
from collections.abc import Iterable, Mapping, Sequence
from pathlib import Path
from typing import Any

from shaper_fmu.archives import write_file
from shaper_fmu.errors import ArgumentError, StudyError, nearest
from shaper_fmu.master.structure import SystemStructure as Structure
from shaper_fmu.metrics.metric import Metric
from shaper_fmu.slips import checked_mapping
from shaper_fmu.ssp.archive import load_ssp
from shaper_fmu.ssp.export import write_system
from shaper_fmu.ssp.system import System
from shaper_fmu.sweep.engine import Progress, engine_for, run_study
from shaper_fmu.sweep.plan import Value
from shaper_fmu.sweep.study import Study
from shaper_fmu.sweep.variation import Vary

_CASES = '{"ZV": {"shaper.shaper": "zv"}, "ZVD": {"shaper.shaper": "zvd"}}'


def sweep_system(
    system: System,
    store: Path | str,
    *,
    vary: Mapping[str, Vary | Sequence[Value]],
    metrics: Mapping[str, Metric],
    stop_time: float,
    step: float,
    workers: int = 0,
    dask: str | None = None,
    progress: Progress | None = None,
    retry_failed: bool = False,
    **options: Any,
) -> dict[str, int]:
    """Do the runs of a sweep over the system that the store lacks; returns the number of runs by status.

    `vary` has `Vary` or lists of values, by "instance.variable". `workers` are processes, 0 for this one. `options` are the other
    fields of `Study`: compare, reference, refine, plan, algorithm, ... The system is written as an archive beside the store,
    "<store>.ssp", by which the store is resumed, reported and exported as any other. Raises StudyError if the store is another
    system's or another study's, ModelError for what an archive cannot hold, such as functions that drive inputs.
    """
    checked_mapping("vary", vary, '{"plant.mass": [0.9, 1.0, 1.1]}')
    checked_mapping("metrics", metrics, '{"left": Residual(output="plant.position", command="shaper.shaped")}')
    compare = options.get("compare")
    checked_mapping("compare", compare, _CASES)
    for name, one in (compare or {}).items():
        checked_mapping(f"compare: {name}", one, f"compare={_CASES}")
    for name, one in vary.items():
        if isinstance(one, str) or not isinstance(one, Vary | Iterable):
            raise ArgumentError(f"vary: {name} = {one!r:.80}: a list of values is needed, or Vary(low=..., high=..., points=...)")
    for name in options:
        if name not in Study.__struct_fields__:
            raise ArgumentError(f"sweep_system has no option {name!r}.{nearest(name, Study.__struct_fields__)}")
    store = Path(store)
    study = Study(
        name=options.pop("name", "") or system.name,
        system=f"{store.name}.ssp",
        stop_time=stop_time,
        step=step,
        vary={name: one if isinstance(one, Vary) else Vary(values=list(one)) for name, one in vary.items()},
        metrics=dict(metrics),
        folder=str(store.parent),
        **options,
    )
    _write_beside(store, study.system_path, system)
    _check_storable(system, load_ssp(study.system_path).system)
    return run_study(study, store, progress, engine=engine_for(workers, dask), retry_failed=retry_failed)


def _check_storable(system: System, written: Structure) -> None:
    """Raise StudyError for settings of the system that an archive cannot hold, since the runs would differ."""
    for what, name in (
        ("which outputs announce events", "event_outputs"),
        ("instances without event mode", "without_event_mode"),
        ("which instances may be read after inputs are set", "readable"),
    ):
        current, kept = getattr(system, name), getattr(written, name)
        if current != kept:
            raise StudyError(f"{system.name}: an archive does not hold {what}: {current}, not {kept}; leave it as declared")


def _write_beside(store: Path, archive: Path, system: System) -> None:
    """Write the archive, whose bytes depend only on the system. StudyError if the store's runs are of another one."""
    with tempfile.TemporaryDirectory(prefix="shaper-fmu-sweep-") as folder:
        content = write_system(system, Path(folder) / archive.name).read_bytes()
    if archive.is_file() and archive.read_bytes() == content:
        return
    if store.exists() and archive.is_file():
        raise StudyError(f"{store}: this store holds runs of another system than this one; give another store")
    write_file(archive, content)
