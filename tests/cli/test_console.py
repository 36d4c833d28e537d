"""Texts from outside are printed as they are: no emoji, no markup, no words broken."""

from __future__ import annotations

import io
import re
import sys
from dataclasses import replace

import pytest
from rich.cells import cell_len
from rich.console import Console

from shaper_fmu import console
from shaper_fmu.page.blocks import Table
from shaper_fmu.progress import progress, runs_progress


@pytest.fixture(autouse=True)
def a_capable_terminal(monkeypatch):
    """Whatever the tests run in: rich takes a dumb terminal for 80 columns wide."""
    monkeypatch.setenv("TERM", "xterm")


NAMES = (":smile:", "[bold]x[/bold]", "[/]", "[red]", ":warning: [link=a]b")


@pytest.mark.parametrize("name", NAMES)
@pytest.mark.parametrize("which", ["out", "err"])
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


class Terminal(io.StringIO):
    """Where a terminal would be: what is written to it can be read."""

    def isatty(self) -> bool:
        return True


LONG = "n" * 200
WORDS = "a spring, a damper and a mass, which move along a line"
TABLE = Table(
    f"what {LONG} is", ["name", "what it is", LONG], [[LONG, WORDS, "1"], ["mass", f"{WORDS} and {LONG}", f"/{LONG}/x.csv"]]
)


def shown(table: Table, monkeypatch, stream: io.StringIO, **options) -> str:
    monkeypatch.setattr(sys, "stdout", stream)
    monkeypatch.setattr(console, "out", console.PlainConsole())
    console.show(table, **options)
    return re.sub(r"\x1b\[[0-9;]*m", "", stream.getvalue())


@pytest.mark.parametrize("words", [False, True])
@pytest.mark.parametrize("setting", ["COLUMNS=40", "COLUMNS=0", "FORCE_COLOR=1", "NO_COLOR=1", "TERM=dumb", "TTY_COMPATIBLE=1"])
def test_outside_of_a_terminal_no_cell_is_folded_or_cut(setting, words, monkeypatch):
    """Nor a title, whatever the environment says of a width; a tab counts as the spaces that it stands for."""
    monkeypatch.setenv(*setting.split("="))
    table = replace(TABLE, left_aligned=words, rows=[*TABLE.rows, ["a\ttab" * 20, ":smile:", "深" * 100]])
    lines = shown(table, monkeypatch, io.StringIO()).splitlines()
    assert lines[0] == table.title
    cells = [[cell.strip() for cell in line[1:-1].split(line[0])] for line in lines if line[0] in "│┃"]
    assert cells == [table.head, *([cell.expandtabs() for cell in row] for row in table.rows)]
    assert len({cell_len(line) for line in lines[1:]}) == 1


@pytest.mark.parametrize("columns", [20, 40, 80, 160])
@pytest.mark.parametrize("name", ["mass", "overhead_crane.initial_rope_length", LONG])
def test_on_a_terminal_no_word_is_broken(name, columns, monkeypatch):
    """All words stand in the output; where they fit into a table of the terminal's width, none of its lines is longer."""
    monkeypatch.setenv("COLUMNS", str(columns))
    table = Table("The system", ["name", "what it is", "value"], [[name, WORDS, "1.5 mm"], ["x", "", "2"]], left_aligned=True)
    text = shown(table, monkeypatch, Terminal())
    assert sorted(set(re.findall(r"[\w.,]+", text))) == sorted(
        set(f"The system name what it is value {name} {WORDS} 1.5 mm x 2".split())
    )
    framed = [line for line in text.splitlines() if line[0:1] in ("│", "┃", "┏")]
    assert bool(framed) == (len(name) + len("spring,") + len("value") + 10 <= columns)  # the longest words, and the frame
    assert all(len(line) <= columns for line in framed)


def test_styles_and_lines_are_a_terminals(monkeypatch):
    monkeypatch.setenv("COLUMNS", "80")
    monkeypatch.setenv("TERM", "xterm")
    monkeypatch.delenv("NO_COLOR", raising=False)
    stream = Terminal()
    shown(
        Table("", ["claim", "verdict"], [["one", "held"], ["two", "open"]], left_aligned=True),
        monkeypatch,
        stream,
        lines=True,
        styles={"held": "green"},
    )
    text = stream.getvalue()
    assert text.count("├") == 1
    assert text.count("\x1b[32mheld") == 1


@pytest.mark.parametrize("stream", [Terminal(), io.StringIO()], ids=["terminal", "pipe"])
def test_lines_break_between_words_on_terminals_alone(stream, monkeypatch):
    monkeypatch.setenv("COLUMNS", "40")
    monkeypatch.setattr(sys, "stderr", stream)
    err = console.PlainConsole(stderr=True)
    err.print(f"note: {WORDS}")
    err.print(f"error: {LONG}: no such file")
    wrapped = "note: a spring, a damper and a mass, \nwhich move along a line" if stream.isatty() else f"note: {WORDS}"
    assert stream.getvalue() == f"{wrapped}\nerror: {LONG}: no such file\n"
