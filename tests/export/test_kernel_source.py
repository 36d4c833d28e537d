"""What a third party's kernel may not use is named by file and line; what it may use compiles; equal sources, equal code."""

from __future__ import annotations

import functools
import os
import re
import subprocess
import sys
from pathlib import Path

import pytest
from compiled_kernels import kernel_library

from shaper_fmu.component import Component
from shaper_fmu.errors import BuildError
from shaper_fmu.export.c.translate import translated
from shaper_fmu.export.kernel_source import check_kernels, reached_functions
from shaper_fmu.registry import components, load_components

HEAD = '''"""A third party's component."""

import enum
import math
import random
import time
from functools import partial
from math import sqrt
from time import monotonic

import numpy as np

import shaper_fmu.component as base
from shaper_fmu.component import NO_EVENT, Component, Input, Output, Parameter, State


class Kind(enum.IntEnum):
    one = 1
    two = 2


class Settings:
    gain = 2.0


SETTINGS = Settings()
TABLE = [1.0, 2.0]
NAMED = {"gain": 2.0}
PAIR = (1.0, 2.0)
ARRAY = np.array([1.0, 2.0])
ARRAY_32 = np.float32(0.1)
WORD = "one"


def double(x, factor=2.0):
    return factor * x


def both(x):
    return x, double(x)


HALF = partial(double, factor=0.5)
'''

CLASS = """

class Mine(Component):
    u = Input("", "in")
    y = Output("", "out")
    n = Parameter(1, "", "number")
    kind = Parameter(Kind.one, "", "kind")
    flag = State(False)
    a = State(size=4)

    LIMIT = 3.0

    def gain(self):
        return 2.0

    def step(self, t, h):
"""


def written(folder: Path, body: str, helpers: str = "") -> tuple[type[Component], str]:
    """A component with these lines in its step function, and "file:line" of the line that ends with "# here"."""
    lines = "".join(f"        {line}\n" for line in body.splitlines())
    path = folder / "my_component.py"
    path.write_text(HEAD + helpers + CLASS + lines)
    marked = [i for i, line in enumerate(path.read_text().splitlines(), start=1) if line.endswith("# here")]
    return load_components(path)[0], f"{path}:{marked[0] if marked else 0}"


NEEDS_PYTHON = [
    ("x = [1.0, self.u]  # here\nself.y = x[0]", "a list [...] needs Python's memory"),
    ("x = {1: self.u}  # here\nself.y = x[1]", "a dictionary {...} needs"),
    ("self.y = 1.0 if self.n in {1, 2} else 0.0  # here", "a set {...} needs"),
    ("x = [i * self.u for i in range(3)]  # here\nself.y = x[1]", "a list comprehension needs"),
    ("self.y = sum(x * x for x in self.a)  # here", "a generator does not compile"),
    ("self.y = list(self.a)[0]  # here", "list: needs Python's memory"),
    ("self.y = 1.0\nprint(self.u)  # here", "print: a kernel cannot write"),
    ("self.y = float(f'{self.n}' == 'x')  # here", "f-string"),
    ("self.y = float(SETTINGS.gain)  # here", "SETTINGS is of type Settings"),
    ("self.y = Settings.gain  # here", "Settings is a class"),
    ("self.y = TABLE[self.n]  # here", "TABLE is of type list"),
    ("self.y = NAMED['gain']  # here", "NAMED is of type dict"),
    ("self.y = HALF(self.u)  # here", "HALF is of type partial"),
    ("self.y = monotonic()  # here", "monotonic is a function of time without Python source"),
    ("self.y = time.time()  # here", "a kernel cannot call time.time"),
    ("self.y = random.random()  # here", "a kernel cannot call random.random"),
    ("self.y = np.zeros(3)[0]  # here", "a kernel cannot call np.zeros"),
    ("self.y = base.time_tolerance(self, t, h)  # here", "write 'from shaper_fmu.component import time_tolerance'"),
    ("self.y = math.modf(self.u)[0]  # here", "math.modf does not compile; use"),
    ("self.y = math.sqroot(self.u)  # here", "math has no function 'sqroot'. Did you mean 'sqrt'?"),
    ("self.y = self.speed  # here", "self.speed is not declared"),
    ("self.y = 1.0\nself.kimd = 2  # here", "self.kimd is not declared. Did you mean 'kind'?"),
    ("self.y = self.gain()  # here", "self.gain is a method; make it a function gain(m, ...) outside the class"),
    ("self.y = self.LIMIT  # here", "self.LIMIT belongs to the class"),
    ("self.y = float(self.kind.value)  # here", "self.kind is a number and has no 'value'"),
    ("self.y = Kind(self.kind)  # here", "Kind(...) makes a member of Python's"),
    ("self.y = (x := self.u) + x  # here", "an assignment inside an expression (:=)"),
    ("x = 1.0\ndel x  # here\nself.y = 1.0", "del does not compile"),
    ("import math as m  # here\nself.y = m.sqrt(self.u)", "an import inside a kernel"),
    ("class Inner:  # here\n    x = 1.0\nself.y = 1.0", "a class inside a kernel"),
    ("x, *rest = both(self.u)  # here\nself.y = x", "a starred name"),
    ("with self.a:  # here\n    self.y = 1.0", "with does not compile"),
    ("self.y = double(**{'x': 1.0})  # here", "a call cannot take its arguments from a dictionary"),
    ("self.y = doubled(self.u)  # here", "there is no 'doubled'"),
    ("global WORD  # here\nWORD = 3", "WORD is a variable of the module"),
    ("match (self.n, self.u):\n    case (1, x):  # here\n        self.y = x", "match compares numbers alone"),
]

