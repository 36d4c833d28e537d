"""The calls that worker processes do: functions of a plant, with all runs of the plant in files.

A task of the pool is a number; the call and its result are files of that number in a folder of the caller's. Only results that are
complete have their names.
"""

from __future__ import annotations

import ctypes
import os
import pickle
import time
from collections.abc import Callable, Iterator, Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np

from shaper_fmu.sweep.runs import Outcome, Task
from shaper_fmu.tune.kept_runs import RunsToRead
from shaper_fmu.tune.meter import Budget
from shaper_fmu.tune.workers.logged import Done, LoggedMeter

if TYPE_CHECKING:
    from shaper_fmu.tune.plant import Plant

RUNS, KNOWN = "runs", "known"
"""Folders of the runs that workers have made, and of those that the caller's memory has, by key."""


@dataclass(frozen=True)
class Call:
    """A function of a plant and more, which a worker calls.

    Attributes:
        function: of a module.
        plant: on which it does runs.
        arguments: more of the function's.
        budget: of the call.
        kept: file in which runs are that are known; None for none.
    """

    function: Callable[..., Any]
    plant: Plant
    arguments: tuple[Any, ...]
    budget: Budget
    kept: Path | None

    def write(self, path: Path) -> None:
        """Write it."""
        path.write_bytes(pickle.dumps(self, pickle.HIGHEST_PROTOCOL))


@dataclass(frozen=True)
class Calls:
    """The work of a pool: calls in a folder. See `shaper_fmu.sweep.job.Work`."""

    folder: str
    time_limit: float | None = None

    @property
    def content(self) -> bytes:
        """The work, pickled."""
        return pickle.dumps(self, pickle.HIGHEST_PROTOCOL)

    @property
    def metrics(self) -> Mapping[str, Any]:
        """None: results are in files."""
        return {}

    def runner(self) -> CallRunner:
        """In the worker: what does the calls."""
        return CallRunner(Path(self.folder))


class CallRunner:
    """Does calls in a worker process. See `shaper_fmu.sweep.job.Doer`."""

    def __init__(self, folder: Path):
        self.reuses: bool = True
        self._folder, self._process = folder, os.getpid()

    def close(self) -> None:
        """Nothing is left open."""

    def outcomes(self, tasks: Sequence[Task], now: int = 0) -> Iterator[list[Outcome]]:
        """Do the calls, one after the other."""
        for task in tasks:
            if now:
                ctypes.c_int64.from_address(now).value = task.id
            begun = time.perf_counter()
            done = self._done(task.id)
            if os.getpid() != self._process:
                os._exit(1)  # a copy, which an FMU has made by forking: it would tell everything twice
            write_whole(self._folder / f"{task.id}.done", done)
            yield [Outcome(task.id, (), None, time.perf_counter() - begun, task.attempts + 1)]

    def _done(self, number: int) -> Done:
        call: Call = pickle.loads((self._folder / f"{number}.call").read_bytes())
        meter, plant = LoggedMeter(call.budget), call.plant
        plant.meter, plant.kept = meter, (runs := RunsOfWorker(self._folder, call.kept, meter))
        before, result, error = plant.longest_step, None, ""
        try:
            result = call.function(plant, *call.arguments)
        except Exception as problem:  # the caller does the call itself, and meets it
            error = f"{type(problem).__name__}: {problem}"
        runs.close()
        times = tuple(meter.times().items())
        return Done(result, error, tuple(meter.log), times, meter.refused, (before, plant.longest_step), tuple(runs.made))


class RunsOfWorker:
    """The runs that are known in a worker: those that the caller knows. Its own are put into a folder.

    What other workers have made is not known: one process would have made it again, too.

    Attributes:
        path: that folder.
        made: keys of its own.
    """

    def __init__(self, folder: Path, kept: Path | None, meter: LoggedMeter):
        self.made: list[str] = []
        self.path: Path = folder / RUNS
        self._known = folder / KNOWN
        self._meter = meter
        self._kept = RunsToRead(kept) if kept is not None else None

    def found(self, key: str) -> tuple[np.ndarray, ...] | None:
        """The arrays that were kept under a key; None for none."""
        path = self._known / key
        if path.is_file():
            return pickle.loads(path.read_bytes())[0]
        return self._kept.found(key) if self._kept is not None else None

    def keep(self, key: str, *arrays: np.ndarray) -> None:
        """Keep arrays under a key, with the time that the steps have taken."""
        write_whole(self.path / key, (arrays, self._meter.log[-1].stepping if self._meter.log else 0.0))
        self.made.append(key)

    def close(self) -> None:
        """Close the file."""
        if self._kept is not None:
            self._kept.close()


def write_whole(path: Path, content: object) -> None:
    """Write a pickle that has its name only when it is complete."""
    draft = path.with_name(f"{path.name}.{os.getpid()}.draft")
    draft.write_bytes(pickle.dumps(content, pickle.HIGHEST_PROTOCOL))
    draft.replace(path)
