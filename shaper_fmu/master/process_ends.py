"""Handles FMUs that end their process: they do so with a message, and never with exit code 0.

C's exit() runs our handler before it ends the process. During an FMU's call the message names the call, and the exit code is 1.
Faults (abort, memory access and the like) end the process by their signal, after a line that was written beforehand: nothing
else is safe then. No process can intercept _exit(); only another process (`isolate=True`, the workers of sweeps) notices it.
The handlers are machine code, since C calls the first one after Python's end, too.
"""

from __future__ import annotations

import atexit
import ctypes
import os
import signal
import sys
import threading
from collections.abc import Callable
from contextlib import suppress
from typing import Any

from llvmlite import binding, ir

from shaper_fmu.master.fmu import remove_folders

_HEARS = sys.platform == "linux" and ctypes.sizeof(ctypes.c_void_p) == 8
_FAULTS = [getattr(signal, f"SIG{name}") for name in ("ABRT", "SEGV", "BUS", "FPE", "ILL")] if _HEARS else []
_ROOM, _FLAGS = 256, 136  # of C's struct sigaction: more than it has, and where its flags are
_ON_STACK = 0x08000000  # a handler's own stack, if there is one
_PID, _THREAD, _TEXT, _LENGTH, _ACTIONS = 0, 8, 16, 24, 32
"""Where things are in the memory that the handlers look at; it is never freed. The last one has room for all signals."""

_I32, _I64 = ir.IntType(32), ir.IntType(64)
_here = ctypes.CDLL(None) if _HEARS else None
_answer_type = ctypes.CFUNCTYPE(None, ctypes.c_int)
_made: tuple[int, int, Any] | None = None
"""The memory, the address of the handler of faults, and what must not be collected."""

_put_back: Callable[[], None] | None = None
"""Puts back what FMUs have changed in the process, so that a user can read the message."""

live: dict[int, tuple[str, str, str]] = {}
"""The instances by number: name, FMU, and the folder of its libraries."""

_silent = False


def _address(name: str) -> int:
    assert _here is not None
    return ctypes.cast(getattr(_here, name), ctypes.c_void_p).value or 0


def _module(memory: int, answer: int) -> str:
    """The handlers: `ended` (of exit) asks Python, `crashed` (of a signal) writes the text and gives the signal to who had it."""
    module = ir.Module("ends")

    def call(builder: Any, address: int, result: Any, *arguments: Any) -> Any:
        kind = ir.FunctionType(result, [argument.type for argument in arguments])
        return builder.call(builder.inttoptr(ir.Constant(_I64, address), kind.as_pointer()), arguments)

    def at(builder: Any, offset: int) -> Any:
        return builder.load(builder.inttoptr(ir.Constant(_I64, memory + offset), _I64.as_pointer()))

    def begun(name: str, *arguments: Any) -> tuple[Any, Any]:
        function = ir.Function(module, ir.FunctionType(ir.VoidType(), arguments), name)
        function.attributes.add("uwtable")  # so that the stack can be followed through it
        return function, ir.IRBuilder(function.append_basic_block())

    def is_here(builder: Any) -> Any:
        pid = builder.sext(call(builder, _address("getpid"), _I32), _I64)
        return builder.icmp_unsigned("==", pid, at(builder, _PID))

    function, builder = begun("ended", _I32, _I64)
    thread = builder.icmp_unsigned("==", call(builder, _address("pthread_self"), _I64), at(builder, _THREAD))
    with builder.if_then(builder.and_(is_here(builder), thread)):
        call(builder, answer, ir.VoidType(), function.args[0])
    builder.ret_void()

    function, builder = begun("crashed", _I32)
    with builder.if_then(is_here(builder)):
        call(builder, _address("write"), _I64, ir.Constant(_I32, 2), at(builder, _TEXT), at(builder, _LENGTH))
    number = builder.zext(function.args[0], _I64)
    action = builder.add(ir.Constant(_I64, memory + _ACTIONS), builder.mul(number, ir.Constant(_I64, _ROOM)))
    call(builder, _address("sigaction"), _I32, function.args[0], action, ir.Constant(_I64, 0))
    call(builder, _address("raise"), _I32, function.args[0])
    builder.ret_void()
    return str(module)


