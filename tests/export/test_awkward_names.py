"""A component whose names are C's, its headers' and each other's, as C: it compiles without a warning and computes what plain Python does."""

from __future__ import annotations

import re
import subprocess
from pathlib import Path

import fmpy
import pytest
from compiled_kernels import WARNINGS, ZIG, Kernels, record_of
from test_plain_c import COMPILERS, compiled

from shaper_fmu.errors import BuildError
from shaper_fmu.export.build import build_fmu
from shaper_fmu.export.native.kernels import component_files
from shaper_fmu.export.plain_c import write_c
from shaper_fmu.registry import load_components

AWKWARD = '''"""Awkward names."""

import math
from enum import IntEnum

from shaper_fmu.component import Component, Input, Output, Parameter, State


class Kind(IntEnum):
    int = 1
    default = 2
    grün = 3


class Awkward(Component):
    """A "quoted" text that ends a comment */ and /* begins one, \\\\ with % and ??/ in it."""

    NAN = Input("", "an /* input */ \\\\ and ??/")
    errno = Input("", "ends in \\\\")
    int = Parameter(2, "", "bounded", min=0, max=3)
    kind = Parameter(Kind.int, "", "kind")
    register = Parameter(0.5, "", "an array", size=3)
    M_PI = Output("", "output")
    I = Output("", "the sign of a start value")
    main = Output("", "output")
    Record = State(0.0)
    _hidden = State(1.0)
    hidden = State(2.0)
    HOT = State(-0.0)
    COLD = State([0.0, -0.0], size=2)
    fault = State(0.0)
    messages = {3: 'ready??! "not" at 100 % \\\\ {M_PI}'}

    def step(self, t, h):
        self.M_PI = self.NAN * 2.0 + self.register[self.int % 3] + self._hidden + self.hidden * 10.0
        self.I = math.copysign(1.0, self.HOT) + 2.0 * math.copysign(1.0, self.COLD[0]) + 4.0 * math.copysign(1.0, self.COLD[1])
        self.main = float(self.kind == Kind.grün) + self.errno
        self.Record += h
        self.fault = self.Record
        return 3 if self.Record > 0.055 else 0
'''


LANGUAGES = [
    *[("gcc", f"-std={standard}") for standard in ("c99", "c11")],
    *[("g++", "-x", "c++", f"-std={standard}") for standard in ("c++11", "c++17")],
    (*ZIG, "-std=c99"),
    *[(*ZIG[:-2], "c++", ZIG[-1], "-x", "c++", f"-std={standard}") for standard in ("c++11", "c++17")],
]


@pytest.fixture
def awkward(tmp_path):
    path = tmp_path / "awkward.py"
    path.write_text(AWKWARD, encoding="utf-8")
    return load_components(path)[0]


def test_the_kernel_computes_the_same(awkward):
    plain = awkward(NAN=0.25, errno=3.0, kind=3)
    record, native = record_of(plain), Kernels(awkward)
    plain.initialize(0.0)
    plain.do_step(0.0, 0.01)
    assert native.step(record, 0.0, 0.0) == native.step(record, 0.0, 0.01) == 0
    assert record.tobytes() == record_of(plain).tobytes()
    assert (plain.M_PI, plain.I, plain.main) == (22.0, -3.0, 4.0)  # 0.5 + 0.5 + 1 + 20; -1 + 2 - 4; 1 + 3


@pytest.mark.parametrize("kind", COMPILERS)
def test_it_compiles_as_plain_c_and_its_example_runs(awkward, tmp_path, kind):
    write_c(awkward, tmp_path / "c")
    header = (tmp_path / "c" / "Awkward.h").read_text(encoding="utf-8")
    assert header.isascii()
    done = subprocess.run(
        [compiled(tmp_path / "c", "Awkward", "Awkward_example.c", kind)], capture_output=True, text=True, check=False
    )
    lines = done.stdout.splitlines()
    assert lines[0] == "t = 0.01, M_PI = 23.5, I = -3, main = 0"  # 2 + 0.5 + 1 + 20
    assert lines[-1] == 'ready??! "not" at 100 % \\ {M_PI}'  # after six steps of 0.01 s
    assert len(lines) == 7
    assert done.returncode == 1


@pytest.mark.parametrize("fmi", [2, 3])
def test_its_fmu_computes_the_same(awkward, tmp_path, fmi):
    """component.h has macros of these names, and start values keep the sign of a zero."""
    fields = re.findall(r"^    \w+ (\w+)", component_files(awkward)["record.h"], re.MULTILINE)
    assert len(fields) == len(set(fields)) == len(awkward.variables)
    assert not {"HOT", "COLD", "NAN", "errno", "M_PI", "I"} & set(fields)
    fmu = build_fmu(awkward, tmp_path, fmi=fmi, platforms=["this"])
    folder = fmpy.extract(str(fmu), str(tmp_path / "unpacked"))
    headers = Path(fmpy.__file__).parent / "c-code"
    for language in LANGUAGES:  # FMI's own headers are none of ours
        for file in ("fmu.c", "kernels.c"):
            options = [
                *WARNINGS,
                "-ffp-contract=off",
                "-isystem",
                str(headers),
                f"-I{folder}/sources",
                "-c",
                f"{folder}/sources/{file}",
            ]
            done = subprocess.run(
                [*language, *options, "-o", str(tmp_path / "unit.o")], capture_output=True, text=True, check=False
            )
            assert (done.returncode, done.stderr) == (0, ""), language
    result = fmpy.simulate_fmu(str(fmu), fmi_type="CoSimulation", stop_time=0.05, step_size=0.01, output_interval=0.01)
    assert list(result["I"]) == [-3.0] * 6
    assert list(result["M_PI"]) == [21.5] * 6


def test_a_component_with_a_name_of_c_is_refused_as_plain_c(tmp_path):
    path = tmp_path / "faulty.py"
    path.write_text(AWKWARD.replace("class Awkward", "class Fault"), encoding="utf-8")
    with pytest.raises(BuildError, match=r"Fault: C, its library or kernel.h has this name itself; give the component another"):
        write_c(load_components(path)[0], tmp_path / "c")
