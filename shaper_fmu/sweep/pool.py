"""Worker processes of a sweep: fed, listened to, replaced when an FMU has killed one or hangs.

What a killed worker has not told is done again. The run it was at is tried once more in a fresh process; a run that kills a
second time is quarantined: it counts as failed, with the reason.
"""

from __future__ import annotations

import queue
import time
from collections.abc import Callable, Iterator
from dataclasses import dataclass, field

import msgspec

from shaper_fmu import errors
from shaper_fmu.errors import ModelError, ShaperFmuError, SimulationError
from shaper_fmu.master.isolated_process import BEGUN, CLOSED, Child
from shaper_fmu.sweep.job import Job
from shaper_fmu.sweep.store import Outcome, Task
from shaper_fmu.sweep.worker import CODE, NOW, Answer, tasks_frame

_POLL = 0.1
_CHUNK_SECONDS = 0.15  # at the end of a sweep some workers wait for the others, for a chunk at most
_MOST_TASKS = 2000
_TRIES = 2
"""A run that kills its worker this often is quarantined."""

_MOST_BARREN = 20

Feed = Callable[[int], list[Task]]
"""Gives up to so many tasks; none when there are no more."""


@dataclass
class _Worker:
    number: int
    child: Child
    open: dict[int, Task] = field(default_factory=dict)  # sent, and not answered yet, in their order
    begun: bool = False
    at: int = -1  # the run that it was seen at last
    since: float = 0.0  # when it was first seen there (monotonic clock) [s]


class Pool:
    """A number of worker processes for one job. Use it in a with statement: at its end they are gone."""

    def __init__(self, job: Job, workers: int):
        self._job = job
        self._answers: queue.SimpleQueue[tuple[int, bytes | None]] = queue.SimpleQueue()
        self._workers: dict[int, _Worker] = {}
        self._count, self._started = workers, 0
        self._seconds = 0.0  # what a run takes, about
        self._again: list[Task] = []  # sent to a worker that is gone
        self._suspects: list[Task] = []  # it was at one of these
        self._barren = 0  # workers that have ended since the last outcome
        self.reuses = True

    def __enter__(self) -> Pool:
        return self

    def __exit__(self, *error: object) -> None:
        for worker in self._workers.values():
            worker.child.__exit__()
        self._workers.clear()

    def outcomes(self, feed: Feed) -> Iterator[list[Outcome]]:
        """What becomes of all tasks that `feed` gives, as they are done. Raises what the workers raise before the first run."""
        while True:
            self._fill(feed)
            if not any(worker.open for worker in self._workers.values()) and not self._again and not self._suspects:
                return
            yield from self._answered()
            self._end_orphans()
            yield from self._overdue()

    def _fill(self, feed: Feed) -> None:
        """Keep every worker busy for a while, and start those that are missing."""
        size = int(_CHUNK_SECONDS / self._seconds) if self._seconds > 0.0 else 4
        size = max(1, min(_MOST_TASKS, size))
        numbers = list(self._workers)
        for _ in range(self._count - len(numbers)):
            tasks = self._next(feed, min(size, 4))
            if not tasks:
                break
            self._give(self._start(), tasks)
        for number in numbers:
            worker = self._workers[number]
            if worker.begun and len(worker.open) <= size // 2:
                tasks = self._next(feed, size)
                if tasks:
                    self._give(worker, tasks)

    def _next(self, feed: Feed, size: int) -> list[Task]:
        """Tasks that are to be done again first, suspects last and alone."""
        if self._again:
            tasks, self._again = self._again[:size], self._again[size:]
            return tasks
        tasks = feed(size)
        if not tasks and self._suspects:
            return [self._suspects.pop(0)]
        return tasks

    def _start(self) -> _Worker:
        number = self._started
        self._started += 1
        child = Child(self._job.content, CODE, NOW.size, lambda frame: self._answers.put((number, frame)), quiet=True)
        worker = self._workers[number] = _Worker(number, child.__enter__())
        child.put(self._job.content)
        return worker

    def _give(self, worker: _Worker, tasks: list[Task]) -> None:
        worker.open.update({task.id: task for task in tasks})
        worker.child.put(tasks_frame(tasks))

    def _answered(self) -> Iterator[list[Outcome]]:
        """Outcomes that have arrived; those of a worker that has ended are told by its end."""
        try:
            number, frame = self._answers.get(timeout=_POLL)
        except queue.Empty:
            return
        worker = self._workers.get(number)
        if worker is None:
            return
        if frame == BEGUN:
            worker.begun = True
        elif frame is None:
            yield from self._lost(worker, worker.child.end() + worker.child.last_words())
        elif frame != CLOSED:
            outcomes = self._taken(worker, frame)
            if outcomes:
                yield outcomes

    def _taken(self, worker: _Worker, frame: bytes) -> list[Outcome]:
        answer = msgspec.msgpack.decode(frame, type=Answer)
        if answer.error:
            raise _error(answer)
        self.reuses = self.reuses and answer.reuses
        for outcome in answer.outcomes:
            worker.open.pop(outcome.id, None)
        if answer.outcomes:
            self._barren = 0
            mean = sum(outcome.seconds for outcome in answer.outcomes) / len(answer.outcomes)
            self._seconds = mean if not self._seconds else 0.5 * (self._seconds + mean)
        return answer.outcomes

    def _lost(self, worker: _Worker, end: str) -> Iterator[list[Outcome]]:
        """A worker has ended: the run it was at is suspect, all others of its open ones are done again."""
        (at,) = NOW.unpack(worker.child.shared())
        worker.child.__exit__()
        del self._workers[worker.number]
        if not worker.begun:
            raise SimulationError(f"a worker ended before its first run: {end}")
        self._barren += 1
        if self._barren > _MOST_BARREN:
            raise SimulationError(f"{self._barren} workers in a row ended before they had done a run, the last one: {end}")
        suspect = worker.open.pop(at, None)
        self._again += worker.open.values()
        if suspect is None:
            return
        suspect = msgspec.structs.replace(suspect, attempts=suspect.attempts + 1)
        if suspect.attempts >= _TRIES:
            yield [Outcome(at, None, f"quarantined: it ended its worker {suspect.attempts} times: {end}", 0.0, suspect.attempts)]
        else:
            self._suspects.append(suspect)

    def _end_orphans(self) -> None:
        """A worker that has ended may leave processes that hold its channel open; without them, its end arrives."""
        for worker in self._workers.values():
            if worker.child.process.poll() is not None:
                worker.child.kill()

    def _overdue(self) -> Iterator[list[Outcome]]:
        """Kill workers whose run takes longer than allowed."""
        limit = self._job.time_limit
        if limit is None:
            return
        for worker in list(self._workers.values()):
            (at,) = NOW.unpack(worker.child.shared())
            if at != worker.at:
                worker.at, worker.since = at, time.monotonic()
            if not worker.begun or at < 0 or time.monotonic() - worker.since <= limit:
                continue
            worker.child.__exit__()
            del self._workers[worker.number]
            late = worker.open.pop(at, None)
            self._again += worker.open.values()
            if late is not None:
                yield [Outcome(at, None, f"killed after the time limit of {limit:g} s", limit, late.attempts + 1)]


def _error(answer: Answer) -> ShaperFmuError:
    """The error that a worker raised before its first run."""
    kind = getattr(errors, answer.error, None)
    if kind is ModelError:
        return ModelError(answer.text)
    if isinstance(kind, type) and issubclass(kind, ShaperFmuError):
        return kind("\n".join(answer.text))
    return SimulationError(f"a worker failed before its first run: {answer.error}: {'; '.join(answer.text)}")
