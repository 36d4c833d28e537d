"""Worker processes of a sweep: feeds them, reads their answers, and replaces one that an FMU has killed or that hangs.

Runs that a killed worker has not answered are repeated. Its current run is tried once more in a fresh process; a run that kills a
second time is quarantined: it counts as failed, with the reason. A worker whose answers cannot be read, or are to runs that it
was not asked for, is broken: what it was asked for counts, the rest does not, and it is replaced as if it had been killed.
"""

from __future__ import annotations

import queue
import time
from collections.abc import Callable, Iterator
from dataclasses import dataclass, field
from itertools import islice

import msgspec

from shaper_fmu import errors
from shaper_fmu.errors import ModelError, ShaperFmuError, SimulationError
from shaper_fmu.master.isolated_process import BEGUN, CLOSED, Child
from shaper_fmu.sweep.job import Work
from shaper_fmu.sweep.runs import Outcome, Task
from shaper_fmu.sweep.worker import CODE, NOW, Answer, tasks_frame

_POLL = 0.1
_CHUNK_SECONDS = 0.15  # at the end of a sweep some workers wait for the others, for a chunk at most
_MOST_TASKS = 2000
_TRIES = 2
"""A run that kills its worker this often is quarantined."""

_MOST_BARREN = 20
_MOST_STARTS = 5
"""So many workers in a row may end before they are ready."""

_START_SECONDS = 60.0
"""What a process may take to load and to compile, beside the time limit of a run [s]."""

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

    def run(self) -> int:
        """The run that it is at now, -1 if none."""
        return NOW.unpack(self.child.shared())[0] if self.begun else -1


