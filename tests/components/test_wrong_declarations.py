"""Components that no FMU could hold: told in words when they are loaded or built, and nothing is written."""

from __future__ import annotations

import re
from pathlib import Path

import pytest
from typer.testing import CliRunner

from shaper_fmu.cli.main import app
from shaper_fmu.errors import ShaperFmuError
from shaper_fmu.export.build import build_fmu
from shaper_fmu.registry import load_components

SOURCE = """\
{top}
import enum, math, os, sys
from shaper_fmu.component import Component, Input, Output, Parameter, State
{before}
class {name}(Component):
    {inside}
    command = Input("", "command")
    result = Output("", "result")

    def step(self, t, h):
        self.result = self.command
        {kernel}
"""

INSIDE = {
    "p = Parameter(3000000000, '', 'p')": "'p': the start value of p is 3000000000; an Integer of FMI is from -2147483648 to",
    "p = State(-2**31 - 1)": "state 'p': the start value of p is -2147483649",
    "p = Parameter([1, 2**40], '', 'p', size=2)": "the start value of p[2] is 1099511627776",
    "p = Parameter(1, '', 'p', max=2**31)": "max is 2147483648; an Integer of FMI",
    "p = Parameter(1, '', 'p', min=0.5)": "min is 0.5; the bound of an Integer must be a whole number",
    "p = Parameter(1.0, '', 'p', min=-math.inf)": "min is -inf; it must be a finite number. Leave it out",
    "p = Parameter(1.0, '', 'p', max=math.nan)": "max is nan; it must be a finite number",
    "p = Parameter(1.0, '', 'p', max='2')": "max is '2'; it must be a number",
    "p = Parameter(1.0, '', 'p', min=2.0, max=0.0)": "no value is between min = 2.0 and max = 0.0",
    "p = Parameter(1.0, '', 'p', min=0.0, exclusive=True, published=1e-9)": "published is 1e-09; it must be a pair (min, max)",
    "p = Parameter(1.0, '', 'p', min=0.0, exclusive=True, published=(0.0, None))": "published min = 0 must be greater than 0",
    "p = Parameter(1.0, '', 'p', max=2.0, published=(None, math.inf))": "published max is inf; it must be a finite number",
    "p = Parameter(1.0, '', 'p', published=('a', None))": "published min is 'a'; it must be a number",
    "p = Parameter(1.0, '', 'p', published=(2.0, 1.0))": "no value is between min = 2.0 and max = 1.0",
    "p = Parameter(True, '', 'p', published=(0, 1))": "published min = 0: a Boolean or an enumeration has no bounds",
    "p = Parameter(1, '', 'p', min=0, max=1, exclusive=True)": "no value is between min = 0 and max = 1 and excluded",
    "p = Parameter(1.0, '', 'p', min=2.0)": "the start value is outside of its bounds: p = 1 must be at least 2",
    "p = Parameter(math.inf, '', 'p')": "the start value of p is inf; it must be a finite number",
    "p = State(math.nan)": "the start value of p is nan",
    "p = Parameter(2.5, '', 'p', kind=int)": ".py:6: 'p': the start value 2.5 is not of type int",
    "p = Parameter('fast', '', 'p')": "the start value 'fast' is not of type float",
    "p = Parameter(1.0, '', 'p', kind=complex)": "values of type complex are not known to FMI",
    "p = Parameter(1.0, '', 'a\\0b')": "the description 'a\\x00b' has U+0000 (character 2), which XML cannot hold",
    "p = Parameter(1.0, '', '\\ud800')": "has U+D800 (character 1), which XML cannot hold",
    "p = Parameter(1.0, 'm\\x01', 'p')": "the unit 'm\\x01' has U+0001",
    "p = Parameter(1.0, '', None)": "the description is None; it must be a text",
    "p = State(size=0)": "size = 0 must be a whole number from 1 to 65535",
    "p = State(size=-1)": "size = -1 must be",
    "p = State(size=10**12)": "size = 1000000000000 must be",
    "p = State(size=2.0)": "size = 2.0 must be",
    "p = q = State()": "p and q are one variable; declare each by itself",
    "messages = {1: 'no {nosuch}'}": "the message of status 1 names {nosuch}, which is not a variable",
    "messages = {0: 'fine'}": "the message of status 0 cannot be returned",
    "default_step_size = 0.0": "default_step_size is 0.0; it must be a positive, finite number",
    "größe = State()": "the name has letters that are not ASCII",
}
"""What stands in the class, and what is said of it."""