# compiles, but behaves otherwise than in Python, or is outside what kernels are promised (numpy)
BEHAVES_OTHERWISE = [
    (
        "if self.u < 0.0:\n    raise ValueError  # here\nself.y = 1.0",
        "a kernel has no raise: exceptions are Python's; return a status",
    ),
    ("assert self.u >= 0.0  # here\nself.y = 1.0", "a kernel has no assert"),
    ("try:  # here\n    self.y = 1.0 / self.u\nexcept ZeroDivisionError:\n    self.y = 0.0", "a kernel has no try"),
    ("self.y = 1.0 if self.kind == 'one' else 0.0  # here", "a kernel has no texts such as 'one'; give kinds as members"),
    ("self.y = float(self.n == WORD)  # here", "WORD is a text"),
    ("self.y = getattr(self, 'u')  # here", "a kernel has no texts such as 'u'"),
    ("self.y = float(np.sin(self.u))  # here", "a kernel cannot call np.sin"),
    ("self.y = ARRAY[self.n]  # here", "ARRAY is a value of numpy, which computes otherwise than Python"),
    ("self.y = ARRAY_32 * self.u  # here", "ARRAY_32 is a value of numpy"),
]


def assert_refused(component: type[Component], place: str, words: str) -> None:
    """The check names the line, with its text, and the compiler is not asked."""
    with pytest.raises(BuildError) as caught:
        check_kernels(component)
    heading, *lines = str(caught.value).splitlines()
    assert heading == "Mine.step does not compile:"
    found = [i for i, line in enumerate(lines) if line.startswith(f"{place}: ") and words in line]
    assert len(found) == 1, str(caught.value)
    assert lines[found[0] + 1].endswith("# here")


@pytest.mark.parametrize(("body", "words"), NEEDS_PYTHON + BEHAVES_OTHERWISE)
def test_what_a_kernel_may_not_use_is_named_with_its_line(tmp_path, body, words):
    assert_refused(*written(tmp_path, body), words)


@pytest.mark.parametrize("body", [body for body, _ in NEEDS_PYTHON if "base." not in body])
def test_the_translator_refuses_it_too(tmp_path, body):
    """The same sources without the check, which says it better."""
    component, place = written(tmp_path, body)
    with pytest.raises(BuildError, match=re.escape(place.rsplit(":", 1)[0])):
        translated(component)


