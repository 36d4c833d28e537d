"""The worker process of a sweep: reads tasks from its standard input, and sends their outcomes."""

from __future__ import annotations

import mmap
import os
import pickle
import struct
import sys
import threading
import time
from contextlib import suppress

import msgspec
import numpy as np

from shaper_fmu.master.isolated_process import BEGUN, CLOSED, read_frame, send
from shaper_fmu.master.once import OccupiedError
from shaper_fmu.master.process_ends import leave_ends_to_the_caller
from shaper_fmu.sweep.job import Doer, Work
from shaper_fmu.sweep.runs import Outcome, Task

CODE = (  # the FMUs' own words on standard output go to standard error, so the channel has the outcomes alone
    "import os; channel = os.dup(1); os.dup2(2, 1); from shaper_fmu.sweep.worker import serve; serve(channel, {window!r})"
)
NOW = struct.Struct("=q")
"""What the worker shares while it works: the number of the run that it is at, -1 for none."""

_SEND_AFTER = 0.05
"""Outcomes are sent when this time has passed [s]: so often that little is done twice, so seldom that it costs nothing."""


class Answer(msgspec.Struct):
    """Outcomes; or an error that ends the sweep, and the name of its class."""

    outcomes: list[Outcome] = []
    error: str = ""
    text: list[str] = []
    reuses: bool = True


def tasks_frame(tasks: list[Task]) -> bytes:
    """Tasks as they are sent."""
    return msgspec.msgpack.encode(tasks)


class _Channel:
    """The channel for answers. An FMU may close file descriptors that are not its own, and open others in their places."""

    def __init__(self, number: int):
        self._number = number
        self._file = self._identity()

    def _identity(self) -> tuple[int, int] | None:
        try:
            status = os.fstat(self._number)
        except OSError:
            return None
        return status.st_dev, status.st_ino

    def send(self, frame: bytes) -> None:
        """Send a frame; ends this process if it would go elsewhere."""
        if self._identity() != self._file:
            os.write(2, b"an FMU has closed the channel of its process\n")
            os._exit(1)
        send(self._number, frame)


def serve(number: int, window: str) -> None:
    """The worker's life: a job, then tasks, until standard input ends. Answers go to the file of this number."""
    leave_ends_to_the_caller()
    channel = _Channel(number)
    orders = os.fdopen(os.dup(0), "rb")
    os.dup2(os.open(os.devnull, os.O_RDONLY), 0)
    memory = mmap.mmap(-1, NOW.size, tagname=window) if sys.platform == "win32" else mmap.mmap(int(window), NOW.size)
    now = np.frombuffer(memory, np.int64, 1)
    now[0] = -1
    work = _Inbox(orders)
    try:
        job: Work = pickle.loads(work.next() or b"")
        runner = job.runner()
    except Exception as error:
        problems = getattr(error, "problems", [str(error)])
        channel.send(msgspec.msgpack.encode(Answer(error=type(error).__name__, text=problems)))
        return
    channel.send(BEGUN)
    with suppress(OccupiedError):  # this process is used up: what is left is given to another one
        while (frame := work.next()) is not None:
            _do(runner, msgspec.msgpack.decode(frame, type=list[Task]), now, channel)
    runner.close()
    channel.send(CLOSED)


class _Inbox:
    """Frames of standard input, read by a thread. When it ends, the caller is no more: a run that goes on is of no use."""

    def __init__(self, orders):
        self._frames: list[bytes] = []
        self._arrived = threading.Condition()
        self._ended = self._busy = False
        threading.Thread(target=self._read, args=(orders,), daemon=True).start()

    def _read(self, orders) -> None:
        while (frame := read_frame(orders)) is not None:
            with self._arrived:
                self._frames.append(frame)
                self._arrived.notify()
        with self._arrived:
            self._ended = True
            self._arrived.notify()
        if self._busy:
            time.sleep(1.0)  # the last run may be short
            os._exit(1)

    def next(self) -> bytes | None:
        """The next frame; None at the end."""
        with self._arrived:
            self._busy = False
            self._arrived.wait_for(lambda: self._frames or self._ended)
            self._busy = True
            return self._frames.pop(0) if self._frames else None


def _do(runner: Doer, tasks: list[Task], now: np.ndarray, channel: _Channel) -> None:
    done: list[Outcome] = []
    last = time.monotonic()
    try:
        for outcomes in runner.outcomes(tasks, now.ctypes.data):
            done += outcomes
            if time.monotonic() - last > _SEND_AFTER:
                _send(channel, done, runner)
                last, done = time.monotonic(), []
    except OccupiedError:
        _rest(now, channel, done, runner)
        raise
    _rest(now, channel, done, runner)


def _rest(now: np.ndarray, channel: _Channel, done: list[Outcome], runner: Doer) -> None:
    """Send the last outcomes, then mark that no run is active: an earlier end of the process counts for the last run."""
    _send(channel, done, runner)
    now[0] = -1


def _send(channel: _Channel, outcomes: list[Outcome], runner: Doer) -> None:
    channel.send(msgspec.msgpack.encode(Answer(outcomes, reuses=runner.reuses)))
