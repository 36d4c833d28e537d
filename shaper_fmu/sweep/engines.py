"""The engines that do the runs of a sweep. All give the same outcomes, bit for bit, in any order."""

from __future__ import annotations

import os
from collections.abc import Iterator
from typing import Protocol

from shaper_fmu.sweep.job import Job, Runner
from shaper_fmu.sweep.pool import Feed, Pool
from shaper_fmu.sweep.runs import Outcome

_ENTER_AFTER = 0.2
"""Outcomes of a serial sweep are given when this time has passed [s]."""


def available_workers() -> int:
    """How many processors this process may use."""
    return len(os.sched_getaffinity(0)) if hasattr(os, "sched_getaffinity") else os.cpu_count() or 1


class Engine(Protocol):
    """Does runs."""

    reuses: bool

    def outcomes(self, job: Job, feed: Feed) -> Iterator[list[Outcome]]:
        """What becomes of all tasks that `feed` gives, as they are done. Closing the iterator ends all work."""
        ...


class Serial:
    """One run after the other in this process: for debugging; an FMU that crashes takes the sweep with it, and none is timed."""

    def __init__(self) -> None:
        self.reuses: bool = True

    def outcomes(self, job: Job, feed: Feed) -> Iterator[list[Outcome]]:
        """See `Engine`."""
        runner = Runner(job)
        try:
            size = 1
            while tasks := feed(size):
                done = [outcome for group in runner.outcomes(tasks) for outcome in group]
                spent = sum(outcome.seconds for outcome in done)
                size = max(1, min(1000, int(size * _ENTER_AFTER / max(1e-6, spent))))
                self.reuses = runner.reuses
                yield done
        finally:
            runner.close()


class Processes:
    """Worker processes on this machine. A run that crashes or hangs costs its worker, and no other run."""

    def __init__(self, workers: int):
        self._workers = workers
        self.reuses: bool = True

    def outcomes(self, job: Job, feed: Feed) -> Iterator[list[Outcome]]:
        """See `Engine`."""
        with Pool(job, self._workers) as pool:
            for outcomes in pool.outcomes(feed):
                self.reuses = pool.reuses
                yield outcomes
