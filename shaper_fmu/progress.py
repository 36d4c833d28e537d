"""Shows the progress of long work: a bar on a terminal, a few lines otherwise."""

from __future__ import annotations

import time
from collections.abc import Callable, Iterator
from contextlib import contextmanager

from rich.console import Console
from rich.progress import BarColumn, MofNCompleteColumn, Progress, TaskID, TextColumn, TimeRemainingColumn

Update = Callable[[float, float], None]
"""Called with what is done and the whole."""

RunsUpdate = Callable[[int, int, int], None]
"""Called with the numbers of runs that are done, that have failed, and of all."""

_LINE_AFTER = 5.0
"""A piped sweep prints its progress at this interval [s]."""


def _text(form: str) -> TextColumn:
    """A column of text that is shown as it is."""
    return TextColumn(form, markup=False)


@contextmanager
def progress(what: str, console: Console) -> Iterator[Update]:
    """A function to call with (done, total); shows `what`."""
    if console.is_terminal:
        columns = _text("{task.description}"), BarColumn(), MofNCompleteColumn(), TimeRemainingColumn()
        with Progress(*columns, console=console, transient=True) as bar:
            task = bar.add_task(what, total=None)
            yield lambda done, total: bar.update(task, completed=round(done, 3), total=round(total, 3))
    else:
        last = [-1]

        def show(done: float, total: float) -> None:
            quarter = int(4 * done / total) if total else 4
            if quarter > last[0]:
                last[0] = quarter
                console.print(f"{what}: {done:g} of {total:g}")

        yield show


PartsUpdate = Callable[[str, float, float], None]
"""Called with a part of the work, what is done of it, and the whole of it."""


@contextmanager
def parts_progress(console: Console) -> Iterator[PartsUpdate]:
    """A function to call with (part, done, total): a bar with the time left for each part, in the order of their begin.

    A part may go on after others have begun. What is more than was expected makes the part's whole larger.
    """
    if console.is_terminal:
        columns = _text("{task.description}"), BarColumn(), MofNCompleteColumn(), TimeRemainingColumn()
        with Progress(*columns, console=console, transient=True) as bar:
            tasks: dict[str, TaskID] = {}

            def show(part: str, done: float, total: float) -> None:
                if part not in tasks:
                    tasks[part] = bar.add_task(part, total=None)
                bar.update(tasks[part], completed=round(done, 3), total=round(max(done, total), 3))

            yield show
    else:
        last: dict[str, int] = {}

        def tell(part: str, done: float, total: float) -> None:
            quarter = int(4 * done / total) if total else 4
            if quarter > last.get(part, -1) and quarter <= 4:
                last[part] = quarter
                console.print(f"{part}: {done:g} of {max(done, total):g}")

        yield tell


@contextmanager
def runs_progress(what: str, console: Console) -> Iterator[RunsUpdate]:
    """A function to call with (done, failed, total); shows `what`, the rate since its first call, and the time left."""
    pace = _Pace()
    if console.is_terminal:
        columns = (
            _text("{task.description}"),
            BarColumn(),
            MofNCompleteColumn(),
            TextColumn("{task.fields[text]}", markup=False),
        )
        with Progress(*columns, console=console, transient=True) as bar:
            task = bar.add_task(what, total=None, text="")

            def show(done: int, failed: int, total: int) -> None:
                bar.update(task, completed=done + failed, total=total, text=pace.text(done, failed, total))

            yield show
    else:
        last, latest = [float("-inf")], [(-1, -1, -1)]

        def show(done: int, failed: int, total: int) -> None:
            now, text = time.monotonic(), pace.text(done, failed, total)
            ended = done + failed == total
            if (ended or now - last[0] >= _LINE_AFTER) and (done, failed, total) != latest[0]:
                last[0], latest[0] = now, (done, failed, total)
                console.print(f"{what}: {done + failed} of {total}{', ' if text else ''}{text}")

        yield show


class _Pace:
    """The rate of a sweep and its remaining time, since the first call."""

    def __init__(self) -> None:
        self._first: tuple[float, int] | None = None

    def text(self, done: int, failed: int, total: int) -> str:
        """Failed runs, rate and time left, as far as they are known."""
        now, ended = time.monotonic(), done + failed
        if self._first is None:
            self._first = now, ended
        begin, before = self._first
        parts = [f"{failed} failed"] if failed else []
        if ended > before and now > begin:
            rate = (ended - before) / (now - begin)
            parts.append(f"{rate:.3g}/s" if rate < 1000.0 else f"{rate:.0f}/s")
            if ended < total:
                parts.append(f"{_duration((total - ended) / rate)} left")
        return ", ".join(parts)


def _duration(seconds: float) -> str:
    """Hours, minutes and seconds, as 1:02:03 or 2:03."""
    whole = round(seconds)
    hours, rest = divmod(whole, 3600)
    minutes, left = divmod(rest, 60)
    return f"{hours}:{minutes:02d}:{left:02d}" if hours else f"{minutes}:{left:02d}"
