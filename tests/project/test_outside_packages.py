"""Packages of others whose entry points cannot be used: they are named with what to do, and all else works."""

from __future__ import annotations

import re
from pathlib import Path

import pytest
from outside_packages import COMMAND, announced, python

SHAPER = """
from shaper_fmu.shapers.method import ShaperMethod
from shaper_fmu.component import Parameter

def impulses({arguments}):
    m.factor_amplitude[0], m.factor_delay[0] = 1.0, 0.0
    return 1

X = ShaperMethod(name={name}, number={number}, impulses={impulses}, summary="", parameters={parameters}, solved={solved})
"""
RIGHT = {
    "name": "'theirs'",
    "number": 200,
    "arguments": "m, damping_ratio",
    "impulses": "impulses",
    "parameters": "{}",
    "solved": False,
}
USED = "from shaper_fmu import shaper; print(shaper('{}', 1.0).duration)"
TOLD = r"theirs 1\.0: entry point wrong = \S+ of shaper_fmu.shapers is left out: .*{}.*; update, mend or uninstall the package"


def their_shaper(folder: Path, **values: object) -> None:
    """A package in this folder whose shaper is made with these values, as they stand in its source."""
    (folder / "wrong.py").write_text(SHAPER.format(**{**RIGHT, **values}))
    announced(folder, {"shaper_fmu.shapers": {"wrong": "wrong"}})


def left_out(folder: Path, words: str) -> None:
    """What Python warns of, with all of our own in its place."""
    done = python(folder, USED.format("zvd"))
    assert (done.returncode, done.stdout.split()) == (0, ["6.283185307179586"]), done.stderr
    assert re.search(f"OutsidePackageWarning: {TOLD.format(words)}", done.stderr), done.stderr


@pytest.mark.parametrize(
    ("values", "words"),
    [
        ({"number": 2}, "numbers below 100 are kept for shaper-fmu itself"),
        ({"number": 3000000000}, r"theirs = 3000000000; the number must be a whole one from 1 to 2147483647"),
        ({"number": "'200'"}, "theirs = '200'; the number must be a whole one"),
        ({"name": "'zvd'"}, "zvd = 200 in wrong and zvd = 3 in shaper_fmu.shapers.zero_derivative are one item"),
        ({"name": "'none'"}, "none = 200 in wrong and none = 1 in shaper_fmu.shapers are one item"),
        ({"name": "'my shaper'"}, "must be one word of letters"),
        ({"name": "7"}, "the name 7 must be one word of letters"),
        ({"arguments": "m, damping"}, "wrong: impulses of theirs asks for 'damping'; it may ask for m, damping_ratio"),
        ({"impulses": "lambda m: 0"}, "impulses of theirs must be a plain function at the top of its module"),
        ({"impulses": "None"}, "impulses of theirs must be a plain function at the top of its module"),
        ({"solved": "object()"}, "solved of theirs is <object .*; it must be a number, true or false"),
        ({"parameters": '{"modes": Parameter(1.0, "", "")}'}, "the component has a variable 'modes'"),
        ({"parameters": '{"step": Parameter(1.0, "", "")}'}, "the component has a variable 'step'"),
        ({"parameters": '{"two words": Parameter(1.0, "", "")}'}, "the parameter 'two words' must be one word"),
        ({"parameters": '{"equal_impulses": Parameter(1, "", "")}'}, "another method has a parameter 'equal_impulses', too"),
        ({"parameters": '{"x": Parameter([1.0, 2.0], "", "", size=2)}'}, "theirs: x must be a Parameter: a single number"),
    ],
)  # fmt: skip
def test_a_wrong_record_is_left_out_in_clear_words(tmp_path, values, words):
    their_shaper(tmp_path, **values)
    left_out(tmp_path, words)


BROKEN = {
    "import no_such_module": r"ModuleNotFoundError: No module named 'no_such_module' \(.*wrong.py:1\)",
    "x = 1 / 0": r"ZeroDivisionError: division by zero \(.*wrong.py:1\)",
    "def :": r"SyntaxError: .*wrong.py, line 1",
    "raise SystemExit(3)": r"it ends the process while it is loaded, with exit status 3 \(.*wrong.py:1\)",
    "import os; os._exit(0)": r"it ends the process while it is loaded, with exit status 0",
    "import os; os.chdir('/'); raise OSError('no licence')": r"OSError: no licence \(.*wrong.py:1\)",
    "x = 1": "it names no ",
}


@pytest.mark.parametrize("text", BROKEN)
def test_a_module_that_does_not_load_is_left_out(tmp_path, text):
    (tmp_path / "wrong.py").write_text(text)
    announced(tmp_path, {"shaper_fmu.shapers": {"wrong": "wrong"}})
    left_out(tmp_path, BROKEN[text])


def test_the_command_tells_it_in_a_line_and_works(tmp_path):
    (tmp_path / "wrong.py").write_text("import no_such_module")
    announced(tmp_path, {"shaper_fmu.shapers": {"wrong": "wrong"}})
    done = python(tmp_path, COMMAND, "design", "zvd", "-w", "5")
    assert done.returncode == 0, done.stderr
    assert re.fullmatch(f"warning: {TOLD.format('No module named .no_such_module.')}", done.stderr.strip()), done.stderr


