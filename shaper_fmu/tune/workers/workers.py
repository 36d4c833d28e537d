"""Worker processes for the experiments of a tuning, in the pool of the sweeps.

What a tuning decides by are its runs, and these do not depend on the process that makes them. The results of calls are taken in
their order, and counted in it, so that a tuning has the same bits with and without workers. An FMU that ends its worker is tried
once more, as in a sweep; then how it has ended is told.
"""

from __future__ import annotations

import pickle
import tempfile
from collections.abc import Callable, Iterator, Sequence
from contextlib import suppress
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np

from shaper_fmu.sweep.pool import Pool
from shaper_fmu.sweep.runs import Task
from shaper_fmu.tune.workers.call import KNOWN, RUNS, Call, Calls, write_whole
from shaper_fmu.tune.workers.logged import Done

if TYPE_CHECKING:
    from shaper_fmu.tune.meter import Budget
    from shaper_fmu.tune.plant import Plant

_AMPLE = 10.0
"""Times what a call is expected to take that its share of a budget of steps must be."""


class Workers:
    """So many processes, which are started with the first calls. Close it at the end.

    Args:
        count: of the processes, at least 2.
    """

    def __init__(self, count: int):
        self.count: int = count
        self._folder = tempfile.TemporaryDirectory(prefix="shaper-fmu-tune-", ignore_cleanup_errors=True)
        self._path = Path(self._folder.name)
        for name in (RUNS, KNOWN):
            (self._path / name).mkdir()
        self._pool: Pool | None = None
        self._calls = 0

    def close(self) -> None:
        """End the processes."""
        if self._pool is not None:
            self._pool.__exit__()
        self._pool = None
        self._folder.cleanup()

    def each(
        self, plant: Plant, function: Callable[..., Any], arguments: Sequence[tuple[Any, ...]], expected: float = 0.0
    ) -> Iterator[Done | None]:
        """What becomes of the function with the plant and each of these arguments, in their order.

        None for a call that the caller has to do itself: where a budget of steps might not do for all that are under way, each of
        which is expected to take so many, and after a Ctrl-C, which is kept as `Meter.stopped`.
        """
        waiting = list(arguments)
        try:
            while waiting:
                budget, size = self._shares(plant, len(waiting), expected)
                if not size:
                    break
                batch, waiting = waiting[:size], waiting[size:]
                first, self._calls = self._calls, self._calls + len(batch)
                kept = plant.kept.path if plant.kept is not None and plant.kept.path.is_file() else None
                for number, more in enumerate(batch, first):
                    Call(function, plant, more, budget, kept).write(self._path / f"{number}.call")
                yield from self._in_order(first, len(batch))
        except KeyboardInterrupt as error:
            if type(error) is not KeyboardInterrupt:  # SIGTERM: there is no time for what is known
                raise
            plant.meter.stopped = error
            self.close_pool()
        self.collect(plant)
        while True:
            yield None

    def close_pool(self) -> None:
        """End the processes; others are started with the next calls."""
        if self._pool is not None:
            self._pool.__exit__()
        self._pool = None

    def share(self, plant: Plant) -> None:
        """Have the workers know the runs in the plant's memory."""
        for key, arrays in plant.memory.items():
            path = self._path / KNOWN / key
            if not path.exists():
                write_whole(path, (arrays, 0.0))

    def collect(self, plant: Plant) -> None:
        """Keep all runs that workers have made in the plant's file, if it has one."""
        for path in (self._path / RUNS).iterdir() if plant.kept is not None else ():
            if not path.name.endswith(".draft"):
                self._keep(plant, path.name)

    def take(self, plant: Plant, done: Done, *, ahead: bool) -> None:
        """Take over the runs of a call: with `ahead` as runs that are not counted yet, else into the plant's file."""
        for key in done.runs:
            if not ahead:
                self._keep(plant, key)
                continue
            plant.ahead[key] = self._run(key)

    def _keep(self, plant: Plant, key: str) -> None:
        if plant.kept is not None and plant.kept.found(key) is None:
            plant.kept.keep(key, *self._run(key)[0])

    def _run(self, key: str) -> tuple[tuple[np.ndarray, ...], float]:
        return pickle.loads((self._path / RUNS / key).read_bytes())

    def _shares(self, plant: Plant, waiting: int, expected: float) -> tuple[Budget, int]:
        """The budget of each call, and how many calls are given at once."""
        left = plant.meter.left()
        if left.steps is None:
            return left, waiting
        size = min(waiting, self.count, int(left.steps / max(1.0, _AMPLE * expected)))
        return (type(left)(left.steps // size, left.seconds) if size else left), size

    def _in_order(self, first: int, count: int) -> Iterator[Done]:
        """The results of the calls from the first number on, in their order."""
        if self._pool is None:
            self._pool = Pool(Calls(str(self._path)), self.count).__enter__()
        given, ended = 0, {}

        def feed(_: int) -> list[Task]:
            nonlocal given
            if given == count or given - len(ended) >= self.count:  # each worker has one call at a time
                return []
            given += 1
            return [Task(first + given - 1, "", ())]

        wanted = first
        for outcomes in self._pool.outcomes(feed):
            ended |= {one.id: one for one in outcomes}
            while wanted in ended:
                yield self._done(wanted, ended[wanted].reason)
                wanted += 1

    def _done(self, number: int, reason: str | None) -> Done:
        with suppress(FileNotFoundError):
            (self._path / f"{number}.call").unlink()
        if reason is not None:
            return Done(ended=reason)
        path = self._path / f"{number}.done"
        done: Done = pickle.loads(path.read_bytes())
        path.unlink()
        return done
