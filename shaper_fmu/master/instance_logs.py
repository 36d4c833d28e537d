"""The callbacks of FMI 1.0 and 2.0, and where the messages of live instances go."""

from __future__ import annotations

from collections import deque
from ctypes import byref, c_void_p, cast

import fmpy
from fmpy.fmi1 import (
    fmi1CallbackAllocateMemoryTYPE,
    fmi1CallbackFreeMemoryTYPE,
    fmi1CallbackFunctions,
    fmi1CallbackLoggerTYPE,
    printLogMessage,
)
from fmpy.fmi2 import (
    fmi2CallbackAllocateMemoryTYPE,
    fmi2CallbackFreeMemoryTYPE,
    fmi2CallbackFunctions,
    fmi2CallbackLoggerTYPE,
)
from fmpy.logging import addLoggerProxy

from shaper_fmu.master.process_signals import SILENT

LOGS: dict[int, deque[str]] = {}
"""Log messages by the instance's number, which is its component environment."""
LOGS1: dict[int | bytes, deque[str]] = {}
"""By the instance's name, and of FMI 1.0, which has no number, by its address: while it is made its address is not known, and
some FMUs of FMI 2.0 call without a number (20-sim's)."""


def _log(environment: int | None, name: bytes, status: int, category: bytes, message: bytes) -> None:
    log = LOGS.get(environment or 0)
    log = LOGS1.get(environment or 0, LOGS1.get(name)) if log is None else log
    if log is None:
        printLogMessage(c_void_p(environment), name, status, category, message)
    else:
        log.append(text_of(message))


def text_of(message: bytes | None) -> str:
    """An FMU's message as text."""
    return (message or b"").decode("utf-8", "replace").strip()


SILENT.update((_log.__code__, text_of.__code__))


def _make_callbacks() -> fmi2CallbackFunctions:
    """fmpy's logger proxy keeps one Python function for the whole process, so all instances share this one."""
    callbacks = fmi2CallbackFunctions()
    callbacks.logger = fmi2CallbackLoggerTYPE(_log)
    callbacks.allocateMemory = fmi2CallbackAllocateMemoryTYPE(fmpy.calloc)
    callbacks.freeMemory = fmi2CallbackFreeMemoryTYPE(fmpy.free)
    addLoggerProxy(byref(callbacks))
    return callbacks


_callbacks = _make_callbacks()


def callbacks2(environment: int) -> fmi2CallbackFunctions:
    """The callbacks of FMI 2.0 for the instance of this number."""
    callbacks = fmi2CallbackFunctions.from_buffer_copy(_callbacks)
    callbacks.componentEnvironment = environment
    return callbacks


def _make_callbacks1() -> fmi1CallbackFunctions:
    """With the same logger, whose first argument is the instance."""
    callbacks = fmi1CallbackFunctions()
    callbacks.logger = cast(_callbacks.logger, fmi1CallbackLoggerTYPE)
    callbacks.allocateMemory = cast(_callbacks.allocateMemory, fmi1CallbackAllocateMemoryTYPE)
    callbacks.freeMemory = cast(_callbacks.freeMemory, fmi1CallbackFreeMemoryTYPE)
    return callbacks


CALLBACKS1 = _make_callbacks1()
"""The callbacks of FMI 1.0."""