@pytest.mark.parametrize(("group", "words"), [
    ("shaper_fmu.profiles", "it names no ProfileMethod, and no module with one"),
    ("shaper_fmu.pulse_designs", "it names no PulseMethod, and no module with one"),
    ("shaper_fmu.components", "it names no subclass of Component with a step function"),
])  # fmt: skip
def test_the_wrong_object_is_left_out(tmp_path, group, words):
    (tmp_path / "wrong.py").write_text("x = 1")
    announced(tmp_path, {group: {"wrong": "wrong:x"}})
    done = python(
        tmp_path, "from shaper_fmu import components; print('PulseTrain' in components(), 'MotionProfile' in components())"
    )
    assert (done.returncode, done.stdout.split()) == (0, ["True", "True"]), done.stderr
    assert f"theirs 1.0: entry point wrong = wrong:x of {group} is left out: {words}" in done.stderr


def test_a_missing_object_is_left_out(tmp_path):
    (tmp_path / "wrong.py").write_text("x = 1")
    announced(tmp_path, {"shaper_fmu.shapers": {"wrong": "wrong:missing"}})
    left_out(tmp_path, "AttributeError: module 'wrong' has no attribute 'missing'")


def test_two_packages_with_one_number_leave_the_first(tmp_path):
    for name in ("first", "second"):
        (tmp_path / f"{name}_shaper.py").write_text(SHAPER.format(**{**RIGHT, "name": repr(name)}))
        announced(tmp_path, {"shaper_fmu.shapers": {name: f"{name}_shaper"}}, name)
    done = python(tmp_path, USED.format("first"))
    assert done.stdout.split() == ["0.0"], done.stderr
    assert "second 1.0: entry point second = second_shaper" in done.stderr
    assert "second = 200 in second_shaper and first = 200 in first_shaper are one item" in done.stderr


COMPONENT = """
from shaper_fmu import Component, Output

class {name}(Component):
    x = Output("", "x")

    def step(self, t, h):
        self.x = t
"""


def test_components_of_others_that_cannot_be_used_are_left_out(tmp_path):
    """A name of ours, and beside it a right one of the same package."""
    (tmp_path / "wrong.py").write_text(COMPONENT.format(name="OverheadCrane"))
    (tmp_path / "right.py").write_text(COMPONENT.format(name="Theirs"))
    announced(tmp_path, {"shaper_fmu.components": {"wrong": "wrong", "right": "right"}})
    done = python(tmp_path, COMMAND, "list")
    assert done.returncode == 0, done.stderr
    assert {"OverheadCrane", "Theirs"} <= set(done.stdout.split())
    assert "warning: theirs 1.0: entry point wrong = wrong of shaper_fmu.components is left out: two components" in done.stderr


METRIC = """
from shaper_fmu.metrics.metric import Metric

class X(Metric, tag="{tag}", frozen=True):
    {field}: {type} = ""

    def values(self, gathered):
        return gathered["last"]
"""


@pytest.mark.parametrize(
    ("values", "words"),
    [
        (("peak", "more", "str"), "wrong: the metric X is of the kind 'peak', as is Peak in shaper_fmu.metrics.peak"),
        (("my metric", "more", "str"), "wrong: the metric X is of the kind 'my metric', which must be one word"),
        (("length", "unit", "str"), "wrong: the metric X has a field 'unit', which every metric has for something else"),
        (("length", "more", "'Missing'"), "wrong: the metric X cannot be read from a study file: name 'Missing' is not defined"),
    ],
)
def test_wrong_metrics_are_left_out_in_clear_words(tmp_path, values, words):
    (tmp_path / "wrong.py").write_text(METRIC.format(**dict(zip(("tag", "field", "type"), values, strict=True))))
    announced(tmp_path, {"shaper_fmu.metrics": {"wrong": "wrong"}})
    done = python(tmp_path, "from shaper_fmu.metrics.known import METRICS; print('peak' in METRICS, 'length' in METRICS)")
    assert (done.returncode, done.stdout.split()) == (0, ["True", "False"]), done.stderr
    assert f"theirs 1.0: entry point wrong = wrong of shaper_fmu.metrics is left out: {words}" in done.stderr


def test_warnings_can_be_made_errors(tmp_path):
    their_shaper(tmp_path, number=2)
    done = python(tmp_path, USED.format("zvd"), flags=("-W", "error::UserWarning"))
    assert done.returncode == 1
    assert "numbers below 100" in done.stderr


def test_a_parameter_that_the_command_has_already_is_no_option(tmp_path):
    their_shaper(tmp_path, parameters='{"plot": Parameter(1.0, "", "")}')
    done = python(tmp_path, COMMAND, "design", "theirs", "-w", "5", "--plot", "x.png")
    assert done.returncode == 0, done.stderr
    assert (tmp_path / "x.png").is_file()
    assert "warning: the parameter plot of another package's method is no option of this command" in done.stderr


def test_what_does_not_compile_is_named_in_the_methods_file(tmp_path):
    """The check of kernels goes through the functions that are made, which have no file."""
    their_shaper(tmp_path)
    text = (tmp_path / "wrong.py").read_text().replace("return 1", "return len({1: 2})")
    (tmp_path / "wrong.py").write_text(text)
    work = (
        "from shaper_fmu.commands.input_shaper import InputShaper as C; from shaper_fmu.export.kernel_source import check_kernels"
    )
    done = python(tmp_path, f"{work}; check_kernels(C)")
    line = text.splitlines().index("    return len({1: 2})") + 1
    assert f"wrong.py:{line}: " in done.stderr, done.stderr


def test_tracebacks_show_the_lines_that_are_made(tmp_path):
    their_shaper(tmp_path)
    (tmp_path / "wrong.py").write_text((tmp_path / "wrong.py").read_text().replace("return 1", "return 1 / 0"))
    work = "import traceback; from shaper_fmu import shaper\ntry: shaper('theirs', 1.0)\nexcept ZeroDivisionError: traceback.print_exc()"
    done = python(tmp_path, work)
    assert "return theirs_impulses(m, damping_ratio)" in done.stderr, done.stderr