class Pool:
    """A number of worker processes for one job. Use it in a with statement: at its end they are gone."""

    def __init__(self, job: Work, workers: int):
        self._job = job
        self._answers: queue.SimpleQueue[tuple[int, bytes | None]] = queue.SimpleQueue()
        self._workers: dict[int, _Worker] = {}
        self._count, self._started = workers, 0
        self._seconds = 0.0  # what a run takes, about
        self._again: list[Task] = []  # sent to a worker that is gone
        self._suspects: list[Task] = []  # it was at one of these
        self._apart: set[int] = set()  # suspects that were given to a worker that has nothing else
        self._barren = 0  # workers that have ended since the last outcome
        self._unready = 0  # workers that have ended since the last one was ready
        self.reuses: bool = True

    def __enter__(self) -> Pool:
        return self

    def __exit__(self, *error: object) -> None:
        for worker in self._workers.values():
            worker.child.__exit__()
        self._workers.clear()

    def outcomes(self, feed: Feed) -> Iterator[list[Outcome]]:
        """The outcomes of all tasks of `feed`, as they are done. Raises the workers' errors before the first run."""
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
            if worker.begun and len(worker.open) <= size // 2 and not self._apart.intersection(islice(worker.open, 1)):
                tasks = self._next(feed, size, not worker.open)
                if tasks:
                    self._give(worker, tasks)

    def _next(self, feed: Feed, size: int, idle: bool = True) -> list[Task]:
        """The next tasks: repeated ones first, suspects last and alone, on an idle worker."""
        if self._again:
            tasks, self._again = self._again[:size], self._again[size:]
            return tasks
        tasks = feed(size)
        if not tasks and self._suspects and idle:
            tasks = [self._suspects.pop(0)]
            self._apart.add(tasks[0].id)
        return tasks

    def _start(self) -> _Worker:
        number = self._started
        self._started += 1
        child = Child(self._job.content, CODE, NOW.size, lambda frame: self._answers.put((number, frame)), quiet=True)
        worker = self._workers[number] = _Worker(number, child.__enter__(), since=time.monotonic())
        child.put(self._job.content)
        return worker

    def _give(self, worker: _Worker, tasks: list[Task]) -> None:
        worker.open.update({task.id: task for task in tasks})
        worker.child.put(tasks_frame(tasks))

    def _answered(self) -> Iterator[list[Outcome]]:
        """Outcomes that have arrived; an ended worker's outcomes follow from its end."""
        try:
            number, frame = self._answers.get(timeout=_POLL)
        except queue.Empty:
            return
        worker = self._workers.get(number)
        if worker is None:
            return
        if frame == BEGUN:
            worker.begun, self._unready = True, 0
        elif frame is None:
            end, by_itself = worker.child.end(), worker.child.ended_itself
            yield from self._lost(worker, end + worker.child.last_words(), by_itself)
        elif frame != CLOSED:
            yield from self._taken(worker, frame)

    def _taken(self, worker: _Worker, frame: bytes) -> Iterator[list[Outcome]]:
        broken = ""
        try:
            answer = msgspec.msgpack.decode(frame, type=Answer)
        except (msgspec.DecodeError, UnicodeDecodeError) as error:
            answer, broken = Answer(), f"it gave an answer that cannot be read ({error})"
        if answer.error and not worker.begun:
            raise _error(answer)
        self.reuses = self.reuses and answer.reuses
        outcomes = [one for one in answer.outcomes if self._is_open(worker, one) and worker.open.pop(one.id)]
        if outcomes:
            self._barren = 0
            mean = sum(outcome.seconds for outcome in outcomes) / len(outcomes)
            self._seconds = mean if not self._seconds else 0.5 * (self._seconds + mean)
            yield outcomes
        if len(outcomes) < len(answer.outcomes):
            broken = "it answered for runs that it was not asked for, or twice"
        if broken:
            yield from self._lost(worker, broken, False)

    def _is_open(self, worker: _Worker, outcome: Outcome) -> bool:
        """Whether this is an answer to an open task of the worker."""
        is_valid = outcome.reason is not None if outcome.metrics is None else len(outcome.metrics) == len(self._job.metrics)
        return is_valid and outcome.id in worker.open

    def _lost(self, worker: _Worker, end: str, at_once: bool = True) -> Iterator[list[Outcome]]:
        """A worker has ended: its current run is suspect, its other open runs are repeated.

        If it has gone on after what it ended for (not `at_once`), all of them are suspect.
        """
        at, left = worker.run(), worker.open
        worker.child.__exit__()
        del self._workers[worker.number]
        self._count_end(worker, end)
        if not at_once and worker.begun and len(left) > 1:
            self._suspects += left.values()
            return
        suspect = left.pop(at if at_once else next(iter(left), -1), None) if worker.begun else None
        self._again += left.values()
        if suspect is None:
            return
        self._barren = 0 if self._seconds else self._barren
        suspect = msgspec.structs.replace(suspect, attempts=suspect.attempts + 1)
        if suspect.attempts >= _TRIES:
            reason = f"quarantined: it ended its worker {suspect.attempts} times: {end}"
            yield [Outcome(suspect.id, None, reason, 0.0, suspect.attempts)]
        else:
            self._suspects.append(suspect)

    def _count_end(self, worker: _Worker, end: str) -> None:
        """Raise SimulationError if workers end in a row, and nothing comes of it."""
        self._barren += 1
        if not worker.begun:
            self._unready += 1
        if self._unready >= _MOST_STARTS:
            if not any(other.begun for other in self._workers.values()):
                raise SimulationError(f"{self._unready} workers in a row ended before their first run, the last one: {end}")
            self._count, self._unready = len(self._workers), 0  # there is no room for more: memory, a licence
        if self._barren > _MOST_BARREN:
            raise SimulationError(f"{self._barren} workers in a row ended before they had done a run, the last one: {end}")

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
            at = worker.run()
            if at != worker.at:
                worker.at, worker.since = at, time.monotonic()
            spent = time.monotonic() - worker.since
            if not worker.begun and spent > limit + _START_SECONDS:
                yield from self._lost(worker, f"it was not ready {limit + _START_SECONDS:g} s after its start")
            if at < 0 or spent <= limit:
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
