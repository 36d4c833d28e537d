"""Restores what FMUs change in the process, so that neither other FMUs nor the caller are affected.

`Kept` is around all calls of a run, and `keeping` around methods that make them. In between, `put_back` is called after calls: it
looks after what other FMUs' numbers depend on, and now and then, or if asked, after everything. How the processor calculates is put
back after each call of the compiled loop, too (see arithmetic.py).
"""

from __future__ import annotations

import functools
import os
import threading
import time
from collections.abc import Callable, Iterable
from contextlib import suppress
from enum import IntEnum
from types import TracebackType
from typing import Any, TypeVar, cast

from shaper_fmu.master.loop_library import loop
from shaper_fmu.master.process_ends import Ends
from shaper_fmu.master.process_environment import Environment, restore_environment
from shaper_fmu.master.process_parts import Arithmetic, Directory, Locale, NumpyErrors, Part, Processors, Streams, Umask
from shaper_fmu.master.process_signals import Interrupts, Signals, Timers

_ALL: tuple[type[Part], ...] = (
    Arithmetic, Directory, Locale, Streams, Umask, NumpyErrors, Processors, Signals, Timers, Environment,
)  # fmt: skip
_OFTEN = 0.02
"""Everything is looked after again when this time has passed [s]."""


class Share(IntEnum):
    """How many of the parts are looked after: what other FMUs' numbers depend on comes first."""

    ARITHMETIC = 1
    FOR_OTHERS = 3
    EVERYTHING = len(_ALL)


_threads = threading.local()
F = TypeVar("F", bound=Callable[..., Any])


class Kept:
    """Keeps the process's state in a with statement; at its end, and by `put_back`, changes are undone.

    Ctrl-C ends it by what Python raises for it (KeyboardInterrupt), whatever has become of that in the FMUs; an error that came of
    it is dropped. A copy of the process that an FMU has made is ended by it. One in another one does nothing. `last`: the FMUs are
    freed in it, so what they may have needed until then is put back, too. `changed` gets the names of what was put back.
    """

    def __init__(self, changed: dict[str, None] | None = None, last: bool = False):
        self._changed: dict[str, None] = changed if changed is not None else {}
        self._last = last
        self._parts: list[Part] = []
        self._outer = getattr(_threads, "kept", None)

    def __enter__(self) -> Kept:
        if self._outer is not None:
            return self
        loop()  # raises what it raises while there is nothing to put back
        self._interrupts = Interrupts()
        self._ends = Ends(lambda: self._restore(self._parts))
        try:
            for part in _ALL:
                self._parts.append(part())
        except BaseException:
            self._close()
            raise
        self._looked = time.monotonic()
        self._process = os.getpid()
        _threads.kept = self
        return self

    def put_back(self, share: Share) -> None:
        """See the function of this name."""
        self._end_copy()
        now = time.monotonic()
        if share is Share.EVERYTHING or now - self._looked > _OFTEN:
            self._looked, share = now, Share.EVERYTHING
        self._restore(self._parts[:share])
        if self._interrupts.error is not None:
            raise self._interrupts.error

    def __exit__(self, kind: type[BaseException] | None, error: BaseException | None, trace: TracebackType | None) -> None:
        if self._outer is None:
            self._end_copy()
            try:
                self._restore(self._parts)
            finally:
                _threads.kept = None
                self._close()
        if self._last and self._outer is None and restore_environment():
            self._changed[Environment.label] = None
        interrupt = self._interrupts.error if self._outer is None else None
        if interrupt is not None and (error is None or isinstance(error, Exception)):
            raise interrupt from None

    def _end_copy(self) -> None:
        """End a process that an FMU has forked and let return; otherwise all further work would be done and reported twice."""
        if os.getpid() != self._process:
            with suppress(OSError):
                os.write(2, b"note: an FMU has made a copy of its process (fork) and let it return; the copy is ended\n")
            os._exit(1)

    def _restore(self, parts: Iterable[Part]) -> None:
        for part in parts:
            if part.restore():
                self._changed[part.label] = None

    def _close(self) -> None:
        for part in self._parts:
            part.close()
        self._ends.close()
        self._interrupts.close()


def _leave_to_the_copy() -> None:
    """Forget the kept state in a process that Python has forked, such as a worker of multiprocessing."""
    _threads.kept = None


if hasattr(os, "register_at_fork"):
    os.register_at_fork(after_in_child=_leave_to_the_copy)


def put_back(share: Share) -> None:
    """After calls of FMUs inside of `Kept`: this share at least. Raises what Python has raised for Ctrl-C."""
    kept = getattr(_threads, "kept", None)
    if kept is not None:
        kept.put_back(share)


def keeping(method: F) -> F:
    """Decorator for a method that calls FMUs: keeps the process's state, and collects changes in its object's `changed`."""

    @functools.wraps(method)
    def kept(self: Any, *arguments: Any, **options: Any) -> Any:
        with Kept(self.changed):
            return method(self, *arguments, **options)

    return cast("F", kept)


def process_notes(changed: Iterable[str]) -> tuple[str, ...]:
    """Notes on the state that was restored."""
    named = sorted(changed)
    return (f"the FMUs have changed {', '.join(named)} in this process; that was restored",) if named else ()