@pytest.mark.parametrize(
    ("body", "helpers", "words"),
    [
        ("self.y = gain_of(self)", "def gain_of(m):\n    return m.gian * m.u  # here", "m.gian is not declared. Did you mean"),
        ("self.y = middle(2.0, m=self)", "def inner(x, r):\n    return x * r.v  # here\n\n\ndef middle(x, m):\n    return inner(x, m)", "r.v is not"),
        ("self.y = loose(self.u)", "def loose(x, *, y=1.0):  # here\n    return x * y", "the argument y can be given by its name alone"),
        ("self.y = loose(self.u)", "def loose(x, **rest):  # here\n    return x", "the argument rest can be given by its name alone"),
        ("self.y = first(self.u)", "def first(x):\n    values = [x]  # here\n    return values[0]", "a list [...] needs"),
        ("self.y = even(self.n)", "def even(n):\n    return 1.0 if n <= 0 else odd(n - 1)\n\n\ndef odd(n):\n    return even(n)  # here", "recursion"),
        ("self.y = f(self.u)", "def maker():\n    def f(x):\n        return sorted((x, 1.0))[0]  # here\n    return f\n\n\nf = maker()", "sorted: needs"),
        ("self.y = f(self.u)", "f = lambda x: len(str(x))  # here", "str: a kernel has no texts"),
    ],
)  # fmt: skip
def test_functions_that_a_kernel_calls_are_read_too(tmp_path, body, helpers, words):
    assert_refused(*written(tmp_path, body, helpers), words)


def test_at_most_ten_findings_are_listed_and_the_rest_counted(tmp_path):
    component, _ = written(tmp_path, "\n".join(f"self.nothing_{i} = 1.0" for i in range(13)))
    with pytest.raises(BuildError) as caught:
        check_kernels(component)
    assert len(re.findall(r"my_component\.py:\d+: ", str(caught.value))) == 10
    assert str(caught.value).endswith("... and 3 more")


def test_a_kernel_that_is_no_plain_method_is_named(tmp_path):
    component, _ = written(tmp_path, "self.y = 1.0\nstart = partial(both, 1.0)")
    component.start = functools.lru_cache(component.start)  # what a decorator leaves behind
    with pytest.raises(BuildError, match=r"Mine.start is of type _lru_cache_wrapper; write it as a plain method"):
        check_kernels(component)


@pytest.mark.parametrize(
    ("body", "helpers", "words"),
    [
        ("x = 0.0\nif self.n > 1:\n    x = self.a  # here\nself.y = x", "", "x is a real number in one place and an array of 4 in another; give it values of one kind"),
        ("x = 0.0\nif self.n > 1:\n    x = PAIR  # here\nself.y = x + 1.0", "", "x is a real number in one place and an array of 2 in another"),
        ("self.y = either(self.u)", "def either(x):\n    if x > 0.0:\n        return 1.0\n    return x, x  # here", "returns a real number in one place and a tuple of 2 in another; return values of one type"),
        ("self.y = either(self.u)", "def either(x):  # here\n    if x > 0.0:\n        return 1.0", "either returns a real number on one path and nothing on another"),
        ("self.y = part(self.u)", "def part(x):\n    return x.size  # here", "x is a real number and has no 'size'"),
        ("self.y = math.comb(self.n, 2)  # here", "", "math.comb does not compile"),
        ("self.y = float(any((self.flag, True)))  # here", "", "'any' does not compile"),
        ("self.y = double(self.u, 2.0, 3.0)  # here", "", "double takes 2 arguments, and is given 3 (too many)"),
        ("self.y = double()  # here", "", "double is not given x"),
        ("self.y = double(self.u, fator=2.0)  # here", "", "double cannot be given 'fator' here. Did you mean 'factor'"),
        ("self.y = self.a[self.u]  # here", "", "the index self.u is a real number; write int(...)"),
        ("self.a = self.u  # here", "", "self.a is an array of 4; the types do not fit: set its elements in a loop"),
        ("self.y = (self.a + self.a)[0]  # here", "", "computes with an array of 4; a kernel computes with single numbers"),
        ("self.y = 1.0\nself.a[0:2] = self.a[2:4]  # here", "", "self.a[2:4] is a copy in Python"),
        ("self.y = summed(self)", "def summed(m):\n    x = 1.0\n    y = m.a.copy()  # here\n    return x + y[0]", "m.a is an array of 4 and has no 'copy'"),
        ("x = 1.0\ndef change():\n    nonlocal x  # here\n    x = 2.0\nchange()\nself.y = x", "", "nonlocal does not compile; return the new value"),
        ("x = None  # here\nif self.n > 1:\n    x = 2.0\nself.y = 0.0 if x is None else x", "", "x is set to nothing (None)"),
    ],
)  # fmt: skip
def test_what_the_compiler_finds_is_said_in_one_sentence_with_its_line(tmp_path, body, helpers, words):
    component, place = written(tmp_path, body, helpers)
    check_kernels(component)
    with pytest.raises(BuildError) as caught:
        translated(component)
    heading, finding, source = str(caught.value).splitlines()
    assert heading == "Mine.step does not compile:"
    assert finding.startswith(f"{place}: ")
    assert words in finding
    assert source.endswith("# here")


