"""Texts from outside are printed as they are: no emoji, no markup, no words broken."""

from __future__ import annotations

import io
import sys

import pytest
from rich.console import Console

from shaper_fmu import console
from shaper_fmu.progress import progress, runs_progress
from shaper_fmu.report.page import Table

NAMES = (":smile:", "[bold]x[/bold]", "[/]", "[red]", ":warning: [link=a]b")


@pytest.mark.parametrize("name", NAMES)
@pytest.mark.parametrize("which", ["out", "err", "wrapping"])
def test_texts_and_tables_are_literal(which, name, monkeypatch):
    stream = io.StringIO()
    # The standard streams are put elsewhere, not the console's own `file`: read back, that is the stream of this test, and it would stay.
    monkeypatch.setattr(sys, "stdout", stream)
    monkeypatch.setattr(sys, "stderr", stream)
    monkeypatch.setattr(console, "out", getattr(console, which))
    console.out.print(f"error: {name}")
    console.show(Table(name, [name, "value"], [[name, name]]))
    assert stream.getvalue().count(name) == 5


@pytest.mark.parametrize("name", NAMES)
def test_progress_is_literal(name):
    stream = io.StringIO()
    terminal = Console(file=stream, force_terminal=True, width=200, highlight=False, markup=False, emoji=False)
    with progress(name, terminal) as update:
        update(1.0, 2.0)
    with runs_progress(name, terminal) as tell:
        tell(1, 0, 2)
    assert stream.getvalue().count(name) >= 2