AROUND = {
    ("name", "A" * 300): "the name has 300 letters, and files are called so; give the component one of at most 128",
    ("name", "signed"): "this is a keyword",
    ("name", "Nul"): "Windows cannot have files of this name",
    ("before", "sys.exit(0)"): "wrong.py:4: the file ends the process (exit status 0)",
    ("before", "os._exit(3)"): "wrong.py:4: the file ends the process (exit status 3)",
    ("before", "1 / 0"): "wrong.py:4: ZeroDivisionError",
    ("kernel", "sys.exit(0)"): "does not run with its start values: SystemExit: 0",
}
"""What is wrong elsewhere in the file."""


def source(**parts: str) -> str:
    return SOURCE.format(**{"top": "", "before": "", "name": "Mine", "inside": "", "kernel": "", **parts})


def refused(folder: Path, text: str) -> str:
    """What is said of a file of this content; nothing is left in the folder of FMUs."""
    (folder / "wrong.py").write_text(text)
    with pytest.raises(ShaperFmuError) as told:
        build_fmu(load_components(folder / "wrong.py")[-1], folder / "fmus", platforms=["this"])
    assert not (folder / "fmus").exists()
    return str(told.value)


@pytest.mark.parametrize("inside", INSIDE)
def test_a_wrong_declaration_is_told(tmp_path, inside):
    assert INSIDE[inside] in refused(tmp_path, source(inside=inside))


@pytest.mark.parametrize(("part", "content"), list(AROUND))
def test_what_is_wrong_around_it_is_told(tmp_path, part, content):
    assert str(AROUND[part, content]) in refused(tmp_path, source(**{part: content}))


def test_items_beyond_an_integer_are_told(tmp_path):
    text = source(before="K = enum.IntEnum('K', {'a': 2**31})", inside="k = Parameter(K.a, '', 'k')")
    assert re.search("item 'a' of enumeration K is 2147483648; an Integer of FMI", refused(tmp_path, text))


def test_files_beside_a_component_and_what_it_prints_do_not_disturb_its_build(tmp_path, monkeypatch):
    """In the folder that is looked into first, with a name that is not a module's, from a file with a byte order mark."""
    (tmp_path / "random.py").write_text("raise SystemExit(7)\n")
    elsewhere = tmp_path / "elsewhere"
    elsewhere.mkdir()
    file = tmp_path / "my component.2.py"
    noise = f"print('hello')\nos.write(1, b'there')\nos.chdir({str(elsewhere)!r})"
    file.write_text("\ufeff" + source(before=noise), encoding="utf-8")
    monkeypatch.chdir(tmp_path)
    monkeypatch.syspath_prepend(str(tmp_path))
    path = build_fmu(load_components(file)[0], "fmus", platforms=["this"])
    assert (tmp_path / path).is_file()


def test_components_that_would_be_one_file_are_told(tmp_path):
    (tmp_path / "one.py").write_text(source(name="Mine"))
    (tmp_path / "two.py").write_text(source(name="MINE"))
    files = [str(tmp_path / name) for name in ("one.py", "two.py")]
    done = CliRunner().invoke(app, ["build", *files, "--output", str(tmp_path / "fmus")], env={"COLUMNS": "400"})
    assert done.exit_code == 2
    assert "Mine of component_one and MINE of component_two would be written into one file" in done.output
    assert not (tmp_path / "fmus").exists()
