"""The job that a worker gets of a sweep, and the runs that it does with it."""

from __future__ import annotations

import hashlib
import math
import os
import pickle
import time
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass
from functools import cached_property
from typing import Protocol

import numpy as np

from shaper_fmu.errors import ShaperFmuError, SimulationError
from shaper_fmu.master.batch import Batch, Plan
from shaper_fmu.master.once import OccupiedError
from shaper_fmu.master.system import System
from shaper_fmu.metrics.metric import Metric
from shaper_fmu.sweep.plan import Value
from shaper_fmu.sweep.runs import Outcome, Task

_GROUP_SECONDS = 0.02
_LARGEST_GROUP = 1000
"""Short runs are done by the group: so many that Python's share is small, so few that Ctrl-C is heard at once."""


class Doer(Protocol):
    """Does tasks in a worker process: see `Runner`."""

    reuses: bool

    def outcomes(self, tasks: Sequence[Task], now: int = 0) -> Iterator[list[Outcome]]:
        """What becomes of the tasks; the number of the one at work is kept at the address `now`, unless that is 0."""
        ...

    def close(self) -> None:
        """Free what it has."""
        ...


class Work(Protocol):
    """What the workers of a `Pool` do: a sweep's `Job`, or calls of functions. The worker gets its `content`."""

    @property
    def content(self) -> bytes:
        """The work, pickled."""
        ...

    @property
    def metrics(self) -> Mapping[str, Metric]:
        """Of each outcome."""
        ...

    @property
    def time_limit(self) -> float | None:
        """Of a task [s]."""
        ...

    def runner(self) -> Doer:
        """In the worker: what does the tasks."""
        ...


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

    @property
    def content(self) -> bytes:
        """The job as bytes, to be sent to workers."""
        return self._content

    @cached_property
    def _content(self) -> bytes:
        return pickle.dumps(self, pickle.HIGHEST_PROTOCOL)

    @classmethod
    def of_content(cls, content: bytes) -> Job:
        """The job that these bytes stand for; it keeps them, since other processes may pickle it to other ones."""
        job: Job = pickle.loads(content)
        object.__setattr__(job, "_content", content)  # frozen, as in its own __init__
        return job

    def runner(self) -> Doer:
        """See `Work`."""
        return Runner(self)

    @property
    def digest(self) -> str:
        """Stands for the job's content."""
        return hashlib.sha256(self.content).hexdigest()


