"""Handles FMUs that end their process: they do so with a message, and never with exit code 0.

C's exit() runs our handler before it ends the process. During an FMU's call the message names the call, and the exit code is 1.
Faults (abort, memory access and the like) end the process by their signal, after a line that was written beforehand: nothing
else is safe then. No process can intercept _exit(); only another process (`isolate=True`, the workers of sweeps) notices it.
The handlers are C (ends.c), since they are called after Python's end, too.
"""

from __future__ import annotations

import atexit
import ctypes
import os
import sys
from collections.abc import Callable
from contextlib import suppress

from shaper_fmu.master.fmu import remove_folders
from shaper_fmu.master.loop_library import loop

_HEARS = sys.platform == "linux" and ctypes.sizeof(ctypes.c_void_p) == 8
_here = ctypes.CDLL(None) if _HEARS else None
_answer_type = ctypes.CFUNCTYPE(None, ctypes.c_int)
_hearing = False

_put_back: Callable[[], None] | None = None
"""Puts back what FMUs have changed in the process, so that a user can read the message."""

live: dict[int, tuple[str, str, str]] = {}
"""The instances by number: name, FMU, and the folder of its libraries."""

_silent = False


def _hear() -> None:
    """Have exit() call us."""
    global _hearing
    _hearing = True
    answer = _answer_type(_ended)
    ctypes.pythonapi.Py_IncRef(ctypes.py_object(answer))  # it is called after Python's end
    if loop().hear_ends(ctypes.cast(answer, ctypes.c_void_p)):
        atexit.register(_ended, 0)  # where an FMU has brought Python itself to its end


class Ends:
    """While it is open, this thread is in FMUs' calls. `put_back` runs before an end of the process is reported."""

    def __init__(self, put_back: Callable[[], None]):
        global _put_back
        self._text = b""
        if not _HEARS or _silent:
            return
        self._text = f"error: the process is ended by a fault in an FMU's code; {_fmus()}\n".encode()
        if not _hearing:
            _hear()
        _put_back = put_back
        loop().enter_calls(self._text, len(self._text))

    def close(self) -> None:
        """The calls have come back."""
        if self._text:
            loop().leave_calls()


def leave_ends_to_the_caller() -> None:
    """This process only runs FMUs: its caller notices its end and reports it."""
    global _silent
    _silent = True


def _ended(status: int) -> None:
    """exit() was called in the midst of an FMU's call."""
    if _put_back is None or not live or not loop().is_in_calls():
        return
    try:
        for work in (_put_back, sys.stdout.flush, sys.stderr.flush):
            with suppress(Exception):
                work()
        assert _here is not None
        _here.fflush(None)
        message = f"error: {_caller()} has ended the process by exit({status}); the work is not finished\n"
        os.write(2, message.encode())
        remove_folders()
    finally:
        os._exit(1)


def _fmus() -> str:
    return "FMUs: " + ", ".join(f"{name} ({fmu})" for name, fmu, _ in live.values())


class _Symbol(ctypes.Structure):
    """C's Dl_info."""

    _fields_ = (
        ("file", ctypes.c_char_p), ("base", ctypes.c_void_p), ("name", ctypes.c_char_p), ("address", ctypes.c_void_p),
    )  # fmt: skip


def _caller() -> str:
    """The FMU function that called, read from the stack; without one, all FMUs."""
    assert _here is not None
    frames, symbol = (ctypes.c_void_p * 200)(), _Symbol()
    for frame in frames[: _here.backtrace(frames, len(frames))]:
        call = ctypes.c_void_p(frame - 1)  # what comes after one that never returns may be another function
        if not _here.dladdr(call, ctypes.byref(symbol)) or not (symbol.name or b"").startswith(b"fmi"):
            continue
        owners = [f"{name} ({fmu})" for name, fmu, folder in live.values() if os.fsdecode(symbol.file).startswith(folder)]
        if owners:
            return f"{' or '.join(owners)}: {symbol.name.decode()}"
    return f"an FMU's call ({_fmus()})"