def _make() -> tuple[int, int, Any]:
    """Make the handlers, and have exit() call the first one."""
    assert _here is not None
    _here.calloc.restype, _here.calloc.argtypes = ctypes.c_void_p, (ctypes.c_size_t, ctypes.c_size_t)
    size = _ACTIONS + _ROOM * (max(_FAULTS) + 1)
    memory = int(_here.calloc(1, size))
    answer = _answer_type(_ended)
    module = binding.parse_assembly(_module(memory, ctypes.cast(answer, ctypes.c_void_p).value or 0))
    machine = binding.Target.from_default_triple().create_target_machine()
    engine = binding.create_mcjit_compiler(module, machine)
    engine.finalize_object()
    for kept in (engine, answer):  # the code outlives Python
        ctypes.pythonapi.Py_IncRef(ctypes.py_object(kept))
    if hasattr(_here, "on_exit"):
        _here.on_exit(ctypes.c_void_p(engine.get_function_address("ended")), None)
        atexit.register(_ended, 0)  # where an FMU has brought Python itself to its end
    return memory, engine.get_function_address("crashed"), (engine, answer)


class Ends:
    """While it is open, this thread is in FMUs' calls. `put_back` runs before an end of the process is reported."""

    def __init__(self, put_back: Callable[[], None]):
        global _made, _put_back
        self._memory = 0
        if not _HEARS or _silent:
            return
        if _made is None:
            _made = _make()
        self._memory, handler, _ = _made
        _put_back = put_back
        text = f"error: the process is ended by a fault in an FMU's code; {_fmus()}\n".encode()
        self._text = ctypes.create_string_buffer(text)
        self._set(_TEXT, ctypes.addressof(self._text))
        self._set(_LENGTH, len(text))
        self._set(_THREAD, threading.get_ident())
        self._set(_PID, os.getpid())
        self._install(handler)

    def _set(self, offset: int, value: int) -> None:
        ctypes.c_int64.from_address(self._memory + offset).value = value

    def _install(self, handler: int) -> None:
        assert _here is not None
        action = ctypes.create_string_buffer(_ROOM)
        ctypes.c_int64.from_buffer(action).value = handler
        ctypes.c_int32.from_buffer(action, _FLAGS).value = _ON_STACK
        for number in _FAULTS:
            kept = ctypes.c_void_p(self._memory + _ACTIONS + _ROOM * int(number))
            if _handler_of(number) == 0:  # nobody else's, such as faulthandler's, or that of a runtime
                _here.sigaction(int(number), action, kept)

    def close(self) -> None:
        """The calls have come back."""
        if not self._memory:
            return
        assert _here is not None
        self._set(_PID, 0)
        for number in _FAULTS:
            if _made is not None and _handler_of(number) == _made[1]:
                _here.sigaction(int(number), ctypes.c_void_p(self._memory + _ACTIONS + _ROOM * int(number)), None)


def _handler_of(number: int) -> int:
    """Address of a signal's handler; 0 for the default."""
    assert _here is not None
    found = ctypes.create_string_buffer(_ROOM)
    _here.sigaction(int(number), None, found)
    return ctypes.c_int64.from_buffer(found).value


def leave_ends_to_the_caller() -> None:
    """This process only runs FMUs: its caller notices its end and reports it."""
    global _silent
    _silent = True


def _ended(status: int) -> None:
    """exit() was called in the midst of an FMU's call."""
    if _made is None or _put_back is None or not live:
        return
    pid, thread = (ctypes.c_int64.from_address(_made[0] + offset).value for offset in (_PID, _THREAD))
    if (pid, thread) != (os.getpid(), threading.get_ident()):
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
