"""Signal handlers and timers that an FMU may change: restored, except what a runtime inside of the FMU needs.

A handler of an error in the program (SIGSEGV, SIGFPE, ...) or of a timer stays as long as its code is loaded: runtimes such as
Java's or Go's would crash without. All others, such as SIGINT's and SIGPIPE's, are the caller's, and put back at once.
"""

from __future__ import annotations

import _signal  # signal's own functions look up a name for every number  # pyright: ignore[reportMissingImports]
import ctypes
import signal
import sys
import threading
import time
from contextlib import suppress
from typing import Any

import numpy as np

POSIX = sys.platform != "win32"
_RUNTIMES = ("SEGV", "BUS", "FPE", "ILL", "ABRT", "URG", "PROF", "ALRM", "VTALRM", "USR1", "USR2")
_CALLERS = ("INT", "TERM", "HUP", "QUIT", "PIPE", "CHLD", "TSTP", "WINCH", "XFSZ")


def _numbers(names: tuple[str, ...]) -> tuple[int, ...]:
    return tuple(int(getattr(signal, f"SIG{name}")) for name in names if hasattr(signal, f"SIG{name}"))


_OF_RUNTIMES, _OF_CALLER = _numbers(_RUNTIMES), _numbers(_CALLERS)
_WATCHED = _OF_CALLER + _OF_RUNTIMES
_ROOM = 256
"""Bytes, more than C's struct sigaction has anywhere. It begins with the handler."""

_RELEVANT = np.r_[0:16, 136:140] if sys.platform == "linux" else np.r_[0:16]
"""The relevant bytes: handler, mask and flags. On Linux the mask has room for more signals than there are."""

_here = ctypes.CDLL(None) if POSIX else None
_buffer = np.zeros((len(_WATCHED), _ROOM), np.uint8)
_places = [(ctypes.c_int(number), ctypes.c_void_p(row.ctypes.data)) for number, row in zip(_WATCHED, _buffer, strict=True)]

_left: dict[int, tuple[bytes, bytes]] = {}
"""By signal: the action that was found, and the relevant bytes of an FMU's action that was left."""


def _actions() -> np.ndarray:
    """C's actions for all signals that are watched, a row each."""
    if _here is not None:
        for number, place in _places:
            _here.sigaction(number, None, place)
    return _buffer.copy()


def _set_action(number: int, action: bytes) -> None:
    assert _here is not None
    _here.sigaction(number, action, None)


def _handler(action: bytes) -> int:
    return int.from_bytes(action[: ctypes.sizeof(ctypes.c_void_p)], sys.byteorder)


def _is_loaded(address: int) -> bool:
    """Whether there is a library (or program) with code at this address; 0 and 1 are no addresses but default and ignored."""
    assert _here is not None
    return address > 1 and bool(_here.dladdr(ctypes.c_void_p(address), ctypes.create_string_buffer(64)))


class Signals:
    """Signal handlers in C and in Python, and this thread's signal mask."""

    label = "the treatment of signals"

    def __init__(self) -> None:
        if POSIX:
            self._mask = _signal.pthread_sigmask(signal.SIG_BLOCK, ())
            self._handlers = {number: _signal.getsignal(number) for number in _OF_CALLER}
            self._actions = _actions()

    def restore(self) -> bool:
        """Restore the caller's handlers, and those that no FMU needs any more."""
        if not POSIX:
            return False
        changed = False
        for number, handler in self._handlers.items():
            if _signal.getsignal(number) is not handler and threading.current_thread() is threading.main_thread():
                changed = True
                with suppress(TypeError, ValueError):  # one that was set in C is None for Python
                    signal.signal(number, handler)
        found = _actions()
        differing = (found[:, _RELEVANT] != self._actions[:, _RELEVANT]).any(axis=1)
        for i, number in enumerate(_WATCHED):
            if differing[i] or number in _left:
                changed = _restore_action(number, self._actions[i].tobytes(), found[i].tobytes()) or changed
        if _signal.pthread_sigmask(signal.SIG_BLOCK, ()) != self._mask:
            changed = True
            signal.pthread_sigmask(signal.SIG_SETMASK, self._mask)
        return changed

    def close(self) -> None:
        """Nothing is held."""


def _restore_action(number: int, kept: bytes, found: bytes) -> bool:
    current = bytes(found[i] for i in _RELEVANT)
    original = _left[number][0] if number in _left and _left[number][1] == current else kept
    if current == bytes(original[i] for i in _RELEVANT):
        return False
    if number in _OF_RUNTIMES and _is_loaded(_handler(found)):
        _left[number] = original, current
        return False
    _left.pop(number, None)
    _set_action(number, original)
    return True


_TIMERS: dict[int, int] = {signal.ITIMER_REAL: signal.SIGALRM, signal.ITIMER_VIRTUAL: signal.SIGVTALRM} if POSIX else {}
_started: set[int] = set()
"""Timers that an FMU has started, and whose signal it handles."""


class Timers:
    """Timers whose signal would end the process."""

    label = "the timers"

    def __init__(self) -> None:
        self._kept: dict[int, Any] = {timer: signal.getitimer(timer) for timer in _TIMERS}
        self._since = time.monotonic()

    def restore(self) -> bool:
        """Stop FMUs' timers without a handler, and restart the caller's."""
        changed = False
        for timer, (left, interval) in self._kept.items():
            left_now = signal.getitimer(timer)[0]
            due = left - (time.monotonic() - self._since)
            if left_now and (not left or timer in _started):
                if _handler(_actions()[_WATCHED.index(_TIMERS[timer])].tobytes()) > 1:
                    _started.add(timer)
                else:
                    signal.setitimer(timer, 0.0)
                    _started.discard(timer)
                    changed = True
            elif due > 0.0 and not left_now and timer == signal.ITIMER_REAL and timer not in _started:
                signal.setitimer(timer, due, interval)
                changed = True
        return changed

    def close(self) -> None:
        """Nothing is held."""


class Interrupts:
    """Hears Ctrl-C, and SIGTERM where Python treats it, even where an FMU swallows what Python raises then.

    Such an FMU is written in Python itself, or it was calling our logger. `error` is what Python has raised.
    """

    def __init__(self) -> None:
        self.error: BaseException | None = None
        self._previous: dict[int, Any] = {}
        if threading.current_thread() is threading.main_thread():
            for number in (signal.SIGINT, signal.SIGTERM):
                previous = signal.getsignal(number)
                if callable(previous):
                    self._previous[number] = previous
                    signal.signal(number, self._hear)

    def _hear(self, number: int, frame: Any) -> None:
        try:
            self._previous[number](number, frame)
        except BaseException as error:
            self.error = error
            if frame is not None and frame.f_code in SILENT:
                return
            raise

    def close(self) -> None:
        """Give the signals back to who had them."""
        for number, previous in self._previous.items():
            signal.signal(number, previous)


SILENT: set[Any] = set()
"""Code of functions that FMUs call, where nothing can be raised."""
