"""Runs sweeps on a Dask cluster: each task is a chunk of runs, done by our worker processes on the cluster's machines.

A run that crashes or hangs costs one of these processes, as on one machine. A Dask worker that is lost has its chunks done
elsewhere; runs without an answer are repeated, and nothing counts twice.
"""

from __future__ import annotations

import atexit
import math
import threading
from collections.abc import Iterator
from typing import Any

from shaper_fmu.errors import ShaperFmuError, StudyError
from shaper_fmu.sweep.engines import available_workers
from shaper_fmu.sweep.job import Job
from shaper_fmu.sweep.pool import Feed, Pool
from shaper_fmu.sweep.runs import Outcome, Task

_CHUNK_SECONDS = 2.0
_MOST_TASKS = 5000
_AHEAD = 2
"""Chunks that are under way for each thread of the cluster."""

_pools: dict[tuple[str, int], Pool] = {}
_content: dict[str, Job] = {}


class Dask:
    """A cluster: its scheduler's address, or "local" for one of our own with so many workers."""

    def __init__(self, address: str, workers: int | None = None):
        try:
            import distributed  # noqa: F401  # pyright: ignore[reportMissingImports]
        except ImportError:
            raise StudyError("--dask needs the package distributed: pip install 'shaper-fmu[dask]'") from None
        self._address, self._workers = address, workers
        self.reuses: bool = True

    def outcomes(self, job: Job, feed: Feed) -> Iterator[list[Outcome]]:
        """See `Engine`."""
        from distributed import Client, as_completed  # pyright: ignore[reportMissingImports]

        cluster = self._local() if self._address == "local" else None
        try:
            with _connected(Client, cluster or self._address) as client:
                content = client.scatter(job.content, broadcast=True)
                size, waiting = 4, as_completed()
                while True:
                    threads = max(1, sum(client.nthreads().values()))
                    while waiting.count() < _AHEAD * threads:
                        tasks = feed(size)
                        if not tasks:
                            break
                        waiting.add(client.submit(run_chunk, content, tasks, pure=False, retries=3))
                    if waiting.is_empty():
                        return
                    outcomes, self.reuses = _result(next(waiting), self.reuses)
                    mean = max(1e-6, math.fsum(outcome.seconds for outcome in outcomes) / max(1, len(outcomes)))
                    size = max(1, min(_MOST_TASKS, int(_CHUNK_SECONDS / mean)))
                    yield outcomes
        finally:
            if cluster is not None:
                cluster.close()

    def _local(self) -> Any:
        from distributed import LocalCluster  # pyright: ignore[reportMissingImports]

        return LocalCluster(n_workers=self._workers or available_workers(), threads_per_worker=1, dashboard_address=":0")


def _connected(client: Any, where: Any) -> Any:
    try:
        return client(where, timeout=20)
    except (OSError, TimeoutError, ValueError) as error:
        raise StudyError(f"--dask {where}: no scheduler answers there: {error}") from None


def _result(future: Any, reuses: bool) -> tuple[list[Outcome], bool]:
    try:
        outcomes, reused = future.result()
    except ShaperFmuError:
        raise
    except Exception as error:  # the cluster's own, such as that too many workers were lost with this chunk
        raise StudyError(
            f"the cluster gave up on a chunk of runs: {type(error).__name__}: {error}; start the sweep again"
        ) from None
    return outcomes, reuses and reused


def run_chunk(content: bytes, tasks: list[Task]) -> tuple[list[Outcome], bool]:
    """On the cluster: do a chunk of runs with a process of ours, which is kept for the next chunk of this thread."""
    job = _job(content)
    key = (job.digest, threading.get_ident())
    pool = _pools.get(key)
    if pool is None:
        pool = _pools[key] = Pool(job, 1)
        atexit.register(pool.__exit__)
    left = list(tasks)

    def feed(size: int) -> list[Task]:
        chunk, left[:] = left[:size], left[size:]
        return chunk

    try:
        found = [outcome for outcomes in pool.outcomes(feed) for outcome in outcomes]
    except BaseException:
        _pools.pop(key).__exit__()
        raise
    return found, pool.reuses


def _job(content: bytes) -> Job:
    import hashlib

    digest = hashlib.sha256(content).hexdigest()
    if digest not in _content:
        _content[digest] = Job.of_content(content)
    return _content[digest]
