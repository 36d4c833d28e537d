"""Starts, watches and kills child processes that run FMUs, for isolated runs and for the workers of sweeps."""

from __future__ import annotations

import io
import math
import mmap
import os
import queue
import signal as signals_of
import subprocess
import sys
import tempfile
import threading
import time
from collections.abc import Callable, Iterator
from contextlib import suppress
from subprocess import Popen
from typing import IO, Any

from shaper_fmu.master import layout as of
from shaper_fmu.master.simulation import Progress
from shaper_fmu.search_path import with_search_path

BEGUN, CLOSED = b"begun", b"closed"  # what the child sends beside its answer
_POLL_SECONDS = 0.1
_HEAD = b"\x93fm"  # begins every frame; its length follows
_CHILD = (  # the FMUs' own words on standard output go to standard error, so the channel has the answers alone
    "import os; channel = os.dup(1); os.dup2(2, 1); from shaper_fmu.master.isolated import serve; serve(channel, {window!r})"
)


class Child:
    """The child process, seen from the caller. The with statement ends it in any case.

    `code` is what it runs, with {window} for the memory of `size` bytes that it shares with the caller; `sink` takes what it
    sends, and None at the end. What it writes to standard error is passed on unless `quiet`.
    """

    def __init__(
        self,
        plan: bytes,
        code: str = _CHILD,
        size: int = of.CONTROL.itemsize,
        sink: Callable[[bytes | None], None] | None = None,
        quiet: bool = False,
    ):
        self._begun = self._killed = False
        self._quiet = quiet
        self.ended_itself: bool = True  # it has not been killed for what it did to its channel; see `end`
        self._answers: queue.SimpleQueue[bytes | None] = queue.SimpleQueue()
        self._sink = sink or self._answers.put
        self._tail = b""
        options: dict[str, Any] = {"start_new_session": True}  # Ctrl-C is for the caller, who ends the whole group
        with tempfile.TemporaryFile() as file:
            if sys.platform == "win32":
                window = f"shaper-fmu-{os.getpid()}-{id(self)}"
                self._memory = mmap.mmap(-1, size, tagname=window)
                options = {"creationflags": subprocess.CREATE_NEW_PROCESS_GROUP}
            else:
                file.truncate(size)
                self._memory, window = mmap.mmap(file.fileno(), size), str(file.fileno())
                options["pass_fds"] = (file.fileno(),)
            command, environment = with_search_path(code.format(window=window))
            self.process: Popen[str] = subprocess.Popen(
                command, stdin=subprocess.PIPE, stdout=subprocess.PIPE, stderr=subprocess.PIPE, env=environment, **options
            )
        self._threads = [threading.Thread(target=work, daemon=True) for work in (self._listen, self._relay)]
        self._plan = plan

    def __enter__(self) -> Child:
        for thread in self._threads:
            thread.start()
        return self

    def __exit__(self, *error: object) -> None:
        self.kill()
        for thread, stream in zip(self._threads, (self.process.stdout, self.process.stderr), strict=True):
            thread.join(1.0)
            if stream is not None and not thread.is_alive():  # else a process that has left the group keeps it open
                stream.close()
        with suppress(BrokenPipeError):
            self.process.stdin.close()  # pyright: ignore[reportOptionalMemberAccess]
        self._memory.close()

    def frames(self, time_limit: float | None, progress: Progress | None) -> Iterator[bytes]:
        """The child's frames, until it has finished or ended.

        Raises TimeoutError when the limit is over, which counts from the first call of an FMU on.
        """
        deadline, reported = math.inf, -math.inf
        self.put(self._plan)
        while True:
            with suppress(queue.Empty):
                patience = 5.0 if self._killed else max(0.0, min(_POLL_SECONDS, deadline - time.monotonic()))
                frame = self._answers.get(timeout=patience)
                if frame is None:
                    return
                if frame == BEGUN:
                    self._begun = True
                    deadline = time.monotonic() + (time_limit or math.inf)
                yield frame
                if frame == CLOSED:
                    return
                continue
            if self.process.poll() is not None:
                if self._killed:
                    return
                self.kill()  # what it has started may keep the channel open; what it has sent is still read
            if time.monotonic() >= deadline:
                raise TimeoutError
            if progress is not None and isinstance(self.time, float) and self.time > reported:
                reported = self.time
                progress(reported)

    def put(self, frame: bytes) -> None:
        """Send a frame; if the process has ended, the frame is lost."""
        with suppress(BrokenPipeError):
            assert self.process.stdin is not None
            send(self.process.stdin.fileno(), frame)

    def shared(self) -> bytes:
        """The content of the shared memory."""
        return self._memory[:]

    @property
    def time(self) -> float | str:
        """The simulated time [s] that the loop has reached, or what comes before."""
        control = of.Control.from_buffer_copy(self._memory[:])
        before = "initialization" if self._begun else "the start of its process"
        return float(control.t) if control.step > 0.0 else before

    def end(self) -> str:
        """A message on how the process ended."""
        try:
            self.process.wait(2.0)
        except subprocess.TimeoutExpired:
            self.ended_itself = False
        status = self.kill()
        if not self.ended_itself:
            return "its process had closed its channel, or written into it, and was killed"
        if status >= 0:
            return f"its process ended with exit status {status if status < 1 << 16 else hex(status)}"
        name = next((known.name for known in signals_of.Signals if known == -status), f"signal {-status}")
        return f"its process was ended by {name} ({signals_of.strsignal(-status)})"

    def last_words(self) -> str:
        """The last lines of its standard error, as part of a message."""
        self._threads[1].join(1.0)
        lines = [line.strip() for line in self._tail.decode("utf-8", "replace").splitlines() if line.strip()]
        return f"; last messages: {'; '.join(lines[-3:])}" if lines else ""

    def kill(self) -> int:
        """Kill the process and its child processes; returns its status."""
        if sys.platform == "win32":
            self.process.kill()
        elif not self._killed:
            with suppress(ProcessLookupError, PermissionError):
                os.killpg(self.process.pid, signals_of.SIGKILL)
        self._killed = True
        return self.process.wait()

    def _listen(self) -> None:
        assert self.process.stdout is not None
        while (frame := read_frame(self.process.stdout)) is not None:
            self._sink(frame)
        self._sink(None)

    def _relay(self) -> None:
        """Forward its standard error, and keep the last lines."""
        assert isinstance(self.process.stderr, io.BufferedReader)
        while chunk := self.process.stderr.read1(4096):
            self._tail = (self._tail + chunk)[-4096:]
            if self._quiet:
                continue
            with suppress(OSError, ValueError, AttributeError):  # the caller may have no standard error
                sys.stderr.write(chunk.decode("utf-8", "replace"))


def send(channel: int, frame: bytes) -> None:
    data = memoryview(_HEAD + len(frame).to_bytes(5, "little") + frame)
    while data:
        data = data[os.write(channel, data) :]


def read_frame(stream: IO[bytes]) -> bytes | None:
    """The next frame; None at the end, or if it is incomplete or invalid: an FMU may write into any file."""
    head = stream.read(len(_HEAD) + 5)
    if not head.startswith(_HEAD):
        return None
    length = int.from_bytes(head[len(_HEAD) :], "little")
    try:
        frame = stream.read(length) if length else b""
    except MemoryError:  # a length that is none
        return None
    return frame if frame and len(frame) == length else None
