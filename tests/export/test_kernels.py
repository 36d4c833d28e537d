"""Every component's kernels in C: the same bits as plain Python, no warning of two compilers, and nothing but the C library."""

from __future__ import annotations

import enum
import random
import re
import subprocess

import pytest
from compiled_kernels import ZIG, Kernels, kernel_library, record_of
from trial_runs import moved

from shaper_fmu.component import Component
from shaper_fmu.errors import ComponentError
from shaper_fmu.export.native.kernels import component_files
from shaper_fmu.registry import components

LIBM = {
    "sqrt",
    "exp",
    "sin",
    "cos",
    "pow",
    "fmod",
    "tan",
    "acos",
    "asin",
    "atan",
    "atan2",
    "log",
    "log2",
    "fabs",
    "sinh",
    "cosh",
    "floor",
    "ceil",
    "trunc",
    "rint",
    "copysign",
    "ldexp",
    "memmove",
    "exp2",
}
GCC = ("gcc",)


PLANS = {"ShapedStop": 30}
"""Steps of components that plan in each of them, for tenths of a second in plain Python; others take 150."""


def random_parameters(component: type[Component], rng: random.Random) -> dict:
    """Values inside the domains, moderately far from the start values."""
    values = {}
    for variable in component.variables.values():
        bound = variable.name.startswith("custom") or variable.name == "minimum_pulse_width"  # to what other parameters are
        if variable.causality == "parameter" and variable.kind is float and not bound:
            scaled = [start * rng.uniform(0.5, 1.5) if start else rng.uniform(0.0, 0.4) for start in variable.starts]
            values[variable.name] = scaled if variable.size else scaled[0]
    return values


def every_item(component: type[Component]) -> list[dict]:
    """The start values, and with them every item of every enumeration."""
    parameters = [v for v in component.variables.values() if v.causality == "parameter" and issubclass(v.kind, enum.IntEnum)]
    return [{}, *[{v.name: item.name} for v in parameters for item in v.kind.__members__.values()]]


def compare(component: type[Component], native: Kernels, values: dict, rng: random.Random) -> None:
    """The whole record over random inputs and steps; what one refuses, at the start or on the way, the other refuses, too."""
    plain = component(**values)
    record = record_of(plain)
    try:
        plain.initialize(0.0)
    except ComponentError:
        assert native.start(record) != 0 or native.step(record, 0.0, 0.0) != 0
        return
    assert (native.start(record), native.step(record, 0.0, 0.0)) == (0, 0)
    t = 0.0
    for _ in range(PLANS.get(component.__name__, 150)):
        for variable in component.variables.values():
            if variable.causality == "input":
                value = moved(variable, rng.choice([0.0, 0.05, rng.uniform(-0.1, 0.1)]))
                setattr(plain, variable.name, value if variable.size is None else [value] * variable.size)
                record[variable.name] = value
        h = rng.choice([0.0, 0.01, 0.013, 0.05])
        try:
            plain.do_step(t, h)
        except ComponentError:
            assert native.step(record, t, h) != 0
            return
        assert native.step(record, t, h) == 0
        expected = record_of(plain)
        for field in expected.dtype.names or ():
            assert expected[field].tobytes() == record[field].tobytes(), (field, values, t)
        t += h


@pytest.mark.parametrize("name", components())
def test_plain_and_native_agree_bit_for_bit(name):
    component, rng = components()[name], random.Random(name)
    native = Kernels(component)
    for values in [*every_item(component), *[random_parameters(component, rng) for _ in range(3)]]:
        compare(component, native, values, rng)


@pytest.mark.thorough
@pytest.mark.parametrize("name", components())
def test_gcc_without_optimization_gives_the_same_bits(name):
    component, rng = components()[name], random.Random(name)
    native = Kernels(component, GCC, ("-O0",))
    for values in every_item(component):
        compare(component, native, values, rng)


@pytest.mark.parametrize("name", components())
def test_kernels_refer_to_the_mathematics_library_alone(name):
    library = kernel_library(components()[name])
    done = subprocess.run(["nm", "-D", "--undefined-only", library], capture_output=True, text=True, check=True)
    symbols = {line.split()[-1].split("@")[0] for line in done.stdout.splitlines() if " U " in line}
    assert symbols <= LIBM


@pytest.mark.parametrize("name", components())
def test_the_c_can_be_compared_with_the_python(name):
    """Every function has a comment with file and line of its source, and the names of its arguments."""
    text = component_files(components()[name])["kernels.c"]
    functions = re.findall(r"\*/\nstatic \w+ (\w+)\(", text)
    assert len(functions) == len(re.findall(r"^static (?!inline|const)\w+ \w+\(", text, re.MULTILINE)) > 0
    assert len(re.findall(r",\s+line\s+\d+\)? \*/\nstatic", text)) == len(functions)
    assert max(map(len, text.splitlines())) <= 140


@pytest.mark.thorough
@pytest.mark.parametrize("compiler", [GCC, ZIG, ("g++", "-x", "c++")], ids=["gcc", "clang", "g++"])
@pytest.mark.parametrize("name", components())
def test_no_compiler_warns(name, compiler):
    """-Wall -Wextra -pedantic -Werror, with the optimizer's warnings, too."""
    assert kernel_library(components()[name], compiler, ("-O2",)).is_file()
