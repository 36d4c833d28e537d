"""Components are read side by side, in threads, whatever runs between."""

from __future__ import annotations

import gc
import sys
from collections.abc import Iterator
from concurrent.futures import ThreadPoolExecutor
from pathlib import Path

import pytest

from shaper_fmu import syntax


class Dying:
    """An object in a cycle, whose end takes so long that another thread comes in."""

    def __init__(self) -> None:
        self.own = self

    def __del__(self) -> None:
        for _ in range(200):
            pass


@pytest.fixture
def changing_threads() -> Iterator[None]:
    """Threads change often, and the garbage collector runs in the midst of everything."""
    interval, thresholds = sys.getswitchinterval(), gc.get_threshold()
    sys.setswitchinterval(1e-6)
    gc.set_threshold(50, 5, 5)
    yield
    sys.setswitchinterval(interval)
    gc.set_threshold(*thresholds)


@pytest.mark.usefixtures("changing_threads")
def test_syntax_trees_are_made_in_threads():
    """Of 240 trees that four threads make by ast.parse itself, CPython 3.11.7 fails at some 40."""
    source = Path(syntax.__file__).with_name("public_names.py").read_text()

    def parse(_: int) -> int:
        Dying()
        return len(syntax.parse(source).body)

    with ThreadPoolExecutor(4) as pool:
        assert len(set(pool.map(parse, range(240)))) == 1