class Runner:
    """Does the runs of a job in this process, on instances that are reset between runs. Close it after use.

    Whether a reset leaves anything behind is tried with the first two runs that succeed: the first is done again after the
    second, and has to give the same bits. If it does not, or there is no reset, every run gets fresh instances (`reuses` is false).

    An FMU that forks and lets the child return has made a second process that would do, and tell, all the rest once more: it
    ends here, and only the one that was asked goes on.
    """

    def __init__(self, job: Job):
        self.job = job
        self._process = os.getpid()
        self.reuses: bool = True
        self._batch: Batch | None = None
        self._tried: list[tuple[Task, tuple[float, ...]]] = []
        self._cases = {}
        self._seconds = 1.0
        batch = self._live()
        self.reuses = batch.resets
        for name, values in job.cases.items():
            self._cases[name] = batch.values_of(values)
        self._case_rows = dict(zip(self._cases, batch.rows(list(self._cases.values())), strict=True))
        self._varied_columns = [batch.columns[name] for name in job.varied]

    def close(self) -> None:
        """Free the instances."""
        if self._batch is not None:
            self._batch.close()
            self._batch = None
            self._end_copy()

    def _end_copy(self) -> None:
        """End a process that an FMU has forked: without flushing buffers or reporting anything twice."""
        if os.getpid() != self._process:
            os._exit(1)

    def outcomes(self, tasks: Sequence[Task], now: int = 0) -> Iterator[list[Outcome]]:
        """Do runs, short ones in groups; a failure becomes an outcome.

        The number of the run at work is kept at the address `now`, unless that is 0: a process that watches this one can tell
        which run has ended it. Raises OccupiedError where the FMUs cannot be instantiated again in this process.
        """
        done = 0
        while done < len(tasks):
            alone = not self.reuses or len(self._tried) < 2
            size = 1 if alone else max(1, min(_LARGEST_GROUP, int(_GROUP_SECONDS / self._seconds)))
            found = self._group(tasks[done : done + size], now)
            done += len(found)
            yield found

    def _group(self, tasks: Sequence[Task], now: int) -> list[Outcome]:
        """The outcomes of the first of these tasks, or of as many as go well and one that fails."""
        begin = time.perf_counter()
        try:
            found = self._runs(tasks, now)
            if self.reuses and len(self._tried) < 2 and isinstance(found[0], tuple):
                found[0] = self._try_reset(tasks[0], found[0], now)
        except OccupiedError:  # says nothing of the run
            raise
        except Exception as error:
            found = [error]
        except BaseException:
            self.close()
            raise
        finally:
            self._end_copy()
        self._seconds = max(1e-7, (time.perf_counter() - begin) / len(found))
        if not isinstance(found[-1], tuple):
            self.close()
        return [self._outcome(task, one) for task, one in zip(tasks, found, strict=False)]

    def _outcome(self, task: Task, found: tuple[float, ...] | Exception) -> Outcome:
        if isinstance(found, tuple):
            return Outcome(task.id, found, None, self._seconds, task.attempts + 1)
        kind = "" if isinstance(found, ShaperFmuError) else f"{type(found).__name__}: "
        return Outcome(task.id, None, f"{kind}{found}", self._seconds, task.attempts + 1)

    def _live(self) -> Batch:
        if not self.reuses:  # after a run that fails there is no batch
            self.close()
        if self._batch is None:
            names = dict.fromkeys(
                [*(n for values in self.job.cases.values() for n in _elements(self.job, values)), *self.job.varied]
            )
            self._batch = Batch(self.job.system, self.job.plan, self.job.metrics, list(names))
            self._end_copy()
        return self._batch

    def _runs(self, tasks: Sequence[Task], now: int) -> list[tuple[float, ...] | Exception]:
        """Metrics, or errors; the list ends with the first run after which the instances are of no more use."""
        batch = self._live()
        numbers = np.array([task.id for task in tasks], np.int64)
        found: list[tuple[float, ...] | Exception] = list(batch.run_rows(self._rows(batch, tasks), numbers, now))
        for i, metrics in enumerate(found):
            if isinstance(metrics, tuple) and any(map(math.isnan, metrics)):
                found[i] = self._nan_error(metrics)
            if not isinstance(found[i], tuple):
                return found[: i + 1]
        return found

    def _rows(self, batch: Batch, tasks: Sequence[Task]) -> np.ndarray:
        """The start values of runs, in the batch's order."""
        if any(type(value) is str for task in tasks for value in task.values):  # items of enumerations
            varied = (batch.values_of(dict(zip(self.job.varied, task.values, strict=True))) for task in tasks)
            return batch.rows([{**self._cases[task.compared], **values} for task, values in zip(tasks, varied, strict=True)])
        rows = np.array([self._case_rows[task.compared] for task in tasks])
        rows[:, self._varied_columns] = [task.values for task in tasks]
        return rows

    def _nan_error(self, metrics: tuple[float, ...]) -> SimulationError:
        values = zip(self.job.metrics.items(), metrics, strict=True)
        name, metric = next(item for item, value in values if math.isnan(value))
        return SimulationError(f"metric {name} is not a number: {metric.output} became NaN")

    def _try_reset(self, task: Task, metrics: tuple[float, ...], now: int) -> tuple[float, ...] | Exception:
        """Compare the first run with itself after another one."""
        self._tried.append((task, metrics))
        if len(self._tried) == 2:
            first, found = self._tried[0]
            if self._runs([first], now)[0] != found:
                self.reuses = False
                return self._runs([task], now)[0]
        return metrics


def _elements(job: Job, values: Mapping[str, Value]) -> Iterator[str]:
    """The names of the scalars that start values set."""
    for name, value in values.items():
        instance, variable = job.system.split(name)
        for element in job.system.fmus[instance].start_values({variable: value}):
            yield f"{instance}.{element}"
