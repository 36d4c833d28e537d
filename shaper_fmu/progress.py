"""Progress of long work: a bar on a terminal, a few lines when piped."""

from __future__ import annotations

from collections.abc import Callable, Iterator
from contextlib import contextmanager

from rich.console import Console
from rich.progress import BarColumn, MofNCompleteColumn, Progress, TextColumn, TimeRemainingColumn

Update = Callable[[float, float], None]
"""Called with what is done and the whole."""


@contextmanager
def progress(what: str, console: Console) -> Iterator[Update]:
    """A function to call with (done, total); shows `what`."""
    if console.is_terminal:
        columns = TextColumn("{task.description}"), BarColumn(), MofNCompleteColumn(), TimeRemainingColumn()
        with Progress(*columns, console=console, transient=True) as bar:
            task = bar.add_task(what, total=None)
            yield lambda done, total: bar.update(task, completed=round(done, 3), total=round(total, 3))
    else:
        said = [-1]

        def say(done: float, total: float) -> None:
            quarter = int(4 * done / total) if total else 4
            if quarter > said[0]:
                said[0] = quarter
                console.print(f"{what}: {done:g} of {total:g}")

        yield say
