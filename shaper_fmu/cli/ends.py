"""Ends commands that are interrupted: exit code 130 after Ctrl-C, 143 after SIGTERM, with all resources released."""

from __future__ import annotations

import os
import re
import signal
import sys
import threading
from collections.abc import Iterator
from contextlib import contextmanager, suppress
from types import FrameType
from typing import Any

import typer
from typer.core import TyperGroup

from shaper_fmu.console import err
from shaper_fmu.errors import nearest

INTERRUPTED, TERMINATED = 130, 143
_PATIENCE = 10.0
"""So long is waited for a call of an FMU that goes on after SIGTERM [s]."""


class Terminated(KeyboardInterrupt):
    """Raised for SIGTERM: treated as Ctrl-C is, but for the exit code."""


def end_message(error: KeyboardInterrupt) -> tuple[str, int]:
    """The message for an end by a signal, and the exit code."""
    return ("ended by SIGTERM", TERMINATED) if isinstance(error, Terminated) else ("interrupted", INTERRUPTED)


def readable(message: str) -> str:
    """A message of the parser as a sentence, with the nearest of the words that it lists."""
    found = re.fullmatch(r"(?:Value error, )?('.*?') is not one of ('.*')\.?", message)
    if found is None:
        return message.removeprefix("Value error, ")
    given, known = found[1].strip("'"), [one.strip("' ") for one in found[2].split(",")]
    hint = nearest(given, known)
    return f"{found[1]} is not one of {found[2]}.{hint if 'Did you mean' in hint else ''}"


class Commands(TyperGroup):
    """The group of commands; prints a message when a signal ends one."""

    def invoke(self, ctx: Any) -> Any:
        """Do the command."""
        try:
            return super().invoke(ctx)
        except typer.BadParameter as error:
            error.message = readable(error.message)
            raise
        except KeyboardInterrupt as error:
            message, code = end_message(error)
            err.print(f"{message} before the work was finished")
            raise typer.Exit(code) from None


@contextmanager
def sigterm_heard() -> Iterator[None]:
    """Inside, SIGTERM ends the command in order. If SIGTERM is ignored or handled otherwise, nothing changes."""
    in_main_thread = threading.current_thread() is threading.main_thread()
    if sys.platform == "win32" or not in_main_thread or signal.getsignal(signal.SIGTERM) is not signal.SIG_DFL:
        yield
        return
    handled = threading.Event()

    def raise_it(number: int, frame: FrameType | None) -> None:
        handled.set()
        raise Terminated

    read_end, write_end = os.pipe()
    os.set_blocking(write_end, False)
    threading.Thread(target=_watch, args=(read_end, handled), daemon=True).start()
    signal.signal(signal.SIGTERM, raise_it)
    before = signal.set_wakeup_fd(write_end, warn_on_full_buffer=False)
    try:
        yield
    finally:
        signal.set_wakeup_fd(before)
        signal.signal(signal.SIGTERM, signal.SIG_DFL)
        os.close(write_end)


def _watch(read_end: int, handled: threading.Event) -> None:
    """Python handles signals only between its own instructions: this ends a process whose FMU call does not return in time."""
    with open(read_end, "rb", buffering=0) as signals:
        while (number := signals.read(1)) and number[0] != signal.SIGTERM:
            pass
    if number and not handled.wait(_PATIENCE):
        _end_at_once()


def _end_at_once() -> None:
    from shaper_fmu.master.fmu import remove_folders

    remove_folders()
    with suppress(OSError):
        os.write(2, b"ended by SIGTERM, in the midst of an FMU's call that did not come back\n")
    os._exit(TERMINATED)