def test_a_status_that_is_no_number_is_named(tmp_path):
    component, _ = written(tmp_path, "return both(self.u)")
    with pytest.raises(
        BuildError, match=r"a kernel returns nothing, or a status number, not a tuple of 2\n    def step\(self, t, h\):"
    ):
        translated(component)


@pytest.mark.parametrize(
    "body",
    [
        "self.y = double(self.u) + double(self.u, 3.0) + double(factor=self.u, x=1.0)",
        "x, (y, z) = self.u, both(self.u)\nself.y = x + y + z",
        "self.y = PAIR[self.n] + len(PAIR) + base.NO_EVENT",
        "for x in [1.0, 2.0]:\n    self.y += x\nself.y += 1.0 if self.n in [1, 2] else 0.0",
        "for i, x in enumerate(self.a):\n    self.y += i * x",
        "def inner(x):\n    return double(x) + self.u\nself.y = inner(1.0) + (lambda x: x * x)(2.0)",
        "match self.kind:\n    case Kind.one:\n        self.y = 1.0\n    case 2 | 3:\n        self.y = 2.0\n    case _:\n        self.y = 3.0",
        "self.y = 1.0 / self.u if self.kind == Kind.two and self.kind != Kind.one else sqrt(self.u)",
        "x: 'float' = 1.0\n'a remark'\nself.y = x",
        "self.a[0], self.a[1] = self.a[1], self.a[0]\nif self.n < 0:\n    return 1\nreturn 0",
        "m = self\nm.y = 1.0\nself.flag = m.y > 0.0",
    ],
)
def test_what_a_kernel_may_use_compiles_without_a_warning(tmp_path, body):
    component, _ = written(tmp_path, body)
    assert kernel_library(component).is_file()


@pytest.mark.parametrize("name", components())
def test_the_components_of_the_registry_pass(name):
    check_kernels(components()[name])
    reached = reached_functions(components()[name])
    assert {components()[name].start, components()[name].step} <= set(reached)


COMPILE = """
import sys
from shaper_fmu.export.c.translate import translated
from shaper_fmu.registry import components

for name in sys.argv[1:]:
    text = translated(components()[name])
print(text)
"""


def test_equal_sources_give_equal_code_in_any_process():
    runs = []
    for seed, names in (("1", ["PulseWidthModulator"]), ("2", ["PositionController", "MassSpringDamper", "PulseWidthModulator"])):
        environment = {**os.environ, "PYTHONHASHSEED": seed}
        command = [sys.executable, "-c", COMPILE, *names]
        runs.append(subprocess.run(command, env=environment, capture_output=True, text=True, check=True).stdout)
    assert runs[0] == runs[1]
    assert "int kernel_step(" in runs[0]
