"""What a worker needs to know of a sweep, and the runs that it does with it."""

from __future__ import annotations

import hashlib
import math
import pickle
import time
from collections.abc import Iterator, Mapping
from dataclasses import dataclass
from functools import cached_property

from shaper_fmu.errors import ShaperFmuError, SimulationError
from shaper_fmu.master.batch import Batch, Plan
from shaper_fmu.master.metrics import Metric
from shaper_fmu.master.system import System
from shaper_fmu.sweep.plan import Value
from shaper_fmu.sweep.store import Outcome, Task


@dataclass(frozen=True)
class Job:
    """A system, what its runs have in common, and the start values of the cases; can be pickled.

    `varied` are the names of the start values that come with each task.
    """

    system: System
    plan: Plan
    metrics: Mapping[str, Metric]
    cases: Mapping[str, Mapping[str, Value]]
    varied: tuple[str, ...]
    time_limit: float | None = None

    @cached_property
    def content(self) -> bytes:
        """The job as bytes, to be sent to workers."""
        return pickle.dumps(self, pickle.HIGHEST_PROTOCOL)

    @property
    def digest(self) -> str:
        """Stands for the job's content."""
        return hashlib.sha256(self.content).hexdigest()


class Runner:
    """Does the runs of a job in this process, on instances that are reset between runs. Close it after use.

    Whether a reset leaves anything behind is tried with the first two runs that succeed: the first is done again after the
    second, and has to give the same bits. If it does not, every run gets fresh instances (`reuses` is false).
    """

    def __init__(self, job: Job):
        self.job = job
        self.reuses = True
        self._batch: Batch | None = None
        self._tried: list[tuple[Task, tuple[float, ...]]] = []
        self._cases = {}
        batch = self._live()
        for name, values in job.cases.items():
            self._cases[name] = batch.values_of(values)

    def close(self) -> None:
        """Free the instances."""
        if self._batch is not None:
            self._batch.close()
            self._batch = None

    def run(self, task: Task) -> Outcome:
        """Do a run; what fails is told in the outcome."""
        begin = time.perf_counter()
        try:
            metrics, reason = self._metrics(task), None
            if self.reuses and len(self._tried) < 2:
                metrics = self._try_reset(task, metrics)
        except Exception as error:
            kind = "" if isinstance(error, ShaperFmuError) else f"{type(error).__name__}: "
            metrics, reason = None, f"{kind}{error}"
            self.close()
        except BaseException:
            self.close()
            raise
        return Outcome(task.id, metrics, reason, time.perf_counter() - begin, task.attempts + 1)

    def _live(self) -> Batch:
        if not self.reuses:  # after a run that fails there is no batch
            self.close()
        if self._batch is None:
            names = dict.fromkeys(
                [*(n for values in self.job.cases.values() for n in _elements(self.job, values)), *self.job.varied]
            )
            self._batch = Batch(self.job.system, self.job.plan, self.job.metrics, list(names))
        return self._batch

    def _metrics(self, task: Task) -> tuple[float, ...]:
        batch = self._live()
        varied = dict(zip(self.job.varied, task.values, strict=True))
        if str in map(type, task.values):
            varied = batch.values_of(varied)
        found = batch.run({**self._cases[task.compared], **varied})  # pyright: ignore[reportArgumentType]
        for name, value in found.items():
            if math.isnan(value):
                raise SimulationError(f"metric {name} is not a number: {self.job.metrics[name].output} became NaN")
        return tuple(found.values())

    def _try_reset(self, task: Task, metrics: tuple[float, ...]) -> tuple[float, ...]:
        """Compare the first run with itself after another one."""
        self._tried.append((task, metrics))
        if len(self._tried) == 2:
            first, found = self._tried[0]
            if self._metrics(first) != found:
                self.reuses = False
                return self._metrics(task)
        return metrics


def _elements(job: Job, values: Mapping[str, Value]) -> Iterator[str]:
    """The names of the scalars that start values set."""
    for name, value in values.items():
        instance, variable = job.system.split(name)
        for element in job.system.fmus[instance].start_values({variable: value}):
            yield f"{instance}.{element}"
